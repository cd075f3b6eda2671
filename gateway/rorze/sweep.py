"""Questions to many bodies of a line in few frames, by virtual bodies that the gateway keeps for itself."""

import asyncio
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from math import ceil, inf
from typing import NamedTuple, cast

from gateway.core.errors import ControllerRefused, GatewayError, NoReply
from gateway.core.lanes import Lane
from gateway.core.line_state import LineState
from gateway.rorze.bodies import STATUS, Body, Group, R
from gateway.rorze.errors import is_evasive
from gateway.rorze.line import Line
from gateway.rorze.poll_intervals import background_of, is_prompt
from protocols.rorze.link_master import MOST_MEMBERS
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply

WORTH = 0.5
"""A group is asked where at least this share of its members is asked for; else each is asked alone."""
SERVING = (LineState.READY, LineState.OUT_OF_STEP)
"""What a line is that was set up; out of step it takes what is to be sent, and fences first."""
DISTRUST_S = 60.0
"""A group that did not answer is not asked again for this time: its link master may not define it."""


class SweepAnswer(NamedTuple):
    """What a body said, and when on the event loop's clock."""

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
        return [*self.own, *sorted(self._declared(), key=lambda it: len(it.members), reverse=True)]

    def relies_on(self, group: Group) -> bool:
        """Whether its number reaches its members, as far as is known."""
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
        """Whether a group that is relied on asks for it."""
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
        wanted = sum(it.online and groups.get(it) is group for it in company)
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
        """What each member of a group told; nothing where the group is not to be relied on."""
        try:
            return await group.ask(command, lane=lane)
        except (NoReply, ControllerRefused):
            self.distrust(group)
        except GatewayError:
            pass  # the line is down, or the like: each member says so
        return {}


def _says_nothing(error: GatewayError) -> bool:
    """Whether a group's reply leaves open if a member is there."""
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
