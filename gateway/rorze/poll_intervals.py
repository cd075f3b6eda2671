"""How much of a line's time the gateway takes for itself, and how often it can ask for that."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, nullcontext
from math import inf

from gateway.core.lanes import Lane
from gateway.rorze.line import Line

HEALTH_POLL_S = 5.0
"""A body without a move is asked for its status and position this often, where the line has the time."""
IDLE_POLL_S = 0.6
"""One that has not answered for this time is asked for its status, where the line has the time."""
MARK_POLL_S = 30.0
"""The mark of its power is read this often, where the line has the time."""
PROMPT_SHARE = 0.3
"""Share of the time of a line of few bodies, whose loss of power is told within two seconds."""
PRESENCE, POLLS, MARKS = 0.45, 0.3, 0.2
"""How the share of health is divided among presence, polls, and marks; the rest is for what is asked anew."""
STATUS_BYTES, POLL_BYTES, MARK_BYTES = 18, 43, 30
"""Of 9CD, of 9CD and 6PD, and of 9VD, with their replies."""
MARK_EXCHANGES = 3
"""The comment is read, written, and read back."""
ATTENDED_AT_A_TIME = 2
"""So many bodies of a line of many are attended at a time: who follows a motor takes turns with few."""
CALLED_FOR_SHARE = 0.05
"""Share of the line's time for looks that something has called for and that go among clients' reads."""
LEARN_SHARE = 0.38
"""Share of the line's time for all else that is asked anew, as at the start; with those less than half."""
GROUP_BYTES, MEMBER_BYTES = 16, 8
"""Of 9CD or URD to a group and its reply, and for each member in it, at most."""
TURNAROUND_S = 0.003
"""From a question to its reply, besides the bytes: an assumption."""
SLOWEST_BYTE_S = 10 / 9600
"""A port that does not tell its speed may lead to a line of 9600 baud."""
FOLLOW_SHARE = 0.7
"""Share of the line's time for polls of moving bodies."""
END_SEEN_S = 1.0
"""Where these polls would be further apart, moving bodies are asked for their status only."""
CROWD_POLL_S = 0.8
CROWD_SHARE = 0.9
"""Then they are asked this often, or as often as a share of the line's time allows: clients go first."""


def wire_s(line: Line, wire_bytes: int, exchanges: int = 1) -> float:
    """How long so many bytes, of questions and replies, take on a line."""
    return wire_bytes * (line.byte_time_s or SLOWEST_BYTE_S) + exchanges * TURNAROUND_S


def taken_s(line: Line, wire_bytes: int, exchanges: int = 1) -> float:
    """How long so many bytes take with the replies as late as they are: a busy machine reads them late."""
    late_s = max(line.turnaround_s - TURNAROUND_S, 0.0)
    return wire_s(line, wire_bytes, exchanges) + exchanges * late_s


def poll_s(line: Line) -> float:
    """How long a poll takes; a move that has just begun may be over by then, and nobody has to ask twice."""
    return taken_s(line, POLL_BYTES, exchanges=2)


def status_s(line: Line) -> float:
    """How long the question for the status takes."""
    return taken_s(line, STATUS_BYTES)


def mark_s(line: Line, *, written: bool) -> float:
    """How long it takes to read a mark, or to write one where there is none."""
    exchanges = 1 if written else MARK_EXCHANGES
    return taken_s(line, exchanges * MARK_BYTES, exchanges)


def group_s(line: Line, members: int) -> float:
    """How long the question for the status takes, to a group of so many."""
    return taken_s(line, GROUP_BYTES + members * MEMBER_BYTES)


def is_prompt(line: Line) -> bool:
    """Whether few enough bodies are there to tell within two seconds that one has lost its power.

    At 9600 baud these are 8 bodies; they take more than the share of health for it.
    """
    bodies = len(line.bodies) - len(line.offline)
    return bodies * wire_s(line, STATUS_BYTES) <= PROMPT_SHARE * IDLE_POLL_S


def background_of(line: Line) -> Lane:
    """The lane of what the gateway asks for itself: on a line of few bodies it takes turns with clients."""
    return Lane.READ if is_prompt(line) else Lane.BACKGROUND


class Budget:
    """Moments for questions that together take no more than a share of a line's time."""

    def __init__(self, share: float) -> None:
        self._share = share
        self._free_at = -inf

    def next(self, soonest: float, takes_s: float) -> float:
        """Keep the next free moment, from `soonest` on, for a question of this length."""
        at = max(soonest, self._free_at)
        self._free_at = at + takes_s / self._share
        return at

    def is_free(self, now: float, takes_s: float) -> bool:
        """Keep this moment for a question of this length, unless the one before it lasts."""
        free = self._free_at <= now
        if free:
            self.next(now, takes_s)
        return free


class Health:
    """When the bodies of a line are asked how they are."""

    def __init__(self, line: Line, share: float) -> None:
        self.line = line
        self._presence = Budget(PRESENCE * share)
        self._polls, self._marks = Budget(POLLS * share), Budget(MARKS * share)
        self._called_for, self._learning = Budget(CALLED_FOR_SHARE), Budget(LEARN_SHARE)
        self._turns = asyncio.Semaphore(ATTENDED_AT_A_TIME)

    @asynccontextmanager
    async def turn(self, takes_s: float) -> AsyncIterator[None]:
        """Wait for a turn in the background of a line of many bodies, and until its roll is called."""
        async with nullcontext() if is_prompt(self.line) else self._turns:
            await self.line.roll.called.wait()
            if not is_prompt(self.line):
                now = asyncio.get_running_loop().time()
                await asyncio.sleep(self.next_moment(now, takes_s) - now)
            yield

    def next_moment(self, now: float, takes_s: float) -> float:
        """When to ask something anew that takes so long: half of the line is left to others."""
        return self._learning.next(now, takes_s)

    def next_status(self, now: float) -> float:
        """When to ask a body that no group covers whether it is there."""
        return self._presence.next(now + IDLE_POLL_S, status_s(self.line))

    def next_of_group(self, now: float, members: int, groups: int) -> float:
        """When to ask one of so many groups, of so many members, whether they are there."""
        soonest = now + (HEALTH_POLL_S / groups if is_prompt(self.line) else IDLE_POLL_S)
        return self._presence.next(soonest, group_s(self.line, members))

    def next_poll(self, now: float) -> float:
        """When to ask a body for its status and position."""
        if is_prompt(self.line):
            return now + HEALTH_POLL_S
        return self._polls.next(now + HEALTH_POLL_S, poll_s(self.line))

    def lane_of_called_for(self, now: float) -> Lane:
        """Where a look waits that something has called for: in a crowd, as at the start, behind clients."""
        free = self.line.roll.called.is_set() and self._called_for.is_free(now, poll_s(self.line))
        return Lane.READ if free else background_of(self.line)

    def next_mark(self, now: float) -> float:
        """When to read the mark of a body's power."""
        if is_prompt(self.line):
            return now + MARK_POLL_S
        return self._marks.next(now + MARK_POLL_S, mark_s(self.line, written=True))


def follow_s(line: Line) -> float:
    """How far apart the questions to a body that has a move are, at the least."""
    if not is_crowded(line):
        return line.followed * wire_s(line, POLL_BYTES, 2) / FOLLOW_SHARE
    return max(CROWD_POLL_S, line.followed * wire_s(line, STATUS_BYTES) / CROWD_SHARE)


def is_crowded(line: Line) -> bool:
    """Whether too many move to ask each for its position, too, and see its end in time."""
    return line.followed * wire_s(line, POLL_BYTES, 2) > FOLLOW_SHARE * END_SEEN_S
