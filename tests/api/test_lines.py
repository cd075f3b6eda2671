"""Lines over HTTP: what state they are in, who is there, and what was said on them."""

import asyncio

import pytest

from gateway.access.principal import EVERYBODY, asking
from gateway.config import Config
from gateway.core.origin import POLL, QUESTIONS, acting
from gateway.door import traces
from gateway.plant import Plant
from protocols.rorze.status import GetControllerStatus
from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import UNIT, Cell, in_cell
from tests.api.stand import BODIES, Stand, on_stand, socket
from transports.trace import Record, TraceFilter


@on_stand({"arm": BODIES, "rail": [{"id": "10"}]})
async def test_lines_say_what_they_can_do(stand: Stand) -> None:
    lines = (await stand.get("/lines")).json()["lines"]
    assert [(line["line_id"], line["state"]) for line in lines] == [("arm", "ready"), ("rail", "ready")]
    assert {line["protocol"] for line in lines} == {"rorze"}
    assert lines[0]["bodies"] == ["arm.00", "arm.01", "arm.3F"]
    assert lines[0]["controllers"] == "00,01,3F"
    assert lines[0]["stop_mode"] == "interject"


@on_stand()
async def test_a_line_that_is_down_says_why(stand: Stand) -> None:
    stand.port.unplug()
    line = (await stand.get("/lines/arm")).json()
    assert line["state"] == "down"
    assert "cable" in line["down_reason"]


@on_stand()
async def test_an_unknown_line_is_404(stand: Stand) -> None:
    assert (await stand.get("/lines/leg")).status_code == 404
    assert (await stand.get("/lines/leg/trace")).status_code == 404
    assert (await stand.post("/lines/leg/scans")).status_code == 404


@on_stand()
async def test_a_scan_finds_who_is_there_and_can_be_asked_for_later(stand: Stand) -> None:
    started = await stand.post("/lines/arm/scans")
    assert (started.status_code, started.json()["status"]) == (202, "running")
    busy = await stand.post("/lines/arm/scans")
    assert busy.status_code == 409

    over = (await stand.get(started.headers["location"] + "?wait=60")).json()

    assert (over["status"], over["asked"]) == ("finished", 120)
    assert [found["body_id"] for found in over["found"]] == ["arm.00", "arm.01", "arm.3F"]
    assert (await stand.get("/lines/arm/scans/none")).status_code == 404


