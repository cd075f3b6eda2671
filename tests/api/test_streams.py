"""Events over WebSocket, SSE and as a list: no client can miss one without being told."""

import asyncio
import json
from urllib.parse import quote

from gateway.core.events import MAX_BACKLOG
from gateway.door.event_models import EventList
from gateway.event_types import EVENT_TYPES
from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm
from tests.api.stand import RELATIVE, Served, Stand, on_stand, socket


async def move(stand: Stand) -> dict[str, object]:
    await stand.teach_speeds("3F")
    return dict((await stand.post("/bodies/3F/moves?wait=30", RELATIVE)).json())


@on_stand()
async def test_a_websocket_client_sees_a_move_start_and_end(stand: Stand) -> None:
    async with socket(stand, "/events?types=body.move.*") as client:
        assert (await client.message())["type"] == "websocket.accept"
        moved = await move(stand)
        types = [(await client.event())["type"] for _ in range(4)]
    assert types == ["body.move.queued", "body.move.sent", "body.move.started", "body.move.succeeded"]
    assert moved["status"] == "succeeded"


@on_stand()
async def test_a_client_resumes_after_its_cursor_without_a_hole(stand: Stand) -> None:
    moved = await move(stand)
    async with socket(stand, f"/events?after={moved['event_cursor']}") as client:
        await client.message()
        event = await client.event()
    assert (event["type"], event["correlationid"]) == ("body.move.sent", moved["id"])
    assert (event["specversion"], event["subject"]) == ("1.0", "/bodies/arm.3F")


@on_stand()
async def test_a_cursor_of_another_life_is_answered_with_a_gap(stand: Stand) -> None:
    async with socket(stand, "/events?after=00000000-000000000007") as client:
        await client.message()
        event, snapshot = await client.event(), await client.event()
    assert event["type"] == "stream.gap"
    assert event["data"]["requested"] == "00000000-000000000007"
    assert snapshot["type"] == "stream.snapshot"
    assert {body["body_id"] for body in snapshot["data"]["bodies"]} == {"arm.00", "arm.01", "arm.3F"}


@on_stand()
async def test_a_stream_begins_with_a_snapshot_where_that_is_asked_for(stand: Stand) -> None:
    async with socket(stand, "/events?snapshot=true&bodies=00") as client:
        await client.message()
        snapshot = await client.event()
    assert (snapshot["type"], snapshot["data"]["as_of"]) == ("stream.snapshot", snapshot["cursor"])
    assert [body["body_id"] for body in snapshot["data"]["bodies"]] == ["arm.00"]


@on_stand()
async def test_events_of_other_bodies_are_left_out(stand: Stand) -> None:
    async with socket(stand, "/events?bodies=00,01") as client:
        await client.message()
        await move(stand)
        stand.plant.events.publish("body.online", "/bodies/arm.00", {})
        assert (await client.event())["type"] == "body.online"


@on_stand()
async def test_the_subprotocol_is_spoken_when_it_is_offered(stand: Stand) -> None:
    async with socket(stand, "/events", ["other", "cloudevents.json"]) as client:
        assert (await client.message())["subprotocol"] == "cloudevents.json"
    async with socket(stand, "/events", ["other"]) as client:
        assert (await client.message())["subprotocol"] is None
    async with socket(stand, "/events", ["cloudevents.json", "cloudevents-batch.json"]) as client:
        assert (await client.message())["subprotocol"] == "cloudevents-batch.json"


@on_stand()
async def test_a_malformed_cursor_or_filter_closes_the_socket_with_a_reason(stand: Stand) -> None:
    for query in ("after=yesterday", "bodies=ZZ", "types=*", "snapshot=maybe"):
        async with socket(stand, f"/events?{query}") as client:
            await client.message()
            closed = await client.message()
        assert (closed["type"], closed["code"]) == ("websocket.close", 4400)
        assert closed["reason"]


