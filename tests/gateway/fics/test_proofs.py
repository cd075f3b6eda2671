"""Proofs of the end of a move by the places and the motion of axes, and their limits."""

from typing import Any

import pytest

from gateway.core.verdicts import Begun, Place
from gateway.fics.axes import Places
from gateway.fics.targets import PlaceProof
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
) -> PlaceProof:
    return PlaceProof(command, start, target, position, more.get("moved", False), more.get("replied", False))


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
    assert found(target={"Z": 5.0}, position=AT_5).place() is Place.TARGET
    assert found(target={"Z": 0.0}).place() is Place.TARGET
    assert found(target={"Z": 5.0}, replied=True, moved=True).place() is Place.ELSEWHERE
    assert found(target=None, replied=True, moved=True).place() is Place.UNKNOWN


def test_a_way_that_its_roundings_hide_is_proved_by_motion_or_an_answer() -> None:
    assert found(target={"Z": 0.01}).place() is Place.TARGET_PERHAPS
    assert found(target={"Z": 0.01}, moved=True).place() is Place.TARGET
    assert found(target={"Z": 0.01}, replied=True).place() is Place.TARGET


def test_one_axis_off_its_target_is_a_miss_though_another_does_not_know_its_place() -> None:
    lost: Places = {"X": 1.0, "Z": None}
    assert found(target={"X": 3.0, "Z": None}, position=lost).place() is Place.ELSEWHERE
    assert found(target={"X": 1.0, "Z": None}, position=lost).place() is Place.UNKNOWN


def test_what_has_not_left_its_place_stands_at_its_start() -> None:
    assert found(target={"Z": 5.0}).place() is Place.START
    assert found(target={"Z": 5.0}, moved=True).place() is Place.ELSEWHERE
    assert found(target={"Z": 5.0}, position=NOWHERE).place() is Place.UNKNOWN


def test_motion_outweighs_an_answer_and_an_answer_silence() -> None:
    assert found(moved=True, replied=True).begun() is Begun.SEEN
    assert found(replied=True).begun() is Begun.ANSWERED
    assert found().begun() is Begun.UNREFUSED


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
