import pytest

from protocols.fics.inputs_outputs import GetInputChannel, GetOutputChannel, SwitchOutput
from protocols.table import RangeFault, SyntaxFault


def test_a_channel_is_answered_in_two_hexadecimal_digits() -> None:
    assert GetInputChannel(channel=1).read_reply("A5").bits == 0xA5
    for text in ("", "5", "0A5", "a5", "5G"):
        with pytest.raises(SyntaxFault):
            GetOutputChannel(channel=1).read_reply(text)


def test_an_output_is_switched_by_its_sign() -> None:
    assert SwitchOutput.read("1-7:+") == SwitchOutput(channel=1, bit=7, on=True)
    assert SwitchOutput(channel=12, bit=0, on=False).text == "IOT 12-0:-"


@pytest.mark.parametrize("text", ["0-1:+", "100-1:+", "1-8:+"])
def test_channels_start_at_one_and_bits_end_at_seven(text: str) -> None:
    with pytest.raises(RangeFault):
        SwitchOutput.read(text)


@pytest.mark.parametrize("text", ["1-1", "1:1:+", "1-1:1", "1-1:"])
def test_a_switch_has_channel_bit_and_sign(text: str) -> None:
    with pytest.raises(SyntaxFault):
        SwitchOutput.read(text)
