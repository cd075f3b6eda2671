"""The noise filter against the manual's algorithm, step by step."""

from hypothesis import given
from hypothesis import strategies as st

from simulator.rorze.debounce import SAMPLE_S, NoiseFilter

# Changes of an input: after so many tenths of a sample, never on a sample itself.
CHANGES = st.lists(st.integers(1, 60).map(lambda tenths: tenths * 10 + 1), max_size=20)


class Sampled:
    """The algorithm as RC-420 manual 13.9.7 words it."""

    def __init__(self, limit: int) -> None:
        self.limit, self.count, self.level = limit, 0, False

    def sample(self, raw: bool) -> None:
        self.count = min(self.limit, self.count + 1) if raw else max(0, self.count - 1)
        if self.count == self.limit:
            self.level = True
        if self.count == 0:
            self.level = False


def test_a_level_is_believed_after_as_many_samples_as_the_count() -> None:
    noise_filter = NoiseFilter(False, 5, now=0.0)
    noise_filter.sense(True, 0.0005)
    assert noise_filter.changes_at() == 0.005
    noise_filter.advance(0.0049)
    assert not noise_filter.level
    noise_filter.advance(0.005)
    assert noise_filter.level
    assert noise_filter.changes_at() is None


def test_a_short_disturbance_is_not_seen_but_delays_what_follows() -> None:
    noise_filter = NoiseFilter(False, 5, now=0.0)
    noise_filter.sense(True, 0.0005)
    noise_filter.sense(False, 0.0035)  # three samples up
    noise_filter.sense(True, 0.0045)  # one down
    assert noise_filter.changes_at() == 0.007


def test_without_a_filter_the_level_follows_at_once() -> None:
    noise_filter = NoiseFilter(False, 1, now=0.0)
    noise_filter.sense(True, 0.0001)
    assert noise_filter.level
    noise_filter.sense(False, 0.0002)
    assert not noise_filter.level


def test_switching_the_filter_off_shows_the_input_as_it_is() -> None:
    noise_filter = NoiseFilter(False, 99, now=0.0)
    noise_filter.sense(True, 0.01)
    noise_filter.set_limit(1, 0.02)
    assert noise_filter.level


@given(CHANGES, st.integers(2, 99), st.sampled_from([0.0, 12.0, 1e6]))
def test_it_counts_like_the_algorithm_sample_by_sample(changes: list[int], limit: int, start: float) -> None:
    noise_filter, algorithm = NoiseFilter(False, limit, start), Sampled(limit)
    hundredths, raw, samples = 0, False, 0
    for change in changes:
        hundredths += change
        expected, missing = noise_filter.changes_at(), 0
        while samples < hundredths // 100:
            samples += 1
            before = algorithm.level
            algorithm.sample(raw)
            if algorithm.level != before:
                missing = samples
        if missing:
            assert expected is not None
            assert abs(expected - (start + missing * SAMPLE_S)) < SAMPLE_S / 100
        raw = not raw
        noise_filter.sense(raw, start + hundredths / 100 * SAMPLE_S)
        assert noise_filter.level == algorithm.level
