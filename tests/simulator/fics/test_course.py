"""Motion in a unit: several axes at a time, on straight lines, until a limit or a stop."""

from math import inf

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulator.fics.axes import Sensor
from simulator.fics.course import Span, stroke
from simulator.fics.motion import Ramps
from tests.simulator.fics.bench import Bench, cartesian

# One stroke


def test_the_axis_that_takes_longest_sets_the_pace() -> None:
    ramps = {0: Ramps(0.0, 100.0, inf, inf), 1: Ramps(0.0, 10.0, inf, inf)}
    both = stroke({0: Span(0.0, 200.0), 1: Span(5.0, -35.0)}, ramps, 1.0)
    assert both.glide.ends_at == 5.0
    assert (both.place(0, 3.0), both.place(1, 3.0)) == (100.0, -15.0)


def test_axes_that_need_not_move_do_not_matter() -> None:
    ramps = {0: Ramps(0.0, 1e-9), 1: Ramps(0.0, 10.0)}
    assert stroke({0: Span(7.0, 7.0), 1: Span(0.0, 10.0)}, ramps, 0.0).glide.ends_at == 1.0
    assert stroke({0: Span(7.0, 7.0)}, ramps, 3.0).glide.ends_at == 3.0


places = st.floats(-1e5, 1e5)
axis_ramps = st.builds(
    Ramps, st.floats(0, 1e3), st.floats(0.1, 1e4), st.floats(0.1, 1e5), st.floats(0.1, 1e5), st.booleans()
)


@given(
    st.lists(st.tuples(st.builds(Span, places, places), axis_ramps), min_size=1, max_size=8),
    st.floats(0, 1e6),
    st.floats(0, 1),
)
def test_a_stroke_is_exact_straight_and_never_too_fast(
    axes: list[tuple[Span, Ramps]], now: float, share: float
) -> None:
    spans = {axis: span for axis, (span, _) in enumerate(axes)}
    ramps = {axis: ramp for axis, (_, ramp) in enumerate(axes)}
    way = stroke(spans, ramps, now)
    moment = now + (way.glide.ends_at - now) * share
    gone = way.glide.place(moment)
    assert 0.0 <= gone <= 1.0 + 1e-9
    for axis, (span, ramp) in enumerate(axes):
        assert way.place(axis, way.glide.ends_at) == span.target
        assert way.place(axis, moment) == pytest.approx(span.place(gone))
        speed = way.glide.speed(moment) * abs(span.target - span.start)
        assert speed <= ramp.speed * (1 + 1e-9)


# The courses of a unit


def stopped(bench: Bench) -> dict[str, tuple[float, float]]:
    """When and where each motor last stopped."""
    found = {}
    for fact in bench.line.truth.of("axis_stop"):
        place = fact.facts["place"]
        assert isinstance(place, float)
        found[str(fact.facts["axis"])] = (fact.at, place)
    return found


def test_the_axes_of_a_move_start_and_end_together() -> None:
    bench = Bench(cartesian())
    assert bench.do("LMI 50,10,-300") == ["LMI"]
    ends = stopped(bench)
    assert {place for _, place in ends.values()} == {50.0, 10.0, -300.0}
    assert len({at for at, _ in ends.values()}) == 1
    assert {fact.at for fact in bench.line.truth.of("axis_start")} == {0.0}


def test_every_start_and_stop_is_told_with_its_axis_and_unit() -> None:
    bench = Bench(cartesian(units=2))
    bench.asked("UNT 2")
    bench.do("LMI 5,,0")
    (start,), (stop,) = (bench.line.truth.of(kind) for kind in ("axis_start", "axis_stop"))
    assert (start.body, start.at, start.facts) == (2, 0.0, {"axis": "Z", "place": 0.0})
    assert (stop.body, stop.at, stop.facts) == (2, bench.now, {"axis": "Z", "place": 5.0})
    assert start.request == bench.line.requests


def test_a_converted_move_moves_both_arms() -> None:
    bench = Bench()
    bench.home()
    before = len(bench.line.truth.of("axis_start"))
    bench.do("LMI 5,,3")
    facts = bench.line.truth.of("axis_start")[before:]
    assert [fact.facts["axis"] for fact in facts] == ["A", "B", "Z"]


def test_an_axis_may_join_others_that_jog_and_each_stops_for_itself() -> None:
    bench = Bench(cartesian())
    bench.asked("JOG Z+")
    bench.wait(0.5)
    bench.asked("JOG W-", "JOG Z")
    bench.wait(0.5)
    assert list(stopped(bench)) == ["Z"]
    bench.asked("JOG W")
    bench.finish()
    assert stopped(bench)["W"][0] == bench.now
    assert bench.ask("ACD") == ["ACD 0200,0200,0200"]


def test_a_decelerating_stop_ramps_all_axes_down_on_their_line() -> None:
    bench = Bench(cartesian())
    bench.ask("LMI 90,45")
    bench.wait(0.25)
    assert bench.do("ASS") == ["ASS", "LMI"]
    ends = stopped(bench)
    # At 300 mm/s, 45 mm on its way; 30 mm more to brake.
    assert [*ends["Z"], *ends["@"]] == pytest.approx([0.45, 75.0, 0.45, 37.5])