@on_stand()
async def test_a_client_that_does_not_read_is_closed_and_can_go_on_later(stand: Stand) -> None:
    async with socket(stand, "/events?types=line.message") as client:
        await client.message()
        await asyncio.sleep(0.1)  # it has read all there is
        client.reading.clear()
        for number in range(MAX_BACKLOG + 100):
            stand.plant.events.publish("line.message", "/lines/arm", {"frame": f"number {number}"})
            await asyncio.sleep(0)
        client.reading.set()
        first = await client.event()
        closed = await client.message()
    assert (closed["type"], closed["code"]) == ("websocket.close", 4008)
    assert closed["reason"].endswith(first["cursor"])


@on_stand()
async def test_a_client_that_opens_a_websocket_elsewhere_is_told_where_there_is_one(stand: Stand) -> None:
    async with socket(stand, "/events/stream") as client:
        assert (await client.message())["status"] == 404
        told = json.loads((await client.message())["body"])["detail"]
    assert told == (
        "There is no WebSocket at /events/stream "
        "(there is one at /events and at /lines/{line_id}/trace/stream); nothing was sent."
    )


@on_stand()
async def test_what_a_client_says_disturbs_nothing(stand: Stand) -> None:
    async with socket(stand, "/events?types=line.message") as client:
        await client.message()
        await client.say({"type": "websocket.receive", "text": "{" * 1000})
        await client.say({"type": "websocket.receive", "bytes": b"\xff"})
        await asyncio.sleep(0.1)
        stand.plant.events.publish("line.message", "/lines/arm", {"frame": ">&7C"})
        assert (await client.event())["type"] == "line.message"


@on_stand()
async def test_a_client_that_goes_leaves_nothing_behind(stand: Stand) -> None:
    async with socket(stand, "/events") as client:
        await client.message()
    assert client.task.done()
    assert client.task.exception() is None


@on_stand()
async def test_the_list_is_read_page_by_page(stand: Stand) -> None:
    await move(stand)
    everything = (await stand.get("/events?limit=1000")).json()["events"]

    pages, cursor = [], None
    while True:
        page = (await stand.get("/events?limit=2" + (f"&after={cursor}" if cursor else ""))).json()
        if not page["events"]:
            break
        pages += page["events"]
        cursor = page["cursor"]

    assert pages == everything
    assert len({event["id"] for event in pages}) == len(pages) > 4


@on_stand()
async def test_a_list_asked_for_oddly_is_422(stand: Stand) -> None:
    for query in ("after=x", "types=A", "bodies=,", "limit=0", "limit=x"):
        answer = await stand.get(f"/events?{query}")
        assert answer.status_code == 422
        assert answer.json()["type"].endswith(":invalid-request")


@on_stand()
async def test_a_type_that_there_is_not_is_refused_for_nothing_would_ever_come(stand: Stand) -> None:
    for path in ("/events", "/events/stream"):
        answer = await stand.get(f"{path}?types=line.down,body.mvoe.*")
        assert answer.status_code == 422
        assert answer.json()["detail"] == "types: there is no 'body.mvoe.*' (did you mean body.move.*?)."
    async with socket(stand, "/events?types=body.stpo.confirmed") as client:
        await client.message()
        closed = await client.message()
    assert (closed["code"], "did you mean body.stop.confirmed?" in closed["reason"]) == (4400, True)
    unlike = (await stand.get("/events?types=nothing")).json()["detail"]
    assert "known are alarm.*, body.*, gateway.*" in unlike
    assert "body.move" not in unlike


@on_stand()
async def test_every_type_and_every_beginning_of_one_can_be_asked_for(stand: Stand) -> None:
    for name in EVENT_TYPES:
        beginnings = [name[:end] + ".*" for end, char in enumerate(name) if char == "."]
        answer = await stand.get(f"/events?types={','.join([name, *beginnings])}")
        assert answer.status_code == 200


async def read_sent(served: Served, count: int, path: str, **headers: str) -> list[dict[str, str]]:
    """Read a few frames of server-sent events, straight from the app, and hang up."""
    gone, received = asyncio.Event(), bytearray()

    async def receive() -> dict[str, object]:
        await gone.wait()
        return {"type": "http.disconnect"}

    async def send(message: dict[str, object]) -> None:
        body = message.get("body", b"")
        assert isinstance(body, bytes)
        received.extend(body)
        if received.count(b"\ndata: ") >= count:
            gone.set()

    place, _, query = path.partition("?")
    raw = [(b"host", b"localhost"), *((key.encode(), value.encode()) for key, value in headers.items())]
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": "GET",
        "scheme": "http",
        "path": place,
        "raw_path": place.encode(),
        "root_path": "",
        "query_string": query.encode(),
        "headers": raw,
    }
    await served.app(scope, receive, send)  # type: ignore[arg-type]  # plain dictionaries are messages
    frames = [frame for frame in received.decode().split("\n\n") if frame.startswith("id: ")]
    return [dict(line.split(": ", 1) for line in frame.splitlines()) for frame in frames]


