import pytest
from pydantic import ValidationError

from protocols.fics.commands import read
from protocols.fics.link import Completion, FicsRefusal, Ver3Reader, credit
from protocols.fics.macros import RunMacro
from protocols.table import RangeFault, SyntaxFault


def test_a_name_that_is_no_commands_runs_a_macro() -> None:
    assert read("PCK", "10,,-3") == RunMacro(macro="PCK", arguments=[10, None, -3])
    assert read("X01", "") == RunMacro(macro="X01")


def test_a_macro_is_completed_and_refused_under_its_own_name() -> None:
    macro = RunMacro(macro="PCK")
    done, other, refused = Ver3Reader().feed(b"PCK\rPUT\rPCK E12\r")
    assert credit(macro, done) == Completion("PCK")
    assert credit(macro, other) is None
    assert credit(macro, refused) == FicsRefusal("PCK", "E12")


@pytest.mark.parametrize("name", ["LMA", "POE", "MSM"])
def test_a_macro_cannot_pass_for_a_command(name: str) -> None:
    with pytest.raises(ValidationError, match="is a command"):
        RunMacro(macro=name)


@pytest.mark.parametrize("name", ["lma", "AB", "ABCD", "A B", "A\r1", ""])
def test_a_macro_has_three_capitals_or_digits(name: str) -> None:
    with pytest.raises(ValidationError):
        RunMacro(macro=name)


def test_a_macro_takes_up_to_four_numbers() -> None:
    assert RunMacro(macro="PCK", arguments=[1, 2, 3, 4]).text == "PCK 1,2,3,4"
    with pytest.raises(SyntaxFault):
        read("PCK", "1,2,3,4,5")
    with pytest.raises(RangeFault):
        read("PCK", "9999999999")
