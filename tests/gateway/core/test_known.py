"""Facts that only a gateway can know of a controller are there for the next gateway of that controller."""

import pytest

from gateway.core.known import FactStore


class Counting:
    """Knows a number."""

    def __init__(self, known: FactStore, address: str = "arm.3F") -> None:
        self.number = 0
        self._keep = known.keep(address, self)

    def count_to(self, number: int) -> None:
        self.number = number
        self._keep()

    def memory(self) -> str:
        return str(self.number)

    def recall(self, memory: str) -> None:
        self.number = int(memory)


def test_who_looks_after_a_controller_next_goes_on_from_what_was_known() -> None:
    known = FactStore()
    Counting(known).count_to(7)
    assert Counting(known).number == 7
    assert Counting(known, "arm.00").number == 0


def test_a_change_is_told_once() -> None:
    known, told = FactStore(), list[tuple[str, str]]()
    known.on_change = lambda address, fact: told.append((address, fact))
    counting = Counting(known)
    for number in (7, 7, 8):
        counting.count_to(number)
    assert told == [("arm.3F", "7"), ("arm.3F", "8")]


def test_what_an_earlier_life_knew_counts_and_what_cannot_be_read_is_forgotten_with_a_word(
    caplog: pytest.LogCaptureFixture,
) -> None:
    known = FactStore()
    known.resume({"arm.3F": "7", "arm.00": "seven"})
    assert Counting(known).number == 7
    assert Counting(known, "arm.00").number == 0
    assert "what was known of arm.00 cannot be read" in caplog.text
