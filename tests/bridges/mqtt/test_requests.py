"""Commands as they come: each is read, however odd, and means the same operation here and at the gateway."""

import json
from types import SimpleNamespace
from typing import Any

import pytest
from aiomqtt import Message
from hypothesis import given
from hypothesis import strategies as st

from bridges.mqtt import requests
from bridges.mqtt.requests import LONGEST_PATH, Request

HALF = '"\\ud800"'
"""Half of a character, in JSON."""


def read(asked: str, payload: bytes = b"", **told: object) -> Request:
    message = Message(f"root/cmd/mes{asked}", payload, 1, False, 1, SimpleNamespace(**told))  # type: ignore[arg-type]
    return requests.read(message, "root")


@pytest.mark.parametrize(
    ("asked", "path"),
    [
        ("/bodies/3F/moves", "/bodies/3F/moves"),
        ("/bodies/3F/m%6Fves", "/bodies/3F/moves"),
        ("/%61ccess/keys", "/access/keys"),
        ("/robots/r1/macros/戻る/runs", "/robots/r1/macros/%E6%88%BB%E3%82%8B/runs"),
        ("/robots/r1/macros/50%/runs", "/robots/r1/macros/50%25/runs"),
        ("/bodies%2F3F/moves", ""),
        ("/bodies/%2e%2E/stop", ""),
        ("/bodies/./stop", ""),
        ("/bodies//stop", ""),
        ("/stop/", ""),
        ("/bodies/%00/stop", ""),
        ("", ""),
        (f"/{'a' * LONGEST_PATH}", ""),
    ],
)
def test_a_path_is_written_in_one_way_or_is_none(asked: str, path: str) -> None:
    assert read(asked).path == path


@pytest.mark.parametrize(
    "payload",
    [
        b"{",
        b'{"distance": NaN}',
        b"-Infinity",
        b'{"distance": 1e999}',
        b"9" * 5000,
        b"[" * 100_000,
        f'{{"correlation": {HALF}, "body": null}}'.encode(),
        f'{{"response_topic": {HALF}}}'.encode(),
        b"\xff\xfe",
        b'"' + b"x" * requests.MOST_BYTES + b'"',
    ],
)
def test_what_no_gateway_could_read_is_malformed(payload: bytes) -> None:
    request = read("/bodies/3F/moves", payload)
    assert request.malformed
    assert request.body is None


@pytest.mark.parametrize("wait", ["abc", "", "-1", "nan", "inf", "1e9", "99999", "10s"])
def test_a_wait_is_a_number_of_seconds(wait: str) -> None:
    assert "wait" in (read(f"/bodies/3F/moves?wait={wait}").malformed or "")


@pytest.mark.parametrize("token", ["é", "17\r\nX: 1", "", "stocker1:17", "1" * 20])
def test_a_lease_token_is_a_number(token: str) -> None:
    assert "lease token" in (read("/bodies/3F/moves", UserProperty=[("lease-token", token)]).malformed or "")
    envelope = json.dumps({"correlation": "c", "lease_token": token}).encode()
    assert "lease token" in (read("/bodies/3F/moves", envelope).malformed or "")


def test_tokens_of_leases_come_from_properties_and_from_the_envelope() -> None:
    envelope = b'{"correlation": "c", "lease_token": 4}'
    assert read("/x", envelope, UserProperty=[("lease-token", "17")]).lease_tokens == ("17", "4")


anything = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text()
    | st.sampled_from(["2026-01-31T12:00:00Z"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text() | st.sampled_from(sorted(requests.ENVELOPE)), inner, max_size=5)
    ),
)


@given(
    st.text(st.characters(exclude_characters="+#\0", exclude_categories=["Cs"]), max_size=50),
    st.binary(max_size=50) | anything.map(lambda it: json.dumps(it).encode()),
    st.binary(max_size=200) | st.none(),
    st.text(max_size=20) | st.none(),
    st.lists(st.tuples(st.sampled_from(["lease-token", "x"]), st.text(max_size=10)), max_size=3),
)
def test_whatever_comes_is_read_and_can_be_sent_on(
    asked: str, payload: bytes, correlation: bytes | None, topic: str | None, given_: list[tuple[str, str]]
) -> None:
    told: dict[str, Any] = {"CorrelationData": correlation, "ResponseTopic": topic, "UserProperty": given_}
    request = read(f"/{asked}", payload, **told)
    if not request.malformed:
        json.dumps(request.body, allow_nan=False).encode()
        ",".join((*request.lease_tokens, request.correlation or "")).encode("ascii")
    request.path.encode("ascii")
