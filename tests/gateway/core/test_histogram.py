"""Durations, counted by length."""

from math import inf

from hypothesis import given
from hypothesis import strategies as st

from gateway.core.histogram import Histogram

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
