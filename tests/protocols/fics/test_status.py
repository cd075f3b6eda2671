import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocols.fics.status import AxisSensors, AxisStatus, GetAxisSensors, GetAxisStatus, MotionMode
from protocols.table import SyntaxFault


def test_the_status_of_an_axis_is_taken_apart() -> None:
    moving, alarmed = GetAxisStatus().read_reply("2700,0B41").axes
    assert moving.motion_mode == MotionMode.MOVE
    assert (moving.origin_done, moving.servo_ready, moving.moving, moving.alarm) == (True, True, True, False)
    assert moving.driver_error == 0
    assert (alarmed.moving, alarmed.alarm, alarmed.driver_error) == (False, True, 0x41)


def test_the_sensors_of_an_axis_are_three_bits() -> None:
    assert GetAxisSensors().read_reply("1,6").axes == [
        AxisSensors(origin=True, plus_limit=False, minus_limit=False),
        AxisSensors(origin=False, plus_limit=True, minus_limit=True),
    ]


@pytest.mark.parametrize("text", ["", "270", "27000", "6000", "2700,", "27x0", "2f00"])
def test_a_status_has_four_digits_and_a_known_mode(text: str) -> None:
    with pytest.raises(SyntaxFault):
        GetAxisStatus().read_reply(text)


@pytest.mark.parametrize("text", ["", "8", "01", "1,,2"])
def test_sensors_have_one_digit(text: str) -> None:
    with pytest.raises(SyntaxFault):
        GetAxisSensors().read_reply(text)


@given(st.lists(st.from_regex("[0-5][0-9A-F]{3}", fullmatch=True), min_size=1, max_size=8).map(",".join))
def test_no_bit_of_a_status_is_lost(text: str) -> None:
    reply = GetAxisStatus().read_reply(text)
    assert reply.written() == text
    assert all(isinstance(axis, AxisStatus) for axis in reply.axes)
