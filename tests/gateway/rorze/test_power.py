"""Knowledge of a body's power: signs, proofs and refusals."""

from typing import Any

import pytest

from gateway.rorze.asked_body import is_mark, new_mark
from gateway.rorze.power import PROOF_HOLDS_S, BodyPower, PowerMark, ProofTooOld, needs_place
from protocols.rorze.flash import SaveSettings
from protocols.rorze.interpolation import StartInterpolation, TurnFinger
from protocols.rorze.moves import MoveClockwise, MoveTo, MoveToSlowly
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import CentreStallDog, Home
from protocols.rorze.position import GetPosition, SetPosition
from protocols.rorze.programs import RunProgram, StepProgram
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetStartSpeed
from protocols.rorze.status import ClearControllerStatus, SetUserComment

LIMIT = 0x02
ENTRY = PositionReference(position=5)
NEXT = PositionReference(position="next")


@pytest.mark.parametrize(
    ("command", "place"),
    [
        (MoveTo(position=5), True),
        (MoveToSlowly(position=ENTRY), True),
        (MoveClockwise(distance=ENTRY), True),
        (MoveClockwise(distance=NEXT), True),
        (StartInterpolation(), True),
        (TurnFinger(angle=90_000), True),
        (RunProgram(), True),
        (StepProgram(), True),
        (MoveClockwise(distance=5), False),
        (MoveClockwise(distance="endless"), False),
        (Home(), False),
        (CentreStallDog(), False),
        (SetPosition(position=5), False),
        (GetPosition(), False),
    ],
)
def test_what_goes_to_a_place(command: RorzeCommand[Any], place: bool) -> None:
    assert needs_place(command) is place


def at_rest(position: int = 500, bits: int = 0) -> BodyPower:
    power = BodyPower()
    power.rests(position, bits, at=1.0)
    power.rests(position, bits, at=1.0)
    return power


def test_another_place_and_a_fallen_error_contradict_what_was_said_before() -> None:
    assert not BodyPower().signs.contradicts(0, 0), "nothing was said before"
    power = at_rest(500, LIMIT)
    assert not power.signs.contradicts(500, LIMIT)
    assert not power.signs.contradicts(500, LIMIT | 0x04), "an error that comes is no loss of power"
    assert power.signs.contradicts(501, LIMIT)
    assert not power.signs.contradicts(501, LIMIT, tolerance=1)
    assert power.signs.contradicts(500, 0)


def test_only_0_looks_like_a_loss_of_power_where_nothing_was_said_before() -> None:
    power = at_rest(500, LIMIT)
    assert power.signs.looks_switched_on(0)
    assert not power.signs.looks_switched_on(700)
    assert not at_rest(0).signs.looks_switched_on(0)


def test_what_has_jumped_is_said() -> None:
    power = at_rest(500, LIMIT)
    assert power.signs.jumped(500, LIMIT | 0x04) is None
    assert power.signs.jumped(0, LIMIT) == "its position went from 500 to 0"
    assert power.signs.jumped(501, LIMIT, tolerance=1) is None
    assert power.signs.jumped(500, 0) == "limit_error went from its status"


def test_a_command_takes_away_what_it_may_change() -> None:
    for command, position, bits in (
        (SetStartSpeed(speed=5), True, False),
        (ClearControllerStatus(), True, False),
        (MoveTo(position=5), False, False),
        (SetPosition(position=5), False, False),
        (RunProgram(), False, False),
    ):
        power = at_rest(500, LIMIT)
        power.sent(command, is_known=True)
        assert power.signs.contradicts(0, LIMIT) is position
        assert power.signs.contradicts(500, 0) is bits


def test_silence_after_a_move_nobody_saw_the_end_of_is_a_contradiction() -> None:
    power = at_rest()
    power.sent(MoveTo(position=5), is_known=True)
    assert not power.signs.contradicts(0, 0)
    power.silent()
    assert power.signs.contradicts(0, 0)
    assert power.signs.looks_switched_on(0)
    never_seen = BodyPower()
    never_seen.silent()
    assert not never_seen.signs.contradicts(0, 0), "a body that is switched on for the first time"


@pytest.mark.parametrize(
    ("command", "kept"),
    [
        (SaveSettings(), False),
        (SetUserComment(comment_number=7, text="mine"), False),
        (SetUserComment(comment_number=6, text="mine"), True),
        (SetUserComment(comment_number=7, text="GW-00000001"), True),
        (SetStartSpeed(speed=5), True),
    ],
)
def test_a_mark_that_was_saved_or_overwritten_proves_nothing(command: RorzeCommand[Any], kept: bool) -> None:
    power = BodyPower(PowerMark(7))
    power.was_marked("GW-00000001")
    power.done(command, certain=False)
    assert (power.mark.text is not None, power.mark.is_written, power.mark.due) == (kept, kept, not kept)


def test_a_motion_to_a_place_is_written_only_soon_after_it_was_proved() -> None:
    power = at_rest()
    for command, late in ((MoveTo(position=5), True), (RunProgram(), False), (Home(), False)):
        assert power.refuses_write("3F", command, 1.0 + PROOF_HOLDS_S) is None
        refusal = power.refuses_write("3F", command, 1.1 + PROOF_HOLDS_S)
        assert isinstance(refusal, ProofTooOld) is late
    power.needs_origin = False
    assert power.refuses_write("3F", MoveTo(position=5), 100.0) is None


def test_with_a_mark_positions_prove_nothing() -> None:
    power = BodyPower(PowerMark(7))
    power.was_marked("GW-00000001")
    power.rests(500, 0, at=50.0)
    assert isinstance(power.refuses_write("3F", MoveTo(position=5), 50.0), ProofTooOld)
    power.was_kept(50.0)
    assert power.refuses_write("3F", MoveTo(position=5), 50.0) is None


def test_marks_are_told_from_what_people_write() -> None:
    assert is_mark(new_mark())
    assert new_mark() != new_mark()
    assert is_mark("")
    assert not is_mark("GW-1234")
    assert not is_mark("Serial No.152")


def test_a_loss_is_told_each_time_and_acknowledged_once() -> None:
    told: list[str] = []
    power = BodyPower(PowerMark(7), on_news=lambda kind, _: told.append(kind))
    power.lost(certain=True)
    power.lost(certain=True)
    power.found_origin()
    assert (power.homed, power.cycled) == ("no", True), "it may have lost its power since: there is no mark"
    power.was_marked(new_mark())
    power.found_origin()
    assert (power.homed, power.cycled) == ("yes", False)
    power.acknowledge("request")
    assert told == [*["body.power_cycled"] * 2, "body.power_cycle.acknowledged"]
