from collections.abc import Sequence
from math import ceil, isclose, nextafter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.rorze.profile import (
    TICK_S,
    ChangeSpan,
    Profile,
    ProfileError,
    SpeedChange,
    SpeedParameters,
    first_moment,
    plan,
    plan_slow,
    ramp_pulses,
    ramp_time_s,
    resolve_changes,
    steady,
)

# The pattern A[17] of RC-420 manual 13.3.4: quick to start, soft to stop.
UP = SpeedParameters(low=5_000, high=50_000, acceleration=70_000, rising=30, falling=30)
DOWN = SpeedParameters(low=50, high=50_000, acceleration=95_000, rising=50, falling=20)
DOWN_FROM_40000 = SpeedParameters(low=50, high=40_000, acceleration=95_000, rising=50, falling=20)
DOWN_FROM_60000 = SpeedParameters(low=50, high=60_000, acceleration=95_000, rising=50, falling=20)


@st.composite
def speed_parameters(draw: st.DrawFn) -> SpeedParameters:
    low = draw(st.integers(1, 30_000))
    high = draw(st.integers(low, 1_000_000))
    rising = draw(st.integers(0, 100))
    falling = draw(st.integers(0, 100 - rising))
    return SpeedParameters(low, high, draw(st.integers(1, 10_000_000)), rising, falling)


distances = st.integers(0, 999_999_999)


def duration_of(profile: Profile) -> float:
    assert profile.duration_s is not None
    return profile.duration_s


def moments(profile: Profile, count: int = 200) -> Sequence[float]:
    return [*(duration_of(profile) * index / count for index in range(count)), duration_of(profile)]


def ticked_pulses(parameters: SpeedParameters, start: float, end: float) -> int:
    """The controller's count written out tick by tick, as slow and plain as it is defined."""
    duration_s = ramp_time_s(parameters, start, end)
    first, last = parameters.rising / 100, parameters.falling / 100
    if end < start:
        first, last = last, first
    steepness = 1 / (1 - (first + last) / 2)

    def speed(at_s: float) -> float:
        share = at_s / duration_s
        if share < first:
            gained = steepness * share**2 / (2 * first)
        elif share <= 1 - last:
            gained = steepness * (share - first / 2)
        else:
            gained = 1 - steepness * (1 - share) ** 2 / (2 * last)
        return start + (end - start) * gained

    ticks = [index * TICK_S for index in range(ceil(duration_s / TICK_S))]
    pulses = sum(speed(at_s) * min(TICK_S, duration_s - at_s) for at_s in ticks)
    return max(1, ceil(pulses - 1e-6))


def test_the_ramps_of_the_manual_take_the_printed_pulses() -> None:
    assert ramp_pulses(UP, 5_000, 50_000) == 25_236
    assert ramp_pulses(DOWN, 50_000, 50) == 17_778
    assert ramp_pulses(DOWN_FROM_40000, 40_000, 50) == 11_383
    assert ramp_pulses(DOWN_FROM_60000, 60_000, 50) == 25_594


def test_the_deceleration_starts_where_the_manual_says() -> None:
    assert plan(50_000, UP, DOWN).brake_at == 32_222


@given(
    st.integers(1, 50_000),
    st.integers(1, 50_000),
    st.integers(100_000, 10_000_000),
    st.integers(0, 100).flatmap(lambda rising: st.tuples(st.just(rising), st.integers(0, 100 - rising))),
)
def test_the_closed_form_counts_as_the_ticks_do(
    start: int, end: int, acceleration: int, shares: tuple[int, int]
) -> None:
    parameters = SpeedParameters(1, 1, acceleration, *shares)
    if start == end:
        assert ramp_pulses(parameters, start, end) == 0
    else:
        assert ramp_pulses(parameters, start, end) == ticked_pulses(parameters, start, end)


def test_the_slowest_ramp_is_counted_at_once() -> None:
    slowest = SpeedParameters(low=1, high=1_000_000, acceleration=1, rising=50, falling=50)
    assert isclose(ramp_pulses(slowest, 1, 1_000_000), 1e12, rel_tol=1e-5)


