"""The way of a move: all of it, however long it takes, in bounded memory."""

from datetime import UTC, datetime, timedelta
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import NotFound
from gateway.core.move_log import PLACES, WAYS, Trajectories, Trajectory

NOON = datetime(2026, 11, 22, 12, tzinfo=UTC)


def test_places_are_told_by_the_time_since_the_command() -> None:
    trajectory = Trajectory(NOON, 100.0, 7)
    trajectory.add(100.5, 8)
    trajectory.add(101.0, 9)
    assert trajectory.places == [(0.0, 7), (0.5, 8), (1.0, 9)]
    assert trajectory.time_of(0.5) == NOON + timedelta(seconds=0.5)


def test_what_was_read_before_the_command_is_not_of_the_way() -> None:
    trajectory = Trajectory(NOON, 100.0, 7)
    trajectory.add(99.9, 3)
    assert trajectory.places == [(0.0, 7)]


@given(st.lists(st.floats(0.001, 10), min_size=1, max_size=3 * PLACES))
def test_a_long_way_is_thinned_and_keeps_its_ends(pauses: list[float]) -> None:
    trajectory = Trajectory(NOON, 0.0, 0)
    now = 0.0
    for number, pause_s in enumerate(pauses, 1):
        now += pause_s
        trajectory.add(now, number)
    places = trajectory.places
    assert places[0] == (0.0, 0)
    assert places[-1] == (now, len(pauses))
    assert len(places) <= PLACES
    assert all(one < other for one, other in pairwise(places))
    if len(pauses) < PLACES - 1:
        assert len(places) == len(pauses) + 1


def test_a_long_way_is_thinned_evenly() -> None:
    trajectory = Trajectory(NOON, 0.0, 0)
    for number in range(1, 100_000):
        trajectory.add(0.1 * number, number)
    gaps = [later - sooner for (sooner, _), (later, _) in pairwise(trajectory.places[:-1])]
    assert len(trajectory.places) > PLACES / 3
    assert max(gaps) < 4 * min(gaps)


def test_the_ways_of_the_newest_moves_are_kept() -> None:
    trajectories = Trajectories[Trajectory[int]]()
    for number in range(WAYS + 1):
        trajectories.begin(str(number), Trajectory(NOON, 0.0, number))
    assert trajectories.of("1").places == [(0.0, 1)]
    with pytest.raises(NotFound, match="No samples of the move 0"):
        trajectories.of("0")
