"""Every answer has an id, and what was done because of a request carries it down to the wire."""

import asyncio
import json
import re
from typing import Any

import httpx2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.common.request_ids import request_id_of
from simulator.faults import Direction, Fault, Switch
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell
from tests.api.stand import RELATIVE, Stand, on_stand, socket

MINE = "job-17/3"
TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = f"00-{TRACE}-00f067aa0ba902b7-01"
MADE = re.compile("[0-9a-f]{32}")


def id_of(**headers: str) -> str:
    named = [(name.replace("_", "-").encode(), value.encode("latin-1")) for name, value in headers.items()]
    return request_id_of(named)


# which id


@given(st.text(st.characters(min_codepoint=0x21, max_codepoint=0x7E), min_size=1, max_size=128))
def test_a_printable_id_is_taken_as_it_is(text: str) -> None:
    assert id_of(x_request_id=text) == text


@pytest.mark.parametrize("text", ["", "two words", "tab\there", "x" * 129, "line\nfeed", "\xe4", "\x7f"])
def test_another_one_is_passed_over_and_a_new_one_made(text: str) -> None:
    assert MADE.fullmatch(id_of(x_request_id=text))
    assert id_of(x_request_id=text, traceparent=PARENT) == TRACE
    assert id_of(x_request_id=text) != id_of(x_request_id=text)


def test_a_trace_gives_its_id_where_there_is_no_other() -> None:
    assert id_of(traceparent=PARENT) == TRACE
    assert id_of(traceparent=f"cc{PARENT[2:]}-of-the-future") == TRACE
    assert id_of(traceparent=PARENT, x_request_id=MINE) == MINE


@pytest.mark.parametrize(
    "parent",
    [
        f"ff{PARENT[2:]}",
        PARENT.upper(),
        f"{PARENT}-more",
        PARENT.replace(TRACE, "0" * 32),
        PARENT.replace("00f067aa0ba902b7", "0" * 16),
        PARENT[:-1],
        "",
    ],
)
def test_a_trace_that_is_none_is_passed_over(parent: str) -> None:
    made = id_of(traceparent=parent)
    assert MADE.fullmatch(made)
    assert made != TRACE


# every answer


@on_stand()
async def test_every_answer_has_it(stand: Stand) -> None:
    def broken(_: str) -> object:
        raise ZeroDivisionError

    asked = ["/bodies", "/bodies/3F/position", "/docs", "/openapi.json", "/metrics", "/", "/nothing", "/stop"]
    for path in asked:
        answer = await stand.get(path, **{"x-request-id": MINE})
        assert answer.headers.get_list("x-request-id") == [MINE], path
    stand.plant.target = broken  # type: ignore[assignment,method-assign]  # a fault cannot be ordered otherwise
    fault = await stand.get("/bodies/3F/moves", **{"x-request-id": MINE})
    assert (fault.status_code, fault.headers["x-request-id"]) == (500, MINE)
    assert fault.json()["request_id"] == MINE


@on_stand()
async def test_a_document_that_the_client_has_already_has_it_too(stand: Stand) -> None:
    first = await stand.get("/commands")
    again = await stand.get("/commands", **{"if-none-match": first.headers["etag"]})
    assert again.status_code == 304
    assert MADE.fullmatch(again.headers["x-request-id"])
    assert again.headers["x-request-id"] != first.headers["x-request-id"]


@on_stand(allowed_origins=["http://panel.plant:8080"])
async def test_refusals_of_strangers_have_it_and_pages_may_read_it(stand: Stand) -> None:
    stranger = await stand.get("/bodies", **{"x-request-id": MINE, "origin": "http://evil.example"})
    assert (stranger.status_code, stranger.headers["x-request-id"]) == (403, MINE)
    assert stranger.json()["request_id"] == MINE
    page = await stand.get("/bodies", origin="http://panel.plant:8080")
    assert page.headers["access-control-expose-headers"] == "X-Request-Id, Idempotency-Replayed"


