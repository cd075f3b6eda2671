"""The fence as a table: what is known of the replies still to come, and what changes it.

`python -m gateway.core.fence > docs/fence.md` draws it.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Any, NamedTuple

from gateway.core.drawn import states
from protocols.members import at_hand


@at_hand
class State(Enum):
    """State of the fence: can replies be believed, and if not, how far is the proof?"""

    IN_STEP = "in step"
    FIRST_DUE = "1st fence due"
    FIRST_ASKED = "1st fence asked"
    SECOND_DUE = "2nd fence due"
    SECOND_ASKED = "2nd fence asked"
    THIRD_DUE = "3rd fence due"
    THIRD_ASKED = "3rd fence asked"
    SILENT = "witness silent"


@at_hand
class FenceEvent(Enum):
    """An event for the fence."""

    DOUBT = "doubt, or a fence is called for"
    ASKED = "fence handed to the port"
    ECHO = "its own number came back"
    SILENCE = "no echo in time, or a refusal"
    NO_TIME = "no echo in time, and others are waited for"
    WITNESS = "another can be asked"
    NOBODY = "nobody else can be asked"
    STRAY = "reply that nothing under way claims"
    PORT_LOST = "port lost"


@at_hand
class Action(Enum):
    """The session's reaction."""

    NONE = ""
    SETTLE = "settle the exchange in doubt, or repeat it"
    GIVE_UP = "give the witness up, and look for another"
    DROP = "drop the reply"
    CONSIDER = "take it as the late reply of the exchange in doubt, if it fits"


class Step(NamedTuple):
    """One cell of the table."""

    state: State
    action: Action = Action.NONE


class CannotHappen(Exception):
    """An event came that the state of the fence rules out."""


Cell = Step | str
"""A step, or why this cannot happen."""

_DUE = (State.FIRST_DUE, State.SECOND_DUE, State.THIRD_DUE)
_ASKED = (State.FIRST_ASKED, State.SECOND_ASKED, State.THIRD_ASKED)
FENCE_TRIES = len(_ASKED)

_RULED_OUT: Mapping[FenceEvent, Cell] = {
    FenceEvent.ASKED: "a fence is asked only when it is due",
    FenceEvent.ECHO: "no fence is under way",
    FenceEvent.SILENCE: "no fence is under way",
    FenceEvent.NO_TIME: "no fence is under way",
    FenceEvent.WITNESS: "no witness is being looked for",
    FenceEvent.NOBODY: "no witness is being looked for",
    FenceEvent.STRAY: "nothing is heard while a witness is being looked for",
}


def _row(**steps: Cell) -> dict[FenceEvent, Cell]:
    cells = {
        **_RULED_OUT,
        FenceEvent.PORT_LOST: Step(State.IN_STEP),
        **{FenceEvent[event]: steps[event] for event in steps},
    }
    return {event: cells[event] for event in FenceEvent}


def _due(due: State, asked: State) -> dict[FenceEvent, Cell]:
    return _row(DOUBT=Step(State.FIRST_DUE), ASKED=Step(asked), STRAY=Step(due, Action.CONSIDER))


def _asked(asked: State, failed: Step) -> dict[FenceEvent, Cell]:
    return _row(
        DOUBT=Step(State.FIRST_ASKED),  # what is in doubt was written before this fence
        ASKED=Step(asked),  # the port did not take the last one
        ECHO=Step(State.IN_STEP, Action.SETTLE),
        SILENCE=failed,
        NO_TIME=Step(State.SILENT, Action.GIVE_UP),
        STRAY=Step(asked, Action.CONSIDER),
    )


TABLE: Mapping[State, Mapping[FenceEvent, Cell]] = {
    State.IN_STEP: _row(
        DOUBT=Step(State.FIRST_DUE),
        WITNESS=Step(State.IN_STEP),  # the port was lost while one was looked for
        NOBODY=Step(State.IN_STEP),
        STRAY=Step(State.IN_STEP, Action.DROP),
    ),
    State.FIRST_DUE: _due(State.FIRST_DUE, State.FIRST_ASKED),
    State.FIRST_ASKED: _asked(State.FIRST_ASKED, Step(State.SECOND_DUE)),
    State.SECOND_DUE: _due(State.SECOND_DUE, State.SECOND_ASKED),
    State.SECOND_ASKED: _asked(State.SECOND_ASKED, Step(State.THIRD_DUE)),
    State.THIRD_DUE: _due(State.THIRD_DUE, State.THIRD_ASKED),
    State.THIRD_ASKED: _asked(State.THIRD_ASKED, Step(State.SILENT, Action.GIVE_UP)),
    State.SILENT: _row(
        DOUBT=Step(State.SILENT),
        WITNESS=Step(State.FIRST_DUE),
        NOBODY=Step(State.IN_STEP, Action.SETTLE),
    ),
}


class Fence:
    """Where a line stands in the table."""

    def __init__(self) -> None:
        self.state = State.IN_STEP
        self.in_step = True
        """True while replies can be believed."""
        self.query: Any = None
        """The exchange of the fence under way."""
        self.doubts = 0
        """Replies that stayed away, could not be understood, or came unasked."""

    @property
    def tries(self) -> int:
        """Number of fences that have failed since the last doubt, or the last change of the witness."""
        return next((states.index(self.state) for states in (_DUE, _ASKED) if self.state in states), 0)

    def take(self, event: FenceEvent) -> Action:
        """Go on to the next state, and give what has to be done.

        :raises CannotHappen: the table rules it out.
        """
        cell = TABLE[self.state][event]
        if isinstance(cell, str):
            raise CannotHappen(f"{event.value!r} in the state {self.state.value!r}: {cell}")
        self.state, self.in_step = cell.state, cell.state is State.IN_STEP
        return cell.action


def drawing() -> str:
    """The table as a page of the documentation."""
    head = (
        "The fence",
        "What a line knows of the replies still to come (decisions 2 and 14). A cell has the next state and",
        "*what is done*; a dash is what cannot happen, and a fault of the program if it does.",
    )
    return states(head, FenceEvent, TABLE)


if __name__ == "__main__":
    print(drawing(), end="")
