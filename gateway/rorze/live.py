"""Where bodies stand, and how their inputs and outputs are, for their watchers."""

import asyncio
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import ClassVar, Self, cast

from pydantic import Field

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.core.event_types import IO, EventData, Signal, Signals
from gateway.core.exchange import Lane
from gateway.core.live import Live
from gateway.core.move_record import CountedIn
from gateway.core.records import Record
from gateway.core.sampler import IO_HZ, LiveSource
from gateway.rorze.bodies import POSITION, Body, R
from gateway.rorze.probes import Sweep, SweepAnswer
from protocols.rorze.inputs_outputs import GetInputs, GetOutputs
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import CONTROLLER_STATUS_BITS, names_of

INPUTS, OUTPUTS = range(10), range(16)
FRESH = 0.5
"""Share of the time between two values within which a value that was read for another reader is fresh."""


class BodyPosition(EventData):
    """Where a motor stands (6PD)."""

    pulses: int = Field(description="Or encoder counts: see `counted_in`.")
    counted_in: CountedIn | None = Field(
        description="Unit of `pulses`; null where its operating mode could not be read."
    )
    value: float | None = Field(description="Position in `unit`; null without a scale.")
    unit: str | None


@dataclass(eq=False)
class LiveBody(LiveSource):
    """Values of one body; enough of those that are due with it are asked for by their group."""

    body: Body
    sweep: Sweep
    live: Live
    samples_hz: float = 0.0
    """Readings a second during a move."""
    subject: str = field(init=False)

    def __post_init__(self) -> None:
        self.subject = f"/bodies/{self.body.address}"

    def company(self, due: Sequence[LiveSource]) -> dict[Body, Self]:
        """The values that one frame asks for, by their bodies."""
        alike = {source.body: source for source in self.among(due)}
        group = self.sweep.group_for(self.body, alike)
        return {
            body: source
            for body, source in alike.items()
            if body is self.body or (group and body in group.members)
        }

    async def ask(self, bodies: Sequence[Body], command: RorzeCommand[R]) -> dict[Body, tuple[R, float]]:
        """Ask bodies the same, behind everybody else, and give what each has told, and when.

        :raises GatewayError: this one has not told it.
        """
        told = await self.sweep.ask(bodies, command, Lane.BACKGROUND)
        if isinstance(refusal := told[self.body], GatewayError):
            raise refusal
        return {
            body: (cast("R", answer.reply), answer.at)
            for body, answer in told.items()
            if isinstance(answer, SweepAnswer)
        }


class PositionSource(LiveBody):
    """Where a body stands (6PD)."""

    type: ClassVar = "body.position"

    @property
    def own_hz(self) -> float:
        """While it moves, that of the samples which are kept with the move."""
        return 0.0 if self.body.motion.trajectory is None else self.samples_hz

    async def read(self, due: Sequence[LiveSource]) -> list[LiveSource]:
        """Put a fresh value that was read for another reader, or ask."""
        if self.body.told.mode is None:
            with suppress(ControllerRefused):
                await self.ask(
                    [source for source in self.company(due) if source.told.mode is None], GetOperatingMode()
                )
        if self._put_if_fresh():
            return [self]
        sources = self.company(due)
        told = await self.ask(list(sources), POSITION)
        for body, (reply, at) in told.items():
            sources[body].put(reply.pulses, at)
        return [sources[body] for body in told]

    def _put_if_fresh(self) -> bool:
        body, hz = self.body, max(self.live.rate(self.type, self.subject), self.own_hz)
        place = body.told.place
        if place is None or hz <= 0 or asyncio.get_running_loop().time() - place.at > FRESH / hz:
            return False
        self.put(*place)
        return True

    def put(self, pulses: int, at: float) -> None:
        """Tell where it stood."""
        scale = self.body.scale
        position = BodyPosition(
            pulses=pulses,
            counted_in=self.body.counted_in,
            value=scale.value(pulses) if scale else None,
            unit=scale.unit if scale else None,
        )
        self.live.put(self.type, self.subject, position, at)


class SignalSource(LiveBody):
    """A body's general inputs and outputs (CID, COD)."""

    type: ClassVar = IO
    most_hz: ClassVar = IO_HZ

    async def read(self, due: Sequence[LiveSource]) -> list[LiveSource]:
        """Ask, and put what was told."""
        sources = self.company(due)
        inputs = await self.ask(list(sources), GetInputs())
        outputs = await self.ask(list(sources), GetOutputs())
        both = inputs.keys() & outputs.keys()
        for body in both:
            signals = Signals(
                inputs=_signals(INPUTS, body.input_names, inputs[body][0].bits or 0),
                outputs=_signals(OUTPUTS, body.configured.output_names, outputs[body][0].bits or 0),
            )
            self.live.put(self.type, sources[body].subject, signals, inputs[body][1])
        return [sources[body] for body in both]


def _signals(numbers: range, names: Mapping[int, str], bits: int) -> list[Signal]:
    return [Signal(number=number, name=names.get(number), on=bool(bits >> number & 1)) for number in numbers]


class BodyNow(Record):
    """A body, as far as is known."""

    body_id: str
    online: bool
    moving: bool | None
    move_id: str | None
    counted_in: CountedIn | None = Field(description="Unit of the position; null where that is not known.")
    position: int | None = Field(description="Position as last read, in `counted_in`.")
    homed: str
    power_cycled: bool
    status: list[str] | None

    @classmethod
    def of(cls, body: Body) -> Self:
        """Tell it without asking the controller."""
        bits = body.told.status_bits
        return cls(
            body_id=body.address,
            online=body.online,
            moving=body.moving if body.online else None,
            move_id=None if body.move is None else body.move.id,
            counted_in=body.counted_in,
            position=body.told.position,
            homed=body.power.homed,
            power_cycled=body.power.cycled,
            status=None if bits is None else names_of(bits, CONTROLLER_STATUS_BITS),
        )
