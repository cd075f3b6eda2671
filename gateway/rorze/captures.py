"""Captures: an edge on input 8 or 9 records where the motor is, once in a move (RC-420 manual 13.9.4)."""

import asyncio
from collections.abc import Collection, Mapping, Sequence
from typing import Annotated, Final, Literal, NamedTuple, Self

from pydantic import BaseModel, Field, model_validator

from gateway.core.errors import GatewayError, InvalidRequest, PowerCycled
from gateway.core.exchange import Lane
from gateway.core.operation import Rows, Wait
from gateway.core.records import AnswerModel, RequestModel, SentBack, example, require_same
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody, read_pulses
from gateway.rorze.units import Length
from protocols.rorze.inputs_outputs import (
    GetInterruptAction,
    GetInterruptMode,
    GetInterruptRange,
    SetInterruptAction,
    SetInterruptMode,
    SetInterruptRange,
)
from protocols.rorze.notation import BILLION, Bounds, PositionReference
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack

INPUTS: Final = (8, 9)
NOTHING_YET: Final = 1 - BILLION
"""Written into the entries when a capture is armed: the controller's own 0 could be a position."""
EVERYWHERE: Final = Bounds(lower=1 - BILLION, upper=BILLION - 1)
ARM_WITHIN_S: Final = 5.0

ROWS: Final = Rows("captures")
Port = Annotated[int, Field(ge=8, le=9, description="Input that can interrupt, 8 or 9.", examples=[8])]
Edge = Literal["off", "falling", "rising"]
Kind = Literal["position", "encoder", "encoder_in_pulses"]
KINDS: Final[tuple[Kind, ...]] = ("position", "encoder", "encoder_in_pulses")
Entry = Annotated[int, Field(ge=0, le=2047)]


class Section(RequestModel):
    """The stretch of positions in which an edge counts."""

    lower: Length | int = Field(
        description="A number alone, as GET gives it, is in pulses; encoder counts in encoder mode."
    )
    upper: Length | int

    def bounds(self, body: AskedBody) -> Bounds:
        """The length in pulses.

        :raises InvalidRequest: it is empty, too long, or in another unit.
        """
        ends = (self.lower, self.upper)
        lower, upper = (end if isinstance(end, int) else end.pulses(body.scale) for end in ends)
        if not -BILLION < lower < upper < BILLION:
            raise InvalidRequest(f"between: {lower} to {upper} is no stretch of positions; nothing was sent.")
        return Bounds(lower=lower, upper=upper)


class CapturePulse(RequestModel):
    """A pulse that the edge sets off. Arming gives the output the opposite state."""

    output: int = Field(ge=0, le=7, description="General output, 0-7.")
    on: bool = Field(description="State of the output during the pulse.")
    duration_ms: int = Field(ge=1, le=30_000)


class EntryToRecord(SentBack):
    """An entry of the position table that takes a value, as GET gives it."""

    read_only = frozenset(("pulses", "value", "unit"))

    kind: Kind
    number: Entry


class CaptureRequest(SentBack, json_schema_extra=example(edge="rising", position=25)):
    """Actions of an edge in the next move; an action that is left out is not done."""

    read_only = frozenset(("body_id", "input", "name", "armed", "captured"))

    edge: Edge = Field(description="`off` only of what is not armed, as GET gives it; DELETE disarms.")
    position: Entry | None = Field(None, description="Position number that takes the position.")
    encoder: Entry | None = Field(None, description="Position number that takes the encoder count.")
    encoder_in_pulses: Entry | None = Field(
        None, description="Position number that takes the encoder count converted to pulses."
    )
    recorded: list[EntryToRecord] | None = Field(
        None, max_length=len(KINDS), description="The three numbers as GET gives them, in their place."
    )
    pulse: CapturePulse | None = None
    between: Section | None = Field(
        None, description="Numbers of the three entries as GET gives them, each in its place."
    )

    def entries(self) -> dict[Kind, int]:
        """The numbers that take values, by what they take."""
        numbers: dict[Kind, int | None] = {entry.kind: entry.number for entry in self.recorded or ()} or {
            "position": self.position,
            "encoder": self.encoder,
            "encoder_in_pulses": self.encoder_in_pulses,
        }
        return {kind: number for kind in KINDS if (number := numbers.get(kind)) is not None}

    def require_unchanged(self, present: BaseModel) -> None:
        """Refuse what cannot be set and is otherwise, of the entries, too; errors as of `require_same`."""
        super().require_unchanged(present)
        held = {entry.kind: entry for entry in getattr(present, "recorded", ())}
        for entry in self.recorded or ():
            require_same(entry.told, held.get(entry.kind), f"recorded.{entry.kind}.")

    @model_validator(mode="after")
    def _do_something_once(self) -> Self:
        numbers = list(self.entries().values())
        if self.recorded and {self.position, self.encoder, self.encoder_in_pulses} != {None}:
            raise ValueError("give recorded, or the numbers, not both")
        if not numbers and self.pulse is None and self.edge != "off":
            raise ValueError("name a position number that takes a value, or a pulse")
        if len(set(numbers)) < len(numbers):
            raise ValueError("a position number can take one value only")
        return self


