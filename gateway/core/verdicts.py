"""Verdicts as tables: how a move is over, by what was found of it. Nothing else gives it a final status.

A family turns what it saw into a finding; `judge` gives the verdict of the one row that fits.
`python -m gateway.core.verdicts > docs/verdicts.md` draws the tables.
"""

from collections.abc import Iterable, Mapping, Sequence
from enum import Flag, auto
from functools import cache
from re import sub
from typing import Final, Literal, NamedTuple, Protocol, cast

from gateway.core.drawn import BY, drawn_table
from gateway.core.errors import Cancelled, GatewayError, Moved, MoveFailed, NotExecuted, Unproved
from gateway.core.move_record import MoveStatus


class Unbegun(Flag):
    """Why a move never began."""

    REFUSED = auto()
    """The controller has refused the command."""
    WITHHELD = auto()
    """The command was not written, or another has refused it."""
    GATEWAY_ENDED = auto()
    """The last life of the gateway has ended before the command was written."""


class Unwatched(Flag):
    """Reason for which a move is followed no more."""

    FAULT = auto()
    """The gateway has met a fault of its own."""
    OTHER_MEMBERS = auto()
    """Changed membership: after a restart, other bodies belong to the moving part."""


class PowerCycle(Flag):
    """Motion of a robot seen after it told that it was switched off and on in the middle of a move."""

    STANDS = auto()
    MOVES = auto()
    UNTOLD = auto()


class Worst(Flag):
    """The worst end of the moves of several members that move as one."""

    SUCCEEDED = auto()
    STOPPED = auto()
    CANCELLED = auto()
    REJECTED = auto()
    FAILED = auto()
    UNKNOWN = auto()
    LOST = auto()


class Sight(Flag):
    """Reason for which the end of a move cannot be seen."""

    SILENT = auto()
    """The controller answers no more."""
    OUT_OF_REACH = auto()
    """The controller cannot be asked."""


class Heard(Flag):
    """The last that was heard."""

    NOTHING = auto()
    END = auto()
    """The end of a move was announced."""
    STANDSTILL = auto()
    """A standstill by one reading, which no other has confirmed."""


class Told(Flag):
    """The end as the controller tells it."""

    NOTHING = auto()
    """A normal end, as far as the controller tells."""
    STOP = auto()
    CAUSE = auto()
    """A limit, EMS, STALL: by name."""
    ERROR = auto()
    """An error with a code and a text of its own."""
    ALARM = auto()
    """An axis reports an alarm."""
    NOT_IN_POSITION = auto()
    """The servo drive has not arrived in time."""


class Power(Flag):
    """The power since the command was written."""

    KEPT = auto()
    UNPROVED = auto()
    LOST = auto()


class Stop(Flag):
    """A stop since the command was written."""

    NONE = auto()
    SENT = auto()
    CONFIRMED = auto()
    """A standstill was proved, where it stands now."""


class Begun(Flag):
    """The evidence that the command was executed."""

    SEEN = auto()
    """Acknowledged and ended, or seen to run."""
    ANSWERED = auto()
    """The end was answered, but no motion was seen: the answer may be a copy."""
    UNREFUSED = auto()
    """No refusal came, and no motion was seen."""
    REFUSED_IN_MOTION = auto()
    """Refused as in motion, though it had stood still and has moved since: the line may have doubled it."""
    IN_DOUBT = auto()
    """Unknown whether it was executed."""


class Place(Flag):
    """Where it stands."""

    TARGET = auto()
    TARGET_AS_BEFORE = auto()
    """The target, which is the start, too."""
    TARGET_PERHAPS = auto()
    """Near its target and near its start, so that roundings hide whether it went."""
    START = auto()
    """The start, which is not the target."""
    ELSEWHERE = auto()
    WITHOUT_TARGET = auto()
    """A place without a target that could be known beforehand; it does not contradict the end."""
    UNKNOWN = auto()
    """An unknown place, or one that proves nothing."""


class Unseen(NamedTuple):
    """A move whose end cannot be seen."""

    sight: Sight
    heard: Heard = Heard.NOTHING
    stop: Stop = Stop.NONE
    begun: Begun = Begun.SEEN


class AtRest(NamedTuple):
    """A move that was written, and who moves stands still."""

    told: Told = Told.NOTHING
    power: Power = Power.KEPT
    stop: Stop = Stop.NONE
    begun: Begun = Begun.SEEN
    place: Place = Place.WITHOUT_TARGET


