"""Bounds of requests: waiting times, sizes, and the notation of moments."""

import asyncio
from datetime import UTC, datetime, timedelta

import pytest
from pydantic import ValidationError
from starlette.requests import Request

from api.common.requests import wait_s
from api.common.responses import json_response, wait_headers
from gateway.core.operation import MAX_WAIT_S
from gateway.core.records import RequestModel
from gateway.core.times import age_ms_of, utc_of
from tests.gateway.rorze.far_end import virtual


def request(*prefer: str) -> Request:
    return Request({"type": "http", "headers": [(b"prefer", value.encode()) for value in prefer]})


@pytest.mark.parametrize(
    ("prefer", "seconds"),
    [
        ("wait=10", 10.0),
        ("Wait = 2.5", 2.5),
        ('wait="3"', 3.0),
        ("respond-async, wait=4", 4.0),
        ("wait=5; foo=bar", 5.0),
        ("wait=0", 0.0),
        ("wait=999999999", MAX_WAIT_S),
        ("wait=9999999999", 0.0),
        ("wait=-1", 0.0),
        ("wait=1e3", 0.0),
        ("wait=", 0.0),
        ("await=7", 0.0),
        ("respond-async", 0.0),
    ],
)
def test_the_header_prefer_is_heeded_where_it_is_understood(prefer: str, seconds: float) -> None:
    assert wait_s(request(prefer), None) == seconds


def test_the_header_may_come_in_several_lines_or_not_at_all() -> None:
    assert wait_s(request("respond-async", "wait=6"), None) == 6.0
    assert wait_s(request(), None) == 0.0


@pytest.mark.parametrize(("query", "seconds"), [(0.0, 0.0), (7.5, 7.5), (1e300, MAX_WAIT_S)])
def test_the_query_goes_before_the_header(query: float, seconds: float) -> None:
    assert wait_s(request("wait=30"), query) == seconds


@pytest.mark.parametrize(("waited_s", "applied"), [(10.0, "wait=10"), (0.25, "wait=0.25")])
def test_a_wish_that_was_granted_is_confirmed(waited_s: float, applied: str) -> None:
    assert wait_headers(waited_s) == {"Preference-Applied": applied}
    assert wait_headers(0.0) == {}


class Weight(RequestModel):
    grams: float


@pytest.mark.parametrize(
    "body", ['{"grams": "1"}', '{"grams": true}', '{"grams": NaN}', '{"grams": 1, "x": 1}']
)
def test_a_request_is_taken_for_nothing_it_is_not(body: str) -> None:
    with pytest.raises(ValidationError):
        Weight.model_validate_json(body)


def test_an_answer_is_the_model_as_it_is() -> None:
    answer = json_response(Weight(grams=1.5), 202, {"Location": "/here"})
    assert (answer.status_code, answer.body, answer.headers["location"]) == (202, b'{"grams":1.5}', "/here")
    assert answer.headers["content-type"] == "application/json"


@virtual
async def test_moments_of_the_event_loop_are_told_as_ages_and_wall_times() -> None:
    seen_at = asyncio.get_running_loop().time()
    await asyncio.sleep(2.5)
    assert age_ms_of(seen_at) == pytest.approx(2500.0)
    assert age_ms_of(seen_at + 100.0) == 0.0
    assert abs(datetime.now(UTC) - timedelta(seconds=2.5) - utc_of(seen_at)) < timedelta(seconds=1)