class CaptureTarget(NamedTuple):
    """An entry of the position table that takes a value."""

    kind: Kind
    number: int
    value: int | None
    """Value at the edge; None: no edge has come since it was armed."""


class Capture(NamedTuple):
    """How an input is set up to capture, and what it has captured."""

    input: int
    edge: Edge
    """The edge that it waits for; off: it is not armed, or not any more."""
    between: Bounds | None
    recorded: tuple[CaptureTarget, ...]
    pulse: CapturePulse | None

    @property
    def captured(self) -> bool | None:
        """True if an edge has come; None where no entry tells."""
        return any(entry.value is not None for entry in self.recorded) if self.recorded else None

    @property
    def is_over(self) -> bool:
        """True if nothing more will come: it has captured, or is not armed."""
        return self.edge == "off" or bool(self.captured)


class ArmingBrokenOff(GatewayError):
    """An input is set up in part: it may capture in the next move, or not."""

    kind = "arming-broken-off"

    def __init__(self, address: str, port: int, cause: GatewayError) -> None:
        super().__init__(
            f"Input {port} of {address} is set up in part, then it was broken off: "
            f"{cause.title[0].lower()}{cause.title[1:]}.",
            "Arm it again, or disarm it.",
        )


async def read(body: AskedBody, port: int) -> Capture:
    """Read how an input is set up (CPD, CFD, CSD), and the entries that take values (3ND).

    :raises GatewayError: it was not read.
    """
    mode, _ = await body.ask(GetInterruptMode(port=port))
    bounds, _ = await body.ask(GetInterruptRange(port=port))
    pulse, _ = await body.ask(GetInterruptAction(port=port, pulsed="output"))
    recorded: list[CaptureTarget] = []
    for kind in KINDS:
        action, _ = await body.ask(GetInterruptAction(port=port, recorded=kind))
        if action.number is not None:
            recorded.append(await _recorded(body, kind, action.number))
    return Capture(
        port,
        mode.edge,
        None if bounds == EVERYWHERE else bounds,
        tuple(recorded),
        None
        if pulse.output is None or pulse.duration_ms is None
        else CapturePulse(output=pulse.output, on=bool(pulse.state), duration_ms=pulse.duration_ms),
    )


async def arm(body: AskedBody, port: int, wanted: CaptureRequest) -> Capture:
    """Let an input capture in the next move, undivided (CSS, CFS, CPS), and mark the entries.

    :raises InvalidRequest: the stretch is none, or the other input takes a value in the same entry.
    :raises ArmingBrokenOff: a stop, or the line, has divided it.
    :raises GatewayError: it was refused, as while the motor moves, or not sent; nothing was changed.
    """
    bounds = None if wanted.between is None else wanted.between.bounds(body)
    entries, pulse = wanted.entries(), wanted.pulse
    await _require_free(body, port, entries.values())
    commands = [
        SetInterruptRange(port=port)
        if bounds is None
        else SetInterruptRange(port=port, lower=bounds.lower, upper=bounds.upper),
        *_recording(port, entries),
        SetInterruptAction(port=port, pulsed="output")
        if pulse is None
        else SetInterruptAction(
            port=port,
            pulsed="output",
            output=pulse.output,
            state=int(pulse.on),
            duration_ms=pulse.duration_ms,
        ),
        SetInterruptMode(port=port, edge=wanted.edge),
        *(
            SetPositionEntry(entry=PositionReference(position=number), pulses=NOTHING_YET)
            for number in entries.values()
        ),
    ]
    await _set_up(body, port, commands)
    return await read(body, port)


