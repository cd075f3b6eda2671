"""Stored positions, read in parts whose answers are counted: a robot sends them without their numbers."""

from itertools import pairwise

from gateway.core.errors import ControllerRefused, GarbledReply
from gateway.core.lanes import Lane
from gateway.fics.asking import Answers, Asking, answered_now
from gateway.fics.axes import UnitAxes
from gateway.fics.errors import RobotBusy
from protocols.fics.positions import LAST_POSITION, DownloadPositions

PART = 16
"""Positions that are asked for at once: until all have come nothing else is answered, no proof of a stop."""
TRIES = 3
"""How often a part is asked for until the count of its answers is right."""
NOT_SET = "E09"
"""So a robot may answer where the first number is not set (C-HOST manual 2-12), instead of POE alone."""


async def download(
    asking: Asking, unit: UnitAxes, wanted: DownloadPositions, lane: Lane = Lane.READ
) -> Answers:
    """Read stored positions in turn, up to the first number that is not set (C-HOST manual 2-19).

    That a robot ends there, even with more positions behind it, is an assumption.

    :raises RobotBusy: a stop has come before all were read.
    :raises GarbledReply: answers were lost or doubled again and again.
    :raises GatewayError: they were not read; the error says why.
    """
    line, epoch = asking.line, asking.line.stop_epoch
    first = wanted.first or 1
    last = min(first + (wanted.count or LAST_POSITION) - 1, LAST_POSITION)
    parts: list[Answers] = []
    while first <= last:
        if line.stop_epoch != epoch:
            raise RobotBusy(
                f"A stop of {unit.robot_id} came first: not all of its positions were read.",
                "Read them again.",
            )
        count = min(PART, last - first + 1)
        parts.append(await _part(asking, unit, first, count, lane))
        if len(parts[-1].replies) < count:
            break
        first += count
    replies = tuple(reply for part in parts for reply in part.replies)
    return Answers(replies, parts[0].at, tuple(text for part in parts for text in part.texts))


async def _part(asking: Asking, unit: UnitAxes, first: int, count: int, lane: Lane) -> Answers:
    """Read a part; fewer than `count` positions only where the table ends."""
    for _ in range(TRIES):
        told = await _ask(asking, unit, first, count, lane)
        if (
            _is_doubtful(told, count)
            and (await _ask(asking, unit, first, count, lane)).replies != told.replies
        ):
            continue
        found = len(told.replies)
        if found == count or (found < count and await _ends_after(asking, unit, first, found, lane)):
            return told
    raise GarbledReply(
        f"Of the positions of {unit.address} from {first} on some answers were lost or doubled, so nobody "
        "knows their numbers.",
        "Ask again.",
        DownloadPositions(first=first, count=count),
    )


def _is_doubtful(told: Answers, count: int) -> bool:
    """Whether answers may be lost, doubled, or both: then the count is right, and neighbours are equal."""
    return len(told.replies) != count or any(one == other for one, other in pairwise(told.replies))


async def _ends_after(asking: Asking, unit: UnitAxes, first: int, found: int, lane: Lane) -> bool:
    """Whether the table ends after the positions that were found: the last is set, and the next is not."""
    return not found or len((await _ask(asking, unit, first + found - 1, 2, lane)).replies) == 1


async def _ask(asking: Asking, unit: UnitAxes, first: int, count: int, lane: Lane) -> Answers:
    try:
        return await asking.ask(DownloadPositions(first=first, count=count), unit.number, lane)
    except ControllerRefused as refused:
        if refused.error_code != NOT_SET:
            raise
        return answered_now()
