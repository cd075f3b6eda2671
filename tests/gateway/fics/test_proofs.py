"""What the places and the motion of axes prove of the end of a move, and what they do not."""

from typing import Any

import pytest

from gateway.fics.axes import Places
from gateway.fics.proofs import Finding
from protocols.fics.homing import HomeRobot
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveRelative
from protocols.fics.row import FicsCommand

UP = MoveRelative(coordinates=[None, None, 5.0])
MACRO = RunMacro(macro="PCK")
NOWHERE: Places = {"X": None, "Z": None}
AT_0: Places = {"X": 0.0, "Z": 0.0}
AT_5: Places = {"X": 0.0, "Z": 5.0}


def found(
    command: FicsCommand[Any] = UP,
    start: Places = AT_0,
    target: Places | None = None,
    position: Places | None = AT_0,
    **more: bool,
) -> Finding:
    return Finding(command, start, target, position, more.get("moved", False), more.get("replied", False))


@pytest.mark.parametrize("replied", [False, True])
@pytest.mark.parametrize(("moved", "position"), [(True, AT_0), (False, AT_5)])
def test_a_move_ran_that_was_seen_to_move_or_stands_elsewhere(
    moved: bool, position: Places, replied: bool
) -> None:
    assert found(moved=moved, position=position, replied=replied).ran()


@pytest.mark.parametrize("position", [AT_0, NOWHERE, None])
def test_an_answer_and_a_place_that_is_gone_prove_no_motion(position: Places | None) -> None:
    assert not found(position=position, replied=True).ran()


def test_what_gained_a_place_was_homed() -> None:
    homing = found(HomeRobot(), start=NOWHERE, position=AT_0)
    assert homing.ran()
    assert homing.ran_its_course()
    assert homing.shows_power()


def test_homing_that_leaves_an_axis_without_place_did_not_run_its_course_unless_it_was_answered() -> None:
    part: Places = {"X": 0.0, "Z": None}
    assert not found(HomeRobot(), start=NOWHERE, position=part, moved=True).ran_its_course()
    assert found(HomeRobot(), start=NOWHERE, position=part, moved=True, replied=True).ran_its_course()
    assert not found(HomeRobot(), start=NOWHERE, position=part, moved=True).shows_power()


def test_at_its_target_a_move_has_arrived_no_matter_who_says_so() -> None:
    assert found(target={"Z": 5.0}, position=AT_5).arrived()
    assert found(target={"Z": 0.0}).arrived()
    assert not found(target={"Z": 5.0}, replied=True, moved=True).arrived()
    assert not found(target=None, replied=True, moved=True).arrived()


def test_a_way_that_its_roundings_hide_is_proved_by_motion_or_an_answer() -> None:
    assert not found(target={"Z": 0.01}).arrived()
    assert found(target={"Z": 0.01}, moved=True).arrived()
    assert found(target={"Z": 0.01}, replied=True).arrived()


def test_one_axis_off_its_target_is_a_miss_though_another_does_not_know_its_place() -> None:
    assert found(target={"X": 3.0, "Z": None}, position={"X": 1.0, "Z": None}).off_target()
    assert not found(target={"X": 1.0, "Z": None}, position={"X": 1.0, "Z": None}).off_target()


def test_what_has_not_left_its_place_is_untouched() -> None:
    assert found(target={"Z": 5.0}).untouched()
    assert not found(target={"Z": 5.0}, moved=True).untouched()
    assert not found(target={"Z": 5.0}, position=NOWHERE).untouched()


def test_a_move_stayed_whose_axes_are_where_they_were_even_at_its_target() -> None:
    assert found(target={"Z": 5.0}).stayed()
    assert found(target={"Z": 0.0}).stayed()
    assert not found(target={"Z": 0.0}, moved=True).stayed()
    assert not found(target={"Z": 0.0}, position=None).stayed()
    assert not found(MACRO).stayed()


def test_without_a_target_a_course_that_was_seen_is_run() -> None:
    assert found(MACRO, moved=True).ran_its_course()
    assert not found(MACRO, replied=True).ran_its_course()
    assert not found(target={"Z": 5.0}, position=None, moved=True).ran_its_course()
    assert found(target={"Z": 5.0}, position=None, moved=True, replied=True).ran_its_course()


def test_an_axis_that_still_knows_its_place_shows_that_the_power_was_kept() -> None:
    assert found(MACRO, position=AT_5).shows_power()
    assert not found(MACRO, start=NOWHERE, position=NOWHERE).shows_power()
    assert not found(MACRO, start=NOWHERE, position=AT_5).shows_power()
    assert not found(MACRO, position=None).shows_power()
