"""Each way in which a request can be wrong, at every operation of the door: refused in words, nothing sent.

The rights of callers are in `access/test_matrix.py`.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, NamedTuple

import pytest
from httpx2 import ASGITransport, AsyncClient

from api import openapi
from api.app import create_app
from api.common.idempotency import takes_key
from gateway.core.operation import Operation
from gateway.core.rights import Right
from gateway.door import operations
from protocols.table import Effect
from tests.api.stand import HOST
from tests.api.test_openapi import NEVER_ALONE
from tests.api.whole_plant import THERE, whole_plant
from tests.open_access import OPEN_TABLE
from tests.virtual_time import run_virtual

Asked = dict[str, Any]

NAMES: Final = {**THERE, "name": "PCK", "cause": "limit", "port": "8"}
NOWHERE: Final = {**dict.fromkeys(THERE, "none"), "body_id": "arm.55", "group_id": "arm.99"}
JSON: Final = {"content-type": "application/json"}
KEY: Final = {"idempotency-key": "4711"}
NOT_LOOKED_FOR: Final = NEVER_ALONE | {"defineGroup", "addBodies", "getCurve"}
"""Refused before, for what they want besides; and a group may be defined that is not there yet."""


def examples() -> dict[str, Asked]:
    """A good request of each operation that takes one, as the document shows it."""
    document = json.loads((openapi.FOLDER / "openapi.json").read_text("utf-8"))
    found = {}
    for operation in (it for path in document["paths"].values() for it in path.values()):
        content = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
        shown = [it["value"] for it in content.get("examples", {}).values()]
        found[operation["operationId"]] = shown[0] if shown else {}
    return found


GOOD: Final = examples()


def good(row: Operation) -> Asked:
    return GOOD.get(row.name, {})


def stops(row: Operation) -> bool:
    """It goes out whatever else is said."""
    return Effect.STOP is row.effect or row.right is Right.STOP


def takes_json(row: Operation) -> bool:
    return row.request_name is not None and row.media is None and row.http_only is None


def spoilt(row: Operation) -> Iterator[Asked]:
    """Each member of a good request in turn is what no member can be."""
    for name in good(row):
        yield {"json": {**good(row), name: [[]]}}


def the_same(**asked: Any) -> Callable[[Operation], list[Asked]]:
    """One request that is wrong everywhere."""
    return lambda _: [asked]


class Wrong(NamedTuple):
    """One way, the operations that it concerns, what they are asked, and how each answers."""

    concerns: Callable[[Operation], bool]
    asked: Callable[[Operation], Iterable[Asked]]
    status: int
    says: str
    at_least: int
    """Requests that are tried, at the least."""
    query: str = ""
    names: dict[str, str] = NAMES


WAYS: Final = {
    "about what is not there": Wrong(
        lambda row: (
            row.target in NOWHERE
            and not (stops(row) or row.http_only or row.media or row.name in NOT_LOOKED_FOR)
        ),
        lambda row: [{"json": good(row)} if takes_json(row) else {}],
        404,
        "There is no ",
        400,
        names=NAMES | NOWHERE,
    ),
    "with a parameter of the query that is none": Wrong(
        lambda row: not stops(row),
        the_same(),
        422,
        "There is no query parameter 'limits' here",
        500,
        query="?limits=5",
    ),
    "with a member that is none": Wrong(
        takes_json,
        lambda row: [{"json": {**good(row), "limits": 5}}],
        422,
        "limits: is not known here",
        400,
    ),
    "with a member of another type": Wrong(takes_json, spoilt, 422, "; nothing was sent", 400),
    "with something else than an object": Wrong(
        takes_json, the_same(json=[5]), 422, "must be an object", 400
    ),
    "with what is no JSON": Wrong(
        takes_json, the_same(content="{", headers=JSON), 400, "The request body is not JSON", 400
    ),
    "with a body where none is taken": Wrong(
        lambda row: row.verb != "GET" and not (takes_json(row) or stops(row) or row.http_only or row.media),
        the_same(json={"limits": 5}),
        422,
        "limits: is not known here (it takes none)",
        25,
    ),
    "with a key that nobody can honour": Wrong(
        lambda row: takes_key(row.verb, row.path, row.right) and not stops(row),
        the_same(headers=KEY),
        422,
        "The header Idempotency-Key is not honoured here",
        200,
    ),
}
"""Ways in which a request can be wrong."""


@pytest.mark.parametrize("way", WAYS)
def test_a_wrong_request_is_refused_in_words_and_nothing_is_sent(way: str) -> None:
    wrong = WAYS[way]
    tried, others = 0, list[str]()

    async def story() -> None:
        nonlocal tried
        app = create_app(whole_plant(access=OPEN_TABLE))
        transport = ASGITransport(app, raise_app_exceptions=False)
        async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            for row in filter(wrong.concerns, operations()):
                path = row.path.format_map({name: wrong.names.get(name, "1") for name in row.named})
                for asked in wrong.asked(row):
                    tried += 1
                    answer = await client.request(row.verb, path + wrong.query, **asked)
                    if answer.status_code != wrong.status or wrong.says not in answer.text:
                        others.append(f"{row.name} {asked}: {answer.status_code} {answer.text}")

    run_virtual(story())
    assert others == []
    assert tried >= wrong.at_least
