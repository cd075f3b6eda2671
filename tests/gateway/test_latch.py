"""With `latch` each alarm keeps its subject from moving until a person has reset it."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Final, Generic, NamedTuple, TypeVar

import pytest

from gateway.core.alarms import AlarmLasts, Latched
from gateway.core.exchange import Lane
from gateway.core.origin import Origin
from gateway.core.sequence_lock import SequenceLock
from gateway.door.doing import do
from gateway.door.stopping import stop
from gateway.plant import Plant
from protocols.fics.alarms import ResetErrors
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.system import GetSystemVersion
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.status import ClearControllerStatus
from protocols.table import Command
from simulator.fics.alarms import system_error
from simulator.rorze.controller import (
    EMS_ERROR,
    INITIALISATION_ERROR,
    LIMIT_ERROR,
    RANGE_ERROR,
    STALL_ERROR,
)
from simulator.rorze.world import EMS
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import Rig, configuration, finished, in_virtual_time, rig
from tests.through_the_door import reset
from tests.world import World

R = TypeVar("R", Rig, FicsRig)

LATCH: Final = "latch = true"
OPERATOR: Final = Origin("operator")
SEEN_S = 100.0
"""Seconds after which every fault is known."""
MOVE: Final = MoveClockwise(distance=500)
JUMP: Final = MoveRelative(coordinates=[None, None, 1.0])


async def nothing(_: object) -> None:
    """Do nothing: an alarm about a moment is over at once."""


class Story(NamedTuple, Generic[R]):
    """How a cause comes about, and how it ends, if it lasts."""

    happen: Callable[[R], Awaitable[None]]
    end: Callable[[R], Awaitable[None]] = nothing
    lasts: bool = True


# bodies


async def stop_body(it: Rig) -> None:
    await stop(it.plant, OPERATOR, "/bodies/3F", "immediate")


async def run_into(it: Rig, error: int) -> None:
    """The controller shows an error that stays until it is cleared."""
    it.axis().status |= error
    await it.body().poll(Lane.READ)


async def clear(it: Rig) -> None:
    await do(it.plant, OPERATOR, "/bodies/3F", ClearControllerStatus())
    await it.body().poll(Lane.READ)


async def unstall(it: Rig) -> None:
    it.axis().status = 0
    await it.body().poll(Lane.READ)


async def fail(it: Rig) -> None:
    """The EMS input ends a move; the error it leaves is another alarm."""
    moving = asyncio.create_task(finished(it, MoveClockwise(distance=50_000)))
    await asyncio.sleep(0.3)
    it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
    await moving
    it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: False}))
    await clear(it)


async def lose_power(it: Rig) -> None:
    it.machine.brown_out(0x3F, 0.05, asyncio.get_running_loop().time())
    it.wire.turn()


async def acknowledge(it: Rig) -> None:
    await it.body().acknowledge_power_cycle()


async def move_by_another(it: Rig) -> None:
    it.machine.receive(b"&3F1+M900000\r", asyncio.get_running_loop().time())
    it.wire.turn()


async def stop_other(it: Rig) -> None:
    it.machine.receive(b"&3F5IS\r", asyncio.get_running_loop().time())
    it.wire.turn()
    await it.body().poll(Lane.READ)


async def unplug(it: Rig) -> None:
    it.axis().powered = False


async def plug_in(it: Rig) -> None:
    it.axis().powered = True
    await asyncio.sleep(SEEN_S)
    if it.body().power.cycled:
        await it.body().acknowledge_power_cycle()


def error(bit: int) -> Story[Rig]:
    return Story(lambda it: run_into(it, bit), clear)


OF_BODIES: Final[Mapping[str, Story[Rig]]] = {
    "body.stopped": Story(stop_body, lasts=False),
    "body.limit_error": error(LIMIT_ERROR),
    "body.ems_error": error(EMS_ERROR),
    "body.initialisation_error": error(INITIALISATION_ERROR),
    "body.range_error": error(RANGE_ERROR),
    "body.stall_error": Story(lambda it: run_into(it, STALL_ERROR), unstall),
    "body.move.failed": Story(fail, lasts=False),
    "body.power_cycled": Story(lose_power, acknowledge),
    "body.motion.foreign": Story(move_by_another, stop_other),
    "body.offline": Story(unplug, plug_in),
}


@pytest.mark.parametrize("cause", OF_BODIES)
def test_each_cause_holds_its_body_until_the_reset(cause: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(server=LATCH) as it:
            await OF_BODIES[cause].happen(it)
            await _raised(it.plant, cause)
            await _is_held(it.plant, "/bodies/line1.3F", MOVE, cause)
            await do(it.plant, OPERATOR, "/bodies/00", MOVE)
            if cause != "body.offline":
                await do(it.plant, OPERATOR, "/bodies/3F", GetPosition())
            await _ends(it.plant, cause, OF_BODIES[cause].end(it), lasts=OF_BODIES[cause].lasts)
            await do(it.plant, OPERATOR, "/bodies/3F", MOVE)

    story()


# robots


async def stop_robot(it: FicsRig) -> None:
    await stop(it.plant, OPERATOR, "/robots/r1", "immediate")


async def raise_error(it: FicsRig) -> None:
    it.touch(lambda fics, now: fics.raise_alarm(system_error(183, 12, 34), now))
    await it.robot.conversation.poll_error()


async def reset_errors(it: FicsRig) -> None:
    await do(it.plant, OPERATOR, "/robots/r1", ResetErrors())


async def lose_homing(it: FicsRig) -> None:
    """A command is lost on its way, and nothing shows whether it was carried out."""
    it.cable.lost_command = "ORG"
    await it.move(HomeRobot())
    it.cable.lost_command = ""


async def lose_power_of_robot(it: FicsRig) -> None:
    it.power_cycle()


async def acknowledge_robot(it: FicsRig) -> None:
    it.robot.known.power.acknowledge()


async def home_by_another(it: FicsRig) -> None:
    await it.move(MoveRelative(coordinates=[None, None, -100.0]))
    it.touch(lambda fics, now: fics.execute("ORG", "", now))


async def come_to_rest(_: FicsRig) -> None:
    await asyncio.sleep(600.0)


OF_ROBOTS: Final[Mapping[str, Story[FicsRig]]] = {
    "robot.stopped": Story(stop_robot, reset_errors, lasts=False),
    "robot.error": Story(raise_error, reset_errors),
    "robot.move.unknown": Story(lose_homing, lasts=False),
    "robot.power_cycled": Story(lose_power_of_robot, acknowledge_robot),
    "robot.motion.foreign": Story(home_by_another, come_to_rest),
}


@pytest.mark.parametrize("cause", OF_ROBOTS)
def test_each_cause_holds_its_robot_until_the_reset(cause: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(options=f"[server]\n{LATCH}\n") as it:
            await it.move(HomeRobot())
            await OF_ROBOTS[cause].happen(it)
            await _raised(it.plant, cause)
            await _is_held(it.plant, "/robots/r1/units/1", JUMP, cause)
            await do(it.plant, OPERATOR, "/robots/r1", GetSystemVersion())
            await _ends(it.plant, cause, OF_ROBOTS[cause].end(it), lasts=OF_ROBOTS[cause].lasts)
            await do(it.plant, OPERATOR, "/robots/r1/units/1", HomeRobot())

    story()


# both


async def _raised(plant: Plant, cause: str) -> None:
    async with asyncio.timeout(SEEN_S):
        while cause not in {alarm.cause for alarm in plant.alarms.standing()}:  # noqa: ASYNC110  # virtual time
            await asyncio.sleep(0.1)


async def _is_held(plant: Plant, target: str, command: Command[Any], cause: str) -> None:
    """Motion is refused with all its causes and how to reset them; nothing was sent."""
    with pytest.raises(Latched, match="nothing was sent") as refused:
        await do(plant, OPERATOR, target, command)
    standing = [alarm for alarm in plant.alarms.standing() if alarm.subject in (target, "/robots/r1")]
    assert cause in {alarm.cause for alarm in standing}
    for alarm in standing:
        assert alarm.cause in refused.value.detail
        assert f"/alarms/{alarm.id}/reset" in [call.path for call in refused.value.next]


async def _ends(plant: Plant, cause: str, end: Awaitable[None], *, lasts: bool) -> None:
    """A reset is refused while the cause lasts, and sets free afterwards."""
    [alarm] = [alarm for alarm in plant.alarms.standing() if alarm.cause == cause]
    with pytest.raises(AlarmLasts, match="nothing was reset") if lasts else nullcontext():
        await reset(plant, OPERATOR, alarm.id)
    await end
    for alarm in plant.alarms.standing():
        await reset(plant, OPERATOR, alarm.id)


@in_virtual_time
async def test_an_alarm_keeps_back_what_waited_for_its_turn_when_it_came() -> None:
    async with rig(server=LATCH) as it:
        lock = it.body().line.lock_of(0x3F)
        await _is_held_back(it.plant, lock, "/bodies/line1.3F", MOVE, "body.offline")
        assert not it.axis().motor.moving
    async with fics_rig(options=f"[server]\n{LATCH}\n") as cell:
        await cell.move(HomeRobot())
        lock = cell.robot.line.sequence_lock
        await _is_held_back(cell.plant, lock, "/robots/r1/units/1", JUMP, "robot.motion.foreign")
        assert "MMI" not in cell.cable.frames()[-1]


async def _is_held_back(
    plant: Plant, lock: SequenceLock, target: str, command: Command[Any], cause: str
) -> None:
    """A series of others delays a motion; an alarm is raised meanwhile."""

    async def other_series() -> None:
        async with lock.held():
            await asyncio.sleep(1.0)

    other = asyncio.create_task(other_series())
    await asyncio.sleep(0.1)
    waiting = asyncio.create_task(do(plant, OPERATOR, target, command))
    await asyncio.sleep(0.1)
    subject = target.removesuffix("/units/1")
    plant.alarms.find(cause, subject)
    with pytest.raises(Latched, match=f"{cause} at {subject}"):
        await waiting
    await other


@in_virtual_time
async def test_a_crash_holds_everything_and_an_unknown_move_its_body(tmp_path: Path) -> None:
    world = World(tmp_path / "data", text=configuration(bodies=(0x00, 0x3F), groups={}, server=LATCH))
    async with world.gateway() as plant:
        await asyncio.sleep(1.0)
        [move] = (await do(plant, OPERATOR, "/bodies/3F", MoveClockwise(distance=20_000))).moves  # type: ignore[union-attr]
        await asyncio.sleep(0.3)
        world.crash()
        await plant.stops.stop([plant.body("3F")], "immediate")
    async with world.gateway() as plant:
        await plant.moves.wait(move.id, 60.0)
        with pytest.raises(Latched, match=r"body\.move\.unknown at /bodies/line1\.3F"):
            await do(plant, OPERATOR, "/bodies/3F", MOVE)
        with pytest.raises(Latched, match=r"gateway\.crashed at /gateway"):
            await do(plant, OPERATOR, "/bodies/00", MOVE)
        for alarm in plant.alarms.standing():
            await reset(plant, OPERATOR, alarm.id)
        await do(plant, OPERATOR, "/bodies/3F", MOVE)


@in_virtual_time
async def test_without_the_latch_a_stop_is_no_alarm() -> None:
    async with rig() as it:
        await stop_body(it)
        assert it.plant.alarms.standing() == []
        await do(it.plant, OPERATOR, "/bodies/3F", MOVE)