Finding = Unbegun | Unwatched | PowerCycle | Worst | Unseen | AtRest
"""The finding about a move that is over."""


class Judged(Protocol):
    """The record of a move that is judged."""

    end_cause: str | None
    evidence: list[str]


class Verdict(NamedTuple):
    """The end of a move, with its cause, error, remedy and evidence."""

    status: MoveStatus
    end_cause: str | None
    error: GatewayError | None
    evidence: str
    """A sentence, or empty."""

    def write_down(self, move: Judged) -> None:
        """Note in the record of a move why it ends as it does."""
        move.end_cause = self.end_cause
        if self.evidence:
            move.evidence.append(self.evidence)


class RowProblem(NamedTuple):
    """An error of a row; names in braces are words that the family gives."""

    kind: type[GatewayError]
    detail: str
    remedy: str
    moved: Moved | Literal["{moved}", ""] = ""
    """Empty where it is that of the kind."""


class Row(NamedTuple):
    """A row of a table: findings that are judged alike, as one with several members of a fact, and how."""

    finding: Finding
    status: MoveStatus
    cause: str | None = None
    error: RowProblem | str = ""
    """`GIVEN`, or empty, where it is no problem of the table."""
    evidence: str = ""


GIVEN: Final = "given"
"""The error of a row: what the controller, the line or the gateway has told of this one command."""


class VerdictWords(NamedTuple):
    """The words of a family in the sentences of the tables."""

    who: str = ""
    what: str = "motor"
    stand: str = "stands"
    have: str = "has"
    were: str = "was"
    they: str = "it"
    controller: str = "the controller"
    announcer: str = ""
    begins: str = "command was written"
    sending: str = ""
    """Outcome of the command, as a sentence."""
    why: str = ""
    unheard: str = ""
    lost: str = ""
    happened: str = ""
    acknowledge: str = ""
    cause: str = ""
    ended: str = ""
    """The cause in words."""
    position: object = None
    target: object = None
    counted: str = ""
    where: str = "still"
    waited_s: float = 0.0
    stopped: str = ""
    told: str = ""
    moved: str = ""


MOTOR: Final = VerdictWords()
AXES: Final = VerdictWords(
    what="axes", stand="stand", have="have", were="were", they="they", controller="the robot"
)

_ANY_SIGHT: Final = ~Sight(0)
_ANY_POWER: Final = ~Power(0)
_ANY_STOP: Final = ~Stop(0)
_ANY_BEGUN: Final = ~Begun(0)
_ANY_PLACE: Final = ~Place(0)
_AT_TARGET: Final = Place.TARGET | Place.TARGET_AS_BEFORE
_OFF_TARGET: Final = Place.START | Place.ELSEWHERE | Place.WITHOUT_TARGET | Place.UNKNOWN
"""Places off the target, which a stop or another command explains."""
_NOWHERE: Final = Place.WITHOUT_TARGET | Place.UNKNOWN
_EXECUTED: Final = ~Begun.IN_DOUBT
_PERHAPS_KEPT: Final = Power.KEPT | Power.UNPROVED
_NOT_CONFIRMED: Final = Stop.NONE | Stop.SENT

