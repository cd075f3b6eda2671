"""One axis on its way."""

from math import inf

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from simulator.fics.layout import Layout
from simulator.fics.motion import Ramps, glide
from tests.simulator.fics.bench import Bench, cartesian

SLOW_START = Ramps(10.0, 100.0, 200.0, 100.0)


def test_a_long_move_ramps_up_runs_and_ramps_down() -> None:
    way = glide(0.0, 200.0, SLOW_START, 5.0)
    # 0.45 s and 24.75 units up, 0.9 s and 49.5 units down, the rest at 100 units/s.
    assert way.ends_at == pytest.approx(5.0 + 0.45 + 0.9 + (200 - 24.75 - 49.5) / 100)
    assert way.place(5.45) == pytest.approx(24.75)
    assert way.speed(5.45) == pytest.approx(100.0)
    assert way.speed(5.0) == 10.0
    assert way.place(way.ends_at) == 200.0
    assert way.speed(way.ends_at) == 0.0


def test_a_short_move_never_reaches_its_speed() -> None:
    way = glide(0.0, -20.0, SLOW_START, 0.0)
    fastest = max(way.speed(way.ends_at * share / 1000) for share in range(1000))
    assert fastest == pytest.approx((10.0**2 + 20 / (1 / 400 + 1 / 200)) ** 0.5, rel=1e-2)
    assert way.place(way.ends_at) == -20.0


def test_an_s_curve_takes_as_long_and_is_slower_at_first() -> None:
    straight = glide(0.0, 200.0, SLOW_START, 0.0)
    curved = glide(0.0, 200.0, Ramps(10.0, 100.0, 200.0, 100.0, s_curve=True), 0.0)
    assert curved.ends_at == straight.ends_at
    assert curved.place(0.45) == pytest.approx(straight.place(0.45))
    assert curved.place(0.1) < straight.place(0.1)
    assert curved.speed(0.225) == pytest.approx(55.0)


def test_without_ramps_the_speed_is_there_at_once() -> None:
    way = glide(3.0, 8.0, Ramps(0.0, 10.0, inf, inf), 1.0)
    assert way.ends_at == 1.5
    assert way.place(1.2) == pytest.approx(5.0)


def test_no_way_takes_no_time() -> None:
    assert glide(7.0, 7.0, SLOW_START, 2.0).ends_at == 2.0


def test_braking_ends_after_the_ramp_and_short_of_the_target() -> None:
    braked = glide(0.0, 200.0, SLOW_START, 0.0).braked(1.0)
    assert braked.ends_at == pytest.approx(1.9)
    assert braked.target == pytest.approx(24.75 + 55.0 + 49.5)


def test_braking_on_the_last_ramp_changes_nothing() -> None:
    way = glide(0.0, 200.0, SLOW_START, 0.0)
    assert way.braked(way.ends_at - 0.3).target == pytest.approx(200.0)


def test_the_moment_at_a_place_is_found() -> None:
    way = glide(0.0, -200.0, SLOW_START, 0.0)
    assert way.place(way.time_at(-77.0)) == pytest.approx(-77.0)
    assert way.time_at(-201.0) == inf


places, speeds, rates = st.floats(-1e5, 1e5), st.floats(0.1, 1e4), st.floats(0.1, 1e5)


@given(places, places, st.floats(0, 1e4), speeds, rates, rates, st.booleans(), st.floats(0, 1))
@example(0.0, 5e-324, 0.0, 1.0, 0.5, 0.5, False, 0.0).via("a way too short for any speed")
def test_every_move_gets_there_without_jumps_and_never_too_fast(
    origin: float, target: float, low: float, high: float, up: float, down: float, curve: bool, share: float
) -> None:
    way = glide(origin, target, Ramps(low, high, up, down, curve), 0.0)
    moment = way.ends_at * share
    assert way.place(way.ends_at) == target
    assert min(origin, target) - 1e-6 <= way.place(moment) <= max(origin, target) + 1e-6
    assert way.speed(moment) <= high * (1 + 1e-9)
    stopped = way.braked(moment)
    assert stopped.place(moment) == pytest.approx(way.place(moment), abs=1e-6)
    assert min(origin, target) - 1e-6 <= stopped.target <= max(origin, target) + 1e-6


