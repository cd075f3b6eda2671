"""Questions to many bodies of a line in few frames, by virtual bodies that the gateway keeps for itself."""

import asyncio
from collections.abc import Iterable, Sequence
from contextlib import suppress
from math import ceil, inf
from typing import NamedTuple, cast

from gateway.core.errors import ControllerRefused, GatewayError, NoReply
from gateway.core.lanes import Lane
from gateway.core.line_state import LineState
from gateway.rorze.bodies import STATUS, Body, Group, R
from gateway.rorze.errors import is_evasive
from gateway.rorze.line import Line
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

    A group is believed by its answers: who is missing in a reply is asked alone, and after a reply of others
    the link master is told its groups again.
    """

    def __init__(self, line: Line, bodies: Sequence[Body], numbers: Sequence[int] = ()) -> None:
        self._line = line
        self.groups = [
            Group(line, number, members)
            for number, members in zip(numbers, parts_of(bodies) if numbers else (), strict=False)
        ]
        self._group_of = {member: group for group in self.groups for member in group.members}
        self._distrusted_until: dict[Group, float] = {}
        self._defining = asyncio.Lock()
        for group in self.groups:
            line.groups[group.number] = [member.number for member in group.members]
            line.own_groups[group.number] = 0

    def covers(self, body: Body) -> bool:
        """Whether a group that is relied on asks for it."""
        group = self._group_of.get(body)
        if group is None or not self._line.knows_own_group(group.number):
            return False
        return self._distrusted_until.get(group, -inf) <= _now()

    async def define(self) -> None:
        """Define the groups that the link master has not been told since the last set-up (XVS)."""
        async with self._defining:
            for group in self.groups:
                if self._line.state in SERVING and not self._line.knows_own_group(group.number):
                    with suppress(GatewayError):
                        await self._line.define_own_group(group.number)

    async def look_for_silent(self) -> None:
        """Ask the groups in which bodies are silent, for their line lives again: who answers is there."""
        await self.define()
        for group in self.groups:
            first, *_ = group.members
            silent = not all(member.online for member in group.members)
            if silent and self.covers(first) and not await self._ask_group(group, STATUS, Lane.BACKGROUND):
                return

    def group_for(self, body: Body, company: Iterable[Body]) -> Group | None:
        """The group to ask in the place of a body, where enough of its members are in the same company."""
        if not self.covers(body):
            return None
        group = self._group_of[body]
        wanted = sum(it.online and self._group_of.get(it) is group for it in company)
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
            if self._distrusted_until.get(group, -inf) <= _now():
                self._line.set_up_again(f"group {group.short}, which is for sweeps, does not answer")
            self._distrusted_until[group] = _now() + DISTRUST_S
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