_RESTARTED: Final = RowProblem(
    Cancelled,
    "The gateway has ended before this could be sent; nothing was sent, and nothing is sent again.",
    "Send the command again if it is still wanted.",
)
_OTHER_MEMBERS: Final = RowProblem(
    Unproved,
    "The gateway was restarted in the middle of the move, and {who} has other bodies now, or their moves are "
    "not kept any more.",
    "See where the {what} is before anything else.",
)
_SILENT: Final = RowProblem(
    MoveFailed,
    "{who} stopped answering in the middle of the move; it may still be moving.",
    "Check its power and cable, stop it, and home it again.",
)
_OUT_OF_SIGHT: Final = RowProblem(
    Unproved,
    "{who} {unheard}; the move may have ended, or the {what} may still be moving.",
    "See that its line works, then read its status and position.",
)
_CAUSE: Final = RowProblem(
    MoveFailed,
    "The move of {who} {ended}; the {what} {stand} still.",
    "Remove the cause, clear the controller's status, and home the axis if steps were lost.",
)
_ALARM: Final = RowProblem(
    MoveFailed,
    "An axis of {who} reports an alarm; the {what} {stand} still.",
    "Read the errors of {controller}, remove the cause, then reset them.",
)
_NOT_IN_POSITION: Final = RowProblem(
    MoveFailed,
    "{who} has put out all pulses, and its servo drive was not in position within {waited_s:g} s: "
    "{controller} gives CLR then, and the {what} may stand elsewhere than it counts.",
    "See what holds the axis up, and home it before the next move to a place.",
)
_WITHOUT_POWER: Final = RowProblem(
    MoveFailed,
    "{who} {lost} its power before or in the middle of the move; the {what} {stand} still, and nobody knows "
    "where.",
    "Home it again: its position means nothing now.",
)
_POWER_IN_DOUBT: Final = RowProblem(
    Unproved,
    "{who} stands at {position}, and nothing proves that it has kept its power: it has arrived there, or has "
    "lost its power before or in the middle of the move.",
    "Home it again, unless its position is proved otherwise.",
)
_NOT_EXECUTED: Final = RowProblem(
    NotExecuted, "{sending}; the {what} {have} not moved.", "Send it again if it is still wanted."
)
_MISSED: Final = RowProblem(
    MoveFailed,
    "{who} stands at {position}{counted}, not at {target} as was asked.",
    "The command may have been garbled on the line: check the position before the next move.",
)
_MISSED_IN_DOUBT: Final = _MISSED._replace(
    remedy="The command may have been garbled on the line, or the controller has lost its power: "
    "check the position before the next move."
)
_UNPROVED: Final = RowProblem(
    Unproved,
    "{sending}; the {what} {stand} still, but the {what} {were} not seen to move, and no place proves that "
    "it was done.",
    "Read status and position before anything else.",
)
_UNPROVED_POWER: Final = _UNPROVED._replace(
    detail="{sending}; the {what} {stand} still, but {controller} may have lost its power on the way, and "
    "no place proves that it was done."
)
_MEMBERS: Final = RowProblem(
    MoveFailed,
    "The move of {who} failed{stopped}. {told}",
    "Remove the cause, see where the {what} is, and bring it back by moves of single axes or by homing.",
    "{moved}",
)
_STOOD_STILL: Final = "A stop was confirmed: the {what} stood still at {position}."
_PROVES_NOTHING: Final = "The {what} {stand} {where}, which proves nothing."
_NOTHING_TO_DO: Final = (
    "The {what} {stand} at the target, where {they} stood before: there was nothing to do."
)
_WAS_NOT_EXECUTED: Final = "The {what} {stand} where {they} stood: the command was not executed."
_NO_PROOF: Final = "Nothing proves how it has ended."
_ENDED_UNSEEN: Final = "{announcer} has announced the end of a move; nobody could ask how it ended."
_HEARD_STILL: Final = "The {what} {were} last heard to stand still at {position}."


def _cycled(seen: PowerCycle, told: str, look: str = "") -> Row:
    problem = RowProblem(
        MoveFailed, f"{{happened}} in the middle of the move; {told}.", look + "{acknowledge}"
    )
    return Row(seen, MoveStatus.LOST, "power_cycled", problem)


def _told(told: Told, stop: Stop = _ANY_STOP) -> AtRest:
    return AtRest(told, _ANY_POWER, stop, _ANY_BEGUN, _ANY_PLACE)


def _stands(place: Place, begun: Begun, power: Power = _PERHAPS_KEPT, stop: Stop = _ANY_STOP) -> AtRest:
    """Find a standstill of which the controller tells nothing else: the place decides."""
    return AtRest(Told.NOTHING, power, stop, begun, place)


def _unstopped(place: Place, begun: Begun, power: Power = _PERHAPS_KEPT) -> AtRest:
    return _stands(place, begun, power, Stop.NONE)


def _in_doubt(place: Place, power: Power = Power.KEPT) -> AtRest:
    return _stands(place, Begun.IN_DOUBT, power)