# The settings of an axis in what it does: Z reaches 300 mm/s within 200 ms


def seconds_of(bench: Bench, command: str) -> float:
    start = bench.now
    assert bench.do(command) == [command[:3]]
    return bench.now - start


@pytest.mark.parametrize(
    ("settings", "seconds"),
    [
        ([], 0.2 + 0.1 + 0.2),
        (["VAO 50"], 0.1 + 0.5 + 0.1),
        (["MAO 50"], 0.2 + 0.1 + 0.2),
        (["VSO 150"], 0.2 + 0.4 + 0.2),
        (["VST 400"], 0.4 + 0.0 + 0.2),
        (["VSS 400"], 0.2 + 0.0 + 0.4),
        (["MST 100", "MSS 100"], 0.1 + 0.2 + 0.1),
        (["VSB 5000"], 0.2 + 20 / 300 + 0.2),
        (["VSO 50", "VSB 9999"], 1.8),
        (["SCV 1"], 0.5),
    ],
)
def test_settings_make_a_move_of_90_mm_take_its_time(settings: list[str], seconds: float) -> None:
    bench = Bench(cartesian())
    bench.asked(*settings)
    assert seconds_of(bench, "LMI 90") == pytest.approx(seconds)


@pytest.mark.parametrize(("setting", "seconds"), [("MAO 50", 0.7), ("VAO 50", 0.5)])
def test_a_move_of_motors_goes_by_mao_alone(setting: str, seconds: float) -> None:
    bench = Bench(cartesian())
    bench.asked(setting)
    assert seconds_of(bench, "MMI 90") == pytest.approx(seconds)


def test_arms_have_percentages_of_their_own() -> None:
    bench = Bench()
    bench.asked("MST 1,1,1", "MSS 1,1,1", "MAO 50,100", "VAO 1,1")
    # 60 rpm are 360 degrees a second.
    assert seconds_of(bench, "MMI 90") == pytest.approx(0.5, abs=0.002)
    assert seconds_of(bench, "MMI ,45") == pytest.approx(0.125, abs=0.002)


@pytest.mark.parametrize(("curve", "place"), [(0, 7.5), (1, 5.625)])
def test_the_s_curve_begins_more_gently(curve: int, place: float) -> None:
    bench = Bench(cartesian())
    bench.home()
    bench.asked(f"SCV {curve}")
    bench.ask("LMA 90")
    seen = []
    for pause in (0.1, 0.1, 0.05, 0.15, 0.1):
        bench.wait(pause)
        seen.append(told(bench))
    assert seen == pytest.approx([place, 30.0, 45.0, 90 - place, 90.0], abs=0.006)


def told(bench: Bench, axis: int = 0) -> float:
    """Position of an axis, as APS tells it."""
    answers = [line for line in bench.ask("APS") if line.startswith("APS")]
    return float(answers[0].removeprefix("APS ").split(",")[axis])


def test_positions_told_on_the_way_lie_on_the_line() -> None:
    bench = Bench()
    bench.home()
    assert bench.do("LMA 100,100") == ["LMA"]
    bench.ask("LMA 180,-60")
    seen = []
    for _ in range(60):
        bench.wait(0.01)
        seen.append((told(bench, 0), told(bench, 1)))
    assert all(y == pytest.approx(100 - 2 * (x - 100), abs=0.03) for x, y in seen)
    assert [x for x, _ in seen] == sorted(x for x, _ in seen)
    assert seen[0][0] < 110
    assert seen[-1] == (180.0, -60.0)


