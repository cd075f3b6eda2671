"""The present motion, its owner, and the reason for which the next one has to wait."""

import asyncio
from typing import Any

import pytest

from gateway.fics.errors import RobotBusy
from gateway.fics.motion_state import MotionState
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StartJog
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.status import GetAxisStatus
from tests.plants import in_virtual_time

STEP = MoveRelative(coordinates=[1.0])
JOG = StartJog(axis="X", direction="+")


def state() -> tuple[MotionState, list[str]]:
    told: list[str] = []
    return MotionState("r1", lambda kind, _: told.append(kind)), told


def test_a_robot_that_nobody_has_looked_at_may_move() -> None:
    it, _ = state()
    assert it.moving is None
    it.note_foreign(moves=False)
    assert it.moving is False


def test_motion_that_is_not_ours_is_told_when_it_begins() -> None:
    it, told = state()
    for moves in (True, True, False, True):
        it.note_foreign(moves=moves)
    assert told == ["robot.motion.foreign"] * 2


def test_after_a_motion_it_stands_still_only_if_that_was_seen() -> None:
    it, _ = state()
    it.begin(STEP, 1)
    assert it.moving is True
    it.end()
    assert it.moving is None
    assert it.poll_due.is_set()
    it.poll_due.clear()
    it.begin(STEP, 1)
    it.note_rest(1, still=True)
    it.end()
    assert it.moving is False
    assert not it.poll_due.is_set()


def test_a_motion_that_was_refused_has_moved_nothing() -> None:
    it, _ = state()
    it.note_foreign(moves=False)
    it.begin(STEP, 1)
    it.end(refused=True)
    assert it.moving is False


@pytest.mark.parametrize(
    ("command", "still"), [(STEP, {2}), (HomeRobot(), set()), (RunMacro(macro="PCK"), set())]
)
def test_a_motion_may_move_its_unit_and_some_move_all(command: FicsCommand[Any], still: set[int]) -> None:
    it, _ = state()
    it.note_rest(1, still=True)
    it.note_rest(2, still=True)
    it.begin(command, 1)
    assert it.still == still


def test_a_doubt_never_lets_a_robot_stand_still() -> None:
    it, _ = state()
    for moves, then in ((False, None), (None, None), (True, True)):
        it.note_foreign(moves=moves)
        it.doubt()
        assert it.moving is then


def test_in_motion_the_manual_forbids_other_commands_and_lets_jogs_join() -> None:
    it, _ = state()
    it.begin(JOG, 1)
    it.require_free(JOG)
    it.require_free(GetAxisStatus())
    for command in (STEP, SetSpeedPercent(percents=[1.0])):
        with pytest.raises(RobotBusy, match=r"JOG of r1 is under way; \w{3} was not sent"):
            it.require_free(command)
    it.end()
    it.require_free(STEP)


def test_a_macro_may_select_another_unit_and_no_other_motion_may() -> None:
    it, _ = state()
    kept = []
    for command in (STEP, JOG, HomeRobot(), RunMacro(macro="PCK")):
        it.begin(command, 1)
        kept.append(it.kept)
    assert kept == [1, 1, 1, None]
    it.begin(STEP, 1)
    it.end()
    assert it.kept is None


@in_virtual_time
async def test_nothing_moves_while_positions_are_changed() -> None:
    it, _ = state()
    async with it.tables_change:
        with pytest.raises(RobotBusy, match="are being changed and read back; LMI was not sent"):
            it.require_still(STEP)
    it.require_still(STEP)
    await asyncio.sleep(0)


def test_nothing_moves_before_every_stop_is_confirmed() -> None:
    it, _ = state()
    for stops in (1, 2, 1):
        it.stops = stops
        assert it.stopping
        with pytest.raises(RobotBusy, match="is not confirmed yet"):
            it.require_still(STEP)
    it.stops = 0
    assert not it.stopping
    it.require_still(STEP)
