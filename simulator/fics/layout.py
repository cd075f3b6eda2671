"""The layout of a simulated Fics: its units and axes, its inputs and outputs, its macros, its version."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from protocols.fics.notation import LAST_UNIT
from simulator.fics.axes import DEGREE, MILLIMETRE, PULSE, Axis, Measure, Motor, World
from simulator.fics.geometry import Cartesian, MiniScara
from simulator.fics.macros import MACROS, Macro
from simulator.fics.units import Unit
from simulator.truth import TruthLog

MEASURES: Mapping[str, Measure] = {
    "X": MILLIMETRE,
    "Y": MILLIMETRE,
    "Z": MILLIMETRE,
    "@": DEGREE,
    "W": PULSE,
}
"""The axes a unit can have, in any order; @ is theta, W turns a motor that is counted in pulses."""

ARMS = {"X": "A", "Y": "B"}
"""The motors of a miniSCARA's arms, which its axes X and Y are converted from; its other axes are motors."""


class Kit(NamedTuple):
    """The mechanics of an axis."""

    top_speed: float
    homing_speed: float
    z_speed: float
    soft_limit: float
    """Distance of the soft limits from coordinate 0, on either side."""
    world: World


KITS: Mapping[str, Kit] = {
    "X": Kit(500.0, 50.0, 5.0, 300.0, World((-25.0, -20.0), -360.0, 340.0, 5.0)),
    "Y": Kit(500.0, 50.0, 5.0, 300.0, World((-25.0, -20.0), -360.0, 340.0, 5.0)),
    "Z": Kit(300.0, 30.0, 5.0, 100.0, World((-25.0, -20.0), -130.0, 110.0, 5.0)),
    "@": Kit(60.0, 10.0, 1.0, 180.0, World((-15.0, -10.0), -210.0, 200.0, 10.0)),
    "W": Kit(50.0, 5.0, 0.5, 90_000.0, World((-600.0, -500.0), -100_600.0, 99_500.0, 1000.0)),
    "A": Kit(60.0, 10.0, 1.0, 120.0, World((-15.0, -10.0), -160.0, 140.0, 10.0)),
    "B": Kit(60.0, 10.0, 1.0, 80.0, World((-15.0, -10.0), -105.0, 85.0, 10.0)),
}
"""Invented mechanics, in the axes' units from where they stand at first."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How a simulated Fics is equipped.

    :raises ValueError: there are no such axes, or too many units.
    """

    units: int = 1
    axes: str = "XYZ"
    """The user axes of every unit."""
    channels: int = 4
    """Channels of eight inputs, and as many of eight outputs."""
    macros: Mapping[str, Macro] = field(default_factory=lambda: MACROS)

    def __post_init__(self) -> None:
        if not 1 <= self.units <= LAST_UNIT:
            raise ValueError(f"there can be 1 to {LAST_UNIT} units, not {self.units}")
        if not self.axes or len(set(self.axes)) < len(self.axes) or not set(self.axes) <= set(MEASURES):
            raise ValueError(
                f"{self.axes!r} is no set of axes; take each of {''.join(MEASURES)} at most once"
            )

    def build_units(self, truth: TruthLog | None = None) -> dict[int, Unit]:
        """Make the units: unit 1 a miniSCARA if its first axes are X and Y, the others Cartesian."""
        scara = self.axes.startswith("".join(ARMS))
        return {
            number: (_scara if scara and number == 1 else _cartesian)(number, self.axes, truth)
            for number in range(1, self.units + 1)
        }


def _cartesian(number: int, axes: str, truth: TruthLog | None) -> Unit:
    return Unit(number, Cartesian(), [_motor(name, MEASURES[name]) for name in axes], truth=truth)


def _scara(number: int, axes: str, truth: TruthLog | None) -> Unit:
    motors = [_motor(ARMS[name], DEGREE) if name in ARMS else _motor(name, MEASURES[name]) for name in axes]
    return Unit(number, MiniScara(), motors, [_user_axis(name) for name in ARMS], truth)


def _user_axis(name: str) -> Axis:
    kit = KITS[name]
    return Axis(name, MEASURES[name], kit.top_speed, kit.soft_limit, -kit.soft_limit)


def _motor(name: str, measure: Measure) -> Motor:
    kit = KITS[name]
    return Motor(
        name,
        measure,
        kit.top_speed,
        kit.soft_limit,
        -kit.soft_limit,
        world=kit.world,
        homing_speed=kit.homing_speed,
        z_speed=kit.z_speed,
    )