@pytest.mark.parametrize(
    ("settings", "command", "answer"),
    [
        ([], "LMA ,,100", []),
        ([], "LMA ,,100.01", ["LMA E07"]),
        ([], "LMI ,,-100.01", ["LMI E07"]),
        ([], "LMA 301", ["LMA E07"]),
        ([], "MMA 121", ["MMA E07"]),
        ([], "MMI ,-80.01", ["MMI E07"]),
        (["SLP ,,20"], "LMA ,,21", ["LMA E07"]),
        (["SLM 120"], "LMA 119", ["LMA E07"]),
        (["MSP 30"], "MMA 31", ["MMA E07"]),
        (["MSM ,,-10"], "LMI ,,-11", ["LMI E07"]),
        (["MSP 10,10"], "LMA 100,200", ["LMA E07"]),
        ([], "LMA 250,250", ["LMA 183"]),
    ],
)
def test_soft_limits_hold_in_both_coordinate_systems(
    settings: list[str], command: str, answer: list[str]
) -> None:
    bench = Bench()
    bench.home()
    bench.asked(*settings)
    assert bench.ask(command) == answer


def test_what_the_arms_cannot_reach_is_an_error_of_the_conversion() -> None:
    bench = Bench()
    bench.home()
    assert bench.ask("LMA 250,250") == ["LMA 183"]
    assert bench.ask("ERR") == ["ERR 183"]
    assert bench.ask("ERD") == ["ERD -183000000001"]
    assert bench.ask("LMA 100,100") == ["LMA E02"]
    bench.asked("DRT")
    assert bench.do("LMA 100,100") == ["LMA"]
    assert bench.ask("APS") == ["APS 100.00,100.00,0.00"]


def test_a_jog_runs_until_it_is_stopped() -> None:
    bench = Bench(cartesian())
    bench.home()
    bench.asked("JOG Z-")
    bench.wait(1.0)
    assert told(bench) < -25
    bench.asked("JOG Z")
    assert bench.finish() == []
    assert told(bench) == pytest.approx(-30.0, abs=0.02)


@pytest.mark.parametrize(("axis", "end"), [("Z+", 100.0), ("Z-", -100.0)])
def test_a_jog_ends_at_the_soft_limit(axis: str, end: float) -> None:
    bench = Bench(cartesian())
    bench.home()
    assert bench.do(f"JOG {axis}") == ["JOG"]
    assert told(bench) == end
    assert bench.ask("ERR") == ["ERR E00"]


def test_a_jog_without_coordinates_ends_at_the_limit_sensor() -> None:
    bench = Bench(cartesian())
    assert bench.do("JOG Z+") == ["JOG"]
    assert bench.ask("ERR") == ["ERR 002"]
    assert bench.ask("ASD") == ["ASD 2,0,0"]


def test_a_jog_of_the_tool_ends_where_an_arm_cannot_follow() -> None:
    bench = Bench()
    bench.home()
    bench.asked("JOG Y-")
    assert bench.finish() == []
    x, y = told(bench, 0), told(bench, 1)
    assert (x, bench.ask("ERR")) == (150.0, ["ERR E00"])
    # The elbow is at its soft limit: the tool is as far as it can go on this line.
    assert bench.motor("B").at == pytest.approx(-80.0, abs=0.01)
    assert y < 0


@pytest.mark.parametrize(
    ("layout", "command", "answer", "place"),
    [
        (cartesian(), "JTE Z1", ["JTE"], [0.01, 0, 0]),
        (cartesian(), "JTE Z-255", ["JTE"], [-2.55, 0, 0]),
        (cartesian(), "JTE @255", ["JTE"], [0, 2.55, 0]),
        (cartesian(), "JTE W+7", ["JTE"], [0, 0, 7]),
        (cartesian(), "JTE Z256", ["JTE E05"], [0, 0, 0]),
        (cartesian(), "JTE Z0", ["JTE E05"], [0, 0, 0]),
        (cartesian(), "JTE X1", ["JTE E05"], [0, 0, 0]),
        (cartesian(), "JTE Z1.5", ["JTE E06"], [0, 0, 0]),
        (Layout(), "JTE A10", ["JTE"], [0.1, 0, 0]),
        (Layout(), "JTE X10", ["JTE E10"], [0, 0, 0]),
    ],
)
def test_a_step_is_so_many_smallest_units(
    layout: Layout, command: str, answer: list[str], place: list[float]
) -> None:
    bench = Bench(layout)
    assert bench.do(command) == answer
    assert bench.robot.unit.at_rest() == pytest.approx(place)
