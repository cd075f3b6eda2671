"""Needs of a motion of a body: what is asked before it, in which order, and what forbids it.

All is pure: it reads what is known, and asks nothing. The runner is `gateway.core.preparation.prepare`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Any, Final, NamedTuple

from gateway.core.errors import BodyBusy, NotSent
from gateway.core.preparation import Asked, Missing
from gateway.rorze.knowledge import BodyFacts, MotorState, Prepared
from gateway.rorze.power import BodyPower, needs_place
from protocols.rorze.moves import AbsoluteMove, MoveClockwise, MoveClockwiseSlowly, RelativeMove
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import OriginSearch
from protocols.rorze.row import ModeName, RorzeCommand


class StartQuestion(Enum):
    """Question to a body before a motion, in the order in which they are asked."""

    MARK = "Is there a mark, which a loss of power would wipe out? If not, write one."
    REST = "Does the motor rest, and where?"
    TARGET = "Where does the entry of the position table lead to?"
    MODE = "What are its positions counted in?"
    SPEEDS = "Which speed sets has its pattern?"
    POWER = "Does the mark still stand?"
    NEW_MARK = "There is none: write one."


class SharedWay(NamedTuple):
    """Where a motor that moves together with others has to start, and should come to, in pulses."""

    start: int
    target: int
    tolerance: int


@dataclass
class Start:
    """Knowledge of a body just before a motion."""

    who: str
    command: RorzeCommand[Any]
    told: BodyFacts
    prepared: Prepared
    power: BodyPower
    needs_proof: bool
    """True if a loss of power would spoil the motion."""
    encoder_tolerance: int
    """Pulses by which an encoder may find the motor beside its target, by the configuration."""
    stretch: SharedWay | None = None
    """The way in the plan of the move, if it has one."""
    rest: MotorState | None = None
    """The state of the motor; None: not known."""
    in_program: bool = False
    """True if its user program was seen to run."""
    entry: int | None = None
    """Pulses of the entry of the position table; None: not known, or none is meant."""
    mode: ModeName | None = None
    stands: bool | None = None
    """True if the mark was seen to stand."""

    @property
    def target(self) -> int | None:
        """Where the command alone should bring the motor, in pulses; None: not known."""
        return None if self.rest is None else target_from(self.command, self.rest.position, self.entry)

    @property
    def way(self) -> tuple[int | None, int]:
        """Target, and by how many pulses it may be missed: pulses that are put out are counted."""
        if self.stretch is not None:
            return self.stretch.target, self.stretch.tolerance
        return self.target, self.encoder_tolerance if self.mode == "encoder" else 0


def entry_in(command: RorzeCommand[Any]) -> PositionReference | None:
    """The entry of the position table in a motion command, whose pulses it can be asked for."""
    value = _amount_in(command)
    return value if isinstance(value, PositionReference) and isinstance(value.position, int) else None


def target_from(command: RorzeCommand[Any], start: int, entry: int | None) -> int | None:
    """Where the command should bring the motor from `start`, in pulses; `entry` are those of its entry."""
    value = _amount_in(command)
    amount = value if isinstance(value, int) else entry
    if amount is None or isinstance(command, AbsoluteMove):
        return amount
    return start + amount if isinstance(command, MoveClockwise | MoveClockwiseSlowly) else start - amount


def _amount_in(command: RorzeCommand[Any]) -> int | PositionReference | str | None:
    if isinstance(command, RelativeMove):
        return command.distance
    return command.position if isinstance(command, AbsoluteMove) else None


def spoils(power: BodyPower, command: RorzeCommand[Any]) -> bool:
    """True if a loss of power would spoil a motion."""
    return power.needs_origin and (needs_place(command) or isinstance(command, OriginSearch))


def _has_end(start: Start) -> bool:
    return start.target is not None


def _lacks_speeds(start: Start) -> bool:
    """True if its stop would not know how long its ramp takes: in motion it does not tell."""
    pattern = start.prepared.pattern_of(start.command)
    return pattern is not None and pattern not in start.told.pattern_sets


NEEDS: Final[Mapping[StartQuestion, Callable[[Start], bool]]] = {
    StartQuestion.MARK: lambda start: start.needs_proof and start.power.mark.text is None,
    StartQuestion.REST: lambda start: start.rest is None,
    StartQuestion.TARGET: lambda start: start.entry is None and entry_in(start.command) is not None,
    StartQuestion.MODE: lambda start: start.encoder_tolerance > 0 and start.mode is None and _has_end(start),
    StartQuestion.SPEEDS: _lacks_speeds,
    StartQuestion.POWER: lambda start: start.needs_proof and start.stands is None,
    StartQuestion.NEW_MARK: lambda start: start.needs_proof and start.stands is not True,
}
"""The questions, in their order, each with what makes it due; the power is last, just before the motion."""


def needs_of(start: Start) -> Iterator[Missing[StartQuestion, None]]:
    """Needs of a motion, in their order; each is asked for once, whatever the answer."""
    for question, is_due in NEEDS.items():
        yield partial(_missing, start, question, is_due)
    yield partial(_forbidden, start)


def _missing(
    start: Start,
    question: StartQuestion,
    is_due: Callable[[Start], bool],
    heard: Sequence[Asked[StartQuestion, None]],
) -> StartQuestion | None:
    return question if is_due(start) and not heard else None


def _forbidden(start: Start, _: object) -> None:
    """Need that nothing forbids the motion.

    :raises PowerCycled: it has lost its power, and would go to another place.
    :raises BodyBusy: it moves; what it does later would prove nothing of this move.
    :raises NotSent: the motor does not stand where the plan of the move begins.
    """
    refusal = start.power.refusal(start.who, start.command)
    if refusal is not None:
        raise refusal
    if start.rest is None or start.rest.runs:
        mover = "its user program" if start.in_program else "no move of this gateway"
        raise BodyBusy(
            f"{start.who} moves already, by {mover}; {start.command.code} was not sent.",
            "Wait for its end or stop it.",
        )
    if start.stretch is not None and start.rest.position != start.stretch.start:
        raise NotSent(
            f"{start.who} stands at {start.rest.position}, and the move was planned from "
            f"{start.stretch.start}; {start.command.code} was not sent.",
            "See what else moves it, and try again.",
        )
