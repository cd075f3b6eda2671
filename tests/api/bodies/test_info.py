"""Bodies over HTTP: what is read is said with its age, and what is set is set at the controller."""

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from httpx2 import Response

from simulator.faults import Direction, Fault, Switch
from tests.api.stand import BODIES, RELATIVE, Stand, on_stand

SET_SPEED = "/bodies/3F/commands/set-start-speed"


@on_stand()
async def test_the_position_comes_from_the_controller(stand: Stand) -> None:
    await stand.get("/bodies/3F/position")  # the operating mode is asked for once
    await stand.send("3F", "set-position", position=-1234)
    position = (await stand.get("/bodies/3f/position")).json()
    assert (position["body_id"], position["pulses"], position["unit"]) == ("arm.3F", -1234, None)
    assert position["age_ms"] >= 0
    assert stand.frames()[-1] == "&3F6PD"


@on_stand()
async def test_the_position_can_be_called_by_another_number(stand: Stand) -> None:
    answer = await stand.client.put("/bodies/01/position", json={"value": 2.5, "unit": "mm"})
    assert (answer.status_code, answer.json()["pulses"], answer.json()["value"]) == (200, 2500, 2.5)
    assert "&016PS2500" in stand.frames()
    assert (await stand.get("/bodies/01/position")).json()["value"] == 2.5


