"""Questions to many bodies of a line in few frames, by virtual bodies that the gateway keeps for itself."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager, nullcontext, suppress
from math import ceil, inf
from typing import NamedTuple, Protocol, cast

from gateway.core.errors import ControllerRefused, GatewayError, NoReply
from gateway.core.events import EventHub
from gateway.core.exchange import Lane
from gateway.core.line_state import LineState
from gateway.core.stops import CONFIRM_WITHIN_S
from gateway.rorze.bodies import STATUS, Body, Group, R
from gateway.rorze.errors import is_evasive
from gateway.rorze.line import Line
from gateway.rorze.session import SILENT_BODIES
from protocols.rorze.link_master import MOST_MEMBERS
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply

HEALTH_POLL_S = 5.0
"""A body without a move is asked for its status and position this often, where the line has the time."""
IDLE_POLL_S = 0.6
"""One that has not answered for this time is asked for its status, where the line has the time."""
MARK_POLL_S = 30.0
"""The mark of its power is read this often, where the line has the time."""
PROMPT_SHARE = 0.3
"""Share of the time of a line of few bodies, whose loss of power is told within two seconds."""
PRESENCE, POLLS, MARKS = 0.45, 0.3, 0.2
"""Shares of presence, polls, and marks in the share of health; the rest is for what is asked anew."""
STATUS_BYTES, POLL_BYTES, MARK_BYTES = 18, 43, 30
"""Bytes of 9CD, of 9CD and 6PD, and of 9VD, with their replies."""
MARK_EXCHANGES = 3
"""The comment is read, written, and read back."""
ATTENDED_AT_A_TIME = 2
"""Bodies of a crowded line attended at a time: a caller that follows a motor takes turns with few."""
CALLED_FOR_SHARE = 0.05
"""Share of the line's time for looks that something has called for and that go among clients' reads."""
LEARN_SHARE = 0.38
"""Share of the line's time for all else that is asked anew, as at the start; with those less than half."""
GROUP_BYTES, MEMBER_BYTES = 16, 8
"""Bytes of 9CD or URD to a group and its reply, and for each member in it, at most."""
TURNAROUND_S = 0.003
"""Seconds from a question to its reply, besides the bytes: an assumption."""
SLOWEST_BYTE_S = 10 / 9600
"""A port that does not tell its speed may lead to a line of 9600 baud."""
FOLLOW_SHARE = 0.7
"""Share of the line's time for polls of moving bodies."""
END_SEEN_S = 1.0
"""Seconds between polls of moving bodies beyond which they are asked for their status only."""
CROWD_POLL_S = 0.8
CROWD_SHARE = 0.9
"""Then they are asked this often, or as often as a share of the line's time allows: clients go first."""


def wire_s(line: Line, wire_bytes: int, exchanges: int = 1) -> float:
    """The time in seconds that the bytes of questions and replies take on a line."""
    return wire_bytes * (line.byte_time_s or SLOWEST_BYTE_S) + exchanges * TURNAROUND_S


def taken_s(line: Line, wire_bytes: int, exchanges: int = 1) -> float:
    """The time in seconds of exchanges with the measured delay of replies: a busy machine reads them late."""
    late_s = max(line.turnaround_s - TURNAROUND_S, 0.0)
    return wire_s(line, wire_bytes, exchanges) + exchanges * late_s


def poll_s(line: Line) -> float:
    """The time in seconds of a poll; a move that has just begun may be over by then, and one poll tells."""
    return taken_s(line, POLL_BYTES, exchanges=2)


def status_s(line: Line) -> float:
    """The time in seconds of the question for the status."""
    return taken_s(line, STATUS_BYTES)


def mark_s(line: Line, *, written: bool) -> float:
    """The time in seconds to read a mark, or to write one where there is none."""
    exchanges = 1 if written else MARK_EXCHANGES
    return taken_s(line, exchanges * MARK_BYTES, exchanges)


def group_s(line: Line, members: int) -> float:
    """The time in seconds of the question for the status to a group."""
    return taken_s(line, GROUP_BYTES + members * MEMBER_BYTES)


def is_prompt(line: Line) -> bool:
    """True if few enough bodies are there to tell within two seconds that one has lost its power.

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
        """The time of the next question that takes `takes_s` seconds: half of the line is left to others."""
        return self._learning.next(now, takes_s)

    def next_status(self, now: float) -> float:
        """When to ask a body that no group covers whether it is there."""
        return self._presence.next(now + IDLE_POLL_S, status_s(self.line))

    def next_of_group(self, now: float, members: int, groups: int) -> float:
        """The time of the next question to one of `groups` groups with `members` bodies each."""
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
    """The least seconds between questions to a body that has a move."""
    if not is_crowded(line):
        return len(line.followed) * wire_s(line, POLL_BYTES, 2) / FOLLOW_SHARE
    return max(CROWD_POLL_S, len(line.followed) * wire_s(line, STATUS_BYTES) / CROWD_SHARE)


def is_crowded(line: Line) -> bool:
    """True if too many move to ask each for its position, too, and see its end in time."""
    return len(line.followed) * wire_s(line, POLL_BYTES, 2) > FOLLOW_SHARE * END_SEEN_S


WORTH = 0.5
"""A group is asked where at least this share of its members is asked for; else each is asked alone."""
SERVING = (LineState.READY, LineState.OUT_OF_STEP)
"""States of a line that was set up; out of step it takes frames, and fences first."""
DISTRUST_S = 60.0
"""A group that did not answer is not asked again for this time: its link master may not define it."""


class SweepAnswer(NamedTuple):
    """An answer of a body, and its time on the event loop's clock."""

    reply: Reply
    at: float


