"""The fence's table: every state with every event, and the page that shows it."""

from itertools import product
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule

from gateway.core.fence import (
    FENCE_TRIES,
    TABLE,
    Action,
    CannotHappen,
    Fence,
    FenceEvent,
    State,
    Step,
    drawing,
)

PAGE = Path(__file__).parents[3] / "docs" / "fence.md"
ANY_TIME = {FenceEvent.DOUBT, FenceEvent.PORT_LOST}
"""Events that happen in every state; each other one is ruled out in some state."""


@pytest.mark.parametrize(("state", "event"), list(product(State, FenceEvent)), ids=lambda it: it.name)
def test_every_cell_leads_on_or_says_why_it_cannot_happen(state: State, event: FenceEvent) -> None:
    fence, cell = Fence(), TABLE[state][event]
    fence.state = state
    if isinstance(cell, Step):
        assert (fence.take(event), fence.state) == (cell.action, cell.state)
    else:
        assert event not in ANY_TIME
        with pytest.raises(CannotHappen, match=cell):
            fence.take(event)
        assert fence.state is state


def test_the_table_has_no_other_cells() -> None:
    assert list(TABLE) == list(State)
    assert all(list(cells) == list(FenceEvent) for cells in TABLE.values())


def test_every_state_is_reached_from_a_line_in_step() -> None:
    reached, left = set[State](), [State.IN_STEP]
    while left:
        state = left.pop()
        if state not in reached:
            reached.add(state)
            left += [cell.state for cell in TABLE[state].values() if isinstance(cell, Step)]
    assert reached == set(State)


@pytest.mark.parametrize("state", list(State), ids=lambda it: it.name)
def test_only_an_echo_the_silence_of_all_or_a_lost_port_brings_a_line_into_step(state: State) -> None:
    ways = {
        event
        for event, cell in TABLE[state].items()
        if isinstance(cell, Step) and cell.state is State.IN_STEP and state is not State.IN_STEP
    }
    assert ways <= {FenceEvent.ECHO, FenceEvent.NOBODY, FenceEvent.PORT_LOST}


@pytest.mark.parametrize("state", list(State), ids=lambda it: it.name)
def test_a_stray_reply_is_evidence_until_the_fence_has_passed_and_nothing_after_it(state: State) -> None:
    cell = TABLE[state][FenceEvent.STRAY]
    if isinstance(cell, Step):
        assert cell == Step(state, Action.DROP if state is State.IN_STEP else Action.CONSIDER)


def test_a_witness_is_given_up_after_three_fences_and_each_new_one_is_asked_as_often() -> None:
    fence = Fence()
    fence.take(FenceEvent.DOUBT)
    for _ in range(2):
        assert fence.tries == 0
        done = []
        for tries in range(FENCE_TRIES):
            assert fence.tries == tries
            fence.take(FenceEvent.ASKED)
            assert fence.tries == tries
            done.append(fence.take(FenceEvent.SILENCE))
        assert done == [Action.NONE, Action.NONE, Action.GIVE_UP]
        assert fence.take(FenceEvent.WITNESS) is Action.NONE


class AnyFence(RuleBasedStateMachine):
    """A fence under the events of a session in their order: an outcome is told once in each doubt at most."""

    def __init__(self) -> None:
        super().__init__()
        self.fence = Fence()
        self.in_doubt = False

    @rule()
    def doubt(self) -> None:
        self.fence.take(FenceEvent.DOUBT)
        self.in_doubt = True

    @precondition(lambda self: self.fence.state.name.endswith("_DUE"))
    @rule()
    def ask(self) -> None:
        self.fence.take(FenceEvent.ASKED)

    @precondition(lambda self: self.fence.state.name.endswith("_ASKED"))
    @rule(event=st.sampled_from([FenceEvent.ECHO, FenceEvent.SILENCE, FenceEvent.ASKED]))
    def answer(self, event: FenceEvent) -> None:
        self._settle(self.fence.take(event))

    @precondition(lambda self: self.fence.state is State.SILENT)
    @rule(event=st.sampled_from([FenceEvent.WITNESS, FenceEvent.NOBODY]))
    def seek(self, event: FenceEvent) -> None:
        self._settle(self.fence.take(event))

    @precondition(lambda self: self.fence.state is not State.SILENT)
    @rule()
    def stray(self) -> None:
        assert (self.fence.take(FenceEvent.STRAY) is Action.CONSIDER) is self.in_doubt

    @rule()
    def lose_the_port(self) -> None:
        self.fence.take(FenceEvent.PORT_LOST)
        self.in_doubt = False

    def _settle(self, action: Action) -> None:
        if action is Action.SETTLE:
            assert self.in_doubt
            assert self.fence.in_step
            self.in_doubt = False


TestAnyFence = AnyFence.TestCase
TestAnyFence.settings = settings(max_examples=50, stateful_step_count=30, deadline=None)


def test_the_page_shows_the_table() -> None:
    assert PAGE.read_text("utf-8") == drawing()
