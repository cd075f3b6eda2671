"""Where a SCARA robot's wafer is, and where its axes are for that."""

from math import cos, hypot, radians, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from simulator.rorze.scara import Scara

ROBOT = Scara(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
"""That of RC-420 manual 13.10.7."""

FINE = Scara(215_000, 330_000, (9_999_999.99,) * 3)


def test_the_worked_example() -> None:
    assert ROBOT.pulses(0, 115_000, 90_000) == (-10_149, -10_000, -16_666)
    assert ROBOT.place((-10_149, -10_000, -16_666)) == (12, 115_000, 89_998)


def test_each_axis_turns_what_it_carries() -> None:
    quarter = 25.0
    robot = Scara(1_000, 300, (4 * quarter,) * 3)
    assert robot.place((0, 0, 0)) == (300, 0, 0)
    assert robot.place((25, 0, 0)) == (0, 300, 90_000)
    assert robot.place((0, 50, 0)) == (2_000 - 300, 0, -180_000)
    assert robot.place((0, 0, 25)) == (0, -300, -90_000)


@given(st.integers(-900_000, 900_000), st.integers(-900_000, 900_000), st.integers(-180_000, 180_000))
def test_there_and_back(x: int, y: int, direction: int) -> None:
    turned = radians(direction / 1000)
    reach = hypot(x - FINE.finger * cos(turned), y - FINE.finger * sin(turned))
    assume(abs(reach - 2 * FINE.link) > 1)
    pulses = FINE.pulses(x, y, direction)
    if reach > 2 * FINE.link:
        assert pulses is None
        return
    assert pulses is not None
    found_x, found_y, found_direction = FINE.place(pulses)
    assert (found_x, found_y) == pytest.approx((x, y), abs=3)
    assert (found_direction - direction + 180_000) % 360_000 == pytest.approx(180_000, abs=2)
