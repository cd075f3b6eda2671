"""The inputs of one RC-420 as its software sees them, and what they set off (RC-420 manual 13.9)."""

from collections.abc import Callable

from simulator.rorze.axis import Axis
from simulator.rorze.debounce import UNFILTERED, NoiseFilter
from simulator.rorze.interrupts import FALLING, INTERRUPT_INPUTS, RISING, Interrupts
from simulator.rorze.motor import NORMAL_END
from simulator.rorze.outputs import CLEAR, Outputs
from simulator.rorze.world import IN_POSITION, INPUTS, SENSORS

ALL_INPUTS, ALL_SENSORS = (1 << INPUTS) - 1, (1 << SENSORS) - 1

IN_POSITION_TIME_S = 5.0
"""Seconds to wait for INP after the last pulse before CLR is given (RC-420 manual 17.4.1: about 5 s)."""


class Ports:
    """Ten inputs, six sensors, the outputs and the interrupts.

    The levels of inputs and sensors are one word of lines: the inputs in bits 0-9, the sensors in bits 10-15.
    """

    def __init__(self, axis: Axis, sensor_changed: Callable[[int, bool, float], None], now: float) -> None:
        self._axis = axis
        self._sensor_changed = sensor_changed
        self.outputs = Outputs(axis)
        self.interrupts = Interrupts(axis, self.outputs)
        self._in_position_by: float | None = None
        self._raw = self._lines_of(axis.world.levels(axis.motor.pulses(now)))
        self._filters = [
            NoiseFilter(bool(self._raw >> line & 1), limit, now) for line, limit in enumerate(self._limits())
        ]
        self._lines = self._read()

    # Inputs and sensors

    def sense(self, levels: int, now: float) -> None:
        """Take the raw levels of the six sensors, a bit a sensor, and of the inputs in the world."""
        before, self._raw = self._raw, self._lines_of(levels)
        changed = before ^ self._raw
        if changed:
            for line, noise_filter in enumerate(self._filters):
                if changed >> line & 1:
                    noise_filter.sense(bool(self._raw >> line & 1), now)
            self._update(now)

    def settings_changed(self, now: float) -> None:
        """Take over noise counts (DCS) and logic (DIS, DLS)."""
        for noise_filter, limit in zip(self._filters, self._limits(), strict=True):
            noise_filter.set_limit(limit, now)
        self._update(now)

    def inputs(self) -> int:
        """All ten inputs as CID tells them, a bit an input."""
        return self._lines & ALL_INPUTS

    def sensors(self) -> int:
        """All six sensors as CLD tells them, a bit a sensor."""
        return self._lines >> INPUTS

    def sensor(self, sensor: int) -> bool:
        """Tell whether a sensor is on, as CLD tells it."""
        return bool(self.sensors() >> sensor & 1)

    def _lines_of(self, sensors: int) -> int:
        return self._axis.world.inputs & ALL_INPUTS | sensors << INPUTS

    def _limits(self) -> list[int]:
        """The noise count of each line: DCS has one number less, and no filters for inputs 8 and 9."""
        counts = self._axis.settings.noise_counts
        return [*counts[:8], UNFILTERED, UNFILTERED, *counts[9:]]

    def _read(self) -> int:
        settings = self._axis.settings
        levels = sum(noise_filter.level << line for line, noise_filter in enumerate(self._filters))
        return levels ^ (settings.input_logic | (settings.sensor_logic & ALL_SENSORS) << INPUTS)

    def _update(self, now: float) -> None:
        """Find out what the lines show now, and act on every change."""
        before, self._lines = self._lines, self._read()
        changed = before ^ self._lines
        for port in INTERRUPT_INPUTS:
            if changed >> port & 1:
                self.interrupts.edge(port, RISING if self._lines >> port & 1 else FALLING, now)
        for sensor in range(SENSORS):
            if changed >> INPUTS + sensor & 1:
                self._sensor_changed(sensor, self.sensor(sensor), now)

    # Moves

    def error_output_on(self) -> bool:
        """Tell whether an error output holds until CRS: moves are refused with 66 then."""
        return self.outputs.holding()

    def move_ended(self, cause: int, error: str, now: float) -> None:
        """A move has ended; `error` is ems, limit or stall after such an error, else empty."""
        self.interrupts.move_ended()
        if error:
            self.outputs.error(error)
        if error or self._axis.motor.code.startswith("0"):
            self.outputs.give_clear(now)
        elif cause == NORMAL_END and self.outputs.available(CLEAR):
            self._in_position_by = now + IN_POSITION_TIME_S

    # Time

    def advance(self, now: float) -> None:
        """Let everything happen that is due: noise counts, ends of pulses, the end of the wait for INP."""
        for noise_filter in self._filters:
            noise_filter.advance(now)
        self._update(now)
        self.outputs.advance(now)
        self._await_in_position(now)

    def wake_at(self) -> float | None:
        """The next moment something happens without a request; later than the last `advance`."""
        moments = [noise_filter.changes_at() for noise_filter in self._filters]
        moments += [self.outputs.wake_at(), self._in_position_by]
        return min((at for at in moments if at is not None), default=None)

    def _await_in_position(self, now: float) -> None:
        """Give CLR when the servo drive has not come to rest in time; the next move ends the wait."""
        if self._in_position_by is None:
            return
        if self.sensor(IN_POSITION) or self._axis.motor.moving:
            self._in_position_by = None
        elif self._in_position_by <= now:
            self._in_position_by = None
            self.outputs.give_clear(now)