@on_stand()
async def test_server_sent_events_carry_the_cursor_as_their_id(stand: Stand) -> None:
    moved = await move(stand)
    first, second, *_ = await read_sent(stand, 2, f"/events/stream?after={moved['event_cursor']}")
    assert first["event"] == "body.move.sent"
    assert json.loads(first["data"])["cursor"] == first["id"]
    again, *_ = await read_sent(stand, 1, "/events/stream", **{"last-event-id": first["id"]})
    assert again == second


@on_stand()
async def test_a_malformed_cursor_is_422_for_server_sent_events(stand: Stand) -> None:
    assert (await stand.get("/events/stream?after=x")).status_code == 422


@in_cell()
async def test_a_websocket_client_sees_a_robots_move_start_and_end(cell: Cell) -> None:
    async with socket(cell, "/events?bodies=r1/units/1") as client:
        assert (await client.message())["type"] == "websocket.accept"
        moved = await cell.move(HOME)
        await cell.move(HOME, unit=2)
        events = [await client.event() for _ in range(4)]
    assert [(event["type"], event["data"]["status"]) for event in events] == [
        ("robot.move.queued", "queued"),
        ("robot.move.sent", "sent"),
        ("robot.move.started", "moving"),
        ("robot.move.succeeded", "succeeded"),
    ]
    assert {(event["subject"], event["correlationid"]) for event in events} == {(UNIT, moved["id"])}


@in_cell()
async def test_a_robots_address_finds_all_its_events_and_a_units_those_of_the_unit(cell: Cell) -> None:
    await cell.move(HOME, unit=2)
    await cell.post("/robots/r1/jogs", {"unit": 2, "axis": "X", "direction": "+"})
    await asyncio.sleep(2)  # without a heartbeat
    await cell.post("/robots/r1/stop", {"mode": "immediate"})
    await cell.post("/robots/r1/errors/reset")
    cell.rig.power_cycle()
    await asyncio.sleep(10)
    await cell.post("/robots/r1/power-cycle/acknowledge")

    everything = (await cell.get("/events?limit=1000")).json()["events"]
    of_the_robot = (await cell.get("/events?limit=1000&bodies=R1")).json()["events"]
    of_the_unit = (await cell.get("/events?limit=1000&bodies=r1/units/2")).json()["events"]

    assert of_the_robot == [event for event in everything if event["subject"].startswith("/robots/")]
    assert {"robot.move.succeeded", "robot.jog.lost", "robot.stop.confirmed", "robot.error"} < {
        event["type"] for event in of_the_robot
    }
    assert of_the_unit == [event for event in everything if event["type"].startswith("robot.move.")]
    sent = await read_sent(cell, 2, f"/events/stream?bodies=r1/units/2&after={everything[0]['cursor']}")
    assert [frame["event"] for frame in sent[:2]] == ["robot.move.queued", "robot.move.sent"]


@in_cell()
async def test_who_is_not_in_the_configuration_is_told_instead_of_never_heard(cell: Cell) -> None:
    for address in ("r2", "r1/units/3", "3F", "arm.3F", "ロボット"):
        for path in ("/events", "/events/stream"):
            answer = await cell.get(f"{path}?bodies=r1,{address}")
            refused(answer, 422)
            assert address in answer.json()["detail"]
        async with socket(cell, f"/events?bodies=r1,{quote(address * 20)}") as client:
            await client.message()
            closed = await client.message()
        assert (closed["type"], closed["code"]) == ("websocket.close", 4400)
        assert 0 < len(closed["reason"].encode()) <= 123


