"""Lines that are otherwise than is assumed, at the pace of a wire."""

import pytest

from protocols.lines import CR
from simulator.rorze.line import build_line
from simulator.rorze.quirks import QUIRKS
from simulator.truth import TruthLog

QUESTIONS = [b"&003NDP[%04d]" % number + CR for number in range(3)]


@pytest.mark.parametrize("baud", [4800, 9600, 38400])
def test_a_frame_that_comes_before_the_last_reply_is_dropped_at_each_speed(baud: int) -> None:
    line = build_line((0x00,), 0.0, TruthLog())
    QUIRKS["interjection"](line)
    now = 0.0
    for question in QUESTIONS:
        now += 10 / baud * len(question)
        line.receive(question, now)
    answers = line.take_output(now + 1.0).split(CR)[:-1]
    assert answers[0].startswith(b">&003NDP[0000]")
    assert len(answers) < len(QUESTIONS)