async def disarm(body: AskedBody, port: int) -> Capture:
    """Let an input capture nothing (CPS), and forget its entries (CFS).

    The controller sets them to 0, which was not captured.

    :raises ArmingBrokenOff: a stop, or the line, has divided it.
    :raises GatewayError: it was refused, as while the motor moves, not sent, or not answered.
    """
    await _set_up(body, port, [SetInterruptMode(port=port, edge="off"), *_recording(port, {})])
    return await read(body, port)


async def _require_free(body: AskedBody, port: int, entries: Collection[int]) -> None:
    """Make sure that the other input does not wait to take a value in one of these entries.

    :raises InvalidRequest: it does.
    """
    [other] = (other for other in INPUTS if other != port)
    mode, _ = await body.ask(GetInterruptMode(port=other))
    if mode.edge == "off" or not entries:
        return
    taken = {entry.number for entry in (await read(body, other)).recorded}.intersection(entries)
    if taken:
        number = min(taken)
        raise InvalidRequest(
            f"Position {number} of {body.address} takes what input {other} captures; nothing was changed.",
            "Name another position, or disarm that input.",
        )


def _recording(port: int, entries: Mapping[Kind, int]) -> list[SetInterruptAction]:
    """The entry in which each kind of value is recorded; empty where none is named."""
    return [SetInterruptAction(port=port, recorded=kind, number=entries.get(kind)) for kind in KINDS]


async def _set_up(body: AskedBody, port: int, commands: Sequence[RorzeCommand[Ack]]) -> None:
    """Send all of them undivided; errors as of `arm`."""
    expires_at = asyncio.get_running_loop().time() + ARM_WITHIN_S
    with body.line.sending(body.number, commands):
        async with body.line.undivided([body.number], expires_at):
            for done, command in enumerate(commands):
                try:
                    await body.ask(command)
                except GatewayError as error:
                    if done:
                        raise ArmingBrokenOff(body.address, port, error) from error
                    raise


async def when_over(body: AskedBody, port: int, within_s: float) -> Capture:
    """Give a capture when an edge has come, or none will come any more; or as it is when the time is up.

    :raises PowerCycled: the body was switched off and on meanwhile: what its entries hold was not captured.
    :raises GatewayError: it was not read.
    """
    loop = asyncio.get_running_loop()
    until, losses = loop.time() + within_s, body.power.losses
    capture = await read(body, port)
    while not capture.is_over and loop.time() < until:
        await asyncio.sleep(min(body.poll_interval_s, max(0.0, until - loop.time())))
        mode, _ = await body.ask(GetInterruptMode(port=port))
        recorded = [await _recorded(body, entry.kind, entry.number) for entry in capture.recorded]
        capture = capture._replace(edge=mode.edge, recorded=tuple(recorded))
        if capture.is_over and (await body.mark.stands(Lane.READ) is False or body.power.losses != losses):
            raise PowerCycled(
                f"{body.address} has been switched off and on: input {port} has captured nothing.",
                "See to its power, then arm it again.",
            )
    return capture


async def _recorded(body: AskedBody, kind: Kind, number: int) -> CaptureTarget:
    pulses = await read_pulses(body, number)
    return CaptureTarget(kind, number, None if pulses == NOTHING_YET else pulses)


class CapturedValue(AnswerModel):
    """An entry of the position table that takes a value."""

    kind: Literal["position", "encoder", "encoder_in_pulses"]
    number: int = Field(description="Position number.")
    pulses: int | None = Field(
        description=(
            "Value in pulses; null until an edge comes; where another host has armed the input, 0. Encoder "
            "counts for `encoder`, and in encoder mode for `position`."
        )
    )
    value: float | None = Field(description="Value in `unit`; null without a scale, and for `encoder`.")
    unit: str | None


