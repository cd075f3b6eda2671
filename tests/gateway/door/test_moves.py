"""Moves in the words of clients, without HTTP."""

import asyncio
from typing import Any

import pytest
from pydantic import ValidationError

from gateway.core.errors import Expired, InvalidRequest, NotAllowed, NotFound
from gateway.core.origin import Origin
from gateway.core.targets import BegunMoves
from gateway.door import moving
from gateway.fics.move_requests import RobotHomeRequest, RobotStepRequest
from gateway.rorze.move_requests import ContinuousMoveRequest, HomeRequest, RelativeMoveRequest
from gateway.rorze.plans import GroupPlan, PlannedMove
from gateway.rorze.units import Length
from tests.fics_plants import fics_rig
from tests.plants import Rig, in_virtual_time, rig
from tests.through_the_door import get, start

ME = Origin("test")
UNIT = "/robots/r1/units/1"
SCALED = 'units = {unit = "mm", pulses_per_unit = 100.0}'


def by_mm(value: float, *, validate_only: bool = False) -> RelativeMoveRequest:
    return RelativeMoveRequest(
        kind="relative",
        direction="cw",
        distance=Length(value=value, unit="mm"),
        validate_only=validate_only,
    )


@in_virtual_time
async def test_lengths_come_to_pulses_by_the_scale_of_the_body() -> None:
    async with rig(body_options=SCALED) as it:
        begun = await start(it.plant, ME, "/bodies/3F", by_mm(7.5), 30.0)
        assert isinstance(begun, BegunMoves)
        assert [(move.frame, move.status) for move in begun.moves] == [("&3F1+M750\\r", "succeeded")]


@in_virtual_time
async def test_a_body_without_a_scale_knows_no_millimetres() -> None:
    async with rig() as it:
        with pytest.raises(InvalidRequest, match="no pulses_per_unit"):
            await start(it.plant, ME, "/bodies/3F", by_mm(7.5))


@in_virtual_time
async def test_what_is_only_validated_moves_nothing() -> None:
    async with rig(body_options=SCALED) as it:
        plan = await start(it.plant, ME, "/bodies/3F", by_mm(7.5, validate_only=True))
        assert isinstance(plan, PlannedMove)
        assert (plan.frame, plan.distance) == ("&3F1+M750\\r", 750)
        plan = await start(it.plant, ME, "/groups/80", by_mm(2, validate_only=True))
        assert isinstance(plan, GroupPlan)
        assert [member.frame for member in plan.members] == ["&801+M200\\r"] * 2
        assert not [frame for frame in it.wire.frames() if "1+M" in frame]


@in_virtual_time
async def test_a_plan_of_an_endless_move_needs_the_permission_too() -> None:
    endless = ContinuousMoveRequest(kind="continuous", direction="cw", validate_only=True)
    async with rig(server="") as it:
        with pytest.raises(NotAllowed):
            await start(it.plant, ME, "/bodies/3F", endless)


@in_virtual_time
async def test_a_move_is_found_where_it_was_made_and_nowhere_else() -> None:
    async with rig() as it:
        begun = await start(it.plant, ME, "/bodies/3F", HomeRequest(kind="home"))
        assert isinstance(begun, BegunMoves)
        (move,) = begun.moves
        assert (await get(it.plant, "/bodies/3f", move.id, 60.0)).status.final
        assert moving.newest(it.plant.target("/bodies/3F"), 5) == [move]
        with pytest.raises(NotFound, match=r"line1\.00 has no move"):
            await get(it.plant, "/bodies/00", move.id)


@in_virtual_time
async def test_units_move_in_their_own_words() -> None:
    async with fics_rig() as it:
        begun = await start(it.plant, ME, UNIT, RobotHomeRequest(kind="home"), 60.0)
        assert isinstance(begun, BegunMoves)
        assert begun.moves[0].status == "succeeded"
        with pytest.raises(InvalidRequest, match="has the axes"):
            await start(it.plant, ME, UNIT, RobotStepRequest(kind="step", axis="Q", steps=1))


HOLDERS: list[asyncio.Task[None]] = []


async def held(it: Rig, for_s: float) -> None:
    """Let another task hold the body for this time."""

    async def hold() -> None:
        async with it.body().line.undivided([it.body().number]):
            holds.set()
            await asyncio.sleep(for_s)

    holds = asyncio.Event()
    HOLDERS.append(asyncio.create_task(hold()))
    await holds.wait()


@in_virtual_time
async def test_a_move_waits_for_its_turn_as_long_as_it_may_and_is_never_sent_later() -> None:
    async with rig() as it:
        await held(it, 10.0)
        asked_at = asyncio.get_running_loop().time()
        with pytest.raises(Expired, match="nothing was sent"):
            await start(it.plant, ME, "/bodies/3F", relative(start_within_s=0.5))
        assert asyncio.get_running_loop().time() - asked_at == pytest.approx(0.5, abs=0.1)
        await asyncio.sleep(15.0)
        assert it.executed("1+M") == []


@in_virtual_time
async def test_a_move_that_may_wait_long_is_sent_when_its_turn_comes() -> None:
    async with rig() as it:
        await held(it, 10.0)
        begun = await start(it.plant, ME, "/bodies/3F", relative(start_within_s=30.0))
        assert isinstance(begun, BegunMoves)
        assert len(it.executed("1+M")) == 1


@in_virtual_time
async def test_a_robots_move_waits_as_long_as_it_may() -> None:
    request = RobotHomeRequest(kind="home", start_within_s=0.5)
    async with fics_rig() as it:
        async with it.robot.line.sequence_lock.held():
            with pytest.raises(Expired):
                await start(it.plant, ME, UNIT, request)
        await asyncio.sleep(5.0)
        assert it.heard("ORG") == []


@in_virtual_time
async def test_a_robots_move_that_may_wait_long_is_sent_when_its_turn_comes() -> None:
    async def hold() -> None:
        async with it.robot.line.sequence_lock.held():
            await asyncio.sleep(10.0)

    async with fics_rig() as it:
        HOLDERS.append(asyncio.create_task(hold()))
        await asyncio.sleep(0)
        begun = await start(it.plant, ME, UNIT, RobotHomeRequest(kind="home", start_within_s=30.0))
        assert isinstance(begun, BegunMoves)
        assert len(it.heard("ORG")) == 1


@pytest.mark.parametrize("wrong", [0, -1, 60.1, float("inf"), float("nan"), "5", True])
def test_the_time_to_wait_is_more_than_none_and_a_minute_at_most(wrong: Any) -> None:
    with pytest.raises(ValidationError):
        relative(start_within_s=wrong)


def relative(**options: Any) -> RelativeMoveRequest:
    return RelativeMoveRequest(
        kind="relative", direction="cw", distance=Length(value=500, unit="pulse"), **options
    )
