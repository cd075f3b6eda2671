"""News told of a port are true, in whatever order they come."""

from hypothesis import given
from hypothesis import strategies as st

from gateway.core.line_state import TABLE, LineState, PortAction, PortLife, PortNews, PortState

histories = st.lists(st.sampled_from(PortNews), max_size=30)


@given(histories)
def test_up_and_down_are_told_in_turn_and_only_of_what_is_so(history: list[PortNews]) -> None:
    life, told_up = PortLife(), False
    for news in history:
        action = life.take(news, news.value)
        if action is PortAction.TELL_UP:
            assert not told_up
            assert life.told is LineState.READY
            told_up = True
        elif action is PortAction.TELL_DOWN:
            assert told_up
            told_up = False
        assert told_up == (life.told in (LineState.READY, LineState.SETTING_UP) and life.state in UP)
        assert told_up or life.told is not LineState.READY
        assert (life.trouble is None) == (life.told in (LineState.READY, LineState.SETTING_UP))
        assert life.is_open or not life.is_set_up


UP = (PortState.READY, PortState.SETTING_UP_AGAIN)


@given(histories)
def test_a_line_that_was_closed_for_good_stays_closed_with_its_reason(history: list[PortNews]) -> None:
    life = PortLife()
    life.take(PortNews.END, "the configuration is another")
    for news in history:
        action = life.take(news, news.value)
        assert action is (PortAction.CLOSE if news is PortNews.OPENED else PortAction.NONE)
    assert (life.told, life.is_open, life.trouble) == (LineState.DOWN, False, "the configuration is another")


@given(histories)
def test_nothing_is_sent_while_another_gateway_has_the_line(history: list[PortNews]) -> None:
    life = PortLife()
    life.take(PortNews.ELSEWHERE, "gateway b has it")
    for news in history:
        if news in (PortNews.OURS, PortNews.END):
            break
        life.take(news)
        assert (life.told, life.is_open) == (LineState.STANDBY, False)


def test_only_an_open_port_is_heard() -> None:
    heard = PortNews.SET_UP, PortNews.ANSWERED, PortNews.UNANSWERED, PortNews.SILENCE
    for state in (PortState.DOWN, PortState.STANDBY, PortState.ENDED):
        assert {TABLE[state][news].state for news in heard} == {state}
