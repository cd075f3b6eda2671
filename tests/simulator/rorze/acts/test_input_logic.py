"""Contacts are changed one by one or all at once, and noise counts alike."""

import pytest

from tests.simulator.rorze.bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.mark.parametrize(("code", "all_closed"), [("DI", "H03FF"), ("DL", "H7F")])
def test_one_contact_is_closed_and_opened_again_and_the_others_stay(
    bench: Bench, code: str, all_closed: str
) -> None:
    for before, others in (("H" + "0" * (len(all_closed) - 1), 0), (all_closed, int(all_closed[1:], 16))):
        bench.sent(f"{code}S{before}", f"{code}S3,1")
        assert int(bench.send(f"{code}D")[1:], 16) == others | 1 << 3
        bench.sent(f"{code}S3,0")
        assert int(bench.send(f"{code}D")[1:], 16) == others & ~(1 << 3)
        assert bench.send(f"{code}D3") == "0"


def test_one_noise_count_is_set_and_the_others_stay(bench: Bench) -> None:
    bench.sent("DCS4", "DCS14,9")
    assert [bench.send(f"DCD{bit}") for bit in (0, 13, 14)] == ["004", "004", "009"]
