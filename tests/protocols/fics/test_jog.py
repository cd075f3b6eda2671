import pytest

from protocols.fics.commands import read
from protocols.fics.jog import StartJog, StepAxis, StopJog
from protocols.table import RangeFault, SyntaxFault


def test_a_jog_without_direction_stops() -> None:
    assert read("JOG", "X+") == StartJog(axis="X", direction="+")
    assert read("JOG", "A-") == StartJog(axis="A", direction="-")
    assert read("JOG", "@") == StopJog(axis="@")


@pytest.mark.parametrize("text", ["", "+", "X*", "x+", "XY", "X+1"])
def test_a_jog_names_one_axis(text: str) -> None:
    with pytest.raises(SyntaxFault):
        read("JOG", text)


def test_a_step_may_leave_out_its_plus() -> None:
    assert StepAxis.read("X+5") == StepAxis.read("X5") == StepAxis(axis="X", steps=5)
    assert StepAxis(axis="Z", steps=-255).text == "JTE Z-255"


@pytest.mark.parametrize("text", ["X0", "X256", "X-256"])
def test_a_step_is_between_1_and_255(text: str) -> None:
    with pytest.raises(RangeFault):
        StepAxis.read(text)