class Sweep:
    """The questions to many bodies of one line.

    Any virtual body serves whose definition its link master has acknowledged: those that the gateway keeps
    for sweeps and, on a line of many bodies, the plant's own. A group is believed by its answers: who is
    missing in a reply is asked alone, and after a reply of others the link master is told its groups again.
    """

    def __init__(
        self,
        line: Line,
        bodies: Sequence[Body],
        numbers: Sequence[int] = (),
        declared: Callable[[], Iterable[Group]] = tuple,
    ) -> None:
        self._line = line
        self._declared = declared
        """The plant's own groups on this line; they may change while the gateway runs."""
        self.own = [
            Group(line, number, members)
            for number, members in zip(numbers, parts_of(bodies) if numbers else (), strict=False)
        ]
        self._reliable: Sequence[Group] = ()
        self._group_of: dict[Body, Group] = {}
        """The one group that stands for a body, while these groups are relied on."""
        self._distrusted_until: dict[Group, float] = {}
        self._defining = asyncio.Lock()
        for group in self.own:
            line.groups[group.number] = [member.number for member in group.members]
            line.own_groups.add(group.number)

    @property
    def groups(self) -> list[Group]:
        """All groups of the line: its own first, for they share out all bodies, then large ones."""
        return [*self.own, *sorted(self._declared(), key=lambda group: len(group.members), reverse=True)]

    def relies_on(self, group: Group) -> bool:
        """True if its number reaches its members, as far as is known."""
        if not group.in_force or not self._line.knows_group(group.number):
            return False
        return self._distrusted_until.get(group, -inf) <= _now()

    def distrust(self, group: Group) -> None:
        """It did not answer: ask its members alone for a while, and tell the link master its groups again."""
        if self._distrusted_until.get(group, -inf) <= _now():
            self._line.set_up_again(f"group {group.short} does not answer")
        self._distrusted_until[group] = _now() + DISTRUST_S

    def represented_by(self, group: Group) -> list[Body]:
        """The members that are asked by this group, and by no other."""
        groups = self._groups_by_body()
        return [member for member in group.members if groups.get(member) is group]

    def _groups_by_body(self) -> Mapping[Body, Group]:
        groups = self.own if is_prompt(self._line) else self.groups
        reliable = [group for group in groups if self.relies_on(group)]
        if reliable != self._reliable:
            self._reliable = reliable
            self._group_of = {member: group for group in reversed(reliable) for member in group.members}
        return self._group_of

    def covers(self, body: Body) -> bool:
        """True if a group that is relied on asks for it."""
        return body in self._groups_by_body()

    async def define(self) -> None:
        """Define its own groups that the link master has not been told since the last set-up (XVS)."""
        async with self._defining:
            for group in self.own:
                if self._line.state in SERVING and not self._line.knows_group(group.number):
                    with suppress(GatewayError):
                        await self._line.define_own_group(group.number)

    async def look_for_silent(self) -> None:
        """Ask the groups in which bodies are silent, for their line lives again: who answers is there."""
        await self.define()
        for group in self.groups:
            silent = not all(member.online for member in self.represented_by(group))
            if silent and not await self._ask_group(group, STATUS, Lane.BACKGROUND):
                return

    async def look_at(self, group: Group) -> None:
        """See who of a group is there, and that the link master still knows it."""
        if self.relies_on(group) and any(member.online for member in group.members):
            await self._ask_part(group, group.members, STATUS, background_of(self._line))

    def group_for(self, body: Body, company: Iterable[Body]) -> Group | None:
        """The group to ask in the place of a body, where enough of its members are in the same company."""
        groups = self._groups_by_body()
        group = groups.get(body)
        if group is None:
            return None
        wanted = sum(body.online and groups.get(body) is group for body in company)
        return group if wanted >= max(2, WORTH * len(group.members)) else None

    async def ask(
        self, bodies: Sequence[Body], command: RorzeCommand[R], lane: Lane = Lane.READ
    ) -> dict[Body, SweepAnswer | GatewayError]:
        """Ask bodies the same, and give what each has told, or why it has not."""
        parts: dict[Group | None, list[Body]] = {}
        for body in bodies:
            parts.setdefault(self.group_for(body, bodies), []).append(body)
        results: dict[Body, SweepAnswer | GatewayError] = {}
        for told in await asyncio.gather(
            *(self._ask_part(group, members, command, lane) for group, members in parts.items())
        ):
            results |= told
        return {body: results[body] for body in bodies}

    async def ask_one(self, body: Body, company: Iterable[Body], command: RorzeCommand[R], lane: Lane) -> R:
        """Ask one of many that are asked the same at the same time: they share the frame to their group.

        :raises GatewayError: it was refused, not sent, or not answered.
        """
        group = self.group_for(body, company)
        if group is not None:
            reply = (await self._ask_group(group, command, lane)).get(body)
            if isinstance(reply, Reply):
                return cast("R", reply)
        return (await body.ask(command, lane=lane))[0]

    async def _ask_part(
        self, group: Group | None, members: Sequence[Body], command: RorzeCommand[R], lane: Lane
    ) -> dict[Body, SweepAnswer | GatewayError]:
        results: dict[Body, SweepAnswer | GatewayError] = {}
        if group is not None:
            replies = await self._ask_group(group, command, lane)
            results = {
                member: SweepAnswer(reply, member.last_heard_at or 0.0) if isinstance(reply, Reply) else reply
                for member, reply in replies.items()
                if member in members and (isinstance(reply, Reply) or not _says_nothing(reply))
            }
        for member in members:
            if member not in results:
                results[member] = await _ask_alone(member, command, lane)
        return results

    async def _ask_group(
        self, group: Group, command: RorzeCommand[R], lane: Lane
    ) -> dict[Body, Reply | GatewayError]:
        """Ask a group, and give the answer of each member; empty where the group is not to be relied on."""
        try:
            return await group.ask(command, lane=lane)
        except (NoReply, ControllerRefused):
            self.distrust(group)
        except GatewayError:
            pass  # the line is down, or the like: each member says so
        return {}


