"""Silence of a body in the middle of a move: the answers that count, and those that do not."""

import pytest

from gateway.core.move_record import LOST_AFTER_S
from gateway.core.silence import OUT_OF_REACH_S, Silence

LONGEST_S = 2.7


def test_silence_adds_up_until_the_move_is_lost() -> None:
    silence = Silence(100.0, LONGEST_S)
    for count in range(1, 13):
        silence.unanswered(100.0 + 2.5 * count, silent=True)
        assert silence.of_body is silence.too_long is (2.5 * count >= LOST_AFTER_S)


def test_an_answer_ends_the_silence() -> None:
    silence = Silence(0.0, LONGEST_S)
    silence.unanswered(2.0, silent=True)
    silence.unanswered(3.0, silent=False)
    silence.answered(4.0)
    assert (silence.silent_s, silence.out_of_reach_s) == (0.0, 0.0)
    silence.unanswered(5.0, silent=True)
    assert silence.silent_s == 1.0


def test_a_question_that_waited_long_for_its_turn_counts_no_longer_than_a_question() -> None:
    silence = Silence(0.0, LONGEST_S)
    silence.unanswered(1000.0, silent=True)
    assert (silence.silent_s, silence.too_long) == (LONGEST_S, False)
    silence.unanswered(5000.0, silent=False)
    assert (silence.out_of_reach_s, silence.too_long) == (LONGEST_S, False)


def test_what_could_not_be_asked_for_long_is_not_asked_for_ever() -> None:
    silence = Silence(0.0, LONGEST_S)
    now = 0.0
    while not silence.too_long:
        now += 0.2
        silence.unanswered(now, silent=False)
    assert now == pytest.approx(OUT_OF_REACH_S, abs=0.3)
    assert not silence.of_body
