"""From the text of a command to what it does."""

import pytest

from protocols.rorze.position import GetPosition
from simulator.rorze.actions import Refused, codes_acted_out, understand


def test_a_command_is_understood_once_and_remembered() -> None:
    order = understand("6PD")
    assert isinstance(order.command, GetPosition)
    assert understand("6PD") is order


@pytest.mark.parametrize(
    ("text", "code"),
    [("", 0x49), ("6P", 0x49), ("???", 0x49), ("6PDx", 0x4A), ("9CD8", 0x4A), ("1+M0", 0x5D)],
)
def test_what_is_not_understood_has_its_code(text: str, code: int) -> None:
    with pytest.raises(Refused) as refusal:
        understand(text)
    assert refusal.value.code == code


def test_codes_are_three_characters() -> None:
    assert {len(code) for code in codes_acted_out()} == {3}