def test_a_full_move_climbs_runs_and_descends() -> None:
    move = plan(50_000, UP, DOWN)
    top_at = move.curve.time_of(25_236)
    brake_at = move.curve.time_of(32_222)
    assert move.speed(0) == 5_000
    assert isclose(top_at, ramp_time_s(UP, 5_000, 50_000), rel_tol=2e-3)
    assert isclose(move.speed(top_at), 50_000)
    assert isclose(move.speed((top_at + brake_at) / 2), 50_000)
    assert isclose(duration_of(move) - brake_at, ramp_time_s(DOWN, 50_000, 50), rel_tol=2e-3)
    assert isclose(move.speed(nextafter(duration_of(move), 0)), 50, rel_tol=1e-6)
    assert move.speed(duration_of(move)) == 0


def test_acceleration_builds_up_holds_and_dies_away() -> None:
    move = plan(50_000, UP, DOWN)
    ramp_s = move.curve.time_of(25_236)
    forces = [move.curve.at(ramp_s * share).acceleration for share in (0.0, 0.15, 0.3, 0.5, 0.7, 0.85)]
    assert forces == pytest.approx([0, 35_000, 70_000, 70_000, 70_000, 35_000], rel=2e-3)


def test_deceleration_builds_up_over_ob_and_dies_away_over_oa() -> None:
    move = plan(50_000, UP, DOWN)
    brake_s = move.curve.time_of(32_222)
    ramp_s = duration_of(move) - brake_s
    forces = [move.curve.at(brake_s + ramp_s * share).acceleration for share in (0.1, 0.2, 0.4, 0.5, 0.75)]
    assert forces == pytest.approx([-47_500, -95_000, -95_000, -95_000, -47_500], rel=2e-3)


def test_a_short_move_lowers_its_top_speed_and_keeps_the_shape() -> None:
    move = plan(5_000, UP, DOWN)
    top = round(max(phase.speed for phase in move.curve.phases))
    assert ramp_pulses(UP, 5_000, top) + ramp_pulses(DOWN, top, 50) <= 5_000
    assert ramp_pulses(UP, 5_000, top + 1) + ramp_pulses(DOWN, top + 1, 50) > 5_000
    assert move.speed(0) == 5_000
    assert max(phase.acceleration for phase in move.curve.phases) == pytest.approx(70_000, rel=2e-2)
    assert min(phase.acceleration for phase in move.curve.phases) == pytest.approx(-95_000, rel=2e-2)
    assert isclose(move.speed(nextafter(duration_of(move), 0)), 50, rel_tol=1e-6)


def test_a_move_too_short_to_descend_from_ol_starts_below_it() -> None:
    move = plan(100, UP, DOWN)
    start = round(move.speed(0))
    assert 50 < start < UP.low
    assert ramp_pulses(DOWN, start, 50) <= 100 < ramp_pulses(DOWN, start + 1, 50)
    assert move.speed(nextafter(duration_of(move), 0)) == pytest.approx(50, rel=1e-6)


def test_a_move_between_equal_ols_too_short_for_a_ramp_creeps() -> None:
    move = plan(1, DOWN_FROM_40000, DOWN_FROM_40000.capped(50))
    assert move.speed(0) == 50
    assert duration_of(move) <= 1 / 50


def test_no_distance_takes_no_time() -> None:
    move = plan(0, UP, DOWN)
    assert duration_of(move) == 0
    assert move.emitted(0) == 0


def test_a_deceleration_from_less_than_the_speed_ends_above_ol() -> None:
    move = plan(50_000, UP, DOWN_FROM_40000)
    assert move.brake_at == 50_000 - 11_383
    assert move.speed(nextafter(duration_of(move), 0)) > 10_000
    assert move.emitted(duration_of(move)) == 50_000


def test_a_deceleration_from_more_than_the_speed_runs_on_at_ol() -> None:
    move = plan(60_000, UP, DOWN_FROM_60000)
    slow_from = move.curve.time_of(60_000 - 25_594 + 17_778)
    assert move.speed(slow_from + 1) == 50
    assert duration_of(move) - slow_from == pytest.approx((25_594 - 17_778) / 50, rel=1e-6)


