"""The settings in the flash memory of an RC-420, with their factory values (RC-420 manual 18)."""

from dataclasses import dataclass, field, replace
from typing import Any

STANDARD = 30
"""The set of speed parameters, and the acceleration pattern, that a command means when it names none."""

FARTHEST = 999_999_999
"""The largest position and amount the controller can hold."""

POSITIONS = 2048

AXES = 10
"""The number of an interpolation: 0 to 2 are those of a robot, the others are never used."""


@dataclass(frozen=True, slots=True)
class SpeedSet:
    """Speed parameters S[n]: OL pps, OH pps, OS pps/s, OA %, OB %; None has never been set."""

    low: int | None = None
    high: int | None = None
    acceleration: int | None = None
    rising: int | None = None
    falling: int | None = None


@dataclass(frozen=True, slots=True)
class Pattern:
    """Acceleration pattern A[n]: the speed sets of its acceleration and its deceleration."""

    acceleration: int
    deceleration: int


@dataclass(frozen=True, slots=True)
class OutputPulse:
    """The effect of CFS 'O' on a general output: drive it to `level` for `duration_ms`."""

    output: int
    level: int
    duration_ms: int


@dataclass(frozen=True, slots=True)
class InterruptActions:
    """The position numbers where an interrupt on input 8 or 9 stores things, and the pulse it gives (CFS)."""

    position: int | None = None
    encoder: int | None = None
    encoder_in_pulses: int | None = None
    output: OutputPulse | None = None


@dataclass(frozen=True, slots=True)
class ErrorOutput:
    """The general output that an error drives, and its level then (CES)."""

    output: int
    level: int


def _speeds() -> tuple[SpeedSet, ...]:
    standard = SpeedSet(low=50, high=50_000, acceleration=100_000, rising=50, falling=50)
    return (*(SpeedSet(),) * STANDARD, standard)


def _patterns() -> tuple[Pattern | None, ...]:
    return (*(None,) * STANDARD, Pattern(STANDARD, STANDARD))


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings FIS writes, each with the command that sets it. Immutable: flash and RAM share them."""

    overrun_factor: int = 2  # 0BS
    search_retries: int = 0  # 0RS
    origin_offset: int = 10  # 0SS, pulses
    position_index: int = 0  # 3IS
    comments: tuple[str, ...] = ("",) * 7  # 9VS
    clear_pulse_ms: int = 1  # CCS
    error_outputs: dict[str, ErrorOutput] = field(
        default_factory=dict
    )  # CES: by ems, limit, stall, any; replaced, not mutated
    interrupt_actions: tuple[InterruptActions, ...] = (InterruptActions(),) * 2  # CFS: inputs 8 and 9
    outputs: int = 0  # COS
    interrupt_modes: tuple[int, ...] = (0, 0)  # CPS
    interrupt_sections: tuple[tuple[int, int], ...] = ((-FARTHEST, FARTHEST),) * 2  # CSS
    noise_counts: tuple[int, ...] = (1,) * 15  # DCS
    input_logic: int = 0  # DIS, a bit an input
    sensor_logic: int = 0  # DLS, a bit a sensor, bit 6 the CLR output
    mode: int = 0  # EAS: 0 stepping, 1 encoder, 2 servo
    pulse_output: int = 1  # EDS: 0 pulse and direction, 1 CW and CCW pulses
    movable_range: tuple[int, int] = (-FARTHEST, FARTHEST)  # EPS
    arm_length: int = 1  # HAS
    axis_role: int = 0  # HCS
    wafer_distance: int = 1  # HFS
    interpolation: int = 1  # HTS
    resolutions: tuple[float, ...] = (1.0,) * AXES  # HZS
    speeds: tuple[SpeedSet, ...] = field(default_factory=_speeds)  # OLS OHS OSS OAS OBS
    encoder_multiplier: int = 4  # PAS
    encoder_ratio: float = 1.0  # PBS, motor pulses an encoder count
    encoder_tolerance: int = 128  # PES, pulses
    adjust: int = 0  # PJS
    adjust_limit: int = 800  # PKS, pulses
    adjust_speed: int = 0  # PLS
    encoder_stall_detection: int = 0  # PSS
    adjust_delay: int = 3  # PTS, 10 ms
    stall_interval: int = 2048  # QIS, pulses: the period of the dogs
    stall_detection: int = 0  # QSS
    patterns: tuple[Pattern | None, ...] = field(default_factory=_patterns)  # SPS
    autostart: int = 0  # UAS

    def with_item(self, name: str, place: int, value: object) -> "Settings":
        """The settings with one item of the tuple `name` changed."""
        items = list(getattr(self, name))
        items[place] = value
        changed: dict[str, Any] = {name: tuple(items)}
        return replace(self, **changed)

    def with_speed(self, number: int, **values: int) -> "Settings":
        """The settings with some values of one speed set changed."""
        return self.with_item("speeds", number, replace(self.speeds[number], **values))


@dataclass
class Flash:
    """The flash memory: it survives the loss of power (FIS, FPS, FUS, FES)."""

    settings: Settings = field(default_factory=Settings)
    damaged: bool = False
    """True if the settings cannot be read (RC-420 manual 13.8.2), until they are written or erased anew."""
    positions: tuple[int, ...] = (0,) * POSITIONS
    program: tuple[str, ...] = ()
