"""The load of a line: what it is taken for, over the last ten seconds and since the start."""

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.load import WINDOW_S, Histogram, Load


def test_a_frame_takes_the_line_until_its_reply() -> None:
    load = Load()
    load.note("clients", 1.0, 1.5)
    assert load.percent(5.0) == {"clients": 5.0}


def test_what_is_written_beside_takes_it_from_what_awaits_its_reply() -> None:
    load = Load()
    load.note("health", 0.0, 1.0)
    load.note("stops", 1.0, 3.0)
    assert load.percent(3.0) == {"health": 10.0, "stops": 20.0}


def test_the_load_is_that_of_ten_seconds_and_the_sum_stays() -> None:
    load = Load()
    load.note("clients", 0.0, 1.0)
    assert load.percent(0.9 + WINDOW_S) == {"clients": 10.0}
    assert load.percent(1.0 + WINDOW_S) == {}
    assert load.busy_s["clients"] == pytest.approx(1.0)


BOUNDS = (0.01, 0.1, 1.0)


def test_a_bound_is_included() -> None:
    histogram = Histogram(BOUNDS)
    for took_s in (0.01, 0.011, 5.0):
        histogram.observe(took_s)
    assert histogram.up_to() == [(0.01, 1), (0.1, 2), (1.0, 2), (inf, 3)]
    assert histogram.total_s == 0.01 + 0.011 + 5.0


@given(st.lists(st.floats(0, 10)))
def test_it_counts_what_is_no_longer_than_each_bound(times: list[float]) -> None:
    histogram = Histogram(BOUNDS)
    for took_s in times:
        histogram.observe(took_s)
    assert histogram.up_to() == [(it, sum(took <= it for took in times)) for it in (*BOUNDS, inf)]
