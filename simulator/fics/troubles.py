"""Troubles of a Fics as people meet them: each lasts until it is mended."""

from collections.abc import Callable, Mapping
from typing import Final

from simulator.faults import cut
from simulator.fics.alarms import driver_error, emergency
from simulator.fics.line import SimulatedFics

Mend = Callable[[float], object]
"""Ends a trouble at a time."""

DRIVER_ERROR: Final = 0x31
"""A code of a driver, as ERD tells it."""


def _press_stop(line: SimulatedFics, now: float) -> Mend:
    """Activate the stop input; DRT resets the rest when it is released."""
    line.robot.stop_input = True
    line.robot.raise_alarm(emergency(), now)
    return lambda _now: setattr(line.robot, "stop_input", False)


def _cut_power(line: SimulatedFics, now: float) -> Mend:
    line.power_off(now)
    return line.power_on


def _break_driver(line: SimulatedFics, now: float) -> Mend:
    """Let a driver tell an error, which DRT resets."""
    motor = line.robot.units[1].motors[-1]  # which no conversion concerns
    motor.driver_error = DRIVER_ERROR
    unit = line.robot.error_unit(line.robot.units[1])
    line.robot.raise_alarm(driver_error(unit, motor.name, DRIVER_ERROR), now)
    return lambda _now: None


def _pull_cable(line: SimulatedFics, _now: float) -> Mend:
    cut(line.faults)
    return lambda _now: line.faults.clear()


OF_ROBOTS: Final[Mapping[str, Callable[[SimulatedFics, float], Mend]]] = {
    "ems": _press_stop,
    "power": _cut_power,
    "driver": _break_driver,
    "cable": _pull_cable,
}


def break_robot(line: SimulatedFics, kind: str, now: float) -> Mend:
    """Let a trouble of `OF_ROBOTS` begin; what is given ends it."""
    line.robot.advance(now)
    mend = OF_ROBOTS[kind](line, now)
    line.look_after(now)

    def mended(now: float) -> None:
        line.robot.advance(now)
        mend(now)
        line.look_after(now)

    return mended
