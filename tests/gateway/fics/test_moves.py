"""Moves of robots from their start to the log: what is refused beforehand, and the record of each."""

import asyncio
from contextlib import suppress

import pytest

from gateway.core.errors import ControllerRefused, InvalidRequest, NotFound, StoppedFirst
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import RefusedUnhomed, RobotBusy
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis
from protocols.fics.moves import MoveAbsolute, MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.variables import GetVariable
from protocols.table import Ack
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

UP = MoveRelative(coordinates=[None, None, -5.0])
SLOW = SetSpeedPercent(percents=[1, 1, 1])


@in_virtual_time
async def test_a_move_is_given_as_soon_as_it_is_not_refused_and_followed_to_its_end() -> None:
    async with fics_rig() as rig:
        moves = rig.plant.robot_moves
        started = await rig.start(UP)
        assert (started.status, started.kind, started.command) == (MoveStatus.MOVING, "relative", "LMI")
        assert (started.body_id, started.frame) == ("r1/units/1", "LMI ,,-5\\r")
        assert rig.robot.unit(1).move is started
        began_at = asyncio.get_running_loop().time()
        ended = await moves.wait(started.id, 60)
        assert asyncio.get_running_loop().time() < began_at + 10
        assert ended is started
        assert ended.status is MoveStatus.SUCCEEDED
        assert rig.robot.unit(1).move is None
        assert ended.ended_at is not None
        assert ended.sent_at is not None
        assert ended.created_at <= ended.sent_at <= ended.ended_at


@in_virtual_time
async def test_events_after_the_cursor_of_a_move_tell_the_rest_of_its_life() -> None:
    async with fics_rig() as rig:
        before = rig.plant.events.last
        move = await rig.move(UP)
        told = [event for event in rig.events("robot.move.") if event.number > before]
        assert [event.type.removeprefix("robot.move.") for event in told] == [
            "queued",
            "sent",
            "started",
            "succeeded",
        ]
        assert move.event_cursor == told[0].cursor


@pytest.mark.parametrize("unit", [1, 2])
def test_while_a_robot_moves_no_unit_of_it_starts_another(unit: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            moves = rig.plant.robot_moves
            await rig.robot.ask(SLOW, 1)
            first = await rig.start(UP)
            with pytest.raises(RobotBusy):
                await rig.start(UP, unit)
            assert moves.log.of(rig.robot.unit(1).address) == [first]
            assert moves.log.of(rig.robot.unit(2).address) == []
            await moves.wait(first.id, 600)
            assert (await rig.move(UP, unit)).status is MoveStatus.SUCCEEDED
            assert len(rig.heard("LMI")) == 2

    story()


@in_virtual_time
async def test_of_two_moves_asked_for_at_once_one_is_sent() -> None:
    async with fics_rig() as rig:
        moves = rig.plant.robot_moves
        starts = [rig.start(UP) for _ in range(2)]
        outcomes = await asyncio.gather(*starts, return_exceptions=True)
        assert sorted(type(outcome).__name__ for outcome in outcomes) == ["RobotBusy", "RobotMove"]
        assert len(moves.log.of(rig.robot.unit(1).address)) == len(rig.heard("LMI")) == 1


@in_virtual_time
async def test_a_refused_move_is_told_and_remembered_and_the_next_may_start() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        with pytest.raises(ControllerRefused):
            await rig.move(MoveAbsolute(coordinates=[None, None, 9999.0]))
        (rejected, _) = rig.plant.robot_moves.log.of(rig.robot.unit(1).address)
        assert rejected.status is MoveStatus.REJECTED
        assert rejected.error is not None
        assert (rejected.error.controller_error, rejected.error.moved) == ("E07", "no")
        assert (await rig.move(MoveAbsolute(coordinates=[None, None, -1.0]))).status is MoveStatus.SUCCEEDED


@pytest.mark.parametrize("mode", [2, 3])
def test_a_relative_move_of_an_axis_that_is_not_homed_says_so_and_what_to_do(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            with suppress(RefusedUnhomed):
                await rig.start(MoveRelative(coordinates=[1.0]))
            [move] = rig.plant.robot_moves.log.of(rig.robot.unit(1).address)
            await rig.plant.robot_moves.wait(move.id, 60)
            assert move.status is MoveStatus.REJECTED
            assert move.error is not None
            assert (move.error.type, move.error.remedy) == ("not-homed", "Home the robot first.")
            assert move.error.detail == (
                "r1 refused LMI: The command cannot be carried out. Nothing moved because of it. "
                "Axis X is not homed."
            )
            assert [(it.method, it.body) for it in move.error.next] == [("POST", {"kind": "home"})]

    story()


@in_virtual_time
async def test_who_gives_up_waiting_for_the_start_leaves_the_move_followed() -> None:
    async with fics_rig(baud=9600) as rig:
        start = asyncio.create_task(rig.start(UP))
        await asyncio.sleep(0.001)
        start.cancel()
        await asyncio.sleep(30)
        (move,) = rig.plant.robot_moves.log.of(rig.robot.unit(1).address)
        assert move.status is MoveStatus.SUCCEEDED
        assert rig.robot.known.motion.idle.is_set()


@in_virtual_time
async def test_moves_are_told_newest_first_and_found_by_their_ids() -> None:
    async with fics_rig() as rig:
        first, second = await rig.move(UP), await rig.move(StepAxis(axis="Z", steps=1))
        moves = rig.plant.robot_moves
        assert moves.log.of(rig.robot.unit(1).address) == [second, first]
        assert moves.get(first.id) == first
        with pytest.raises(NotFound):
            moves.get("none")


@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        (GetVariable(number=1), "VAR starts no move"),
        (StepAxis(axis="W", steps=1), "axis: r1/units/1 has the axes X, Y, Z, A, B;"),
        (MoveRelative(coordinates=[1.0, 1.0, 1.0, 1.0]), "4 coordinates"),
    ],
    ids=lambda it: it if isinstance(it, str) else type(it).__name__,
)
def test_what_a_unit_cannot_do_is_refused_before_anything_is_sent(
    command: FicsCommand[Ack], complaint: str
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            sent = len(rig.cable.written)
            with pytest.raises(InvalidRequest, match=complaint):
                await rig.start(command)
            assert rig.cable.frames(sent) == []
            assert rig.plant.robot_moves.log.of(rig.robot.unit(1).address) == []
            assert rig.robot.known.motion.idle.is_set()

    story()


@in_virtual_time
async def test_a_move_that_a_stop_came_before_is_remembered_as_cancelled() -> None:
    async with fics_rig(baud=9600) as rig:
        start = asyncio.create_task(rig.start(UP))
        await asyncio.sleep(0.001)
        await rig.robot.stop("immediate")
        with pytest.raises(StoppedFirst):
            await start
        (move,) = rig.plant.robot_moves.log.of(rig.robot.unit(1).address)
        assert move.status is MoveStatus.CANCELLED
        assert move.sent_at is None


@in_virtual_time
async def test_at_the_end_of_the_gateway_a_robot_goes_on_with_its_move() -> None:
    async with fics_rig() as rig:
        await rig.robot.ask(SLOW, 1)
        move = await rig.start(UP)
        await rig.plant.robot_moves.close()
        assert move.status is MoveStatus.MOVING
        assert rig.fics.job is not None
        assert rig.stops() == []
