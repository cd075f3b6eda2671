"""The life of a body, news by news, and the page that shows its tables."""

from dataclasses import fields
from pathlib import Path

import pytest

from gateway.rorze.body_states import TABLES, BodyAction, BodyLife, BodyNews, drawing
from gateway.rorze.knowledge import ENDS, BodyFacts

PAGE = Path(__file__).parents[3] / "docs" / "body-states.md"
STARTED = (BodyNews.STANDS, BodyNews.CLAIMED, BodyNews.SENT)


def after(*news: BodyNews) -> BodyLife:
    """A body of which this was heard."""
    life = BodyLife()
    for each in news:
        life.hear(each)
    return life


@pytest.mark.parametrize(
    ("news", "moving"),
    [
        ((), None),
        ((BodyNews.STANDS,), False),
        ((BodyNews.RUNS,), True),
        (STARTED, True),
        ((*STARTED, BodyNews.REFUSED), None),
        ((*STARTED, BodyNews.RESTS), False),
        ((BodyNews.STANDS, BodyNews.MAY_MOVE), None),
        ((BodyNews.STANDS, BodyNews.SILENT), None),
        ((BodyNews.STANDS, BodyNews.OUT_OF_REACH), None),
        ((*STARTED, BodyNews.SILENT), True),
        ((*STARTED, BodyNews.OUT_OF_REACH), True),
        ((*STARTED, BodyNews.MAY_MOVE), True),
    ],
)
def test_its_motor(news: tuple[BodyNews, ...], moving: bool | None) -> None:
    assert after(*news).moving is moving


def test_a_motor_that_runs_without_a_move_is_told_once() -> None:
    life = after(BodyNews.STANDS)
    assert [life.hear(BodyNews.RUNS), life.hear(BodyNews.RUNS)] == [BodyAction.TELL, BodyAction.NONE]


def test_a_motor_that_may_have_been_set_going_is_asked() -> None:
    life = after(BodyNews.STANDS)
    assert not life.look_due.is_set()
    life.hear(BodyNews.MAY_MOVE)
    assert life.look_due.is_set()


def test_it_is_moved_stopped_and_in_a_program_at_the_same_time() -> None:
    life = after(*STARTED, BodyNews.PROGRAM, BodyNews.STOP)
    assert (life.in_move, life.in_program, life.being_stopped, life.moving) == (True, True, True, True)
    for each in (BodyNews.RESTS, BodyNews.NO_STOP, BodyNews.OVER, BodyNews.PROGRAM_OVER):
        life.hear(each)
    assert (life.in_move, life.in_program, life.being_stopped, life.moving) == (False, False, False, False)


def test_a_body_counts_as_silent_until_its_next_motion_command() -> None:
    assert after(BodyNews.SILENT, BodyNews.STANDS).was_silent
    assert not after(BodyNews.OUT_OF_REACH).was_silent
    assert not after(BodyNews.SILENT, BodyNews.SENT).was_silent
    assert not after(BodyNews.SILENT, BodyNews.PROGRAM).was_silent
    assert after(BodyNews.CUT_OFF).was_silent, "its power may have been away in the middle of the program"


def test_every_step_leads_to_a_state_of_its_table() -> None:
    for table in TABLES.values():
        assert {step.state for steps in table.values() for step in steps.values()} <= table.keys()


def test_every_news_changes_something() -> None:
    heard = {news for table in TABLES.values() for steps in table.values() for news in steps}
    assert heard == set(BodyNews)


def test_the_table_of_ends_names_facts_of_a_body() -> None:
    assert ENDS.keys() <= {each.name for each in fields(BodyFacts)}


def test_the_page_shows_the_tables() -> None:
    assert PAGE.read_text("utf-8") == drawing()
