"""The seven ways home, told by where the axis turned: axis Z, whose sensors are known places of the world."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulator.fics.axes import Sensor
from simulator.truth import Fact
from tests.simulator.fics.bench import Bench, cartesian

DOG, DOG_END, MINUS_LIMIT, Z_PERIOD = -20.0, -25.0, -130.0, 5.0
"""Places of axis Z, from its first: the edges of its sensors towards plus, and the period of its Z phase."""

HMV, HMB = 30.0, 5.0
RATE = 1500.0
"""mm/s² of its ramps."""
FAST, SLOW = HMV**2 / (2 * RATE), HMB**2 / (2 * RATE)
"""Overshoot at either speed."""

COURSES = {
    0: [DOG - FAST, DOG + SLOW, -15 + SLOW, -15.0],
    1: [DOG - FAST, DOG + SLOW, DOG],
    2: [DOG - FAST, -25 - SLOW, -25.0],
    3: [DOG - FAST, DOG],
    4: [MINUS_LIMIT - FAST, MINUS_LIMIT + SLOW, -125 + SLOW, -125.0],
    5: [MINUS_LIMIT - FAST, MINUS_LIMIT + SLOW, MINUS_LIMIT],
    6: [DOG - FAST, -25 - SLOW, -25.0],
}
"""Places where each type stops on its way from 0 (C-HOST manual 2-25)."""


def bench_at(place: float = 0.0) -> Bench:
    bench = Bench(cartesian())
    if place:
        assert bench.do(f"LMI {place}") == ["LMI"]
    return bench


def stops(bench: Bench) -> list[float]:
    """Where Z has stopped in the last motion, in the coordinates of then."""
    facts = list(bench.line.truth)
    begun = max(number for number, fact in enumerate(facts) if fact.kind == "motion_start")
    places = [fact.facts["place"] for fact in facts[begun:] if _is_stop_of_z(fact)]
    return [place for place in places if isinstance(place, float)]


def _is_stop_of_z(fact: Fact) -> bool:
    return fact.kind == "axis_stop" and fact.facts["axis"] == "Z"


def course(bench: Bench, seconds: float, step_s: float = 0.001) -> list[tuple[float, float]]:
    """Where Z is and how fast, measured once in a step."""
    samples, before = [], bench.robot.unit.motor_places(bench.now)[0]
    for _ in range(round(seconds / step_s)):
        bench.wait(step_s)
        place = bench.robot.unit.motor_places(bench.now)[0]
        samples.append((place, abs(place - before) / step_s))
        before = place
    return samples


@pytest.mark.parametrize("homing_type", COURSES)
def test_each_type_goes_its_way_and_calls_the_end_zero(homing_type: int) -> None:
    bench = bench_at()
    bench.asked(f"HMT {homing_type}")
    bench.home()
    assert stops(bench) == pytest.approx(COURSES[homing_type])
    motor = bench.motor("Z")
    assert (motor.at, motor.homed) == (0.0, True)
    assert motor.zero == pytest.approx(COURSES[homing_type][-1])
    assert bench.ask("APS") == ["APS 0.00,0.00,0"]


@pytest.mark.parametrize("homing_type", COURSES)
def test_the_offset_is_gone_and_becomes_zero(homing_type: int) -> None:
    bench = bench_at()
    bench.asked(f"HMT {homing_type}", "HMO 3.5")
    bench.home()
    assert bench.motor("Z").zero == pytest.approx(COURSES[homing_type][-1] + 3.5)
    assert bench.ask("MPS") == ["MPS 0.00,0.00,0"]


def test_the_sensor_is_passed_at_the_high_speed_and_z_at_the_search_speed() -> None:
    bench = bench_at()
    bench.asked("HMV 40", "HMB 4")
    bench.ask("ORG")
    samples = course(bench, 1.8)
    assert max(speed for _, speed in samples) == pytest.approx(40)
    at_the_sensor = next(speed for place, speed in samples if place < DOG)
    at_z = next(speed for place, speed in samples[1000:] if place > -16)
    assert at_the_sensor == pytest.approx(40, rel=0.01)
    assert at_z == pytest.approx(4)


def test_fast_is_enc_sensor_with_more_speed() -> None:
    bench = bench_at()
    bench.asked("HMT 6", "HMV 120", "HMB 2")
    bench.home()
    assert stops(bench) == pytest.approx([DOG - 120**2 / (2 * RATE), -25 - 2**2 / (2 * RATE), -25.0])


def test_an_axis_on_the_sensor_leaves_it_first() -> None:
    bench = bench_at(-22)
    bench.home()
    assert stops(bench) == pytest.approx([DOG + FAST, *COURSES[0]])


def test_an_axis_beyond_the_sensor_goes_round_by_the_limit() -> None:
    bench = bench_at(-60)
    bench.home()
    assert stops(bench) == pytest.approx([MINUS_LIMIT - FAST, DOG + FAST, *COURSES[0]])


def test_an_axis_on_its_limit_finds_home_once_the_error_is_reset() -> None:
    bench = bench_at()
    assert bench.do("LMI -200") == ["LMI 002"]
    assert bench.ask("ASD") == ["ASD 4,0,0"]
    bench.asked("DRT")
    bench.home()
    assert bench.motor("Z").zero == pytest.approx(-15.0)


def test_all_axes_of_all_units_come_home_each_in_its_own_time() -> None:
    bench = Bench(cartesian(units=2))
    bench.home()
    assert all(motor.homed for unit in bench.robot.units.values() for motor in unit.motors)
    ends = {(fact.body, fact.facts["axis"]): fact.at for fact in bench.line.truth.of("axis_stop")}
    assert len(ends) == 6
    assert len(set(ends.values())) == 3
    assert bench.line.truth.of("motion_stop")[-1].at == max(ends.values())


def test_positions_are_not_known_on_the_way_home() -> None:
    bench = bench_at()
    bench.home()
    bench.ask("ORG")
    bench.wait(0.2)
    assert bench.ask("APS") == ["APS #####,#####,#####"]
    assert bench.ask("ACD")[0].startswith("ACD 3")


# What goes wrong


def test_a_sensor_that_never_answers_is_a_matter_of_time() -> None:
    bench = bench_at()
    bench.motor("Z").held[Sensor.ORIGIN] = False
    assert bench.do("ORG") == ["ORG 004"]
    assert bench.ask("ERR") == ["ERR 004"]
    assert bench.ask("ERD") == ["ERD -- T9990000"]
    assert stops(bench)[-1] == MINUS_LIMIT
    assert not bench.motor("Z").homed


def test_a_sensor_that_falls_out_on_the_way_is_not_found_either() -> None:
    bench = bench_at()
    bench.ask("ORG")
    bench.wait(0.3)
    bench.motor("Z").held[Sensor.ORIGIN] = False
    assert bench.finish() == ["ORG 004"]


def test_a_limit_that_never_answers_is_no_origin() -> None:
    bench = bench_at()
    bench.asked("HMT 5")
    bench.motor("Z").held[Sensor.MINUS_LIMIT] = False
    assert bench.do("ORG") == ["ORG 004"]


@pytest.mark.parametrize(
    ("sensor", "homing_type", "sign"),
    [(Sensor.ORIGIN, 0, "+"), (Sensor.MINUS_LIMIT, 4, "+"), (Sensor.MINUS_LIMIT, 0, "-")],
)
def test_a_sensor_stuck_on_drives_the_axis_onto_a_limit(sensor: Sensor, homing_type: int, sign: str) -> None:
    bench = bench_at()
    bench.asked(f"HMT {homing_type}")
    bench.motor("Z").held[sensor] = True
    assert bench.do("ORG") == ["ORG 002"]
    (detail,) = bench.ask("ERD")
    assert detail.startswith("ERD  ZF0")
    assert sign in detail
    assert bench.ask("ACD")[0][5:8] in ("AF0", "8F0")


def test_a_search_too_fast_to_brake_ends_on_the_limit() -> None:
    bench = bench_at()
    bench.asked("HMV 1000")
    assert bench.do("ORG") == ["ORG 002"]
    assert stops(bench)[-1] == MINUS_LIMIT


@pytest.mark.parametrize(("stop", "heard"), [("ASS", ["ASS", "ORG"]), ("AES", ["AES", "ORG 001"])])
def test_a_stop_ends_the_search_and_nothing_is_known(stop: str, heard: list[str]) -> None:
    bench = bench_at()
    bench.ask("ORG")
    bench.wait(0.5)
    assert sorted(bench.do(stop)) == sorted(heard)
    assert bench.ask("APS") == ["APS #####,#####,#####"]
    assert len(bench.line.truth.of("axis_start")) == len(bench.line.truth.of("axis_stop"))


def test_a_driver_without_power_is_not_homed() -> None:
    bench = bench_at()
    bench.motor("Z").silent = True
    assert bench.ask("ORG") == ["ORG E02"]


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-129, 109),
    st.integers(0, 6),
    st.floats(5, 200).map(lambda speed: round(speed, 1)),
    st.floats(1, 20).map(lambda speed: round(speed, 1)),
    st.floats(-10, 10).map(lambda offset: round(offset, 2)),
)
def test_home_is_the_same_place_from_wherever_it_is_sought(
    start: float, homing_type: int, fast: float, slow: float, offset: float
) -> None:
    bench = Bench(cartesian())
    bench.motor("Z").at = start
    offset = abs(offset) if homing_type in (4, 5) else offset
    bench.asked(f"HMT {homing_type}", f"HMV {fast:g}", f"HMB {slow:g}", f"HMO {offset:g}")
    bench.home()
    motor = bench.motor("Z")
    assert motor.at == 0.0
    assert motor.zero == pytest.approx(COURSES[homing_type][-1] + offset)
