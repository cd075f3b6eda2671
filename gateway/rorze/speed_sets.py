"""The speed parameter sets S[0] to S[29] of a body, and the standard one, 30 (RC-420 manual 13.3.1)."""

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeVar

from pydantic import BaseModel, Field, model_validator
from typing_extensions import TypeAliasType

from gateway.core.errors import InvalidRequest
from gateway.core.operation import Expectation, Rows
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody
from gateway.rorze.changes import ChangeStep, Flash, Item, SettingCodec, as_expected, change, plain, read
from gateway.rorze.units import Scaled
from protocols.rorze import speeds
from protocols.rorze.patterns import GetPattern, SetPattern
from protocols.rorze.profile import SpeedParameters

STANDARD: Final = 30
"""The set, and the pattern, that a command means when it names none (RC-420 manual 13.3.4)."""

Speed = TypeAliasType("Speed", Literal["high", "low"])
"""The speed of a move: `low` is the start speed, without ramps."""
ROWS: Final = Rows("body settings")
NOT_SET: Final = "0x47"
"""Refusal of a pattern that was never set (RC-420 manual 21)."""
SetNumber = Annotated[
    int, Field(ge=0, le=STANDARD, description="0-29, or 30: the standard set.", examples=[12])
]
First = Annotated[int, Field(ge=0, le=STANDARD, description="The first of the list.")]
Last = Annotated[int, Field(ge=0, le=STANDARD, description="The last of the list.")]
StartSpeed = Annotated[speeds.StartSpeed, Field(description="OL: 1 to 30,000 pps; 50 at first.")]
MaximumSpeed = Annotated[
    int, Field(ge=1, le=1_000_000, description="OH: 1 to 1,000,000 pps; 50,000 at first.")
]
Acceleration = Annotated[
    speeds.Acceleration, Field(description="OS: 1 to 10,000,000 pps/s; 100,000 at first.")
]
Rising = Annotated[
    speeds.Percent,
    Field(description="OA: percent of the ramp's time in which the acceleration rises; 50 at first."),
]
Falling = Annotated[
    speeds.Percent,
    Field(description="OB: percent of the ramp's time in which it falls; 50 at first."),
]


_EXAMPLE: Final = example(
    start_speed_pps=5_000,
    maximum_speed_pps=50_000,
    acceleration_pps_s=100_000,
    rising_percent=50,
    falling_percent=50,
)


_ROWS: Final[dict[str, tuple[type[Any], type[Any], str]]] = {
    "start_speed_pps": (speeds.GetStartSpeed, speeds.SetStartSpeed, "speed"),
    "maximum_speed_pps": (speeds.GetMaximumSpeed, speeds.SetMaximumSpeed, "speed"),
    "acceleration_pps_s": (speeds.GetMaximumAcceleration, speeds.SetMaximumAcceleration, "acceleration"),
    "rising_percent": (speeds.GetRisingAccelerationShare, speeds.SetRisingAccelerationShare, "percent"),
    "falling_percent": (speeds.GetFallingAccelerationShare, speeds.SetFallingAccelerationShare, "percent"),
}
SPEEDS: Final = set(_ROWS)
"""The parameters of a set."""
SHARES: Final = ("rising_percent", "falling_percent")
"""The parameters of which 0 is a value."""
OF_THE_SET: Final = frozenset(
    ("body_id", "number", "start_speed", "maximum_speed", "acceleration", "flash", "steps")
)
"""Facts of a speed set beside its parameters."""
M = TypeVar("M", bound=BaseModel)


def go_together(request: M) -> M:
    """Refuse what no move could use, as far as it is given (RC-420 manual 21, 45 and 46).

    :raises ValueError: the start speed is above the maximum, or the shares exceed 100 % together.
    """
    values = request.model_dump(include=SPEEDS)
    low, high = values["start_speed_pps"], values["maximum_speed_pps"]
    if low is not None and high is not None and low > high:
        raise ValueError("start_speed_pps must not be above maximum_speed_pps")
    if (values["rising_percent"] or 0) + (values["falling_percent"] or 0) > 100:
        raise ValueError("rising_percent and falling_percent must not exceed 100 together")
    return request


