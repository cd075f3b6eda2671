"""The life of a body as a table: what it does and what holds it, by what is heard of it.

`python -m gateway.rorze.body_states > docs/body-states.md` draws it.
"""

import asyncio
from collections.abc import Mapping
from enum import Enum
from typing import Final, Literal, NamedTuple

from gateway.core.drawn import BY, drawn_table, states
from gateway.rorze.knowledge import ENDS
from protocols.members import at_hand

Part = Literal["motor", "move", "program", "stop", "reach"]


@at_hand
class BodyNews(Enum):
    """News of a body."""

    CLAIMED = "a move of it is queued"
    SENT = "its motion command is on the wire"
    REFUSED = "it refuses that command"
    RESTS = "its move or a stop is seen to have ended at rest"
    OVER = "its move is over and recorded"
    RUNS = "it has no move, and says that pulses run"
    STANDS = "it has no move, and says that no pulses run"
    MAY_MOVE = "something may have set it going"
    PROGRAM = "the gateway starts its program"
    CUT_OFF = "an earlier life of the gateway has started its program"
    PROGRAM_OVER = "that program is over"
    STOP = "a stop is under way"
    NO_STOP = "every stop is confirmed"
    SILENT = "it answers no question"
    OUT_OF_REACH = "nobody on its line is heard"


@at_hand
class BodyAction(Enum):
    """Reactions to it."""

    NONE = ""
    ASK = "ask for its state"
    TELL = "tell that it moves"


class BodyStep(NamedTuple):
    """One cell of a table."""

    state: str
    action: BodyAction = BodyAction.NONE


_UNKNOWN: Final = BodyStep("not known")
_ASK: Final = BodyStep("not known", BodyAction.ASK)
_STANDS, _RUNS = BodyStep("at rest"), BodyStep("moving")
_TELL: Final = BodyStep("moving", BodyAction.TELL)
_AT_REST: Final = {
    BodyNews.SENT: _RUNS,
    BodyNews.REFUSED: _ASK,
    BodyNews.RESTS: _STANDS,
    BodyNews.RUNS: _TELL,
    BodyNews.STANDS: _STANDS,
    BodyNews.MAY_MOVE: _ASK,
    BodyNews.SILENT: _UNKNOWN,
    BodyNews.OUT_OF_REACH: _UNKNOWN,
}
_MOVING: Final = {
    BodyNews.RUNS: _RUNS,
    BodyNews.MAY_MOVE: BodyStep("moving", BodyAction.ASK),
    BodyNews.SILENT: _RUNS,
    BodyNews.OUT_OF_REACH: _RUNS,
}

TABLES: Final[Mapping[Part, Mapping[str, Mapping[BodyNews, BodyStep]]]] = {
    "motor": {"not known": _AT_REST, "at rest": _AT_REST, "moving": {**_AT_REST, **_MOVING}},
    "move": {
        "free": {BodyNews.CLAIMED: BodyStep("in a move")},
        "in a move": {BodyNews.OVER: BodyStep("free")},
    },
    "program": {
        "none": {BodyNews.PROGRAM: BodyStep("in program"), BodyNews.CUT_OFF: BodyStep("in program")},
        "in program": {BodyNews.PROGRAM_OVER: BodyStep("none")},
    },
    "stop": {
        "none": {BodyNews.STOP: BodyStep("being stopped")},
        "being stopped": {BodyNews.NO_STOP: BodyStep("none")},
    },
    "reach": {
        "heard": {BodyNews.SILENT: BodyStep("silent"), BodyNews.CUT_OFF: BodyStep("silent")},
        "silent": {BodyNews.SENT: BodyStep("heard"), BodyNews.PROGRAM: BodyStep("heard")},
    },
}
"""Five tables side by side: a body that moves may be in a program, and be stopped. All other news changes
nothing; a body that was silent since its last motion command may have lost its power meanwhile."""
_PARTS: Final = {
    news: [part for part, table in TABLES.items() if any(news in steps for steps in table.values())]
    for news in BodyNews
}
"""The parts that each piece of news may change."""
_MOVES: Final[Mapping[str, bool | None]] = {"not known": None, "at rest": False, "moving": True}


class BodyLife:
    """The states of one body."""

    def __init__(self) -> None:
        self._states: dict[Part, str] = {part: next(iter(table)) for part, table in TABLES.items()}
        self.look_due = asyncio.Event()
        """Set while its state is to be read now, not at the next poll."""

    def hear(self, news: BodyNews) -> BodyAction:
        """Go on to the next states, and give what is to be done."""
        action = BodyAction.NONE
        for part in _PARTS[news]:
            step = TABLES[part][self._states[part]].get(news)
            if step is not None:
                self._states[part] = step.state
                action = action if step.action is BodyAction.NONE else step.action
        if action is BodyAction.ASK:
            self.look_due.set()
        return action

    @property
    def moving(self) -> bool | None:
        """True if its motor runs; None until its status has been read since it was out of reach."""
        return _MOVES[self._states["motor"]]

    @property
    def in_move(self) -> bool:
        """True if it has a move that is not over: no single reading says then if the motor runs."""
        return self._states["move"] == "in a move"

    @property
    def in_program(self) -> bool:
        """True if a program that the gateway has started is not over, as far as is known."""
        return self._states["program"] == "in program"

    @property
    def being_stopped(self) -> bool:
        """True if a stop is under way that is not confirmed yet."""
        return self._states["stop"] == "being stopped"

    @property
    def was_silent(self) -> bool:
        """True if it has been silent since its last motion command: it may have lost its power meanwhile."""
        return self._states["reach"] == "silent"


def drawing() -> str:
    """The tables as a page of the documentation."""
    pages = []
    for part, table in TABLES.items():
        heard = [news for news in BodyNews if part in _PARTS[news]]
        page = states((part.capitalize(),), heard, table).replace(f"{BY}\n\n", "")
        pages.append(f"#{page}")
    facts = [(f"**{fact}**", *by.drawn()) for fact, by in ENDS.items()]
    columns = ("fact", "commands", "it may have been set going", "it cannot be asked", "its power was lost")
    head = (
        "# The life of a body",
        "",
        "A body's states, side by side: one table for its motor, and one each for what holds it. A cell has",
        "the next state and *what is done*; a dash is news that changes nothing.",
        BY,
        "",
    )
    ends = ("## What is known, and what ends it", "", *drawn_table(columns, facts), "")
    return "\n".join([*head, *pages, *ends])


if __name__ == "__main__":
    print(drawing(), end="")
