"""Request bodies: what is not exactly JSON, or not exactly one thing, is refused and never a fault."""

import json

import pytest
from httpx2 import Response
from hypothesis import given
from hypothesis import strategies as st
from starlette.testclient import TestClient

from api.common.calling import MAX_BODY_BYTES
from gateway.core.operation import Rows
from gateway.core.records import RequestModel
from gateway.core.rights import Right
from gateway.door.strict_json import MAX_DEPTH, MAX_ITEMS, MAX_KEYS, parse
from tests.api.small import client_of
from tests.gateway.door.test_strict_json import JSON

ROWS = Rows("test")


class Pulses(RequestModel):
    """A body with one strict number."""

    pulses: int


@ROWS.post("/pulses", Right.OPERATE, whole_plant=True)
async def take_pulses(body: Pulses) -> int:
    return body.pulses


def client() -> TestClient:
    return client_of(ROWS)


CLIENT = client()


def post(content: bytes, content_type: str = "application/json") -> Response:
    return CLIENT.post("/pulses", content=content, headers={"content-type": content_type})


@given(st.binary(max_size=200) | JSON.map(lambda value: json.dumps(value).encode()))
def test_no_body_is_ever_a_fault_of_the_server(data: bytes) -> None:
    answer = post(data)
    assert answer.status_code in (200, 400, 422)
    if answer.status_code != 200:
        assert answer.headers["content-type"] == "application/problem+json"


def test_a_good_body_is_taken() -> None:
    answer = post(b'{"pulses": 500}')
    assert (answer.status_code, answer.json()) == (200, 500)


@pytest.mark.parametrize(
    "text",
    [
        '{"pulses": true}',
        '{"pulses": "500"}',
        '{"pulses": 5.5}',
        '{"pulses": 9007199254740994.0}',
        '{"pulses": 1e300}',
        '{"pulses": null}',
        '{"pulses": NaN}',
        '{"pulses": Infinity}',
        '{"pulses": -Infinity}',
        '{"pulses": 1e400}',
        '{"pulses": ' + "9" * 5000 + "}",
        '{"pulses": -' + "9" * 5000 + "}",
        '{"pulses": 5, "pulses": 5}',
        '{"pulses": 5, "more": 1}',
        '{"pulses": "\\ud800"}',
        '{"\\ud800": 5}',
        "[5]",
        "5",
        "{}",
        "null",
        "[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1),
        "[" * 10_000 + "]" * 10_000,
        json.dumps({f"a{number}": 1 for number in range(MAX_KEYS + 1)}),
    ],
)
def test_what_could_mean_something_else_is_422(text: str) -> None:
    answer = post(text.encode())
    assert answer.status_code == 422
    assert answer.json()["type"].endswith(":invalid-request")
    assert answer.json()["moved"] == "no"


@pytest.mark.parametrize(("text", "pulses"), [("5000.0", 5000), ("5e2", 500), ("-5.00E+1", -50), ("-0.0", 0)])
def test_a_whole_number_may_be_written_with_a_point(text: str, pulses: int) -> None:
    answer = post(f'{{"pulses": {text}}}'.encode())
    assert (answer.status_code, answer.text) == (200, str(pulses))


@pytest.mark.parametrize(
    "data",
    [
        b"{",
        b"{'pulses': 5}",
        b'{"pulses": 05}',
        b'{"pulses": +5}',
        b'{"pulses": 1_000}',
        b'{"pulses": 5} trailing',
        b'\xef\xbb\xbf{"pulses": 5}',
        b'{"pulses": "\xff"}',
        '{"pulses": 5}'.encode("utf-16"),
    ],
)
def test_what_is_no_json_is_400(data: bytes) -> None:
    assert post(data).status_code == 400


@pytest.mark.parametrize("content_type", ["text/plain", "application/x-www-form-urlencoded", ""])
def test_another_content_type_is_415(content_type: str) -> None:
    answer = post(b'{"pulses": 5}', content_type)
    assert answer.status_code == 415
    assert "application/json" in answer.json()["detail"]


def test_a_charset_beside_the_content_type_does_no_harm() -> None:
    assert post(b'{"pulses": 5}', "application/json; charset=utf-8").status_code == 200


def test_a_body_over_64_kib_is_413() -> None:
    answer = post(b'{"pulses": ' + b" " * MAX_BODY_BYTES + b"5}")
    assert answer.status_code == 413
    assert answer.headers["content-type"] == "application/problem+json"


def test_an_array_has_as_many_entries_as_a_body_has_positions_and_no_more() -> None:
    assert parse(json.dumps([{}] * 2_048).encode()) == [{}] * MAX_ITEMS
    answer = client().post("/pulses", json={"pulses": [1] * (MAX_ITEMS + 1)})
    assert answer.status_code == 422
    assert f"an array has more than {MAX_ITEMS} items" in answer.json()["detail"]