@on_stand()
async def test_a_websocket_client_watches_where_a_body_stands(stand: Stand) -> None:
    await move(stand)
    async with socket(stand, "/events?bodies=01,3F&sample=10&types=body.position") as client:
        await client.message()
        began = asyncio.get_running_loop().time()
        values = [await client.event() for _ in range(20)]
    assert 0.9 < asyncio.get_running_loop().time() - began < 1.2
    of = {it["subject"]: it["data"] for it in values}
    counted = {"counted_in": "pulses"}
    assert of["/bodies/arm.3F"] == {"pulses": 50_000, "value": None, "unit": None} | counted
    assert of["/bodies/arm.01"] == {"pulses": 0, "value": 0.0, "unit": "mm"} | counted
    assert not [it for it in values if "sequence" in it]
    assert {it["cursor"] for it in values} == {stand.plant.events.cursor}


@on_stand()
async def test_values_and_events_come_in_one_stream(stand: Stand) -> None:
    async with socket(stand, "/events?bodies=3F&sample=10") as client:
        await client.message()
        await move(stand)
        types = [(await client.event())["type"] for _ in range(40)]
    assert {"body.position", "io", "body.move.started", "body.move.succeeded"} <= set(types)


@on_stand()
async def test_server_sent_values_are_resumed_after_the_last_event(stand: Stand) -> None:
    sent = await read_sent(stand, 5, "/events/stream?bodies=3F&sample=10&types=body.position")
    assert {(frame["event"], frame["id"]) for frame in sent} == {("body.position", stand.plant.events.cursor)}


@on_stand()
async def test_the_list_has_the_values_of_now_at_its_end(stand: Stand) -> None:
    await move(stand)
    page = (await stand.get("/events?bodies=3F&types=body.position,body.move.*&sample=10")).json()
    assert page["events"][-1]["type"] == "body.position"
    assert page["events"][-1]["data"]["pulses"] == 50_000
    assert page["events"][-2]["type"] == "body.move.succeeded"
    assert page["cursor"] == stand.plant.events.cursor
    EventList.model_validate(page)


@on_stand()
async def test_a_sample_is_a_number_of_times_a_second(stand: Stand) -> None:
    for wrong in ("0", "51", "-1", "nan", "often", ""):
        for path in ("/events", "/events/stream"):
            refused(await stand.get(f"{path}?sample={wrong}"), 422)
        async with socket(stand, f"/events?sample={wrong}") as client:
            await client.message()
            closed = await client.message()
        assert (closed["type"], closed["code"]) == ("websocket.close", 4400)


@on_stand()
async def test_the_load_of_the_line_shows_what_watching_takes(stand: Stand) -> None:
    async with socket(stand, "/events?bodies=3F&sample=10") as client:
        await client.message()
        await asyncio.sleep(2)
        load = (await stand.get("/lines/arm")).json()["load"]
    assert "live" in load
    await asyncio.sleep(12)
    assert "live" not in (await stand.get("/lines/arm")).json()["load"]


@in_cell()
async def test_a_robots_units_are_watched_as_bodies_are(cell: Cell) -> None:
    await cell.move(HOME)
    selected = len(cell.rig.heard("UNT 2"))
    async with socket(cell, "/events?bodies=r1&sample=10&types=robot.position") as client:
        await client.message()
        values = [await client.event() for _ in range(20)]
        await cell.post(f"{UNIT}/moves", {"kind": "absolute", "axes": mm(X=-200)})
        moving = [await client.event() for _ in range(20)]
    assert {it["subject"] for it in (*values, *moving)} == {UNIT}
    assert values[0]["data"]["coordinates"] == "user"
    assert values[0]["data"]["axes"]["X"]["unit"] == "mm"
    assert len({it["data"]["axes"]["X"]["value"] for it in moving}) > 3
    assert len(cell.rig.heard("UNT 2")) == selected


@in_cell()
async def test_a_robots_first_inputs_and_outputs_are_watched(cell: Cell) -> None:
    async with socket(cell, "/events?bodies=r1&sample=10&types=io") as client:
        await client.message()
        value = await client.event()
    assert value["subject"] == "/robots/r1"
    assert [(it["channel"], it["number"]) for it in value["data"]["inputs"]] == [(1, bit) for bit in range(8)]
