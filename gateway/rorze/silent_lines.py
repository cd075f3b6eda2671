"""Lines on which nobody answers while they are to stop: each is told once, for all its bodies."""

import asyncio
from collections.abc import Callable, Sequence
from math import inf
from typing import Protocol

from gateway.core.events import EventHub
from gateway.core.stops import CONFIRM_WITHIN_S
from gateway.rorze.bodies import Body
from gateway.rorze.line import Line
from gateway.rorze.poll_intervals import taken_s
from gateway.rorze.session import SILENT_BODIES

QUIET_TIMEOUTS = 2
"""Where many stops are due, a line is silent on which nobody was heard for so many times as long as a reply
may take."""
MORE_THAN_A_FUSE = 12
"""So many bodies that fall silent at once do not hang on one fuse."""
CHECK_S = 0.5
"""A silent line is listened to this often."""
PROOF_BYTES, PROOF_EXCHANGES = 140, 6
"""What it takes to stop a body and its program, and to see it stand, with all replies."""


class Unconfirmed(Protocol):
    """A stop that is not confirmed yet."""

    body: Body

    @property
    def began_at(self) -> float:
        """When it was asked for, in the event loop's time."""

    def is_late(self) -> bool:
        """Whether its motor was to stand by now."""

    def is_due(self) -> bool:
        """Whether it was to be confirmed by now."""

    def publish(self, what: str) -> None:
        """Tell everybody how far it has come."""


def proofs_s(line: Line, stops: int) -> float:
    """How long it takes to stop so many bodies and to see them stand."""
    return stops * taken_s(line, PROOF_BYTES, PROOF_EXCHANGES)


def is_silent(line: Line) -> bool:
    """Whether nobody on a line has been heard for longer than it takes to find one body silent."""
    return _quiet_timeouts(line) >= QUIET_TIMEOUTS + line.late_reply_s / line.reply_timeout_s


def is_heard(line: Line) -> bool:
    """Whether somebody on a line was heard within the time of a reply."""
    return _quiet_timeouts(line) <= 1


def is_quiet(line: Line) -> bool:
    """Whether nobody on a line was heard for so long that it may be silent."""
    return _quiet_timeouts(line) >= QUIET_TIMEOUTS


def _quiet_timeouts(line: Line) -> float:
    """For how many times as long as a reply may take nobody has been heard."""
    now = _now()
    return (now - line.presence.last_heard_at - line.held_since_heard_s(now)) / line.reply_timeout_s


def _now() -> float:
    return asyncio.get_running_loop().time()


class SilentLines:
    """The silent lines on which stops are not confirmed.

    While a line is told, its bodies need no alarms of their own. When it has been heard for long enough,
    each stop that is not confirmed even then is told again, as one of its body.
    """

    def __init__(self, events: EventHub, stops_on: Callable[[Line], Sequence[Unconfirmed]]) -> None:
        self._events = events
        self._stops_on = stops_on
        self._told: set[asyncio.Task[None]] = set()

    def may_be(self, line: Line) -> bool:
        """Whether it will be known in a moment if a line with many stops is silent."""
        if is_heard(line) or is_silent(line):
            return False
        if self._many_are_due(line):
            return not is_quiet(line)
        return sum(stop.is_late() for stop in self._stops_on(line)) > MORE_THAN_A_FUSE

    def note_overdue(self, line: Line) -> None:
        """A stop on this line is not confirmed in time: tell the line where that is the cause."""
        if line.tells_of_stops or not is_quiet(line) or not self._many_are_due(line):
            return
        line.tells_of_stops = True
        listening = asyncio.create_task(self._listen(line), name=f"silent line {line.id}")
        self._told.add(listening)
        listening.add_done_callback(self._told.discard)
        stops = self._stops_on(line)
        bodies = list(dict.fromkeys(stop.body.address for stop in stops))
        silent_since = max(line.presence.last_heard_at, min(stop.began_at for stop in stops))
        facts = {"silent_s": round(_now() - silent_since, 1), "stops": len(bodies), "bodies": bodies}
        self._events.publish("line.stops.unconfirmed", f"/lines/{line.id}", facts)

    def _many_are_due(self, line: Line) -> bool:
        """Whether so many stops are due that their line is the cause, and not a fuse.

        Where others live, who are not asked while the silent are fenced, it takes more of them to say so.
        """
        due = {stop.body.number for stop in self._stops_on(line) if stop.is_due()}
        others_live = not set(line.bodies) <= due | line.presence.silent | line.presence.mute
        return len(due) >= (MORE_THAN_A_FUSE if others_live else SILENT_BODIES)

    async def close(self) -> None:
        """Listen no longer."""
        listening = list(self._told)
        for task in listening:
            task.cancel()
        await asyncio.gather(*listening, return_exceptions=True)

    async def _listen(self, line: Line) -> None:
        try:
            await self._heard_for_long(line)
        finally:
            line.tells_of_stops = False
        for stop in self._stops_on(line):
            if stop.is_due():
                stop.publish("unconfirmed")

    async def _heard_for_long(self, line: Line) -> None:
        """Wait until its bodies had the time to confirm their stops, or all have."""
        told_at, heard_since, most = _now(), inf, 0
        while stops := self._stops_on(line):
            most = max(most, len(stops))
            if line.presence.last_heard_at > told_at:
                heard_since = min(heard_since, _now())
            fenced_s = 2 * line.late_reply_s  # for one that does not come back, between stops
            if _now() - heard_since >= fenced_s + max(CONFIRM_WITHIN_S, proofs_s(line, most)):
                return
            await asyncio.sleep(CHECK_S)
