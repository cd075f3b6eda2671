"""A SCARA robot's kinematics as clients have them: pulses to coordinates, and back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import InvalidRequest
from gateway.rorze.bodies import Group
from gateway.rorze.line import Line
from gateway.rorze_scara.record import ScaraPlace
from gateway.rorze_scara.scara import Scara
from protocols.rorze.scara import BeltLinked, FingerPlace, Mechanics, ThreeAxes
from simulator.rorze.line import build_line
from tests.simulated_line import SimulatedLine

THREE = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
FINE = ThreeAxes(215_000, 330_000, (9_999_999.99,) * 3)
BELTS = BeltLinked(156_000, 208_000, (98_765.0, 99_000.0))


def robot_of(robot: Mechanics) -> Scara:
    """A robot whose bodies are never asked."""
    line = Line("line1", SimulatedLine(build_line([], 0.0)), [])
    return Scara("wafer", Group(line, 0x8A, []), robot)


def told(scara: Scara, pulses: tuple[int, ...]) -> FingerPlace:
    """Coordinates as a client reads them, and sends them back."""
    place = ScaraPlace.of(scara.place_of(pulses))
    return FingerPlace(place.x.value, place.y.value, place.angle.value)


@pytest.mark.parametrize("robot", [THREE, FINE])
@given(st.data())
def test_there_and_back_within_a_pulse(robot: Mechanics, data: st.DataObject) -> None:
    """All over the reach, the elbow bent as in the manual's example."""
    base, arm, finger = (round(turn / 2) - 2 for turn in robot.pulses_per_turn)
    wanted = st.tuples(st.integers(-base, base), st.integers(-arm, -2), st.integers(-finger, finger))
    pulses = data.draw(wanted)
    scara = robot_of(robot)
    assert scara.pulses_of(told(scara, pulses)) == pytest.approx(pulses, abs=1)


@given(st.integers(-49_000, 49_000), st.integers(-24_700, 24_700))
def test_there_and_back_within_a_pulse_with_belts(turn: int, arm: int) -> None:
    scara = robot_of(BELTS)
    lead = BELTS.lead(BELTS.pose((turn, arm)))
    back = scara.pulses_of(told(scara, (turn, arm)), is_turned=False)
    # A finger's end behind the base may as well be before it, with the base half a turn on.
    assert lead <= 100 or back == pytest.approx((turn, arm), abs=1)
    assert scara.pulses_of(told(scara, (turn, arm))) == pytest.approx((turn, arm), abs=1), "by its angle"


@pytest.mark.parametrize("direction", [0, 45_000, 89_000])
def test_with_belts_the_finger_points_along_its_way_from_the_origin_only(direction: float) -> None:
    with pytest.raises(InvalidRequest, match=r"angle: belts keep the finger .* points to 90000.000"):
        robot_of(BELTS).pulses_of(FingerPlace(0, 300_000, direction))
    free = robot_of(BELTS).pulses_of(FingerPlace(0, 300_000, 0), is_turned=False)
    assert robot_of(BELTS).pulses_of(FingerPlace(0, 300_000, 90_000)) == free


def test_pulses_are_cut_as_hls_cuts_them() -> None:
    """RC-420 manual 13.10.7."""
    assert robot_of(THREE).pulses_of(FingerPlace(0, 115_000, 90_000)) == (-10_149, -10_000, -16_666)


def test_where_the_arm_does_not_come_there_are_no_pulses() -> None:
    with pytest.raises(InvalidRequest, match="comes 430000 um from the origin, but not 570000 um"):
        robot_of(THREE).pulses_of(FingerPlace(0, 900_000, 90_000))
    with pytest.raises(InvalidRequest, match="turned beyond its longest reach"):
        robot_of(BELTS).place_of((0, 25_000))
    with pytest.raises(InvalidRequest, match="wafer has 3 axes, not 2"):
        robot_of(THREE).place_of((0, 0))


@pytest.mark.parametrize(("direction", "angle"), [(180e3, 180e3), (-180e3, 180e3), (270e3, -90e3)])
def test_angles_are_told_within_half_a_turn(direction: float, angle: float) -> None:
    assert ScaraPlace.of(FingerPlace(0, 0, direction)).angle.value == angle
