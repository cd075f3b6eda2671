"""Moves in the words of clients, without HTTP."""

import pytest

from gateway.core.errors import InvalidRequest, NotAllowed, NotFound
from gateway.core.origin import Origin
from gateway.core.targets import Begun
from gateway.fics.move_requests import RobotHomeRequest, RobotStepRequest
from gateway.operations import moves
from gateway.rorze.move_requests import ContinuousMoveRequest, HomeRequest, Length, RelativeMoveRequest
from gateway.rorze.plans import GroupPlan, PlannedMove
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time, rig

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
        begun = await moves.start(it.plant, ME, "/bodies/3F", by_mm(7.5), 30.0)
        assert isinstance(begun, Begun)
        assert [(move.frame, move.status) for move in begun.moves] == [("&3F1+M750\\r", "succeeded")]


@in_virtual_time
async def test_a_body_without_a_scale_knows_no_millimetres() -> None:
    async with rig() as it:
        with pytest.raises(InvalidRequest, match="no pulses_per_unit"):
            await moves.start(it.plant, ME, "/bodies/3F", by_mm(7.5))


@in_virtual_time
async def test_what_is_only_validated_moves_nothing() -> None:
    async with rig(body_options=SCALED) as it:
        plan = await moves.start(it.plant, ME, "/bodies/3F", by_mm(7.5, validate_only=True))
        assert isinstance(plan, PlannedMove)
        assert (plan.frame, plan.distance) == ("&3F1+M750\\r", 750)
        plan = await moves.start(it.plant, ME, "/groups/80", by_mm(2, validate_only=True))
        assert isinstance(plan, GroupPlan)
        assert [member.frame for member in plan.members] == ["&801+M200\\r"] * 2
        assert not [frame for frame in it.wire.frames() if "1+M" in frame]


@in_virtual_time
async def test_a_plan_of_an_endless_move_needs_the_permission_too() -> None:
    endless = ContinuousMoveRequest(kind="continuous", direction="cw", validate_only=True)
    async with rig(server="") as it:
        with pytest.raises(NotAllowed):
            await moves.start(it.plant, ME, "/bodies/3F", endless)


@in_virtual_time
async def test_a_move_is_found_where_it_was_made_and_nowhere_else() -> None:
    async with rig() as it:
        begun = await moves.start(it.plant, ME, "/bodies/3F", HomeRequest(kind="home"))
        assert isinstance(begun, Begun)
        (move,) = begun.moves
        assert (await moves.get(it.plant, "/bodies/3f", move.id, 60.0)).status.final
        assert moves.newest(it.plant, "/bodies/3F", 5) == [move]
        with pytest.raises(NotFound, match=r"line1\.00 has no move"):
            await moves.get(it.plant, "/bodies/00", move.id)


@in_virtual_time
async def test_units_move_in_their_own_words() -> None:
    async with fics_rig() as it:
        begun = await moves.start(it.plant, ME, UNIT, RobotHomeRequest(kind="home"), 60.0)
        assert isinstance(begun, Begun)
        assert begun.moves[0].status == "succeeded"
        with pytest.raises(InvalidRequest, match="has the axes"):
            await moves.start(it.plant, ME, UNIT, RobotStepRequest(kind="step", axis="Q", steps=1))
