"""The axes of a unit: their settings, and of a motor its sensors, its driver and where it stands."""

from dataclasses import dataclass, field, replace
from enum import IntEnum
from math import ceil, floor, inf

from protocols.fics.notation import AxisSystem
from simulator.fics.motion import Ramps


@dataclass(frozen=True, slots=True)
class Measure:
    """An axis system (C-HOST manual 1-5); the decimals and pulses are assumptions."""

    system: AxisSystem
    decimals: int
    speed_factor: float
    """Units/s in one unit of its speed: mm/s, kpps or rpm."""
    pulses: int
    """Motor pulses in one unit; VSB is in pulses/s."""

    @property
    def step(self) -> float:
        """The smallest amount that is displayed: JTE counts these."""
        return 10.0**-self.decimals

    def shown(self, value: float) -> float:
        """A place as it is displayed; never minus zero."""
        return round(value, self.decimals) + 0.0

    def displayed(self, value: float, decimals: int) -> str:
        """A place as APS and MPS write it: with a point, but for pulses (C-HOST manual 2-9, 4-4)."""
        return f"{self.shown(value):.{decimals if self.decimals else 0}f}"


MILLIMETRE = Measure(AxisSystem.MILLIMETRE, 2, 1.0, 100)
PULSE = Measure(AxisSystem.PULSE, 0, 1000.0, 1)
DEGREE = Measure(AxisSystem.DEGREE, 2, 6.0, 100)


@dataclass
class Axis:
    """An axis as the host sees it, with its settings; positions are in its unit."""

    name: str
    measure: Measure
    top_speed: float
    """Top speed in the unit that VSO or MSO tells it in."""
    plus_limit: float
    minus_limit: float
    percent: float = 100.0
    """The share of the top speed in moves of user axes (VAO); back to 100 at power-on."""
    acceleration_ms: int = 200
    deceleration_ms: int = 200
    start_speed_pps: int = 0

    def ramps(self, percent: float, s_curve: bool) -> Ramps:
        """The ramps of a move at a share of the top speed, in units/s.

        The times are those between start speed and top speed, so a slower move ramps for a shorter time.
        """
        top = self.top_speed * self.measure.speed_factor
        start = min(self.start_speed_pps / self.measure.pulses, top)
        # Only the rate matters; without a gap between the speeds there is nothing to ramp.
        gap = top - start
        return Ramps(
            start,
            top * percent / 100,
            gap / (self.acceleration_ms / 1000) or inf,
            gap / (self.deceleration_ms / 1000) or inf,
            s_curve,
        )

    def within_limits(self, place: float) -> bool:
        """Tell whether the soft limits allow a place; half a displayed step is rounding."""
        slack = self.measure.step / 2
        return self.minus_limit - slack < place < self.plus_limit + slack


class Sensor(IntEnum):
    """The sensors of a motor, as the bits of ASD."""

    ORIGIN = 0
    PLUS_LIMIT = 1
    MINUS_LIMIT = 2


@dataclass(frozen=True, slots=True)
class World:
    """Where the sensors of a motor answer, in its units from where it stood at first."""

    dog: tuple[float, float]
    """Over this stretch the origin sensor is on."""
    minus_limit: float
    """Place at and below which the minus limit sensor is on."""
    plus_limit: float
    z_period: float
    """Distance between Z phases of the encoder, which come at its multiples."""

    def sensor(self, sensor: Sensor, at: float) -> bool:
        """Tell whether a sensor is on there."""
        if sensor is Sensor.PLUS_LIMIT:
            return at >= self.plus_limit
        if sensor is Sensor.MINUS_LIMIT:
            return at <= self.minus_limit
        return self.dog[0] <= at <= self.dog[1]

    def next_z(self, at: float, direction: float) -> float:
        """The first Z phase beyond a place."""
        count = at / self.z_period
        return (floor(count) + 1 if direction > 0 else ceil(count) - 1) * self.z_period


@dataclass
class Motor(Axis):
    """A motor axis: a user axis as well, where nothing is converted."""

    world: World = field(kw_only=True)
    motor_percent: float = 100.0
    """The share of the top speed in moves of motor axes (MAO), and user axes; 100 at power-on."""
    homing_type: int = 0
    homing_offset: float = 0.0
    homing_speed: float = field(default=0.0, kw_only=True)
    z_speed: float = field(default=0.0, kw_only=True)
    at: float = 0.0
    """Coordinate of an axis that stands still."""
    zero: float = 0.0
    """Place of coordinate 0 in the world's units."""
    homed: bool = False
    ever_homed: bool = False
    """True if it was homed before the last loss of power, or any earlier one."""
    driver_error: int = 0
    """00-FF as ACD tells it; 0 is none."""
    silent: bool = False
    """The driver does not answer: its position is not known (COMERR)."""
    held: dict[Sensor, bool] = field(default_factory=dict)
    """Sensors that are on or off whatever the world says."""

    def sees(self, sensor: Sensor, coordinate: float) -> bool:
        """Tell whether a sensor is on, with the axis at a coordinate."""
        return self.held.get(sensor, self.world.sensor(sensor, coordinate + self.zero))

    def limit(self, sensor: Sensor) -> float:
        """The coordinate at which a limit sensor comes on; at once or never while it is held."""
        if sensor in self.held:
            return self.at if self.held[sensor] else inf
        return (self.world.plus_limit if sensor is Sensor.PLUS_LIMIT else self.world.minus_limit) - self.zero

    def known(self) -> bool:
        """Tell whether the controller knows where it is."""
        return self.homed and not self.silent

    def ready(self) -> bool:
        """Tell whether the driver can move it."""
        return not self.driver_error and not self.silent

    def search_ramps(self, speed: float) -> Ramps:
        """The ramps of a homing leg at HMV or HMB; straight ones, an assumption."""
        ramps = self.ramps(100.0, s_curve=False)
        return replace(ramps, speed=speed * self.measure.speed_factor)

    def lose_power(self) -> None:
        """Forget where it stands."""
        self.at, self.zero = 0.0, self.zero + self.at
        self.ever_homed |= self.homed
        self.homed, self.driver_error = False, 0
        self.motor_percent = 100.0