_S = MoveStatus
_STOPPED: Final = _S.STOPPED, "stop_command"
TABLES: Final[Mapping[str, Sequence[Row]]] = {
    "Never begun": (
        Row(Unbegun.REFUSED, _S.REJECTED, None, GIVEN),
        Row(Unbegun.WITHHELD, _S.CANCELLED, None, GIVEN),
        Row(
            Unbegun.GATEWAY_ENDED,
            _S.CANCELLED,
            None,
            _RESTARTED,
            "The gateway has ended before the {begins}.",
        ),
    ),
    "Nobody follows it": (
        Row(Unwatched.FAULT, _S.UNKNOWN, None, "", "{why}"),
        Row(Unwatched.OTHER_MEMBERS, _S.UNKNOWN, None, _OTHER_MEMBERS),
    ),
    "Switched off and on in the middle of the move, as it tells itself": (
        _cycled(PowerCycle.STANDS, "its axes were seen to stand still since"),
        _cycled(PowerCycle.MOVES, "its axes were seen to move since", "Stop it. "),
        _cycled(
            PowerCycle.UNTOLD,
            "it has not told since whether its axes stand still",
            "See that nothing moves. ",
        ),
    ),
    "Nobody can see its end": (
        Row(Unseen(_ANY_SIGHT, ~Heard(0), Stop.CONFIRMED, _ANY_BEGUN), *_STOPPED, "", _STOOD_STILL),
        *(
            Row(Unseen(sight, heard, _NOT_CONFIRMED, begun), status, None, error, evidence)
            for sight, heard, status, problem, evidence in (
                (_ANY_SIGHT, Heard.END, _S.UNKNOWN, _OUT_OF_SIGHT, _ENDED_UNSEEN),
                (_ANY_SIGHT, Heard.STANDSTILL, _S.UNKNOWN, _OUT_OF_SIGHT, _HEARD_STILL),
                (Sight.SILENT, Heard.NOTHING, _S.LOST, _SILENT, ""),
                (Sight.OUT_OF_REACH, Heard.NOTHING, _S.UNKNOWN, _OUT_OF_SIGHT, ""),
            )
            for begun, error in ((_EXECUTED, problem), (Begun.IN_DOUBT, GIVEN))
        ),
    ),
    "It stands still, and the controller tells how it ended": (
        Row(_told(Told.STOP), *_STOPPED),
        Row(_told(Told.CAUSE), _S.FAILED, "{cause}", _CAUSE),
        Row(_told(Told.ERROR, Stop.NONE), _S.FAILED, "{cause}", GIVEN),
        Row(_told(Told.ERROR, ~Stop.NONE), *_STOPPED),
        Row(_told(Told.ALARM), _S.FAILED, None, _ALARM),
        Row(_told(Told.NOT_IN_POSITION), _S.FAILED, "not_in_position", _NOT_IN_POSITION),
    ),
    "It stands still, and its place has to tell": (
        Row(_stands(_ANY_PLACE, _ANY_BEGUN, Power.LOST), _S.LOST, None, _WITHOUT_POWER),
        Row(_stands(_OFF_TARGET, _EXECUTED, stop=Stop.CONFIRMED), *_STOPPED, "", _STOOD_STILL),
        Row(_stands(_OFF_TARGET, _EXECUTED, stop=Stop.SENT), *_STOPPED),
        Row(_unstopped(_OFF_TARGET, Begun.REFUSED_IN_MOTION), _S.UNKNOWN, None, GIVEN),
        Row(_stands(_AT_TARGET, _EXECUTED, Power.KEPT), _S.SUCCEEDED, "normal"),
        Row(_stands(_AT_TARGET, _EXECUTED, Power.UNPROVED), _S.UNKNOWN, None, _POWER_IN_DOUBT),
        Row(_stands(Place.TARGET_PERHAPS, _EXECUTED), _S.UNKNOWN, None, _UNPROVED, _NO_PROOF),
        Row(_unstopped(Place.START, Begun.UNREFUSED), _S.FAILED, "not_executed", _NOT_EXECUTED),
        *(
            Row(_unstopped(place, begun, power), _S.FAILED, "position_mismatch", error)
            for power, error in ((Power.KEPT, _MISSED), (Power.UNPROVED, _MISSED_IN_DOUBT))
            for place, begun in (
                (Place.START | Place.ELSEWHERE, Begun.SEEN | Begun.ANSWERED),
                (Place.ELSEWHERE, Begun.UNREFUSED),
            )
        ),
        Row(_unstopped(Place.WITHOUT_TARGET, Begun.SEEN, Power.KEPT), _S.SUCCEEDED, "normal"),
        Row(_unstopped(Place.WITHOUT_TARGET, Begun.SEEN, Power.UNPROVED), _S.UNKNOWN, None, _POWER_IN_DOUBT),
        Row(_unstopped(_NOWHERE, Begun.ANSWERED | Begun.UNREFUSED), _S.UNKNOWN, None, _UNPROVED, _NO_PROOF),
        Row(_unstopped(Place.UNKNOWN, Begun.SEEN), _S.UNKNOWN, None, _UNPROVED_POWER, _NO_PROOF),
    ),
    "It stands still, and nobody knows whether it was begun": (
        Row(_in_doubt(Place.TARGET), _S.SUCCEEDED, "normal"),
        Row(_in_doubt(Place.TARGET_AS_BEFORE), _S.SUCCEEDED, None, "", _NOTHING_TO_DO),
        Row(_in_doubt(Place.START), _S.FAILED, "not_executed", _NOT_EXECUTED, _WAS_NOT_EXECUTED),
        Row(_in_doubt(~(_AT_TARGET | Place.START)), _S.UNKNOWN, None, GIVEN, _PROVES_NOTHING),
        Row(_in_doubt(_ANY_PLACE, Power.UNPROVED), _S.UNKNOWN, None, GIVEN, _PROVES_NOTHING),
    ),
    "Several that move as one": (
        Row(Worst.SUCCEEDED, _S.SUCCEEDED, "normal"),
        Row(Worst.STOPPED, *_STOPPED),
        # What one did not do, others did.
        Row(Worst.CANCELLED | Worst.REJECTED | Worst.FAILED, _S.FAILED, "{cause}", _MEMBERS),
        Row(Worst.UNKNOWN, _S.UNKNOWN, "{cause}", _MEMBERS),
        Row(Worst.LOST, _S.LOST, "{cause}", _MEMBERS),
    ),
}
"""Every finding has exactly one row."""


