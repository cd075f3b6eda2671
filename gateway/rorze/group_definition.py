"""Groups that are defined while the gateway runs."""

from gateway.core.errors import BodyBusy, GatewayError, InvalidRequest
from gateway.core.lanes import Lane
from gateway.rorze.bodies import Body, Group
from gateway.rorze.line import Line
from protocols.rorze.row import FIRST_GROUP, LAST_GROUP


def planned_group(address: str, bodies: list[Body], name: str) -> Group:
    """Make a group that nobody knows yet, with its members in order.

    :raises InvalidRequest: the members are too few, not on one line, or the number is no group's.
    """
    if len(bodies) < 2 or len(set(bodies)) < len(bodies):
        raise InvalidRequest("A group has at least two members, each once; nothing was sent.")
    line = bodies[0].line
    number = _group_number(address, line)
    if any(body.line is not line for body in bodies):
        raise InvalidRequest("All members of a group are on one line; nothing was sent.")
    return Group(line, number, bodies, name)


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
        group.line.cancel(lambda it: it.body == old.number and it.lane is not Lane.STOP, old.redefined())
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