def test_an_immediate_stop_leaves_them_where_they_are() -> None:
    bench = Bench(cartesian())
    bench.ask("LMI 90,45")
    bench.wait(0.25)
    assert sorted(bench.ask("AES")) == ["AES", "LMI 001"]
    ends = stopped(bench)
    assert [*ends["Z"], *ends["@"]] == pytest.approx([0.25, 45.0, 0.25, 22.5])


def test_the_loss_of_power_is_told_as_a_stop() -> None:
    bench = Bench(cartesian())
    bench.ask("LMI 90")
    bench.wait(0.25)
    bench.line.power_off(bench.now)
    assert stopped(bench)["Z"] == pytest.approx((0.25, 45.0))
    assert bench.motor("Z").zero == pytest.approx(45.0)


def test_a_way_that_is_only_rounding_takes_no_time() -> None:
    for target in (5e-324, 1e-12, -1e-10):
        assert stroke({0: Span(0.0, target)}, {0: Ramps(0.0, 1.0, 1.0, 1.0)}, 2.0).glide.ends_at == 2.0


# Limit sensors


def test_a_motor_on_its_limit_sensor_ends_it_all_there() -> None:
    bench = Bench(cartesian())
    assert bench.do("LMI 220,10") == ["LMI 002"]
    assert stopped(bench)["Z"][1] == pytest.approx(110.0)
    assert stopped(bench)["@"][1] == pytest.approx(5.0)
    assert bench.ask("ERD") == ["ERD  ZF0 + "]
    assert bench.ask("LMI 1") == ["LMI E02"]
    bench.asked("DRT")
    assert bench.do("LMI 1") == ["LMI 002"]
    bench.asked("DRT")
    assert bench.do("LMI -1") == ["LMI"]


def test_a_limit_held_by_hand_stops_an_axis_that_moves_towards_it_only() -> None:
    bench = Bench(cartesian())
    bench.ask("LMI 50")
    bench.wait(0.1)
    bench.motor("Z").held[Sensor.MINUS_LIMIT] = True
    bench.line.look_after(bench.now)
    assert bench.wait(0.05) == []
    bench.motor("Z").held[Sensor.PLUS_LIMIT] = True
    bench.line.look_after(bench.now)
    assert bench.heard() == ["LMI 002"]
    assert stopped(bench)["Z"][0] == bench.now


def test_a_converted_move_heeds_a_limit_held_by_hand() -> None:
    bench = Bench()
    bench.home()
    bench.ask("LMI 0,-100")
    bench.wait(0.2)
    for sensor in (Sensor.PLUS_LIMIT, Sensor.MINUS_LIMIT):
        bench.motor("B").held[sensor] = True
    bench.line.look_after(bench.now)
    assert bench.wait(0.001) == ["LMI 002"]


def test_a_converted_move_stops_where_a_motor_meets_its_limit() -> None:
    bench = Bench()
    bench.home()
    bench.asked("MSP 200,200", "MSM -200,-200", "SLM -300,-300")
    limit = bench.motor("A").limit(Sensor.PLUS_LIMIT)
    assert bench.do("LMA -270,-10") == ["LMA 002"]
    assert stopped(bench)["A"][1] == pytest.approx(limit, abs=1e-6)


def test_a_limit_that_never_answers_is_passed() -> None:
    bench = Bench(cartesian())
    bench.motor("Z").held[Sensor.PLUS_LIMIT] = False
    assert bench.do("LMI 220") == ["LMI"]
    assert bench.motor("Z").at == 220.0


# Whatever is asked


moves = st.lists(
    st.tuples(
        st.sampled_from(["LMI", "LMA", "MMI", "MMA"]),
        st.lists(st.floats(-300, 300).map(lambda value: round(value, 2)), min_size=1, max_size=3),
        st.floats(1, 100).map(lambda value: round(value, 1)),
        st.booleans(),
        st.none() | st.tuples(st.sampled_from(["ASS", "AES", "APS"]), st.floats(0, 1)),
    ),
    min_size=1,
    max_size=4,
)


@settings(max_examples=80, deadline=None)
@given(moves)
def test_any_moves_end_and_every_start_has_its_stop(
    asked: list[tuple[str, list[float], float, bool, tuple[str, float] | None]],
) -> None:
    bench = Bench()
    bench.home()
    for name, values, percent, curve, interruption in asked:
        bench.asked(f"VAO {percent:g}", f"MAO {percent:g}", f"SCV {curve:d}", "DRT")
        heard = bench.ask(f"{name} {','.join(f'{value:g}' for value in values)}")
        if interruption is not None and not heard:
            heard += bench.wait(interruption[1]) + bench.ask(interruption[0])
        heard += bench.finish()
        finals = [line for line in heard if line.startswith(name)]
        assert len(finals) == 1
        if finals == ["LMA"] and interruption is None:
            assert bench.robot.unit.shown_users(bench.now)[: len(values)] == pytest.approx(values, abs=0.011)
        starts, stops = (bench.line.truth.of(kind) for kind in ("axis_start", "axis_stop"))
        assert sorted(str(fact.facts["axis"]) for fact in starts) == sorted(
            str(fact.facts["axis"]) for fact in stops
        )
        assert all(motor.within_limits(motor.at) for motor in bench.robot.unit.motors)