def worst_of(statuses: Iterable[MoveStatus]) -> Worst:
    """The worst of final statuses."""
    return max((Worst[status.name] for status in statuses), key=lambda worst: worst.value)


def judge(finding: Finding, words: VerdictWords = MOTOR, given: GatewayError | None = None) -> Verdict:
    """Give the verdict on a move: that of the row of its finding, in the words of the family.

    `given` is the error that was told of this command, for rows that have none of their own.
    """
    row, named = row_of(finding), words._asdict()
    error = given if row.error == GIVEN else _error(row.error, named)
    return Verdict(row.status, row.cause and row.cause.format(**named), error, row.evidence.format(**named))


@cache
def row_of(finding: Finding) -> Row:
    """The row that a finding has."""
    [row] = (row for rows in TABLES.values() for row in rows if fits(finding, row.finding))
    return row


def fits(finding: Finding, row: Finding) -> bool:
    """Say whether a finding is among those of a row."""
    return type(finding) is type(row) and all(map(_is_among, _facts(finding), _facts(row)))


def _is_among(fact: Flag, those: Flag) -> bool:
    return fact in those


def _facts(finding: Finding) -> Sequence[Flag]:
    return (finding,) if isinstance(finding, Flag) else finding


def _error(problem: RowProblem | str, named: Mapping[str, object]) -> GatewayError | None:
    if not isinstance(problem, RowProblem):
        return None
    error = problem.kind(problem.detail.format(**named), problem.remedy.format(**named))
    if problem.moved:
        error.moved = cast("Moved", problem.moved.format(**named))
    return error


def drawing() -> str:
    """The tables as a page of the documentation."""
    page = [
        "# Verdicts",
        "",
        "How a move is over, by what was found of it: every finding has exactly one row (decision 100).",
        "Facts that a row does not name do not matter to it. Words in braces come from the family, such as",
        "`{who}`, the address of what moves; *given* is the error that the controller, the line or the",
        f"gateway has told of this one command. {BY}",
    ]
    columns = ["finding", "status", "cause", "error", "remedy", "evidence"]
    for title, rows in TABLES.items():
        page += ["", f"## {title}", "", *drawn_table(columns, map(_drawn, rows))]
    return "\n".join([*page, ""])


def _drawn(row: Row) -> Sequence[str]:
    detail, remedy = (f"*{row.error}*" if row.error else "", "")
    if isinstance(row.error, RowProblem):
        detail, remedy = f"{row.error.kind.title}: {row.error.detail}", row.error.remedy
    return _named(row.finding), row.status.value, row.cause or "", detail, remedy, row.evidence


def _named(finding: Finding) -> str:
    facts = [fact for fact in _facts(finding) if fact != ~type(fact)(0)]
    return "; ".join(f"{_words(type(fact).__name__)}: {_members(fact)}" for fact in facts) or "any"


def _members(fact: Flag) -> str:
    names = [_words(flag.name or "") for flag in type(fact) if flag in fact]
    others = [_words(flag.name or "") for flag in type(fact) if flag not in fact]
    return " or ".join(names) if len(names) <= len(others) or len(others) > 1 else f"not {others[0]}"


def _words(name: str) -> str:
    return sub("(?<=[a-z])(?=[A-Z])|_", " ", name).lower()


if __name__ == "__main__":
    print(drawing(), end="")
