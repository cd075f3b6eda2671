"""Documents: ready bytes, packed for who takes that, and not sent again to who has them."""

import asyncio
import gzip
import json
import re
from base64 import b64encode
from hashlib import sha256
from threading import current_thread

import pytest
from starlette.requests import Request

from api.common.schemas import core_of
from api.front.documents import Document
from tests.api.stand import Stand, on_stand

LONG = b'{"a":"' + b"x" * 5000 + b'"}'
EVERY_DOCUMENT = (
    "/openapi.json",
    "/openapi/resources.json",
    "/openapi/core.json",
    "/docs",
    "/docs/resources",
    "/docs/all",
    "/redoc",
    "/static-offline-docs/swagger-ui-bundle.js",
    "/static-offline-docs/redoc.standalone.js",
    "/static-offline-docs/swagger-ui.css",
    "/commands",
    "/commands?family=rorze",
    "/commands?family=fics",
)


def asked(**headers: str) -> Request:
    named = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return Request({"type": "http", "headers": named})


def counted() -> tuple[Document, list[int]]:
    """A document, and how often it was made."""
    made: list[int] = []

    def make() -> bytes:
        made.append(1)
        return LONG

    return Document("application/json", make), made


def test_a_document_is_made_once() -> None:
    document, made = counted()
    first, second = document.answer(asked()), document.answer(asked())
    assert first.body == second.body == LONG
    assert len(made) == 1


@pytest.mark.parametrize("accepted", ["gzip", "deflate, gzip;q=0.5", "GZIP ; q=1.0", "*", "br, *;q=0.1"])
def test_a_client_that_takes_gzip_gets_it(accepted: str) -> None:
    answer = counted()[0].answer(asked(accept_encoding=accepted))
    assert answer.headers["content-encoding"] == "gzip"
    assert gzip.decompress(bytes(answer.body)) == LONG


@pytest.mark.parametrize("accepted", ["", "identity", "br", "gzip;q=0", "gzip; q=0.000, *", "*;q=0"])
def test_a_client_that_does_not_take_gzip_gets_the_plain_bytes(accepted: str) -> None:
    answer = counted()[0].answer(asked(accept_encoding=accepted))
    assert "content-encoding" not in answer.headers
    assert answer.body == LONG


def test_what_does_not_get_shorter_is_sent_as_it_is() -> None:
    document = Document("image/png", lambda: bytes(range(256)))
    assert "content-encoding" not in document.answer(asked(accept_encoding="gzip")).headers


@pytest.mark.parametrize("accepted", ["gzip", "identity"])
def test_a_client_that_has_it_is_sent_nothing(accepted: str) -> None:
    document, _ = counted()
    etag = document.answer(asked(accept_encoding=accepted)).headers["etag"]
    for tags in (etag, f'"other", W/{etag}'):
        again = document.answer(asked(accept_encoding=accepted, if_none_match=tags))
        assert (again.status_code, again.body, again.headers["etag"]) == (304, b"", etag)
    assert document.answer(asked(if_none_match='"other"')).status_code == 200


def test_plain_and_packed_bytes_have_different_tags() -> None:
    document, _ = counted()
    tags = {document.answer(asked(accept_encoding=it)).headers["etag"] for it in ("gzip", "identity")}
    assert len(tags) == 2


@on_stand()
async def test_every_document_is_ready_bytes(stand: Stand) -> None:
    for path in EVERY_DOCUMENT:
        plain = await stand.get(path, **{"accept-encoding": "identity"})
        packed = await stand.get(path, **{"accept-encoding": "gzip"})
        assert plain.status_code == packed.status_code == 200, path
        assert plain.content == packed.content, path
        assert plain.headers["vary"] == packed.headers["vary"] == "Accept-Encoding"
        assert int(packed.headers["content-length"]) < int(plain.headers["content-length"])
        again = await stand.get(path, **{"if-none-match": plain.headers["etag"]})
        assert again.status_code == 304, path


@on_stand()
async def test_the_openapi_documents_are_what_the_app_says(stand: Stand) -> None:
    whole = json.loads(json.dumps(stand.app.openapi()))
    assert (await stand.get("/openapi.json")).json() == whole
    assert (await stand.get("/openapi/core.json")).json() == core_of(whole)


def test_a_document_is_made_beside_the_event_loop() -> None:
    makers: list[str] = []

    def make() -> bytes:
        makers.append(current_thread().name)
        return LONG

    async def story() -> None:
        document = Document("application/json", make)
        for _ in range(2):
            assert (await document.send(asked())).body == LONG

    asyncio.run(story())
    assert len(makers) == 1
    assert makers[0] != current_thread().name


@on_stand()
async def test_pages_run_their_own_scripts_and_no_others(stand: Stand) -> None:
    for path in ("/docs", "/docs/resources", "/docs/all", "/redoc"):
        page = await stand.get(path)
        policy = dict(part.split(" ", 1) for part in page.headers["content-security-policy"].split("; "))
        assert policy["default-src"] == policy["frame-ancestors"] == "'none'"
        allowed = policy["script-src"].split()
        assert "'unsafe-inline'" not in allowed
        for script in re.findall(r"<script>(.*?)</script>", page.text, re.DOTALL):
            assert f"'sha256-{b64encode(sha256(script.encode()).digest()).decode()}'" in allowed
        assert page.headers["x-frame-options"] == "DENY"
        assert page.headers["referrer-policy"] == "no-referrer"
