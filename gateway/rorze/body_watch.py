"""The watch over a body: whether it answers, what it does without us, and whether it has kept its power."""

import asyncio
from collections.abc import Callable
from math import inf

from gateway.core.errors import GatewayError
from gateway.rorze.bodies import Body
from gateway.rorze.line import Line
from protocols.rorze.status import GetControllerStatus

HEALTH_POLL_S = 5.0
"""A body without a move is asked for its status and position this often."""
IDLE_POLL_S = 0.6
"""One that was not heard for so long is asked for its status, where the line has the time."""
IDLE_SHARE = 0.3
"""Share of the line's time that these questions may take."""
IDLE_BYTES = 18
"""Of 9CD and its reply."""
TURNAROUND_S = 0.003
"""From a question to its reply, besides the bytes: an assumption."""
SLOWEST_BYTE_S = 10 / 9600
"""A port that does not tell its speed, such as a terminal server, may lead to a line of 9600 baud."""
CLOCK_S = 0.001
"""A timer may be early by so much."""
MARK_POLL_S = 30.0
"""The mark of its power is looked at this often."""


def idle_poll_s(line: Line) -> float:
    """How long a body may be unheard before it is asked whether it is there.

    With 8 bodies at 9600 baud that is soon enough to tell within two seconds that one has lost its power. A
    line that is too slow for its bodies gets no more questions than those of the health poll.
    """
    bodies = len(line.bodies) - len(line.offline)
    question_s = IDLE_BYTES * (line.transport.byte_time_s or SLOWEST_BYTE_S) + TURNAROUND_S
    return min(max(IDLE_POLL_S, bodies * question_s / IDLE_SHARE), HEALTH_POLL_S)


class BodyWatch:
    """Notices what happens to one body without us."""

    def __init__(self, body: Body, stopping: Callable[[Line], bool]) -> None:
        self._body = body
        self._stopping = stopping
        """Whether a line has a stop that is not confirmed: its time belongs to that."""
        self._woke_at = self._looked_at = self._mark_at = -inf

    async def run(self) -> None:
        """Watch until cancelled."""
        body = self._body
        while True:
            self._woke_at, wanted = _now(), body.look_due.is_set()
            body.look_due.clear()
            if body.line.state == "ready" and body.online:
                try:
                    await self._attend(wanted=wanted)
                except GatewayError as error:
                    body.on_news("body.unreadable", {"detail": error.detail})
            await body.look_wanted(self._pause_s())

    def _pause_s(self) -> float:
        """Until the next question, if it is not heard before."""
        idle_s, now = idle_poll_s(self._body.line), _now()
        due_in_s = (self._body.last_heard_at or -inf) + idle_s - now
        return due_in_s if due_in_s > 0 else max(self._woke_at + idle_s - now, 0.0)

    async def _attend(self, *, wanted: bool) -> None:
        body, now = self._body, _now()
        if body.move is None:
            if wanted or now - self._looked_at >= HEALTH_POLL_S:
                self._looked_at = now
                await body.look()
            elif self._is_unheard(now) and not self._stopping(body.line):
                await body.ask(GetControllerStatus())
        if self._mark_wanted(now):
            self._mark_at = now
            await body.mark.tend()

    def _is_unheard(self, now: float) -> bool:
        idle_s = now - (self._body.last_heard_at or -inf)
        return idle_s >= idle_poll_s(self._body.line) - CLOCK_S

    def _mark_wanted(self, now: float) -> bool:
        power = self._body.power
        if not power.comment or power.taken:
            return False
        return power.mark_due or now - self._mark_at >= MARK_POLL_S


def _now() -> float:
    return asyncio.get_running_loop().time()
