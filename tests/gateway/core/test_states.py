"""Every state has one step for each news, every state can be reached, and the page shows the tables."""

from itertools import product
from pathlib import Path
from typing import Any, get_args

import pytest

from gateway.core.drawn import Transition
from gateway.core.journal.journal import DiskState
from gateway.core.line_state import PortState
from gateway.core.states import TABLES, StateTable, drawing
from gateway.core.stops import HardwareCall, StopState

PAGE = Path(__file__).parents[3] / "docs" / "states.md"
STATES: dict[str, list[Any]] = {
    "The port of a line": list(PortState),
    "A stop": list(get_args(StopState.__value__)),
    "The call for the hardware stop": list(HardwareCall),
    "The disk of the journal": list(DiskState),
}
each_table = pytest.mark.parametrize("table", TABLES, ids=lambda table: table.title)


def test_every_table_has_its_states() -> None:
    assert {table.title: sorted(map(str, table.steps)) for table in TABLES} == {
        title: sorted(map(str, states)) for title, states in STATES.items()
    }


@each_table
def test_every_state_has_one_step_for_each_news(table: StateTable) -> None:
    for state, news in product(STATES[table.title], table.news):
        step = table.steps[state][news]
        assert isinstance(step, Transition)
        assert step.state in STATES[table.title]
    assert all(set(steps) == set(table.news) for steps in table.steps.values())


@each_table
def test_every_state_can_be_reached_from_the_first(table: StateTable) -> None:
    first, *_ = table.steps
    reached, waiting = {first}, [first]
    while waiting:
        new = {step.state for step in table.steps[waiting.pop()].values()} - reached
        reached |= new
        waiting += new
    assert reached == set(table.steps)


def test_the_page_shows_the_tables() -> None:
    assert PAGE.read_text("utf-8") == drawing()