class CaptureBounds(AnswerModel):
    """The stretch of positions in which an edge counts."""

    lower: int = Field(description="Lower bound in pulses; encoder counts in encoder mode.")
    upper: int = Field(description="Upper bound, counted as `lower`.")


class CaptureState(AnswerModel):
    """How an input is set up to capture, and what it has captured."""

    body_id: str
    input: int
    name: str | None = Field(description="Name of the input in the configuration.")
    edge: Edge = Field(description="Edge that it waits for; off: it is not armed, or not any more.")
    armed: bool
    captured: bool | None = Field(
        description="True if an edge has set the values; null where no entry takes a value."
    )
    recorded: list[CapturedValue]
    pulse: CapturePulse | None
    between: CaptureBounds | None = Field(
        description="Positions between which an edge counts; null: everywhere."
    )


class CaptureList(AnswerModel):
    """The captures of both inputs."""

    body_id: str
    captures: list[CaptureState]


@ROWS.get("/bodies/{body_id}/captures")
async def list_captures(body: AskedBody) -> CaptureList:
    """Ask the controller how both inputs capture, and what they have captured (CPD, CFD, CSD, 3ND)."""
    return CaptureList(
        body_id=body.address, captures=[_state(body, await read(body, port)) for port in INPUTS]
    )


@ROWS.get("/bodies/{body_id}/captures/{port}")
async def get_capture(body: AskedBody, port: Port, *, wait: Wait = None) -> CaptureState:
    """Ask for a capture, at once or when an edge has come; a move that ends without one disarms it too."""
    return _state(body, await when_over(body, port, wait or 0.0))


@ROWS.put("/bodies/{body_id}/captures/{port}", Right.OPERATE)
async def arm_capture(body: AskedBody, port: Port, capture: CaptureRequest) -> CaptureState:
    """Let an input capture in the next move (CSS, CFS, CPS), once; refused while the motor moves.

    A capture that is sent back as GET gives it stays as it is, and nothing is sent.
    """
    if capture.told or capture.edge == "off":
        present = await read(body, port)
        state = _state(body, present)
        capture.require_unchanged(state)
        if _is_as(present, capture, body):
            return state
    return _state(body, await arm(body, port, capture))


def _is_as(present: Capture, wanted: CaptureRequest, body: AskedBody) -> bool:
    """True if an input is set up as it is wanted.

    :raises InvalidRequest: it is to be off, and is not so already; nothing was sent.
    """
    between = None if wanted.between is None else wanted.between.bounds(body)
    entries = {entry.kind: entry.number for entry in present.recorded}
    is_as = (present.edge, present.between, present.pulse, entries) == (
        *(wanted.edge, between, wanted.pulse),
        wanted.entries(),
    )
    if wanted.edge == "off" and not is_as:
        raise InvalidRequest("edge: off arms nothing; nothing was sent.", "Name an edge, or use DELETE.")
    return is_as


@ROWS.delete("/bodies/{body_id}/captures/{port}", Right.OPERATE)
async def disarm_capture(body: AskedBody, port: Port) -> CaptureState:
    """Let an input capture nothing (CPS), and forget its entries, which are set to 0 (CFS).

    Refused while the motor moves.
    """
    return _state(body, await disarm(body, port))


def _state(body: AskedBody, capture: Capture) -> CaptureState:
    bounds = capture.between
    recorded = []
    for kind, number, pulses in capture.recorded:
        scale = None if kind == "encoder" or pulses is None else body.scale
        recorded.append(
            CapturedValue(
                kind=kind,
                number=number,
                pulses=pulses,
                value=None if scale is None or pulses is None else scale.value(pulses),
                unit=None if scale is None else scale.unit,
            )
        )
    return CaptureState(
        body_id=body.address,
        input=capture.input,
        name=body.input_names.get(capture.input),
        edge=capture.edge,
        armed=capture.edge != "off",
        captured=capture.captured,
        recorded=recorded,
        pulse=capture.pulse,
        between=None if bounds is None else CaptureBounds(lower=bounds.lower, upper=bounds.upper),
    )