def test_an_endless_move_runs_at_oh_for_ever() -> None:
    move = plan(None, UP, DOWN)
    assert move.duration_s is None
    assert move.speed(3600) == 50_000
    assert not move.braking(3600)
    assert move.emitted(3600) - move.emitted(3599) == pytest.approx(50_000, abs=1)


def test_a_low_speed_move_has_no_ramps() -> None:
    move = plan_slow(500, UP, DOWN)
    assert move == steady(500, UP.low, UP, DOWN)
    assert duration_of(move) == 0.1
    assert [move.speed(at_s) for at_s in (0, 0.05, 0.0999)] == [5_000] * 3
    assert [move.emitted(at_s) for at_s in (0, 0.05, 0.1, 1)] == [0, 250, 500, 500]


@given(distances, speed_parameters(), speed_parameters())
def test_every_move_goes_forward_and_ends_on_its_last_pulse(
    distance: int, up: SpeedParameters, down: SpeedParameters
) -> None:
    move = plan(distance, up, down)
    counts = [move.emitted(at_s) for at_s in moments(move)]
    assert counts == sorted(counts)
    assert counts[-1] == distance
    assert move.emitted(nextafter(duration_of(move), 0)) == max(0, distance - 1)


@given(distances, speed_parameters(), speed_parameters())
def test_no_move_is_faster_than_oh_or_slower_than_both_ols(
    distance: int, up: SpeedParameters, down: SpeedParameters
) -> None:
    move = plan(distance, up, down)
    speeds = [move.speed(at_s) for at_s in moments(move)[:-1] if not move.ended(at_s)]
    assert all(min(up.low, down.low) * 0.999 <= speed <= up.high * 1.001 for speed in speeds)


@given(distances, speed_parameters(), speed_parameters(), st.floats(0, 0.999))
def test_positions_lie_on_the_curve(
    distance: int, up: SpeedParameters, down: SpeedParameters, share: float
) -> None:
    move = plan(distance, up, down)
    at_s, step_s = duration_of(move) * share, duration_of(move) * 1e-4
    slowest, fastest = sorted((move.curve.at(at_s).speed, move.curve.at(at_s + step_s).speed))
    covered = move.curve.at(at_s + step_s).position - move.curve.at(at_s).position
    # Between two moments the speed may turn once, at a phase boundary; the acceleration bounds how far.
    turn = 2 * max(up.acceleration, down.acceleration) * step_s
    noise = 1e-9 * distance + 1e-9
    assert (slowest - turn) * step_s - noise <= covered <= (fastest + turn) * step_s + noise


def test_a_speed_change_is_complete_at_its_t_and_starts_at_its_f() -> None:
    changes = [SpeedChange("T", 78_000, 10_000), SpeedChange("F", 80_000, 50_000)]
    slowing = ramp_pulses(DOWN, 50_000, 10_000)
    rising = ramp_pulses(UP, 10_000, 50_000)
    assert resolve_changes(UP, DOWN, changes) == (
        ChangeSpan(78_000 - slowing, 78_000, 10_000),
        ChangeSpan(80_000, 80_000 + rising, 50_000),
    )
    move = plan(200_000, UP, DOWN, changes)

    def speed_at(pulse: int) -> float:
        return move.speed(move.curve.time_of(pulse))

    assert speed_at(78_000 - slowing) == pytest.approx(50_000)
    assert [speed_at(pulse) for pulse in (78_000, 79_000, 80_000)] == pytest.approx([10_000] * 3)
    assert speed_at(80_000 + rising) == pytest.approx(50_000)
    assert move.emitted(duration_of(move)) == 200_000


