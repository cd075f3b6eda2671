"""The load of a line: what it is taken for, over the last ten seconds and since the start."""

import pytest

from gateway.core.load import WINDOW_S, Load


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