class SpeedSetValues(RequestModel, json_schema_extra=_EXAMPLE):
    """The five parameters of a set."""

    start_speed_pps: StartSpeed
    maximum_speed_pps: MaximumSpeed
    acceleration_pps_s: Acceleration
    rising_percent: Rising
    falling_percent: Falling

    _go_together = model_validator(mode="after")(go_together)

    def parameters(self) -> SpeedParameters:
        """As moves use them.

        :raises ProfileError: they do not go together.
        """
        return SpeedParameters(*self.model_dump().values())


class SpeedSetChange(SentBack, json_schema_extra=example(maximum_speed_pps=20_000)):
    """Parameters of a set to change; the others stay as they are."""

    read_only = OF_THE_SET
    null_unset = frozenset(_ROWS)

    start_speed_pps: StartSpeed | None = None
    maximum_speed_pps: MaximumSpeed | None = None
    acceleration_pps_s: Acceleration | None = None
    rising_percent: Rising | None = None
    falling_percent: Falling | None = None

    _go_together = model_validator(mode="after")(go_together)


class SpeedSetWanted(SpeedSetChange, json_schema_extra=_EXAMPLE):
    """The five parameters of a set; null, as GET gives it, is one that was never set, and stays so."""

    start_speed_pps: StartSpeed | None
    maximum_speed_pps: MaximumSpeed | None
    acceleration_pps_s: Acceleration | None
    rising_percent: Rising | None
    falling_percent: Falling | None


class InFlash(AnswerModel):
    """The parameters in flash memory."""

    start_speed_pps: int | None
    maximum_speed_pps: int | None
    acceleration_pps_s: int | None
    rising_percent: int | None
    falling_percent: int | None


class SpeedSet(AnswerModel):
    """A speed parameter set as the body holds it in RAM; null is what was never set."""

    body_id: str
    number: int = Field(description="0-29, or 30: the standard set.")
    start_speed_pps: int | None = Field(description="OL, 1-30,000.")
    maximum_speed_pps: int | None = Field(description="OH, 1-1,000,000.")
    acceleration_pps_s: int | None = Field(description="OS, 1-10,000,000.")
    rising_percent: int | None = Field(
        description="OA, 0-100. The controller tells one that was never set as 0: null where it does so in a "
        "set that has no speeds either."
    )
    falling_percent: int | None = Field(description="OB, 0-100; null as `rising_percent`.")
    start_speed: Scaled | None = Field(description="Start speed in the body's unit; null without a scale.")
    maximum_speed: Scaled | None
    acceleration: Scaled | None
    flash: InFlash | None = Field(
        description=(
            "Values in flash memory, as far as is known; null where the gateway has seen neither the power "
            "come on nor FIS."
        )
    )


class ChangedSpeedSet(SpeedSet):
    """A set as it was read back after a change."""

    steps: list[ChangeStep] = Field(description="Steps of the change, in order.")


class SpeedSetList(AnswerModel):
    """Speed parameter sets of a body."""

    body_id: str
    speed_sets: list[SpeedSet] = Field(description="Sets in the order of their numbers.")


def items_of(number: int) -> dict[str, Item]:
    """The parameters of a set, by their names."""
    place = {"speed_set": None if number == STANDARD else number}
    return {
        name: Item(name, query(**place), setter, plain(field), place)
        for name, (query, setter, field) in _ROWS.items()
    }


async def read_set(body: AskedBody, number: int) -> SpeedSet:
    """Ask a body for a set (OLD, OHD, OSD, OAD, OBD).

    :raises GatewayError: it was not read.
    """
    items = items_of(number)
    values = _known(body, items, {name: await read(body, item) for name, item in items.items()})
    held = {name: item.value_in(body.flash.held(item.question)) for name, item in items.items()}
    return SpeedSet(
        body_id=body.address,
        number=number,
        **values,
        start_speed=Scaled.of(values["start_speed_pps"], body.scale, "/s"),
        maximum_speed=Scaled.of(values["maximum_speed_pps"], body.scale, "/s"),
        acceleration=Scaled.of(values["acceleration_pps_s"], body.scale, "/s2"),
        flash=InFlash(**held) if body.flash.known else None,
    )