@pytest.mark.parametrize(
    ("code", "distance", "changes"),
    [
        (0x62, 200_000, [SpeedChange("F", 80_000, 30_000)]),
        (0x65, 100_000, [SpeedChange("T", 78_000, 10_000), SpeedChange("F", 80_000, 50_000)]),
        (0x65, 200_000, [SpeedChange("F", 25_235, 10_000), SpeedChange("F", 80_000, 50_000)]),
        (0x65, 200_000, [SpeedChange("F", 80_000, 10_000), SpeedChange("F", 80_001, 50_000)]),
        (0x65, 1_000, [SpeedChange("F", 80_000, 50_000)]),
        (0x65, None, [SpeedChange("T", 10, 10_000)]),
    ],
)
def test_speed_changes_that_do_not_fit_are_refused(
    code: int, distance: int | None, changes: list[SpeedChange]
) -> None:
    for make in (plan, plan_slow):
        with pytest.raises(ProfileError) as refusal:
            make(distance, UP, DOWN, changes)
        assert refusal.value.code == code


def test_an_endless_move_may_end_on_any_speed() -> None:
    move = plan(None, UP, DOWN, [SpeedChange("F", 80_000, 3_000)])
    assert move.speed(3600) == 3_000


@pytest.mark.parametrize(
    ("code", "values"),
    [
        (0x45, (5_000, 4_999, 100, 50, 50)),
        (0x46, (50, 5_000, 100, 51, 50)),
        (0x5D, (0, 5_000, 100, 50, 50)),
        (0x5D, (50, 1_000_001, 100, 50, 50)),
        (0x5D, (50, 5_000, 0, 50, 50)),
        (0x5D, (50, 5_000, 100, -1, 50)),
        (0x5D, (50, 5_000, 100, 0, 101)),
    ],
)
def test_impossible_parameters_cannot_be_built(code: int, values: tuple[int, int, int, int, int]) -> None:
    with pytest.raises(ProfileError) as refusal:
        SpeedParameters(*values)
    assert refusal.value.code == code


def test_a_bent_move_keeps_its_point_of_deceleration() -> None:
    move = plan(200_000, UP, DOWN).diverted(2.0, 20_000, UP, DOWN)
    assert move.brake_at == 200_000 - 17_778
    assert move.speed(3.5) == pytest.approx(20_000)
    assert move.speed(move.curve.time_of(200_000 - 17_778 + 16_000)) == 50
    assert move.emitted(duration_of(move)) == 200_000


def test_a_bent_move_still_makes_the_changes_ahead_of_it() -> None:
    changes = [SpeedChange("F", 100_000, 10_000), SpeedChange("F", 120_000, 50_000)]
    move = plan(200_000, UP, DOWN, changes).diverted(1.0, 30_000, UP, DOWN)
    assert move.speed(move.curve.time_of(100_000)) == pytest.approx(30_000)
    assert move.speed(move.curve.time_of(119_999)) == pytest.approx(10_000)
    assert move.speed(move.curve.time_of(170_000)) == pytest.approx(50_000)


def test_a_speed_below_one_pulse_a_second_is_refused() -> None:
    with pytest.raises(ProfileError, match="goes on unchanged"):
        plan(None, UP, DOWN).diverted(1.0, 0, UP, DOWN)


@given(st.floats(0, 10), st.floats(11, 20))
def test_first_moment_is_exact(threshold: float, high: float) -> None:
    found = first_moment(lambda at_s: at_s > threshold, 0.0, high)
    assert found == nextafter(threshold, 20)


@settings(max_examples=200)
@given(
    st.one_of(st.none(), distances),
    speed_parameters(),
    speed_parameters(),
    st.lists(st.tuples(st.floats(0, 100), st.integers(1, 1_000_000) | st.none()), max_size=5),
)
def test_whatever_is_done_to_a_move_it_never_jumps_nor_turns_back(
    distance: int | None,
    up: SpeedParameters,
    down: SpeedParameters,
    deeds: list[tuple[float, int | None]],
) -> None:
    move = plan(distance, up, down)
    for at_s, speed in sorted(deeds, key=lambda deed: deed[0]):
        before, running_at = move.emitted(at_s), move.speed(at_s)
        move = move.braked(at_s, down) if speed is None else move.diverted(at_s, speed, up, down)
        assert move.emitted(at_s) == before
        assert move.ended(at_s) or move.speed(at_s) == pytest.approx(running_at)
        later = [move.emitted(at_s + step / 8) for step in range(17)]
        assert later == sorted(later)
        if distance is not None:
            assert later[-1] <= distance