@pytest.mark.parametrize(
    ("body", "status", "told"),
    [
        ({"bodies": ["3F"]}, 422, "bodies: is not known here (it takes none); nothing was sent."),
        ({"wait": 5}, 422, "wait: is not known here"),
        (["3F"], 422, "The request body: must be an object; nothing was sent."),
        ({}, 202, ""),
    ],
)
def test_what_a_route_without_a_body_would_pass_over_is_refused(body: object, status: int, told: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        before = len(stand.frames())
        answer = await stand.post("/lines/arm/scans", body)
        assert answer.status_code == status, answer.text
        assert answer.json().get("detail", "").startswith(told)
        assert status == 202 or len(stand.frames()) == before

    story()


@on_stand()
async def test_a_scan_can_be_waited_for(stand: Stand) -> None:
    answer = await stand.post("/lines/arm/scans", prefer="wait=60")
    assert (answer.status_code, answer.json()["status"]) == (200, "finished")


@on_stand()
async def test_the_trace_holds_every_byte_with_its_direction(stand: Stand) -> None:
    await stand.get("/bodies/3F/position")
    entries = (await stand.get("/lines/arm/trace?limit=2")).json()["entries"]
    assert [(entry["kind"], entry["data"]) for entry in entries] == [
        ("tx", "&3F6PD\\r"),
        ("rx", ">&3F6PD+000000000\\r"),
    ]
    assert (await stand.get("/lines/arm/trace?last=2")).json()["entries"] == entries
    later = (await stand.get("/lines/arm/trace?since=2100-01-01T00:00:00Z")).json()
    assert later == {"line_id": "arm", "entries": []}


@on_stand()
async def test_the_trace_is_filtered_by_body_and_by_request(stand: Stand) -> None:
    await stand.get("/bodies/01/position")
    await stand.get("/bodies/3F/position", **{"x-request-id": "mine"})
    await stand.get("/bodies/01/position")
    mine = (await stand.get("/lines/arm/trace?request_id=mine")).json()["entries"]
    assert [entry["data"] for entry in mine][-2:] == ["&3F6PD\\r", ">&3F6PD+000000000\\r"]
    assert {entry["data"].lstrip(">")[:3] for entry in mine} == {"&3F"}
    body = (await stand.get("/lines/arm/trace?bodies=3F&limit=2")).json()["entries"]
    assert body == mine[-2:]
    of_others = (await stand.get("/lines/arm/trace?bodies=arm.01")).json()["entries"]
    assert not [entry for entry in of_others if "&3F" in entry["data"]]
    assert (await stand.get("/lines/arm/trace?bodies=77")).status_code == 404


@on_stand()
async def test_the_trace_counts_what_is_left_without_polls(stand: Stand) -> None:
    await stand.get("/bodies/3F/position")
    with acting(POLL):
        for _ in range(5):
            await stand.plant.target("/bodies/3F").ask(GetControllerStatus())
    told = (await stand.get("/lines/arm/trace?polls=false&limit=2")).json()["entries"]
    assert [entry["data"] for entry in told] == ["&3F6PD\\r", ">&3F6PD+000000000\\r"]
    polled = (await stand.get("/lines/arm/trace?limit=2")).json()["entries"]
    assert [entry["data"] for entry in polled] == ["&3F9CD\\r", ">&3F9CDH00\\r"]


@on_stand()
async def test_the_trace_is_followed_live(stand: Stand) -> None:
    passing = traces.filter_of(stand.plant, "arm", "3F", None)
    told: list[str] = []

    async def listen() -> None:
        with asking(EVERYBODY):
            following = traces.follow(stand.plant, "arm", passing, None)
        async for news in following:
            told.extend(entry.data.decode() for entry in (news.entries if news else ()))

    listening = asyncio.create_task(listen())
    await asyncio.sleep(0.2)
    told.clear()
    await stand.get("/bodies/3F/inputs")
    await stand.get("/bodies/01/inputs")
    await asyncio.sleep(0.2)
    assert [text for text in told if "CID" in text] == ["&3FCID\r", ">&3FCIDH0000\r"]
    stand.plant.events.close()
    await asyncio.wait_for(listening, 1.0)


@on_stand()
async def test_the_stream_of_a_trace_resumes_and_tells_what_was_missed(stand: Stand) -> None:
    for _ in range(3):
        await stand.get("/bodies/3F/position")
    asking = asyncio.create_task(stand.get("/lines/arm/trace/stream?bodies=3F", **{"last-event-id": "0"}))
    await asyncio.sleep(0.5)
    stand.plant.events.close()
    answer = await asking
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert answer.text.startswith(": the trace from now on\n\nevent: trace\ndata: {")
    assert answer.text.rstrip().splitlines()[-1].startswith("id: ")
    assert r'"data":"&3F6PD\\r"' in answer.text
    assert (await stand.get("/lines/arm/trace/stream", **{"last-event-id": "x"})).status_code == 422
    assert (await stand.get("/lines/leg/trace/stream")).status_code == 404


@on_stand()
async def test_a_trace_is_followed_by_a_socket_from_the_last_records_on(stand: Stand) -> None:
    mine = {"x-request-id": "job-17"}
    for _ in range(3):
        await stand.get("/bodies/3F/inputs", **mine)
    async with socket(stand, "/lines/arm/trace/stream?bodies=3F&request_id=job-17&last=2") as client:
        await client.message()
        before = await client.event()
        await stand.get("/bodies/3F/inputs")
        await stand.get("/bodies/3F/outputs", **mine)
        news = await client.event()
    assert [it["data"] for it in before["entries"]] == ["&3FCID\\r", ">&3FCIDH0000\\r"]
    assert (news["entries"][0]["data"], news["missed"]) == ("&3FCOD\\r", 0)
    async with socket(stand, f"/lines/arm/trace/stream?request_id=job-17&after={before['number']}") as client:
        await client.message()
        assert (await client.event())["entries"][0] == news["entries"][0]


@on_stand()
async def test_a_socket_that_asks_for_a_trace_oddly_is_closed_with_a_reason(stand: Stand) -> None:
    for target in (
        "arm/trace/stream?last=x",
        "arm/trace/stream?bodies=77",
        "arm/trace/stream?lost=1",
        "leg/trace/stream",
    ):
        async with socket(stand, f"/lines/{target}") as client:
            await client.message()
            closed = await client.message()
        assert (closed["type"], closed["code"]) == ("websocket.close", 4400)
        assert closed["reason"]


@on_stand()
async def test_a_trace_asked_for_oddly_is_422(stand: Stand) -> None:
    for query in ("last=0", "last=99999999", "last=x", "since=yesterday", "since=2026-01-01T00:00:00"):
        assert (await stand.get(f"/lines/arm/trace?{query}")).status_code == 422


@on_stand()
async def test_all_positions_of_a_line_are_read_together(stand: Stand) -> None:
    await stand.send("01", "set-position", position=1500)
    told = (await stand.get("/lines/arm/positions")).json()
    assert [(it["body_id"], it["pulses"], it["value"]) for it in told["positions"]] == [
        ("arm.00", 0, None),
        ("arm.01", 1500, 1.5),
        ("arm.3F", 0, None),
    ]
    assert all(it["read_at"] and it["age_ms"] < 1000 for it in told["positions"])
    assert told["unanswered"] == []


@on_stand()
async def test_who_does_not_answer_a_sweep_is_told_as_such(stand: Stand) -> None:
    stand.port.machine.switch_body(1, on=False, now=0.0)
    told = (await stand.get("/lines/arm/statuses")).json()
    assert [(it["body_id"], it["moving"]) for it in told["statuses"]] == [
        ("arm.00", False),
        ("arm.3F", False),
    ]
    assert [it["body_id"] for it in told["unanswered"]] == ["arm.01"]
    assert told["unanswered"][0]["detail"]


@on_stand()
async def test_a_line_tells_who_takes_up_its_time(stand: Stand) -> None:
    stand.port.machine.switch_body(1, on=False, now=0.0)
    await stand.get("/bodies/01/position")
    await asyncio.sleep(5.0)
    load = (await stand.get("/lines/arm")).json()["load"]
    assert {"clients", "fences", "probes"} <= load.keys()
    assert all(0 <= percent <= 100 for percent in load.values())
    assert (
        'motion_gateway_line_busy_seconds_total{kind="clients",line="arm"}'
        in (await stand.get("/metrics")).text
    )


@on_stand({"arm": BODIES, "rail": [{"id": "10"}]})
async def test_bodies_are_listed_as_they_are_now_where_that_is_wanted(stand: Stand) -> None:
    await stand.send("01", "set-position", position=1500)
    assert (await stand.get("/bodies?fresh=1")).status_code == 200
    listed = (await stand.get("/bodies?fresh=true")).json()["bodies"]
    assert [(it["body_id"], it["position"]) for it in listed][1] == ("arm.01", 1500)
    assert (await stand.get("/bodies?fresh=perhaps")).status_code == 422


@in_cell()
async def test_the_line_of_a_robot_has_no_bodies_to_sweep(cell: Cell) -> None:
    assert (await cell.get("/lines/cell/positions")).status_code == 422


@in_cell()
async def test_the_line_of_a_robot_says_whose_it_is(cell: Cell) -> None:
    (line,) = (await cell.get("/lines")).json()["lines"]
    assert line == (await cell.get("/lines/cell")).json()
    assert (line["line_id"], line["protocol"], line["state"]) == ("cell", "fics", "ready")
    assert (line["robot_id"], line["mode"], line["online"]) == ("r1", 3, True)
    assert line["waiting"] == {
        "stop": 0,
        "verify": 0,
        "command": 0,
        "stop_repeat": 0,
        "read": 0,
        "background": 0,
    }
    assert line["counters"]["frames_sent"] > 0


@in_cell()
async def test_a_line_with_a_robot_has_no_bodies_to_scan_or_command(cell: Cell) -> None:
    before = cell.rig.cable.frames()
    for answer in (
        await cell.post("/lines/cell/scans"),
        await cell.get("/lines/cell/scans/none"),
        await cell.post("/lines/cell/commands/identify-controllers"),
    ):
        refused(answer, 422)
        assert "leads to a robot" in answer.json()["detail"]
    assert cell.rig.cable.frames() == before


@in_cell()
async def test_the_trace_of_a_robots_line_holds_every_byte(cell: Cell) -> None:
    await cell.get(f"{UNIT}/position")
    entries = (await cell.get("/lines/cell/trace")).json()["entries"]
    assert ("tx", "APS\\r") in [(entry["kind"], entry["data"]) for entry in entries]
    unknown = await cell.get("/lines/leg/trace")
    refused(unknown, 404)
    assert "there is cell" in unknown.json()["detail"]


@in_cell()
async def test_a_robots_trace_without_polls_has_the_reply_at_the_end_of_a_move(
    cell: Cell,
) -> None:
    await cell.get(f"{UNIT}/position")
    told = (await cell.get("/lines/cell/trace?polls=false")).json()["entries"]
    every = (await cell.get("/lines/cell/trace")).json()["entries"]
    assert {entry["caller"] for entry in told if entry["kind"] == "tx"} == {"http 127.0.0.1"}
    assert any(entry.get("caller") == "gateway: set-up" for entry in every)
    move: Record = (0, 0, "tx", b"POM 1\r", "http 127.0.0.1", "job-17")
    poll: Record = (0, 0, "tx", b"AXS\r", POLL.caller, None)
    seen: Record = (0, 0, "rx", b"AXS 1\r", None, None)
    ended: Record = (0, 0, "rx", b"POM\r", None, None)
    subject_of = cell.rig.plant.port("cell").subject_of
    assert list(TraceFilter(subject_of, without=QUESTIONS).pass_on([move, poll, seen, ended])) == [
        move,
        ended,
    ]
    of_request = TraceFilter(subject_of, request_id="job-17").pass_on([move, poll, seen, ended])
    assert list(of_request) == [move, ended]


def test_lines_of_both_protocols_come_in_the_order_of_the_configuration() -> None:
    robot = {"id": "r1", "units": [{"number": 1, "axes": ["X"]}]}
    cell = {"id": "cell", "address": "tcp://127.0.0.1:1", "protocol": "fics", "robot": robot}
    arm, rail = (
        {"id": name, "address": f"tcp://127.0.0.1:{port}"} for name, port in (("arm", 2), ("rail", 3))
    )
    plant = Plant(Config.model_validate({"lines": [arm, cell, rail]}))
    assert list(plant.ports()) == ["arm", "cell", "rail"]