def _known(body: AskedBody, items: Mapping[str, Item], read: Mapping[str, int]) -> dict[str, int | None]:
    """Give the values without those that were never set, which a controller tells as 0."""
    unset = {name for name, value in read.items() if value == 0 and name not in SHARES}
    if len(unset) == len(items) - len(SHARES):
        unset |= {
            share for share in SHARES if not read[share] and body.flash.may_be_unset(items[share].command(0))
        }
    return {name: None if name in unset else value for name, value in read.items()}


async def change_set(
    body: AskedBody,
    number: int,
    wanted: SpeedSetChange,
    expects: Expectation | None,
    *,
    flash: bool,
) -> ChangedSpeedSet:
    """Set what differs, and read it back; errors as of `changes.change`."""
    told = await as_expected(body, lambda: read_set(body, number), expects)
    items = items_of(number)
    values = [(items[name], value) for name, value in wanted if value is not None]
    steps = await change(body, values, flash=flash, told=told)
    return ChangedSpeedSet(**dict(await read_set(body, number)), steps=steps)


async def parameters_of(body: AskedBody, number: int) -> SpeedParameters:
    """A set as moves use it.

    :raises ProfileError: it is not complete, or its values do not go together.
    :raises GatewayError: it was not read.
    """
    values = [await read(body, item) for item in items_of(number).values()]
    return SpeedParameters(*values)


@ROWS.get("/bodies/{body_id}/speed-sets")
async def list_speed_sets(body: AskedBody, *, first: First = 0, last: Last = STANDARD) -> SpeedSetList:
    """Ask a body for its speed parameter sets, five frames for each."""
    found = [await read_set(body, number) for number in numbers_of(first, last)]
    return SpeedSetList(body_id=body.address, speed_sets=found)


@ROWS.get("/bodies/{body_id}/speed-sets/{n}", tagged=True)
async def get_speed_set(body: AskedBody, n: SetNumber) -> SpeedSet:
    """Ask a body for a speed parameter set (OLD, OHD, OSD, OAD, OBD)."""
    return await read_set(body, n)


@ROWS.put("/bodies/{body_id}/speed-sets/{n}", Right.SETUP, tagged=True)
async def set_speed_set(
    body: AskedBody,
    n: SetNumber,
    values: SpeedSetWanted,
    *,
    flash: Flash = False,
    expects: Expectation | None,
) -> ChangedSpeedSet:
    """Set the parameters of a set that differ, and read each back; refused while the motor moves."""
    return await change_set(body, n, values, expects, flash=flash)


@ROWS.patch("/bodies/{body_id}/speed-sets/{n}", Right.SETUP, tagged=True)
async def change_speed_set(
    body: AskedBody,
    n: SetNumber,
    change: SpeedSetChange,
    *,
    flash: Flash = False,
    expects: Expectation | None,
) -> ChangedSpeedSet:
    """Set those of the named parameters that differ, and read each back; refused while the motor moves."""
    return await change_set(body, n, change, expects, flash=flash)


def numbers_of(first: int, last: int) -> range:
    """The numbers of a list.

    :raises InvalidRequest: it ends before it begins.
    """
    if last < first:
        raise InvalidRequest(f"last: it is less than first, {first}; nothing was sent.")
    return range(first, last + 1)


def sets_item(number: int) -> Item:
    """The two speed sets that a pattern is made of."""
    place = {"pattern": None if number == STANDARD else number}
    codec = SettingCodec(
        lambda reply: {"acceleration_set": reply.acceleration, "deceleration_set": reply.deceleration},
        lambda sets: {"acceleration": sets["acceleration_set"], "deceleration": sets["deceleration_set"]},
    )
    return Item("speed_sets", GetPattern(**place), SetPattern, codec, place, {NOT_SET: None})