@on_stand()
async def test_the_position_cannot_be_set_while_the_motor_moves(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", RELATIVE)
    answer = await stand.client.put("/bodies/3F/position", json={"value": 0, "unit": "pulse"})
    assert answer.status_code == 409
    assert "still has the move" in answer.json()["detail"]
    assert not [frame for frame in stand.frames() if "6PS" in frame]


@on_stand()
async def test_what_was_read_by_anybody_is_what_a_body_is_described_with(stand: Stand) -> None:
    await stand.send("01", "set-position", position=1500)
    await stand.get("/bodies/01/position")
    assert (await stand.get("/bodies/01")).json()["position"] == 1500
    await stand.client.put("/bodies/01/position", json={"value": 0, "unit": "pulse"})
    assert (await stand.get("/bodies/01")).json()["position"] in (None, 0)
    await asyncio.sleep(0.5)
    described = (await stand.get("/bodies/01")).json()
    assert (described["position"], described["position_read_at"] is None) == (0, False)


@on_stand()
async def test_the_status_names_every_bit(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", RELATIVE)
    await stand.post("/bodies/3F/stop", {"mode": "immediate"})

    status = (await stand.get("/bodies/3F/status")).json()

    assert status["moving"] is False
    assert status["end_causes"] == ["stop_command"]
    assert set(status["sensors"]) == {"stall", "origin", "cw_limit", "ccw_limit", "in_position", "ems"}
    assert (status["status"]["pulses_running"], status["status"]["limit_error"]) == (False, False)
    assert len(status["status"]) == 8


@on_stand()
async def test_the_status_of_a_moving_motor_says_so(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", RELATIVE)
    status = (await stand.get("/bodies/3F/status")).json()
    assert (status["moving"], status["status"]["pulses_running"]) == (True, True)


@on_stand()
async def test_a_body_is_described_without_asking_it(stand: Stand) -> None:
    await stand.get("/bodies/01/position")
    sent = len(stand.frames())
    body = (await stand.get("/bodies/01")).json()
    assert (body["body_id"], body["line_id"], body["online"], body["moving"]) == (
        "arm.01",
        "arm",
        True,
        False,
    )
    assert (body["unit"], body["pulses_per_unit"]) == ("mm", 1000.0)
    assert [it["body_id"] for it in (await stand.get("/bodies")).json()["bodies"]] == [
        "arm.00",
        "arm.01",
        "arm.3F",
    ]
    assert len(stand.frames()) == sent


@on_stand()
async def test_whether_a_body_moves_is_null_while_nobody_can_know(stand: Stand) -> None:
    stand.port.unplug()
    assert (await stand.get("/bodies/3F")).json()["moving"] is None
    stand.port.plugged_in = True
    await anext(stand.plant.events.subscribe(types=["line.up"]))
    assert (await stand.get("/bodies/3F")).json()["moving"] is None
    await asyncio.sleep(0.1)
    assert (await stand.get("/bodies/3F")).json()["moving"] is False


@on_stand()
async def test_the_bodys_move_and_groups_are_named(stand: Stand) -> None:
    await stand.client.put("/groups/80", json={"members": ["00", "3F"]})
    await stand.teach_speeds("3F")
    move = (await stand.post("/bodies/3F/moves", RELATIVE)).json()
    body = (await stand.get("/bodies/3F")).json()
    assert (body["move_id"], body["moving"], body["groups"]) == (move["id"], True, ["arm.80"])


@on_stand({"arm": BODIES, "rail": [{"id": "3F"}]})
async def test_an_address_of_two_bodies_is_409_and_names_them(stand: Stand) -> None:
    ambiguous = await stand.get("/bodies/3F/position")
    assert ambiguous.status_code == 409
    assert "arm.3F, rail.3F" in ambiguous.json()["detail"]
    assert (await stand.get("/bodies/RAIL.3f/position")).json()["body_id"] == "rail.3F"
    assert (await stand.get("/bodies/00/position")).json()["body_id"] == "arm.00"


@pytest.mark.parametrize(
    ("request_body", "frame"),
    [
        ({"mode": "change", "speed": 20_000}, "&3F5CS20000"),
        ({"mode": "accelerate"}, "&3F5AS"),
        ({"mode": "decelerate"}, "&3F5DS"),
    ],
)
def test_the_speed_of_a_move_is_changed(request_body: dict[str, object], frame: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        await stand.teach_speeds("3F")
        await stand.post("/bodies/3F/moves", RELATIVE)
        answer = await stand.post("/bodies/3F/speed", request_body)
        assert (answer.status_code, answer.json()["body_id"]) == (200, "arm.3F")
        assert frame in stand.frames()

    story()


@on_stand()
async def test_the_speed_of_a_standing_motor_cannot_be_changed(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/speed", {"mode": "accelerate"})
    assert (answer.status_code, answer.json()["code"]) == (409, "0x56")
    assert (await stand.post("/bodies/3F/speed", {"mode": "change"})).status_code == 422
    assert (await stand.post("/bodies/3F/speed", {"mode": "change", "speed": 1.5})).status_code == 422


@on_stand()
async def test_a_body_that_falls_silent_is_never_a_reason_to_repeat_blindly(stand: Stand) -> None:
    stand.port.machine.faults.set(Switch(Fault.LOST, Direction.REPLIES, probability=1.0))
    answer = await stand.client.put("/bodies/3F/position", json={"value": 0, "unit": "pulse"})
    assert (answer.status_code, answer.json()["moved"]) == (409, "no")
    assert answer.json()["type"].endswith(":no-reply")
    assert not answer.json()["retryable"]


@pytest.mark.parametrize(
    ("ask", "told"),
    [
        (lambda it: it.get("/bodies/3F/position"), ("no", True, "Ask again.")),
        (lambda it: it.post(SET_SPEED, {"speed": 5}), ("no", False, "Read back whether it was set.")),
    ],
)
def test_what_moves_nothing_is_not_said_to_have_moved_when_its_reply_is_lost(
    ask: Callable[[Stand], Awaitable[Response]], told: tuple[str, bool, str]
) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        stand.port.machine.faults.set(Switch(Fault.LOST, Direction.REPLIES, probability=1.0))
        answer = await ask(stand)
        assert answer.status_code == 409
        assert tuple(answer.json()[key] for key in ("moved", "retryable", "remedy")) == told

    story()


def brown_out(stand: Stand) -> None:
    """Take the power of 3F away for 50 ms."""
    stand.port.machine.brown_out(0x3F, 0.05, asyncio.get_running_loop().time())
    stand.port._turn()


ABSOLUTE = {"kind": "absolute", "position": {"value": 700, "unit": "pulse"}}


@pytest.mark.parametrize(
    ("path", "request_body"),
    [
        ("/bodies/3F/moves", ABSOLUTE),
        ("/bodies/3F/commands/move-to", {"position": 700}),
        ("/bodies/3F/raw", {"text": "1AM700"}),
        ("/groups/80/moves", ABSOLUTE),
        ("/groups/80/commands/move-to", {"position": 700}),
    ],
)
def test_a_body_that_lost_its_power_is_not_sent_to_a_place_until_somebody_knows(
    path: str, request_body: dict[str, object]
) -> None:
    @on_stand(raw_commands=True)
    async def story(stand: Stand) -> None:
        await stand.client.put("/groups/80", json={"members": ["00", "3F"]})
        for body in ("00", "3F"):
            await stand.teach_speeds(body)
            moved = await stand.post(f"/bodies/{body}/moves?wait=10", RELATIVE)
            assert moved.json()["status"] == "succeeded"
        await asyncio.sleep(1.0)
        brown_out(stand)
        await asyncio.sleep(0.1)
        refused = await stand.post(path, request_body)
        assert (refused.status_code, refused.json()["type"]) == (
            409,
            "urn:motion-gateway:problem:power-cycled",
        )
        assert (refused.json()["moved"], refused.json()["retryable"]) == ("no", False)
        assert not [frame for frame in stand.frames() if "1AM" in frame]
        body = (await stand.get("/bodies/3F")).json()
        assert (body["homed"], body["power_cycled"]) == ("no", True)
        plan = await stand.post("/bodies/3F/moves", {**ABSOLUTE, "validate_only": True})
        assert "would be refused" in plan.json()["note"]

        known = await stand.post("/bodies/3F/power-cycle/acknowledge")
        assert (known.status_code, known.json()["homed"], known.json()["power_cycled"]) == (200, "no", False)
        await stand.teach_speeds("3F")
        assert (await stand.post(path, request_body)).status_code == 202

    story()


@on_stand()
async def test_every_view_of_a_body_tells_how_old_it_is(stand: Stand) -> None:
    await stand.get("/bodies/3F/position")
    stand.port.unplug()
    await asyncio.sleep(3.0)
    alone = (await stand.get("/bodies/3F")).json()
    [*_, listed] = (await stand.get("/bodies")).json()["bodies"]
    for body in (alone, listed):
        assert 3.0 <= body["known_age_s"] < 4.0
        assert body["last_heard_at"][:22] == body["position_read_at"][:22]


@on_stand({"arm": [{"id": "3F"}]})
async def test_a_body_that_never_answered_has_no_age(stand: Stand) -> None:
    body = stand.plant.body("3F")
    body.told.heard_at = None
    body.line.presence._heard_at.clear()
    told = (await stand.get("/bodies/3F")).json()
    assert (told["last_heard_at"], told["known_age_s"], told["homed"]) == (None, None, "unknown")


@on_stand()
async def test_no_part_of_a_pulse_is_a_place(stand: Stand) -> None:
    before = stand.frames()
    answer = await stand.client.put("/bodies/3F/position", json={"value": 3.5, "unit": "pulse"})
    assert answer.status_code == 422
    assert "pulses must be a whole number, not 3.5" in answer.json()["detail"]
    assert stand.frames() == before
