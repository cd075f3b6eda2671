"""Servo mode: a move has arrived when the drive says so (INP), and not when the pulses are out."""

import asyncio
from typing import Any

from simulator.rorze.world import IN_POSITION
from tests.api.bodies.test_encoder import moved
from tests.api.bodies.test_homing import axis_of
from tests.api.stand import Stand, on_stand

WIRED = {"arm": [{"id": "3F", "in_position": True}]}


async def in_servo_mode(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    answer = await stand.client.patch("/bodies/3F/settings", json={"operating_mode": "servo"})
    assert answer.status_code == 200, answer.text


def drive_says(stand: Stand, on: bool) -> None:
    """Let the drive switch INP."""
    axis_of(stand).world.forced[IN_POSITION] = on
    axis_of(stand).advance(asyncio.get_running_loop().time())


async def begun(stand: Stand) -> str:
    answer = await stand.post("/bodies/3F/moves", moved(1_000))
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


async def ended(stand: Stand, move_id: str, wait_s: float = 30) -> dict[str, Any]:
    return dict((await stand.get(f"/bodies/3F/moves/{move_id}?wait={wait_s}")).json())


@on_stand(WIRED)
async def test_a_move_goes_on_until_the_drive_is_in_position(stand: Stand) -> None:
    await in_servo_mode(stand)
    move_id = await begun(stand)
    assert (await ended(stand, move_id, 3))["status"] == "moving"
    drive_says(stand, on=True)
    move = await ended(stand, move_id)
    assert (move["status"], move["position"]) == ("succeeded", 1_000)
    assert "The servo drive reports that it is in position (INP)." in move["evidence"]


@on_stand(WIRED)
async def test_a_drive_that_never_arrives_fails_the_move(stand: Stand) -> None:
    await in_servo_mode(stand)
    before = len(stand.frames())
    move = await ended(stand, await begun(stand))
    assert (move["status"], move["end_cause"], move["error"]["moved"]) == ("failed", "not_in_position", "yes")
    assert "CLR" in move["error"]["detail"]
    assert len(stand.frames()) - before < 80, "it is asked at the pace of other moves"


@on_stand(WIRED)
async def test_a_stop_ends_the_wait_for_the_drive(stand: Stand) -> None:
    await in_servo_mode(stand)
    move_id = await begun(stand)
    assert (await ended(stand, move_id, 3))["status"] == "moving"
    await stand.post("/bodies/3F/stop", {"mode": "immediate"})
    assert (await ended(stand, move_id, 1))["status"] == "stopped"


@on_stand(WIRED)
async def test_in_other_modes_nobody_waits_for_a_drive(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    assert (await ended(stand, await begun(stand), 3))["status"] == "succeeded"


@on_stand()
async def test_where_no_inp_is_wired_the_pulses_tell_the_end(stand: Stand) -> None:
    await in_servo_mode(stand)
    assert (await ended(stand, await begun(stand), 3))["status"] == "succeeded"


@on_stand(WIRED)
async def test_the_clear_signal_is_set_and_read_in_servo_mode(stand: Stand) -> None:
    await in_servo_mode(stand)
    await stand.send("3F", "set-clear-signal", on=1)
    assert (await stand.send("3F", "get-outputs", bit="clear"))["on"] == 1
    told = (await stand.client.patch("/bodies/3F/settings", json={"clear_pulse_ms": 0})).json()
    assert told["settings"]["clear_pulse_ms"] == 0
