"""Answers of a body, and the end of each fact: by commands, motion, silence and power."""

from typing import Any

import pytest

from gateway.rorze.knowledge import BodyFacts, MotorState, Prepared
from protocols.rorze.flash import LoadProgram
from protocols.rorze.interpolation import SetStartPosition, StartInterpolation
from protocols.rorze.modes import GetOperatingMode, OperatingMode, SetOperatingMode
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.patterns import GetPattern, PatternSpeedSets, SetPattern
from protocols.rorze.position import GetPosition, SetPosition, SignedPulses
from protocols.rorze.programs import ClearProgram, GetProgramStatus, ProgramStatus
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetStartSpeed
from protocols.rorze.status import ControllerStatus, GetControllerStatus

SETS = PatternSpeedSets(acceleration=1, deceleration=2)
ALL = {"rest", "place", "mode", "pattern_sets", "no_program_at", "program_ends"}


def asked() -> BodyFacts:
    """A body that has told everything, at 5 s."""
    told = BodyFacts()
    told.replied(GetPosition(), SignedPulses(pulses=70), 5.0)
    told.replied(GetControllerStatus(), ControllerStatus(bits=4), 5.0)
    told.replied(GetOperatingMode(), OperatingMode(mode="encoder"), 5.0)
    told.replied(GetPattern(pattern=3), SETS, 5.0)
    told.replied(GetProgramStatus(), ProgramStatus(status=0), 5.0)
    told.program_was_read()
    told.rests(MotorState(4, 70), 5.0, told.sent_count)
    return told


def known(told: BodyFacts) -> set[str]:
    return {fact for fact in ALL if getattr(told, fact)}


def test_a_body_is_known_by_its_answers() -> None:
    told = asked()
    assert known(told) == ALL
    assert (told.position, told.status_bits, told.mode, told.no_program_at) == (70, 4, "encoder", 5.0)
    assert (told.rest, told.pattern_sets, told.heard_at) == (MotorState(4, 70), {3: SETS}, 5.0)


@pytest.mark.parametrize(
    ("command", "ended"),
    [
        (SetStartSpeed(speed=5), {"rest"}),
        (SetPosition(position=5), {"rest", "place"}),
        (SetOperatingMode(mode="servo"), {"rest", "place", "mode"}),
        (SetPattern(pattern=3, acceleration=1, deceleration=1), {"rest", "pattern_sets"}),
        (ClearProgram(), {"rest", "program_ends"}),
        (LoadProgram(), {"rest", "program_ends"}),
    ],
)
def test_a_command_ends_the_facts_that_it_changes(command: RorzeCommand[Any], ended: set[str]) -> None:
    told = asked()
    told.sent(command, is_known=True)
    assert known(told) == ALL - ended
    assert told.sent_count == 1


def test_a_command_of_no_table_may_change_program_and_patterns() -> None:
    told = asked()
    told.sent(SetStartSpeed(speed=5), is_known=False)
    assert known(told) == ALL - {"rest", "program_ends", "pattern_sets"}


def test_motion_silence_and_power_each_end_their_facts() -> None:
    moved, silent, powered = asked(), asked(), asked()
    moved.may_move()
    silent.silent()
    powered.power_in_question()
    assert known(moved) == ALL - {"rest", "mode", "no_program_at"}
    assert known(silent) == ALL - {"rest", "mode", "no_program_at", "program_ends"}
    assert known(powered) == {"rest", "place"}


def test_a_poll_around_a_command_has_seen_two_states() -> None:
    told = asked()
    told.rests(MotorState(0, 70), 6.0, told.sent_count - 1)
    assert told.rest is None


def test_only_commands_that_change_settings_count_as_changes() -> None:
    told = BodyFacts()
    told.sent(MoveClockwise(distance=5), is_known=True)
    told.sent(SetStartSpeed(speed=5), is_known=True)
    assert (told.sent_count, told.changes) == (2, 1)


def test_an_interpolated_move_is_prepared_until_positions_are_told_or_it_moves() -> None:
    prepared = Prepared()
    assert prepared.is_prepared is None, "nobody knows"
    prepared.done(SetStartPosition(axis=0, position=5), certain=True)
    assert prepared.is_prepared is False
    prepared.moves(StartInterpolation())
    assert prepared.is_prepared is False
    prepared.powered_on(certain=True)
    assert prepared.is_prepared is False
