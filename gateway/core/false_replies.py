"""False replies: copies of earlier ones, and echoes of what was written.

A reply may come twice, and the copy later than other frames. One speaker's frames come in order, though:
after the echo of its fence come no copies of its earlier replies. A line that says back what is written to
it, as an adapter with local echo or a looped plug does, tells nothing of the controllers, and its echo stands
where a reply is awaited. No clock and no port: times and frames are given.
"""

from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from math import inf
from typing import Generic

from gateway.core.exchange import F, RememberedReply, X


class Copies(Generic[X, F]):
    """The replies of a line since each speaker's last fence."""

    def __init__(self, remembered: int) -> None:
        self._remembered = remembered
        """Different replies of one name that are remembered; beyond them a fence goes before the next one."""
        self._said: dict[int, dict[Hashable, dict[Hashable, RememberedReply]]] = {}
        """Replies by speaker, by name, and by the command's frame and the kind of reply."""

    def note(self, speaker: int, name: Hashable, said: RememberedReply, now: float) -> None:
        """A reply was credited, or may come; of one command and one kind the last is remembered."""
        names = self._said.get(speaker) or self._said.setdefault(speaker, {})
        others = names.get(name) or names.setdefault(name, {})
        if len(others) >= self._remembered:
            for key in [key for key, reply in others.items() if reply.until <= now]:
                del others[key]
        others[said.exchange.frame, said.kind] = said

    def forget(self, speaker: int) -> None:
        """Forget a speaker's replies: its fence has passed, so no copy of them is on its way any more."""
        self._said.pop(speaker, None)

    def could_answer(self, exchange: X, speaker: int, now: float) -> bool:
        """Say whether a copy of an earlier reply could be taken for the reply to this, and be wrong."""
        said = self._said.get(speaker, {})
        for name in exchange.reply.names if said else ():
            replies = said.get(name, {})
            if len(replies) > self._remembered:
                return True
            for reply in replies.values():
                if reply.until > now and exchange.mistakes(reply):
                    return True
        return False

    def include(self, speaker: int, frame: F) -> bool:
        """Say whether the speaker has sent this frame before."""
        names = self._said.get(speaker, {}).values()
        return any(reply.frame == frame for replies in names for reply in replies.values())


ECHOES = 3
"""Frames that came back one after the other as they were written: the line echoes."""
UNDER_WAY = 4
"""Frames that may be written before an echo comes; where more are, the line echoes no longer."""
PAUSE_S = (0.25, 1.0)
"""First and longest pause after a frame on a line that echoes; it doubles in between. Stops do not wait."""
SEEN_WITHIN_S = 1.0
"""Seconds after a stop in which nothing pauses: whether its motor stands is asked as fast as ever."""
ECHOING = (
    "what is written comes back as it was; turn off the local echo of the adapter, or look whether sending "
    "and receiving wires are joined"
)


@dataclass(slots=True)
class EchoPauses:
    """The pauses in which nothing is written on a line that echoes, in the event loop's time."""

    echoes: bool = False
    until: float = -inf
    """Time until which only stops are written, and questions that a motor waits for."""
    _pause_s: float = PAUSE_S[0]
    _free_until: float = -inf
    """Time until which questions about a stop need not wait."""

    def begin(self, found: bool, now: float) -> None:
        """Note that the line echoes, or does no longer; a stop may have been sent just before."""
        self.echoes, self._pause_s, self.until = found, PAUSE_S[0], -inf
        if found:
            self._free_until = now + SEEN_WITHIN_S

    def note_written(self, now: float, *, is_stop: bool) -> None:
        """Pause after a frame."""
        if is_stop:
            self.until, self._free_until = -inf, now + SEEN_WITHIN_S
        elif now >= self._free_until:
            self.until, self._pause_s = now + self._pause_s, min(2 * self._pause_s, PAUSE_S[1])


class Echo(Generic[X]):
    """Compares what nothing under way has claimed with what was written last."""

    def __init__(self, shows_echo: Callable[[X], bool], on_change: Callable[[bool], None]) -> None:
        self._shows_echo = shows_echo
        """Tells that no reply to an exchange can equal its frame."""
        self.on_change = on_change
        """Called with True when the line is found to echo, and with False when that is over."""
        self.written: deque[X] = deque(maxlen=2 * UNDER_WAY)
        """The latest exchanges; from the first echo on, those that have not come back."""
        self.in_a_row = 0
        """Frames that have come back, since one that did not."""
        self.found = False
        """True while the line echoes."""

    def forget(self) -> None:
        """Begin anew, as with a port that was opened."""
        self.written.clear()
        self.in_a_row, self.found = 0, False

    def heard(self, line: bytes) -> bool:
        """Compare a line that came, without its end: True where it is the echo of a frame written lately."""
        order = self.written if self.in_a_row else reversed(self.written)
        echoed = next((sent for sent in order if sent.frame.strip() == line and self._shows_echo(sent)), None)
        if echoed is None:
            return False
        missed = False
        while (first := self.written.popleft()) is not echoed:
            missed = missed or self._shows_echo(first)
        self.in_a_row = 1 if missed else self.in_a_row + 1
        if self.in_a_row >= ECHOES and not self.found:
            self.found = True
            self.on_change(True)
        return True

    def answered(self, exchange: X) -> None:
        """An exchange has its reply: if it has not come back before, the line does not echo."""
        if exchange in self.written and self._shows_echo(exchange):
            self._is_over()

    def passed_over(self) -> None:
        """Note that another frame is written: if several have not come back, the line echoes no longer."""
        if sum(map(self._shows_echo, self.written)) > UNDER_WAY:
            self._is_over()

    def _is_over(self) -> None:
        was_found, self.found, self.in_a_row = self.found, False, 0
        if was_found:
            self.on_change(False)