@on_stand()
async def test_a_stream_of_events_has_it_in_its_head(stand: Stand) -> None:
    heads: list[dict[str, Any]] = []

    async def send(message: Any) -> None:
        heads.append(message)

    scope = {
        "type": "http",
        "method": "GET",
        "path": "/events/stream",
        "query_string": b"",
        "headers": [(b"host", b"127.0.0.1"), (b"x-request-id", MINE.encode())],
    }
    streaming = asyncio.create_task(stand.app(scope, asyncio.Event().wait, send))  # type: ignore[arg-type]  # nothing comes
    await asyncio.sleep(0.1)
    streaming.cancel()
    assert heads[0]["status"] == 200
    assert (b"x-request-id", MINE.encode()) in heads[0]["headers"]


@on_stand()
async def test_a_websocket_has_it_in_its_handshake(stand: Stand) -> None:
    for path, status in {"/events": None, "/nothing": 404}.items():
        async with socket(stand, path, headers={"traceparent": PARENT}) as client:
            answer = await client.message()
        assert answer.get("status") == status
        assert (b"x-request-id", TRACE.encode()) in answer["headers"]


@pytest.mark.parametrize(
    ("path", "content", "status"),
    [
        ("/bodies/77/moves", RELATIVE, 404),
        ("/bodies/3F/moves", {"kind": "sideways"}, 422),
        ("/bodies/3F/raw", {"text": "6PD"}, 403),
        ("/bodies/3F/commands/move-to-slowly", {"position": 5}, 409),
    ],
)
def test_a_problem_tells_it(path: str, content: object, status: int) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        if status == 409:
            await stand.post("/bodies/3F/power-cycle/acknowledge")
            await stand.teach_speeds("3F")
            await stand.post("/bodies/3F/moves", RELATIVE)
        answer = await stand.post(path, content, **{"x-request-id": MINE})
        assert (answer.status_code, answer.json()["request_id"]) == (status, MINE)

    story()


# what was done


def sent(trace: httpx2.Response) -> list[dict[str, Any]]:
    return [entry for entry in trace.json()["entries"] if entry["kind"] == "tx"]


