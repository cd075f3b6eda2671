"""The life of a line's port as a table: which states it has, and what each news makes of them."""

from collections.abc import Mapping
from enum import Enum, StrEnum
from typing import Final

from gateway.core.drawn import Transition


class LineState(StrEnum):
    """The state of a line for its users now."""

    DOWN = "down"
    SILENT = "silent"
    """The port is open, but no controller answers on it, or it echoes what is written."""
    STANDBY = "standby"
    """Another gateway has it, or may have it; this one does not open it by itself."""
    SETTING_UP = "setting_up"
    READY = "ready"
    OUT_OF_STEP = "out_of_step"


class PortState(Enum):
    """State of a port."""

    DOWN = "down"
    STANDBY = "another gateway has it"
    SETTING_UP = "open, being set up"
    READY = "ready"
    SETTING_UP_AGAIN = "ready before, being set up again"
    SILENT = "silent"
    SILENT_SETTING_UP = "silent, being set up"
    ENDED = "ended"


class PortNews(Enum):
    """News of a port."""

    OPENED = "the port is open"
    SET_UP = "a set-up begins"
    ANSWERED = "set up: the far end answers"
    UNANSWERED = "set up: no answer"
    SILENCE = "no answer, or an echo"
    LOST = "the port is lost, or cannot be opened"
    ELSEWHERE = "another gateway takes it"
    OURS = "it is this gateway's"
    END = "the line is closed for good"


class PortAction(Enum):
    """Reaction to news of a port."""

    NONE = ""
    TELL_UP = "tell line.up"
    TELL_DOWN = "tell line.down"
    CLOSE = "close the port"


PortStep = Transition[PortState, PortAction]

_OPEN: Final = frozenset(
    {
        PortState.SETTING_UP,
        PortState.READY,
        PortState.SETTING_UP_AGAIN,
        PortState.SILENT,
        PortState.SILENT_SETTING_UP,
    }
)
_SET_UP: Final = frozenset({PortState.READY, PortState.SILENT})
_TROUBLED: Final = frozenset(PortState) - {PortState.SETTING_UP, PortState.READY, PortState.SETTING_UP_AGAIN}
_TOLD: Final = {
    PortState.STANDBY: LineState.STANDBY,
    PortState.SETTING_UP: LineState.SETTING_UP,
    PortState.READY: LineState.READY,
    PortState.SETTING_UP_AGAIN: LineState.SETTING_UP,
    PortState.SILENT: LineState.SILENT,
    PortState.SILENT_SETTING_UP: LineState.SILENT,
}


def _closed(state: PortState, **steps: PortState) -> Mapping[PortNews, PortStep]:
    """The row of a port that is not open: nothing can be heard on it."""
    stays = dict.fromkeys(PortNews, PortStep(state, PortAction.NONE))
    return stays | {PortNews[name]: PortStep(steps[name], PortAction.NONE) for name in steps}


def _open(
    state: PortState, set_up: PortState, silent: PortState, *, told: bool
) -> Mapping[PortNews, PortStep]:
    """The row of an open port; `told` where line.up was told, so that line.down follows."""
    down = PortAction.TELL_DOWN if told else PortAction.NONE
    return {
        PortNews.OPENED: PortStep(state, PortAction.NONE),
        PortNews.SET_UP: PortStep(set_up, PortAction.NONE),
        PortNews.ANSWERED: PortStep(PortState.READY, PortAction.NONE if told else PortAction.TELL_UP),
        PortNews.UNANSWERED: PortStep(PortState.SILENT, down),
        PortNews.SILENCE: PortStep(silent, down),
        PortNews.LOST: PortStep(PortState.DOWN, down),
        PortNews.ELSEWHERE: PortStep(PortState.STANDBY, down),
        PortNews.OURS: PortStep(state, PortAction.NONE),
        PortNews.END: PortStep(PortState.ENDED, down),
    }


TABLE: Final[Mapping[PortState, Mapping[PortNews, PortStep]]] = {
    PortState.DOWN: _closed(
        PortState.DOWN, OPENED=PortState.SETTING_UP, ELSEWHERE=PortState.STANDBY, END=PortState.ENDED
    ),
    PortState.STANDBY: {
        **_closed(PortState.STANDBY, OURS=PortState.DOWN, END=PortState.ENDED),
        PortNews.OPENED: PortStep(PortState.STANDBY, PortAction.CLOSE),  # taken while it was being opened
    },
    PortState.SETTING_UP: _open(
        PortState.SETTING_UP, PortState.SETTING_UP, PortState.SILENT_SETTING_UP, told=False
    ),
    PortState.READY: _open(PortState.READY, PortState.SETTING_UP_AGAIN, PortState.SILENT, told=True),
    PortState.SETTING_UP_AGAIN: _open(
        PortState.SETTING_UP_AGAIN, PortState.SETTING_UP_AGAIN, PortState.SILENT_SETTING_UP, told=True
    ),
    PortState.SILENT: _open(PortState.SILENT, PortState.SILENT_SETTING_UP, PortState.SILENT, told=False),
    PortState.SILENT_SETTING_UP: _open(
        PortState.SILENT_SETTING_UP, PortState.SILENT_SETTING_UP, PortState.SILENT_SETTING_UP, told=False
    ),
    PortState.ENDED: {
        **_closed(PortState.ENDED),
        PortNews.OPENED: PortStep(PortState.ENDED, PortAction.CLOSE),
    },
}


class PortLife:
    """Where a port stands in the table, and why it cannot be used."""

    __slots__ = ("is_open", "is_set_up", "state", "why")

    def __init__(self) -> None:
        self.state = PortState.DOWN
        self.is_open = self.is_set_up = False
        self.why = "not opened yet"
        """Last reason for which the port was closed or no controller answered."""

    def take(self, news: PortNews, why: str | None = None) -> PortAction:
        """Go on to the next state, and give what is to be done; the reason of an end stays."""
        if why is not None and self.state is not PortState.ENDED:
            self.why = why
        step = TABLE[self.state][news]
        self.state = step.state
        self.is_open, self.is_set_up = step.state in _OPEN, step.state in _SET_UP
        return step.action

    @property
    def has_ended(self) -> bool:
        """True when the line was closed for good."""
        return self.state is PortState.ENDED

    @property
    def trouble(self) -> str | None:
        """Reason for which the port is closed or no controller answers; None if neither is so."""
        return self.why if self.state in _TROUBLED else None

    @property
    def told(self) -> LineState:
        """The state as users are told it, for replies that can be believed."""
        return _TOLD.get(self.state, LineState.DOWN)
