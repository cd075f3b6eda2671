"""How commands ask the gateway: the key, the id of each request, and what problems come to."""

from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

from app import http
from app.cli import app
from tests.app.fake_gateway import always

NOBODY = {"moved": "no", "detail": "There is no body 3F."}


@pytest.mark.parametrize(
    ("status", "problem", "code"),
    [
        (409, {"moved": "unknown", "detail": "No reply."}, 4),
        (409, {"moved": "no", "detail": "The body is busy."}, 1),
        (409, {"moved": "no", "type": "urn:motion-gateway:problem:no-reply", "detail": "No reply."}, 4),
        (409, {"moved": "no", "type": "urn:motion-gateway:problem:ambiguous-address", "detail": "Two."}, 2),
        (422, {"moved": "no", "detail": "Refused.", "code": "0x4A"}, 1),
        (422, {"moved": "no", "detail": "distance: too long."}, 2),
        (404, NOBODY, 2),
        (401, {"detail": "Say who you are.", "remedy": "Send a key."}, 1),
        (403, {"detail": "Switched off."}, 1),
        (503, {"moved": "no", "detail": "The line is down."}, 3),
        (502, ["a proxy"], 4),
    ],
)
def test_a_problem_is_told_in_its_sentence(
    status: int, problem: object, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = always(problem, status).run(monkeypatch, "send", "3F", "6PD")
    assert (said.exit_code, said.stdout) == (code, "")
    assert (problem["detail"] if isinstance(problem, dict) else "answer was lost") in said.stderr


@pytest.mark.parametrize("url", ["ftp://x", "http://", "http://127.0.0.1:1"])
def test_where_nobody_can_answer_the_sentence_ends_once(url: str) -> None:
    said = CliRunner().invoke(app, ["status", "--url", url])
    assert said.exit_code == 3
    assert said.stderr.startswith("No gateway answers at ")
    assert said.stderr.endswith(". Nothing was sent.\n")
    assert ".." not in said.stderr


def test_a_key_file_that_cannot_be_read_is_told_without_numbers(tmp_path: Path) -> None:
    (tmp_path / "kanji").write_bytes(b"\xe9\x8d\xb5")
    for name, why in (("none", "cannot be read: No such file"), ("kanji", "holds no key: a key is ASCII")):
        said = CliRunner().invoke(app, ["status", "--key-file", str(tmp_path / name)])
        assert (said.exit_code, why in said.stderr, "Errno" in said.stderr) == (2, True, False)


def test_each_call_has_an_id_of_its_own_and_an_error_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for gateway in (always(NOBODY, 404), always(["a proxy"], 502)):
        errors = [gateway.run(monkeypatch, "send", "3F", "6PD").stderr for _ in range(2)]
        ids = [request.headers["X-Request-Id"] for request in gateway.asked]
        assert len(set(ids)) == 2
        assert all(f"request {name}" in error for name, error in zip(ids, errors, strict=True))


def test_without_a_key_it_is_said_where_one_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    refused = {"detail": "The request has no key; nothing was sent.", "remedy": "Send the header."}
    said = always(refused, 401).run(monkeypatch, "send", "3F", "6PD", MOTION_GATEWAY_KEY="")
    assert "Put your key into MOTION_GATEWAY_KEY" in said.stderr
    assert "Send the header" not in said.stderr


def test_a_certificate_that_is_not_trusted_is_called_that(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = http.NotReached("[SSL: CERTIFICATE_VERIFY_FAILED] certificate verify failed: self-signed")
    said = always(broken).run(monkeypatch, "status")
    assert said.exit_code == 3
    assert "is not trusted" in said.stderr
    assert "SSL_CERT_FILE" in said.stderr


def test_a_question_whose_answer_is_lost_has_sent_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    said = always(http.AnswerLost("too late")).run(monkeypatch, "status")
    assert said.exit_code == 3
    assert "may have been carried out" not in said.stderr


def test_no_key_is_sent_where_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    gateway = always({})
    gateway.run(monkeypatch, "send", "3F", "6PD", MOTION_GATEWAY_KEY="")
    assert "Authorization" not in gateway.asked[0].headers


def test_the_key_comes_from_the_environment_or_from_a_file_which_goes_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "key"
    file.write_text("mg_file\n", "ascii")
    gateway = always({})
    for words, environment in (
        ((), {"MOTION_GATEWAY_KEY": "mg_environment"}),
        ((), {"MOTION_GATEWAY_KEY": "mg_environment", "MOTION_GATEWAY_KEY_FILE": str(file)}),
        (("--key-file", str(file)), {}),
    ):
        assert gateway.run(monkeypatch, "send", "3F", "6PD", *words, **environment).exit_code == 0
    keys = [request.headers["Authorization"] for request in gateway.asked]
    assert keys == ["Bearer mg_environment", "Bearer mg_file", "Bearer mg_file"]


@pytest.mark.parametrize(
    ("url", "trusted"), [("http://127.0.0.1:1", False), ("https://gateway.example", True)]
)
def test_no_key_and_no_stop_goes_in_plain_text_to_a_proxy_of_the_environment(
    url: str, trusted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[dict[str, object]] = []

    def request(*_: object, **options: object) -> httpx.Response:
        asked.append(options)
        return httpx.Response(200, json={"confirmed": True, "bodies": [], "robots": []})

    monkeypatch.setattr(http, "request", request)
    assert CliRunner().invoke(app, ["stop", "--url", url]).exit_code == 0
    assert [options["trust_env"] for options in asked] == [trusted]


@pytest.mark.parametrize("content", [None, b"\n", b"\xff"])
def test_a_key_file_that_holds_no_key_is_told_and_nothing_is_sent(
    content: bytes | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "key"
    if content is not None:
        file.write_bytes(content)
    gateway = always({})
    said = gateway.run(monkeypatch, "stop", "--key-file", str(file))
    assert (said.exit_code, gateway.asked) == (2, [])
    assert f"{file}" in said.stderr
