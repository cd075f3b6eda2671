"""The groups of a plant: those of its configuration, and those that are defined while the gateway runs."""

import asyncio
from collections.abc import Callable, Sequence
from functools import partial

from gateway.core.errors import BodyBusy, GatewayError, InvalidRequest
from gateway.core.exchange import Lane
from gateway.rorze.bodies import Body, Group
from gateway.rorze.line import Line
from protocols.rorze.row import FIRST_GROUP, LAST_GROUP


def planned_group(address: str, bodies: list[Body], name: str) -> Group:
    """Make a group that is not defined yet, with its members in order.

    :raises InvalidRequest: the members are too few, not on one line, or the number is no group's.
    """
    if len(bodies) < 2 or len(set(bodies)) < len(bodies):
        raise InvalidRequest("A group has at least two members, each once; nothing was sent.")
    line = bodies[0].line
    number = _group_number(address, line)
    if any(body.line is not line for body in bodies):
        raise InvalidRequest("All members of a group are on one line; nothing was sent.")
    return Group(line, number, bodies, name)


class Groups:
    """All groups of a plant."""

    def __init__(self, on_strangers: Callable[[Group, set[int]], None]) -> None:
        self.by_address: dict[str, Group] = {}
        self.configured: dict[str, Sequence[Body]] = {}
        """The members that the configuration gives each group, by its address."""
        self._on_strangers = on_strangers
        self._defining = asyncio.Lock()

    def of(self, body: Body) -> list[Group]:
        """The groups a body is in."""
        return [group for group in self.by_address.values() if body in group.members]

    def on(self, line: Line) -> list[Group]:
        """The groups of a line."""
        return [group for group in self.by_address.values() if group.line is line]

    def configure(self, group: Group) -> None:
        """Take a group of the configuration, or one that an extension holds."""
        self._add(group)
        self.configured[group.address] = tuple(group.members)

    def look_after(self, group: Group) -> None:
        """Tell of bodies that obey it, and are no members."""
        group.on_strangers = partial(self._on_strangers, group)

    def forget(self, line: Line) -> None:
        """A line is not there any more."""
        for group in self.on(line):
            self.configured.pop(group.address, None)
            del self.by_address[group.address]

    async def define(self, group: Group) -> None:
        """Define a group in the place of one that may have its number.

        :raises InvalidRequest: its number is kept for something.
        :raises GatewayError: a member moves, or the link master refused; the old definition holds.
        """
        before = self.by_address.get(group.address)
        if before is not None and before.kept_for is not None:
            raise InvalidRequest(
                f"{group.address} is the group of {before.kept_for}; nothing was sent.",
                "Take another number, or change the configuration.",
            )
        async with self._defining:
            await define(group, self.by_address.get(group.address))
            self._add(group)

    def _add(self, group: Group) -> None:
        self.look_after(group)
        self.by_address[group.address] = group


async def define(group: Group, old: Group | None) -> None:
    """Define a group at the link master (XVS) in the place of an `old` one.

    From the first word to the link master on, nothing but stops is sent to the number.

    :raises GatewayError: a member moves, or the link master refused; the old definition holds.
    """
    for body in (*group.members, *(old.members if old else ())):
        if body.move is not None:
            raise BodyBusy(f"{body.address} is moving; nothing was sent.", "Wait for the end of its move.")
    if old is not None:
        old.in_force = False
        group.line.cancel(
            lambda exchange: exchange.target == old.number and exchange.lane is not Lane.STOP, old.redefined()
        )
    try:
        await group.line.define_group(group.number, [body.number for body in group.members])
    except (
        GatewayError
    ):  # refused, not sent, or about to be undone; a caller that was cancelled does not know
        if old is not None:
            old.in_force = True
        raise


def _group_number(address: str, line: Line) -> int:
    text = address.removeprefix(f"{line.id}.")
    try:
        number = int(text, 16) if len(text) == 2 else -1
    except ValueError:
        number = -1
    if not FIRST_GROUP <= number <= LAST_GROUP:
        raise InvalidRequest(f"{address} is no group number: they go from 80 to 9E; nothing was sent.")
    return number