def _says_nothing(error: GatewayError) -> bool:
    """True if a group's reply leaves open if a member is there."""
    return isinstance(error, NoReply) or is_evasive(error)


def parts_of(bodies: Sequence[Body]) -> list[list[Body]]:
    """Share bodies out evenly among as few groups as one definition each allows (RC-420 manual 12)."""
    if len(bodies) < 2:
        return []
    size = ceil(len(bodies) / ceil(len(bodies) / MOST_MEMBERS))
    return [list(bodies[first : first + size]) for first in range(0, len(bodies), size)]


async def _ask_alone(body: Body, command: RorzeCommand[R], lane: Lane) -> SweepAnswer | GatewayError:
    try:
        reply, answered = await body.ask(command, lane=lane)
    except GatewayError as error:
        return error
    return SweepAnswer(reply, answered.at)


def _now() -> float:
    return asyncio.get_running_loop().time()


# lines on which many stops are not confirmed

QUIET_TIMEOUTS = 2
"""Timeouts of a reply without an answer after which a line is silent, where many stops are due."""
MORE_THAN_A_FUSE = 12
"""Bodies that fall silent at once and do not hang on one fuse."""
CHECK_S = 0.5
"""A silent line is listened to this often."""
PROOF_BYTES, PROOF_EXCHANGES = 140, 6
"""Bytes and exchanges that stop a body and its program and see it stand, with all replies."""


def proofs_s(line: Line, stops: int) -> float:
    """Time to stop a number of bodies and to see them stand, in seconds."""
    return stops * taken_s(line, PROOF_BYTES, PROOF_EXCHANGES)


def is_silent(line: Line) -> bool:
    """True if no body on a line has been heard for longer than it takes to find one silent."""
    return _quiet_timeouts(line) >= QUIET_TIMEOUTS + line.late_reply_s / line.reply_timeout_s


def is_heard(line: Line) -> bool:
    """True if a body on a line was heard within the time of a reply."""
    return _quiet_timeouts(line) <= 1


def is_quiet(line: Line) -> bool:
    """True if no body on a line was heard for long enough that the line may be silent."""
    return _quiet_timeouts(line) >= QUIET_TIMEOUTS


def _quiet_timeouts(line: Line) -> float:
    """Time since the last answer on a line, in timeouts of a reply."""
    now = _now()
    return (now - line.presence.last_heard_at - line.held_since_heard_s(now)) / line.reply_timeout_s


class StopOnLine(Protocol):
    """The stop of a body, as far as the silence of its line is concerned."""

    body: Body

    @property
    def began_at(self) -> float:
        """Time when it was asked for, on the event loop's clock."""

    def is_late(self) -> bool:
        """True if the motor should stand by now."""

    def is_due(self) -> bool:
        """True if it was to be confirmed by now."""

    def publish(self, what: str, /) -> None:
        """Tell everybody how far it has come."""


class SilentLines:
    """The silent lines on which stops are not confirmed.

    While a line is told, its bodies need no alarms of their own. When it has been heard for long enough,
    each stop that is not confirmed even then is told again, as one of its body.
    """

    def __init__(self, events: EventHub, stops_on: Callable[[Line], Sequence[StopOnLine]]) -> None:
        self._events = events
        self._stops_on = stops_on
        self._told: set[asyncio.Task[None]] = set()

    def may_be(self, line: Line) -> bool:
        """True if it will be known in a moment if a line with many stops is silent."""
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
        """True if enough stops are due that their line is the cause, and not a fuse.

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
