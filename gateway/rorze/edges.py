"""Edges of a body's sensors and inputs: what has changed since it was last told, by whatever frame."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from protocols.rorze.inputs_outputs import Inputs, Sensors
from protocols.rorze.status import SENSOR_BITS
from protocols.table import Reply

INPUTS: Final = range(10)


@dataclass(eq=False)
class SensorEdges:
    """The sensors and inputs of one body as they were last told; what is told first is no edge."""

    _input_names: Mapping[int, str]
    _tell: Callable[[str, dict[str, object]], None]
    """Type and data of an event."""
    _sensors: int | None = field(default=None, init=False)
    _inputs: int | None = field(default=None, init=False)

    def read(self, reply: Reply) -> None:
        """It has answered a question for all of them (CLD, CID)."""
        if isinstance(reply, Sensors) and reply.bits is not None:
            self._saw_sensors(reply.bits)
        elif isinstance(reply, Inputs) and reply.bits is not None:
            self._saw_inputs(reply.bits)

    def reported(self, fields: Mapping[str, int]) -> None:
        """It has reported a change unasked (frame 7E)."""
        if "S" in fields:
            self._saw_sensors(fields["S"])
        if "I" in fields:
            self._saw_inputs(fields["I"])

    def _saw_sensors(self, bits: int) -> None:
        before, self._sensors = self._sensors, bits
        for number in _changed(before, bits, range(len(SENSOR_BITS))):
            on = bool(bits >> number & 1)
            self._tell("body.sensor.changed", {"sensor": SENSOR_BITS[number], "on": on})

    def _saw_inputs(self, bits: int) -> None:
        before, self._inputs = self._inputs, bits
        for number in _changed(before, bits, INPUTS):
            name, on = self._input_names.get(number), bool(bits >> number & 1)
            self._tell("body.input.changed", {"number": number, "name": name, "on": on})


def _changed(before: int | None, now: int, numbers: range) -> list[int]:
    return [] if before is None else [number for number in numbers if (before ^ now) >> number & 1]
