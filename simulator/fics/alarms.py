"""Errors of the system: what ERR and ERD tell of them until DRT."""

from dataclasses import dataclass

from protocols.fics.alarms import DetailKind, DriverSignals, ErrorDetail
from simulator.fics.axes import Sensor

EMERGENCY, DRIVER, CONNECTION, TIMEOUT = 1, 2, 3, 4
"""Assumptions: the manual numbers but one error of the system."""
UNREACHABLE = 183
"""The coordinate conversion failed (C-HOST manual 2-13)."""
MESSAGE = 200
"""The first of the message errors, 2nn (C-HOST manual 2-13)."""

OVERRUN = 0xF0
"""The driver's error code on a limit sensor, an assumption."""

ARMS_TOO_SHORT = 1
"""The offset that the conversion adds to error 183; an assumption."""

NO_ERROR = ErrorDetail()
"""The answer of ERD before anything has happened."""


@dataclass(frozen=True, slots=True)
class Alarm:
    """An error of the system: its three digits, and what is known of it."""

    code: int
    detail: ErrorDetail

    @property
    def is_emergency(self) -> bool:
        """Tell whether all axes are in the state EMERGENCY."""
        return self.detail.kind is DetailKind.EMERGENCY


def emergency() -> Alarm:
    """AES, or the stop input of the system."""
    signals = DriverSignals(emergency=True, plus_overtravel=False, minus_overtravel=False)
    return Alarm(EMERGENCY, ErrorDetail(signals=signals))


def driver_error(unit: int, axis: str, code: int, overrun: Sensor | None = None) -> Alarm:
    """The report of a driver."""
    signals = DriverSignals(
        emergency=False,
        plus_overtravel=overrun is Sensor.PLUS_LIMIT,
        minus_overtravel=overrun is Sensor.MINUS_LIMIT,
    )
    return Alarm(DRIVER, ErrorDetail(unit=unit, axis=axis, driver_error=code, signals=signals))


def connection_lost(unit: int, axis: str) -> Alarm:
    """A driver does not answer."""
    return Alarm(CONNECTION, ErrorDetail(unit=unit, axis=axis))


def timed_out(program: int = 0, step: int = 0) -> Alarm:
    """Something has not happened in time; 999 as the program is homing."""
    return Alarm(TIMEOUT, ErrorDetail(program=program, step=step))


def system_error(code: int, program: int = 0, step: int = 0) -> Alarm:
    """A message error, 200-299, or any other."""
    return Alarm(code, ErrorDetail(error=code, program=program, step=step))


def unreachable() -> Alarm:
    """The coordinate conversion has no result."""
    return Alarm(UNREACHABLE, ErrorDetail(error=UNREACHABLE, program=0, step=0, routine_error=ARMS_TOO_SHORT))