@on_stand()
async def test_a_move_its_events_and_its_frames_carry_it(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    started = await stand.post("/bodies/3F/moves", RELATIVE, **{"x-request-id": MINE})
    moved = await stand.get(started.headers["location"] + "?wait=30")
    assert moved.json()["request_id"] == MINE
    assert moved.headers["x-request-id"] != MINE
    events = (await stand.get("/events?types=body.move.*")).json()["events"]
    assert {event["data"]["request_id"] for event in events} == {MINE}
    by_frame = {entry["data"]: entry for entry in sent(await stand.get("/lines/arm/trace"))}
    frame = by_frame[moved.json()["frame"]]
    assert (frame["caller"], frame["request_id"]) == ("http 127.0.0.1", MINE)


@on_stand()
async def test_a_stop_is_its_senders_however_often_it_is_repeated(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", RELATIVE)
    answer = await stand.post("/bodies/3F/stop", None, **{"x-request-id": MINE})
    assert answer.json()["bodies"][0]["request_id"] == MINE
    events = (await stand.get("/events?types=body.stop.*")).json()["events"]
    assert {event["data"]["request_id"] for event in events} == {MINE}
    stops = [entry for entry in sent(await stand.get("/lines/arm/trace")) if "5SS" in entry["data"]]
    assert stops
    assert {entry["request_id"] for entry in stops} == {MINE}


@on_stand({"arm": [{"id": "00"}, {"id": "01"}]})
async def test_each_move_of_a_group_carries_it(stand: Stand) -> None:
    for body in ("00", "01"):
        await stand.teach_speeds(body)
    await stand.client.put("/groups/80", json={"members": ["00", "01"]})
    answer = await stand.post("/groups/80/moves", RELATIVE, **{"x-request-id": MINE})
    assert [move["request_id"] for move in answer.json()["moves"]] == [MINE, MINE]


@on_stand()
async def test_a_fast_read_is_its_senders_and_received_frames_are_nobodys(stand: Stand) -> None:
    await stand.get("/bodies/3F/position", **{"x-request-id": MINE})
    *_, asked, answered = (await stand.get("/lines/arm/trace")).json()["entries"]
    assert (asked["data"], asked["request_id"]) == ("&3F6PD\\r", MINE)
    assert set(answered) == {"at", "monotonic_ns", "kind", "data"}


@in_cell()
async def test_a_robots_move_and_stop_carry_it(cell: Cell) -> None:
    started = await cell.post(f"{UNIT}/moves", HOME, **{"x-request-id": MINE})
    assert started.json()["request_id"] == MINE
    stopped = await cell.post("/stop", None, **{"x-request-id": "stop-1"})
    assert stopped.json()["robots"][0]["request_id"] == "stop-1"
    told = [json.loads(event.json) for event in cell.rig.events("robot.")]
    ids = {event["type"]: event["data"].get("request_id") for event in told}
    assert (ids["robot.move.sent"], ids["robot.move.stopped"]) == (MINE, MINE)
    assert ids["robot.stop.confirmed"] == "stop-1"
    frames = {
        entry.data[:3]: entry for entry in cell.rig.plant.history.recorders["cell"].entries() if entry.caller
    }
    assert (frames[b"ORG"].caller, frames[b"ORG"].request_id) == ("http 127.0.0.1", MINE)
    assert frames[b"ASS"].request_id == "stop-1"


# what nobody has asked for


@on_stand()
async def test_the_gateways_own_frames_say_what_they_are_for(stand: Stand) -> None:
    callers = {entry["data"]: entry for entry in sent(await stand.get("/lines/arm/trace"))}
    assert callers["&7FXID\\r"]["caller"] == "gateway: set-up"
    assert callers["&009CD\\r"]["caller"] == "gateway: poll"
    assert "request_id" not in callers["&009CD\\r"]


@on_stand({"arm": [{"id": "3F"}, {"id": "00"}]})
async def test_a_fence_and_a_probe_are_the_gateways_own(stand: Stand) -> None:
    stand.port.machine.faults.set(Switch(Fault.LOST, Direction.REQUESTS, 1.0))
    assert (await stand.get("/bodies/3F/position")).status_code in (409, 503)
    await asyncio.sleep(20)
    questions = [entry for entry in sent(await stand.get("/lines/arm/trace")) if "3ND" in entry["data"]]
    assert list(dict.fromkeys(entry["caller"] for entry in questions)) == ["gateway: fence", "gateway: probe"]
    assert not any("request_id" in entry for entry in questions)


@in_cell()
async def test_a_fence_of_a_robot_is_the_gateways_own_and_the_repeated_read_its_senders(cell: Cell) -> None:
    cell.rig.lose_replies()
    assert (await cell.get("/robots/r1/inputs", **{"x-request-id": MINE})).status_code == 200
    frames = [it for it in cell.rig.plant.history.recorders["cell"].entries() if it.kind == "tx"]
    assert {it.caller for it in frames if it.data.startswith(b"VAR")} == {"gateway: fence"}
    assert [it.request_id for it in frames if it.data.startswith(b"IDI")] == [MINE, MINE]


@in_cell()
async def test_an_axis_that_nobody_keeps_jogging_is_stopped_by_the_gateway(cell: Cell) -> None:
    jog = {"unit": 2, "axis": "X", "direction": "+"}
    assert (await cell.post("/robots/r1/jogs", jog, **{"x-request-id": MINE})).status_code == 201
    await asyncio.sleep(1)
    frames = [it for it in cell.rig.plant.history.recorders["cell"].entries() if it.data.startswith(b"JOG")]
    assert [(frame.caller, frame.request_id) for frame in frames if frame.kind == "tx"][:2] == [
        ("http 127.0.0.1", MINE),
        ("gateway: missing heartbeat", None),
    ]


@on_stand()
async def test_no_cache_keeps_an_answer_that_does_not_allow_it(stand: Stand) -> None:
    for path in ("/bodies", "/bodies/77", "/livez", "/events"):
        assert (await stand.get(path)).headers["cache-control"] == "no-store", path
    assert (await stand.get("/openapi.json")).headers.get_list("cache-control") == ["no-cache"]
