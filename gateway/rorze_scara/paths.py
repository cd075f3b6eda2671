"""The interpolation paths that the controllers of a SCARA robot hold (HDS, HDD; RC-420 manual 13.10.5)."""

from collections.abc import Mapping, Sequence

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.exchange import Lane
from gateway.rorze_scara.scara import Scara
from protocols.rorze.interpolation import MOST_POINTS, GetPathPoint, PathPoint, SetPathPoint


class PathsDiffer(GatewayError):
    """The controllers of one robot hold different paths under one number."""

    kind = "paths-differ"


async def read(scara: Scara, path: int, lane: Lane | None = None) -> Mapping[int, PathPoint]:
    """Ask all controllers for a path, point by point; none where it is empty.

    :raises PathsDiffer: they hold different ones.
    :raises GatewayError: one did not tell.
    """
    points: dict[int, PathPoint] = {}
    for number in range(MOST_POINTS):
        point, *others = await scara.ask(GetPathPoint(path=path, point=number), lane=lane)
        if any(other != point for other in others):
            raise PathsDiffer(
                f"The controllers of {scara.id} hold different points {number} of path {path}; nothing was "
                "moved.",
                "Write the path again.",
            )
        if point == PathPoint():
            break
        points[number] = point
    return points


async def require_stored(scara: Scara, command: SetPathPoint) -> None:
    """See that all controllers hold a point that was just set: one garbled digit leads the arm elsewhere.

    :raises PathsDiffer: one holds something else.
    :raises GatewayError: one did not tell.
    """
    if command.point is None:
        return
    question = GetPathPoint(path=command.path, point=command.point)
    wanted = (command.x, command.y, command.radius, command.place)
    for body, point in zip(scara.members, await scara.ask(question, lane=Lane.VERIFY), strict=True):
        if (point.x, point.y, point.radius, point.place) != wanted:
            raise PathsDiffer(
                f"{body.address} holds another point {command.point} of path {command.path} than was sent; "
                "nothing was moved.",
                "Try again; if that does not help, check the line.",
            )


async def write(scara: Scara, path: int, points: Sequence[PathPoint]) -> Mapping[int, PathPoint]:
    """Put a path in the place of another, into RAM, and read it back.

    :raises InvalidRequest: the gateway keeps this path for its lines.
    :raises PathsDiffer: the controllers hold something else nevertheless.
    :raises GatewayError: one has refused it, or did not answer; the path may be cut short.
    """
    if path == scara.own_path:
        raise InvalidRequest(
            f"Path {path} is the one that the gateway writes its lines to; nothing was sent.",
            "Take another number, or change own_path in the configuration.",
        )
    commands = commands_for(path, points)
    with scara.line.sending(scara.group.number, commands):
        async with scara.line.undivided([scara.group.number]):
            for command in commands:
                await scara.ask(command)
            stored = await read(scara, path)
    if stored != dict(enumerate(points)):
        raise PathsDiffer(
            f"The controllers of {scara.id} hold another path {path} than was sent.", "Write it again."
        )
    return stored


def commands_for(path: int, points: Sequence[PathPoint]) -> list[SetPathPoint]:
    """Clear a path, and set its points."""
    setting = [
        SetPathPoint(path=path, point=number, x=point.x, y=point.y, radius=point.radius, place=point.place)
        for number, point in enumerate(points)
    ]
    return [SetPathPoint(path=path), *setting]
