"""The table of positions of a unit: each change is read back, for one lost line shifts all that follow."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from gateway.core.errors import GatewayError, NoReply
from gateway.core.lanes import Lane
from gateway.fics.downloads import download
from gateway.fics.errors import NotDone, NotReadBack, PositionsDiffer
from gateway.fics.read_back import same_number
from gateway.fics.shared_reads import Heard, deadline_of, heard_now
from gateway.fics.targets import DISPLAYED
from gateway.fics.uploads import UPLOAD, Run, runs_of, upload
from protocols.fics.positions import (
    LAST_POSITION,
    ClearPositions,
    DownloadPositions,
    StoredPosition,
    UploadPosition,
)
from protocols.fics.system import HostMode

if TYPE_CHECKING:
    from gateway.fics.units import RobotUnit

TOLD = 3
"""So many positions that differ are told one by one."""

Positions = Sequence[tuple[int, Sequence[float | None]]]


async def store(unit: "RobotUnit", positions: Positions) -> None:
    """Store positions undivided, and see that the robot holds them (C-HOST manual 2-17 to 2-19).

    :raises InvalidRequest: a number or a coordinate is not possible; nothing was sent.
    :raises UploadBrokenOff: positions were sent before the one that failed, or before a stop.
    :raises PositionsDiffer: the robot holds others than were sent.
    :raises NotReadBack: all were sent, and the robot has not told what it holds.
    :raises GatewayError: nothing was stored.
    """
    robot = unit.robot
    robot.line.admission.require()
    runs = runs_of(positions)
    for _, coordinates in positions:
        unit.require_values("user", coordinates)
    robot.require_free(UPLOAD)
    epoch = robot.line.stop_epoch
    async with robot.tables_change:
        async with robot.line.sequence_lock.held(Lane.COMMAND, deadline_of(Lane.COMMAND)):
            await robot.selection.make(unit.number, afresh=True)
            await upload(robot, runs, epoch)
        await _verify(unit, runs)


async def _verify(unit: "RobotUnit", runs: Sequence[Run]) -> None:
    found: dict[int, StoredPosition] = {}
    try:
        for first, commands in runs:
            part = DownloadPositions(first=first, count=len(commands))
            heard = await download(unit, part, Lane.COMMAND)
            found |= dict(enumerate(heard.replies, first))
    except GatewayError as unread:
        sent = sum(len(commands) for _, commands in runs)
        raise NotReadBack(f"{sent} positions were sent to {unit.address}", unread) from unread
    wanted = {n: row for first, commands in runs for n, row in enumerate(commands, first)}
    differing = [number for number, row in wanted.items() if not agrees(row, found.get(number))]
    if differing:
        raise _differ(unit, differing, wanted, found)


def agrees(sent: UploadPosition, held: StoredPosition | None) -> bool:
    """Whether a stored position is the one that was sent, as a robot displays it.

    That it has no coordinate for an axis that was left out, whatever it had before, is an assumption.
    """
    if held is None or len(held.coordinates) != len(sent.coordinates):
        return False  # neither list ends with an axis that is left out
    return all(
        one == other if one is None or other is None else same_number(one, other, DISPLAYED)
        for one, other in zip(sent.coordinates, held.coordinates, strict=True)
    )


def _differ(
    unit: "RobotUnit",
    differing: Sequence[int],
    wanted: Mapping[int, UploadPosition],
    found: Mapping[int, StoredPosition],
) -> PositionsDiffer:
    cases = []
    for number in differing[:TOLD]:
        holds = f"holds {found[number].written()}" if number in found else "is not set"
        cases.append(f"{number} {holds} and was sent as {wanted[number].written()}")
    more = f"; so do {len(differing) - TOLD} more" if len(differing) > TOLD else ""
    return PositionsDiffer(
        f"Of {len(wanted)} positions that were sent to {unit.address}, {len(differing)} differ: "
        f"{'; '.join(cases)}{more}. A line was lost, doubled or garbled on its way; "
        "others may be overwritten.",
        "Move to none of them. Read the table, and upload what differs again.",
    )


async def clear(unit: "RobotUnit", command: ClearPositions) -> Heard:
    """Clear positions (C-HOST manual 2-20); in Ver.2 see that they are.

    What was set there before and is not now proves it: the first position, and of a single one its absence.

    :raises NotDone: the first or the last is still set.
    :raises NotReadBack: it was sent, and the robot has not told whether they are set.
    :raises NoReply: it was sent, and nothing that can be read tells whether it was done.
    :raises GatewayError: it was not done, or not sent.
    """
    robot, epoch = unit.robot, unit.robot.line.stop_epoch
    async with robot.tables_change:
        if robot.mode != HostMode.VER_2:
            return await robot.converse(command, unit.number)
        first = command.first or 1
        last = min(first + (command.count or LAST_POSITION) - 1, LAST_POSITION)
        robot.require_free(command)
        was_set = await unit.stored(first, Lane.COMMAND) is not None
        if robot.line.stop_epoch != epoch:
            raise robot.line.overtaken()
        unanswered = None
        try:
            await robot.converse(command, unit.number)
        except NoReply as error:
            unanswered = error
        await _see_cleared(unit, command, (first, last))
        if unanswered is not None and not was_set and first != last:
            raise unanswered
    return heard_now()


async def _see_cleared(unit: "RobotUnit", command: ClearPositions, numbers: Sequence[int]) -> None:
    sent = f"{command.text()} was sent to {unit.address}"
    for number in dict.fromkeys(numbers):
        try:
            still_set = await unit.stored(number, Lane.COMMAND) is not None
        except GatewayError as unread:
            raise NotReadBack(sent, unread) from unread
        if still_set:
            raise NotDone(f"{sent}, and position {number} is still set: that was not done as asked.", command)
