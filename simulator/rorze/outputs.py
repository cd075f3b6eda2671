"""The outputs of one RC-420: general outputs, error outputs and the CLR signal (RC-420 manual 13.9)."""

from typing import NamedTuple

from simulator.rorze.axis import Axis
from simulator.rorze.settings import ErrorOutput

SERVO_MODE = 2

OUTPUTS = 16
ALL_OUTPUTS = (1 << OUTPUTS) - 1

CLEAR = OUTPUTS
"""The CLR signal, kept beside the general outputs; in servo mode it has the place of output 0."""

CLEAR_LOGIC = 6
"""The bit of DLS that turns the CLR signal round."""

ANY_ERROR = "any"
"""The error output that every error drives (CES)."""


class Pulse(NamedTuple):
    """A level that lasts until a moment."""

    level: bool
    ends_at: float


class Outputs:
    """A pulse hides the steady level of its output while it lasts; setting the output ends it."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._steady = axis.settings.outputs
        self._pulses: dict[int, Pulse] = {}
        self._driven: dict[str, ErrorOutput] = {}

    @property
    def steady(self) -> int:
        """The general outputs as they are without pulses, a bit an output."""
        return self._steady & ALL_OUTPUTS

    def bits(self) -> int:
        """The general outputs as they are now, a bit an output."""
        return sum(self.level(output) << output for output in range(OUTPUTS))

    def level(self, output: int) -> bool:
        """The level of one output, or of CLEAR before its logic."""
        pulse = self._pulses.get(output)
        return pulse.level if pulse else bool(self._steady >> output & 1)

    def pulsing(self, output: int) -> bool:
        """Tell whether a pulse is under way."""
        return output in self._pulses

    def available(self, output: int) -> bool:
        """Tell whether the output is there in this operating mode."""
        absent = 0 if self._axis.settings.mode == SERVO_MODE else CLEAR
        return output != absent

    def set(self, output: int, level: bool) -> None:
        """Give an output a steady level, if it is available."""
        if self.available(output):
            self._pulses.pop(output, None)
            self._steady = self._steady & ~(1 << output) | level << output

    def set_all(self, bits: int) -> None:
        """Set all general outputs that are available, a bit an output."""
        for output in range(OUTPUTS):
            self.set(output, bool(bits >> output & 1))

    def pulse(self, output: int, level: bool, duration_ms: int, now: float) -> None:
        """Give an output a level for a time, if it is available."""
        if self.available(output):
            self._pulses[output] = Pulse(level, now + duration_ms / 1000)

    # CLR

    def give_clear(self, now: float) -> None:
        """Clear the servo drive's deviation counter with a pulse; a length of 0 (CCS) switches it off."""
        if self._axis.settings.clear_pulse_ms:
            self.pulse(CLEAR, True, self._axis.settings.clear_pulse_ms, now)

    def clear_signal(self) -> bool:
        """The CLR signal after its logic (DLS)."""
        return self.level(CLEAR) != bool(self._axis.settings.sensor_logic >> CLEAR_LOGIC & 1)

    # Error outputs

    def error(self, cause: str) -> None:
        """Drive the error outputs (CES) of a cause: ems, limit or stall."""
        for name in (cause, ANY_ERROR):
            chosen = self._axis.settings.error_outputs.get(name)
            if chosen is not None:
                self.set(chosen.output, bool(chosen.level))
                self._driven[name] = chosen

    def driven(self, cause: str) -> bool:
        """Tell whether a cause, or any, has driven its error output since the last release."""
        return cause in self._driven

    def holding(self) -> bool:
        """Tell whether an error output has not been released."""
        return bool(self._driven)

    def release_errors(self) -> None:
        """Turn every error output that was driven to the opposite of its error level (CRS)."""
        for chosen in self._driven.values():
            self.set(chosen.output, not chosen.level)
        self._driven.clear()

    # Time

    def advance(self, now: float) -> None:
        """End the pulses that are over."""
        over = [output for output, pulse in self._pulses.items() if pulse.ends_at <= now]
        for output in over:
            del self._pulses[output]

    def wake_at(self) -> float | None:
        """When the next pulse ends."""
        return min((pulse.ends_at for pulse in self._pulses.values()), default=None)
