"""The acceleration patterns A[n] of a body with their speed changes (RC-420 manual 13.3.4, 13.3.7)."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from operator import attrgetter
from typing import Annotated, Any, Final, Self

from pydantic import AfterValidator, BaseModel, Field, model_validator

from gateway.core.errors import InvalidRequest
from gateway.core.operation import Expectation, Rows
from gateway.core.records import AnswerModel, SentBack, example, require_same
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody
from gateway.rorze.changes import ChangeStep, Flash, Item, SettingCodec, Wanted, as_expected, change, read
from gateway.rorze.speed_sets import STANDARD, First, Last, numbers_of, parameters_of, sets_item
from gateway.rorze.units import Scaled
from protocols.rorze.notation import Amount, Speed
from protocols.rorze.patterns import (
    ChangePoint,
    GetSpeedChange,
    SetSpeedChange,
    SpeedChangePoint,
)
from protocols.rorze.profile import ProfileError, SpeedChange, resolve_changes

ROWS: Final = Rows("body settings")
PatternNumber = Annotated[
    int, Field(ge=0, le=STANDARD, description="0-29, or 30: the standard pattern.", examples=[12])
]
POINTS: Final = range(16)
"""The speed changes that a pattern may have (SES)."""
NOT_READABLE: Final = "not readable"
_UNREADABLE: Final = {f"0x{code:02X}": NOT_READABLE for code in (*range(0x40, 0x49), 0x65)}
"""Refusals of a pattern whose speed sets are not complete, or whose changes do not suit them."""


AnySet = Annotated[int, Field(ge=0, le=STANDARD)]


class SpeedChangeRequest(SentBack):
    """A change of speed on the way: placed by where it begins, or by where it is done.

    With both `begin` counts, and `end` has to be that of the pattern as it was read.
    """

    read_only = frozenset(("begin_in_unit", "end_in_unit", "speed"))

    point: ChangePoint = Field(description="Number of the change, 0-15.")
    begin: Amount | None = Field(
        default=None, description="Pulses after the start at which it begins; or `end`."
    )
    end: Amount | None = Field(
        default=None, description="Pulses after the start at which it is done; or `begin`."
    )
    speed_pps: Speed = Field(description="Speed after the change, 1-1,000,000 pps.")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.begin is None and self.end is None:
            raise ValueError("give begin or end")
        return self

    @property
    def told(self) -> dict[str, Any]:
        """With `begin`, where it is done is not set, too."""
        return super().told | ({"end": self.end} if self.begin is not None and self.end is not None else {})

    def place(self) -> dict[str, Any]:
        """Where it is, and its speed, as the controller takes it."""
        return self.model_dump(
            exclude={"point", "end"} if self.begin is not None else {"point"}, exclude_none=True
        )

    def planned(self) -> SpeedChange:
        """The change as the speed curve takes it."""
        if self.begin is not None:
            return SpeedChange("F", self.begin, self.speed_pps)
        return SpeedChange("T", self.end or 0, self.speed_pps)


def _each_once(changes: list[SpeedChangeRequest]) -> list[SpeedChangeRequest]:
    """Refuse two changes at one point."""
    if len({change.point for change in changes}) < len(changes):
        raise ValueError("each point may be given once")
    return changes


Changes = Annotated[
    list[SpeedChangeRequest],
    AfterValidator(_each_once),
    Field(max_length=len(POINTS), description="All that it shall have."),
]


class PatternSentBack(SentBack):
    """A pattern that may be sent as it was read, with what the body works out of its changes of speed."""

    read_only = frozenset(("body_id", "number", "flash", "steps"))
    null_unset = frozenset(("acceleration_set", "deceleration_set", "changes"))
    changes: Changes | None = None

    @property
    def told(self) -> dict[str, Any]:
        """With what cannot be set of its changes, by their points."""
        return super().told | {str(change.point): change.told for change in self.changes or () if change.told}

    def require_unchanged(self, present: BaseModel) -> None:
        """Refuse what cannot be set and is otherwise; errors as of `require_same`."""
        super().require_unchanged(present)
        points = {change.point: change for change in getattr(present, "changes", None) or ()}
        for wanted in self.changes or ():
            require_same(wanted.told, points.get(wanted.point), f"changes.{wanted.point}.")


class PatternValues(
    PatternSentBack, json_schema_extra=example(acceleration_set=12, deceleration_set=13, changes=[])
):
    """A pattern: two speed parameter sets, and its changes of speed.

    Null, as GET gives it, is what was never set, or cannot be worked out, and stays so.
    """

    acceleration_set: AnySet | None = Field(description="Speed parameter set of the acceleration, 0-29.")
    deceleration_set: AnySet | None = Field(description="Speed parameter set of the deceleration, 0-29.")
    changes: Changes | None = Field(default_factory=list)


class PatternChange(PatternSentBack, json_schema_extra=example(deceleration_set=13)):
    """Changes of a pattern; the rest stays as it is."""

    acceleration_set: AnySet | None = Field(default=None, description="0-29.")
    deceleration_set: AnySet | None = Field(default=None, description="0-29.")


class SpeedChangeInfo(AnswerModel):
    """A change of speed as the body works it out."""

    point: int
    begin: int = Field(description="Pulses after the start at which it begins.")
    end: int = Field(description="Pulses after the start at which it is done.")
    speed_pps: int
    begin_in_unit: Scaled | None = Field(
        description="Begin of the change in the body's unit; null without a scale."
    )
    end_in_unit: Scaled | None
    speed: Scaled | None


class PatternSets(AnswerModel):
    """The speed parameter sets of a pattern."""

    acceleration_set: int
    deceleration_set: int


class Pattern(AnswerModel):
    """An acceleration pattern as the body holds it in RAM."""

    body_id: str
    number: int = Field(
        description="0-29, or 30: the standard one, which is made of set 30 and has no changes."
    )
    acceleration_set: int | None = Field(
        description="Number of the speed set for acceleration; null where the pattern was never set."
    )
    deceleration_set: int | None
    changes: list[SpeedChangeInfo] | None = Field(
        description="Kept in RAM only; null where the body cannot work them out: its speed sets are not "
        "complete, or the changes do not suit them."
    )
    flash: PatternSets | None = Field(description="Sets in flash memory; null where that is not known.")


class ChangedPattern(Pattern):
    """A pattern as it was read back after a change."""

    steps: list[ChangeStep] = Field(description="Steps of the change, in order.")


class PatternList(AnswerModel):
    """Acceleration patterns of a body."""

    body_id: str
    patterns: list[Pattern] = Field(description="Patterns in the order of their numbers.")


def _point_item(number: int, point: int) -> Item:
    place = {"pattern": number, "point": point}
    codec = SettingCodec(
        _change_in,
        lambda change: {"speed": change["speed_pps"], "begin": change.get("begin"), "end": change.get("end")},
    )
    return Item(f"changes.{point}", GetSpeedChange(**place), SetSpeedChange, codec, place, _UNREADABLE)


def _change_in(reply: SpeedChangePoint) -> dict[str, Any] | None:
    if reply.speed is None:
        return None
    return {"begin": reply.begin, "end": reply.end, "speed_pps": reply.speed}


def _clearing_item(number: int, point: int) -> Item:
    """A point that shall not be: only all of a pattern can be cleared together (SES)."""
    codec = SettingCodec(_change_in, lambda _: {})
    question = GetSpeedChange(pattern=number, point=point)
    return Item("changes", question, SetSpeedChange, codec, {"pattern": number}, _UNREADABLE)


async def read_pattern(body: AskedBody, number: int) -> Pattern:
    """Ask a body for a pattern (SPD) and, where it is set, its speed changes (SED).

    :raises GatewayError: it was not read.
    """
    item = sets_item(number)
    sets = await read(body, item)
    return Pattern(
        body_id=body.address,
        number=number,
        **(sets or {"acceleration_set": None, "deceleration_set": None}),
        changes=[] if sets is None or number == STANDARD else await _read_changes(body, number),
        flash=item.value_in(body.flash.held(item.question)),
    )


async def _read_changes(body: AskedBody, number: int) -> list[SpeedChangeInfo] | None:
    changes: list[SpeedChangeInfo] = []
    for point in POINTS:
        found = await read(body, _point_item(number, point))
        if found == NOT_READABLE:
            return None
        if found is not None:
            changes.append(
                SpeedChangeInfo(
                    point=point,
                    **found,
                    begin_in_unit=Scaled.of(found["begin"], body.scale),
                    end_in_unit=Scaled.of(found["end"], body.scale),
                    speed=Scaled.of(found["speed_pps"], body.scale, "/s"),
                )
            )
    return changes


async def read_patterns(body: AskedBody, numbers: Iterable[int]) -> list[Pattern]:
    """Ask a body for patterns, one after the other; errors as of `read_pattern`."""
    return [await read_pattern(body, number) for number in numbers]


async def alter_pattern(
    body: AskedBody,
    number: int,
    wanted: PatternValues | PatternChange,
    expects: Expectation | None,
    *,
    flash: bool,
) -> ChangedPattern:
    """Set what differs, and read it back; errors as of `changes.change`.

    :raises InvalidRequest: it is the standard pattern, one of two sets is missing, or the changes of speed do
        not suit the sets; nothing was sent.
    """
    async with body.looking():
        told = await as_expected(body, lambda: read_pattern(body, number), expects)
        present = await read_pattern(body, number)
    if _stays(present, wanted):
        return ChangedPattern(**dict(present), steps=[])
    if number == STANDARD or STANDARD in (wanted.acceleration_set, wanted.deceleration_set):
        raise InvalidRequest(
            "Pattern 30 is the standard one, always made of speed set 30 alone; only questions were sent."
        )
    sets = _sets_of(present, wanted)
    if wanted.changes:
        await _require_fit(body, sets, wanted.changes)
    steps = await change(body, list(_wanted(present, sets, wanted.changes)), flash=flash, told=told)
    return ChangedPattern(**dict(await read_pattern(body, number)), steps=steps)


def _stays(present: Pattern, wanted: PatternValues | PatternChange) -> bool:
    """True if a pattern that no command can write is wanted as it is: the standard one, or one never set."""
    fixed = present.number == STANDARD or present.acceleration_set is None
    same = (getattr(wanted, name) in (None, getattr(present, name)) for name in PatternSets.model_fields)
    return fixed and wanted.told != {} and not wanted.changes and all(same)


def _sets_of(present: Pattern, wanted: PatternValues | PatternChange) -> dict[str, int]:
    """The speed sets that the pattern shall have.

    :raises InvalidRequest: it has none, and one of them is not named.
    """
    named = {name: getattr(wanted, name) for name in PatternSets.model_fields}
    sets = {name: getattr(present, name) if number is None else number for name, number in named.items()}
    if None in sets.values():
        raise InvalidRequest(
            f"Pattern {present.number} was never set; only questions were sent.",
            "Give acceleration_set and deceleration_set.",
        )
    return sets


async def _require_fit(
    body: AskedBody, sets: Mapping[str, int], changes: Sequence[SpeedChangeRequest]
) -> None:
    """Work out changes of speed as the controller does when it moves (RC-420 manual 13.3.7).

    :raises InvalidRequest: a move would be refused for them.
    """
    try:
        up = await parameters_of(body, sets["acceleration_set"])
        down = await parameters_of(body, sets["deceleration_set"])
        resolve_changes(up, down, [change.planned() for change in sorted(changes, key=attrgetter("point"))])
    except ProfileError as error:
        raise InvalidRequest(
            f"Moves with this pattern would be refused: {error} Only questions were sent."
        ) from None


def _wanted(
    present: Pattern, sets: Mapping[str, int], changes: Sequence[SpeedChangeRequest] | None
) -> Iterator[Wanted]:
    yield sets_item(present.number), sets
    if changes is None:
        return
    points = {change.point for change in changes}
    there = POINTS if present.changes is None else [change.point for change in present.changes]
    surplus = [point for point in there if point not in points or present.changes is None]
    if surplus:
        yield _clearing_item(present.number, surplus[0]), None
    for wanted in sorted(changes, key=attrgetter("point")):
        yield _point_item(present.number, wanted.point), wanted.place()


@ROWS.get("/bodies/{body_id}/patterns")
async def list_patterns(body: AskedBody, *, first: First = 0, last: Last = STANDARD) -> PatternList:
    """Ask a body for its acceleration patterns: one frame for each, and sixteen more for one that is set."""
    return PatternList(body_id=body.address, patterns=await read_patterns(body, numbers_of(first, last)))


@ROWS.get("/bodies/{body_id}/patterns/{n}", tagged=True)
async def get_pattern(body: AskedBody, n: PatternNumber) -> Pattern:
    """Ask a body for an acceleration pattern (SPD) with its speed changes (SED)."""
    return await read_pattern(body, n)


@ROWS.put("/bodies/{body_id}/patterns/{n}", Right.SETUP, tagged=True)
async def set_pattern(
    body: AskedBody,
    n: PatternNumber,
    values: PatternValues,
    *,
    flash: Flash = False,
    expects: Expectation | None,
) -> ChangedPattern:
    """Set what differs of a pattern and its speed changes, and read it back; refused while the motor moves.

    Where a change shall go, all are cleared (SES) and those that stay are set again.
    """
    return await alter_pattern(body, n, values, expects, flash=flash)


@ROWS.patch("/bodies/{body_id}/patterns/{n}", Right.SETUP, tagged=True)
async def change_pattern(
    body: AskedBody,
    n: PatternNumber,
    change: PatternChange,
    *,
    flash: Flash = False,
    expects: Expectation | None,
) -> ChangedPattern:
    """Set what differs of what is named, and read it back; refused while the motor moves."""
    return await alter_pattern(body, n, change, expects, flash=flash)
