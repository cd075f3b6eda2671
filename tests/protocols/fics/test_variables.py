import pytest

from protocols.fics.commands import read
from protocols.fics.variables import GetVariable, SetVariable
from protocols.table import RangeFault, SyntaxFault


def test_a_variable_is_set_by_an_equals_sign_and_asked_for_without() -> None:
    assert read("VAR", "V5") == read("VAR", "V05") == GetVariable(number=5)
    assert read("VAR", "V99=-2.5") == SetVariable(number=99, value=-2.5)
    for text in ("", "5", "V", "V5=", "V5=x", "V-1"):
        with pytest.raises(SyntaxFault):
            read("VAR", text)
    for text in ("V100", "V100=1", "V005"):
        with pytest.raises(RangeFault):
            read("VAR", text)


def test_the_answer_repeats_the_number_that_was_asked_for() -> None:
    asked = GetVariable(number=7)
    assert asked.read_reply("V07=+1").value == 1
    with pytest.raises(SyntaxFault):
        asked.read_reply("V08=+1")
