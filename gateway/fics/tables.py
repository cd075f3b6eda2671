"""The table of positions of a unit: each change is read back, for one lost line shifts all that follow."""

from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Any

from pydantic import ValidationError

from gateway.core.errors import OVERTAKEN, GatewayError, InvalidRequest, NoReply
from gateway.core.exchange import Lane
from gateway.fics.agreement import READINGS, same_number
from gateway.fics.axes import DISPLAYED, at_rest
from gateway.fics.conversation import Answers, Conversation, answered_now, deadline_of
from gateway.fics.errors import (
    NotDone,
    NotReadBack,
    RobotBusy,
    RobotPositionsDiffer,
    UploadBrokenOff,
    preparing,
)
from gateway.fics.units import RobotUnit
from protocols.fics.positions import (
    LAST_POSITION,
    BeginPositionUpload,
    ClearPositions,
    DownloadPositions,
    EndPositionUpload,
    StoredPosition,
    UploadPosition,
)
from protocols.fics.row import FicsCommand
from protocols.fics.system import HostMode
from protocols.wording import sentence

UPLOAD = BeginPositionUpload()
"""Stands for an upload as a whole where it is asked what may be sent."""

Run = tuple[int, list[UploadPosition]]
TOLD = 3
"""The most positions that differ and are told one by one."""

Positions = Sequence[tuple[int, Sequence[float | None]]]


class Tables:
    """The tables of positions of a robot's units."""

    def __init__(self, conversation: Conversation) -> None:
        self._conversation = conversation
        self._known = conversation.known

    async def here(self, unit: RobotUnit) -> list[float | None]:
        """Where a unit stands, as it can be stored.

        :raises RobotBusy: it moves.
        :raises NotHomed, PositionUnknown: the robot does not tell where an axis stands.
        :raises GatewayError: it was not read.
        """
        self._known.motion.require_free(UPLOAD)
        with preparing(unit.robot_id, UPLOAD):
            if not at_rest((await unit.status()).values()):
                raise RobotBusy(
                    f"{unit.address} moves: {UPLOAD.wire_name()} was not sent.",
                    "Wait for its end or stop it.",
                )
            places = await unit.position()
        await unit.require_places(places, UPLOAD)
        return list(places.values())

    async def store(self, unit: RobotUnit, positions: Positions, since: int | None = None) -> None:
        """Store positions undivided, and see that the robot holds them (C-HOST manual 2-17 to 2-19).

        :raises Outdated: something was said `since` the reading of `as_expected`; nothing was sent.
        :raises InvalidRequest: a number or a coordinate is not possible; nothing was sent.
        :raises UploadBrokenOff: positions were sent before the one that failed, or before a stop.
        :raises PositionsDiffer: the robot holds others than were sent.
        :raises NotReadBack: all were sent, and the robot has not told what it holds.
        :raises GatewayError: nothing was stored.
        """
        line = self._conversation.line
        line.require_fit()
        runs = runs_of(positions)
        for _, coordinates in positions:
            unit.require_values("user", coordinates)
        self._known.motion.require_free(UPLOAD)
        epoch = line.stop_epoch
        async with self._known.motion.tables_change:
            with line.sending(lambda: commands_of(runs)):
                async with line.sequence_lock.held(Lane.COMMAND, deadline_of(Lane.COMMAND)):
                    self._known.begin_to_say(since)
                    with preparing(unit.robot_id, UPLOAD):
                        await self._conversation.select(unit.number, afresh=True)
                    await _upload(self._conversation, runs, epoch)
            await self._verify(unit, runs)

    async def _verify(self, unit: RobotUnit, runs: Sequence[Run]) -> None:
        """See that what was sent is held; a run in which something differs is read once more.

        :raises PositionsDiffer: it is not.
        :raises NotReadBack: the robot has not told.
        """
        wanted = {n: row for first, commands in runs for n, row in enumerate(commands, first)}
        left = [range(first, first + len(commands)) for first, commands in runs]
        for _ in range(READINGS):
            try:
                found = await self._held(unit, left)
            except GatewayError as unread:
                raise NotReadBack(f"{len(wanted)} positions were sent to {unit.address}", unread) from unread
            differing = [n for part in left for n in part if not agrees(wanted[n], found.get(n))]
            left = [part for part in left if not set(part).isdisjoint(differing)]
        if differing:
            raise _differ(unit, differing, wanted, found)

    async def _held(self, unit: RobotUnit, parts: Sequence[range]) -> dict[int, StoredPosition]:
        """The positions that are set, by their numbers."""
        found: dict[int, StoredPosition] = {}
        for part in parts:
            wanted = DownloadPositions(first=part.start, count=len(part))
            told = await unit.download(wanted, Lane.COMMAND)
            found |= dict(enumerate(told.replies, part.start))
        return found

    async def clear(self, unit: RobotUnit, command: ClearPositions) -> Answers:
        """Clear positions (C-HOST manual 2-20); in Ver.2 see that they are.

        A position proves it that was set there before and is not now: the first, and of a single one its
        absence.

        :raises NotDone: the first or the last is still set.
        :raises NotReadBack: it was sent, and the robot has not told whether they are set.
        :raises NoReply: it was sent, and nothing that can be read tells whether it was done.
        :raises GatewayError: it was not done, or not sent.
        """
        line, epoch = self._conversation.line, self._conversation.line.stop_epoch
        async with self._known.motion.tables_change:
            if line.mode != HostMode.VER_2:
                return await self._conversation.ask(command, unit.number)
            first = command.first or 1
            last = min(first + (command.count or LAST_POSITION) - 1, LAST_POSITION)
            self._known.motion.require_free(command)
            with preparing(unit.robot_id, command):
                was_set = await unit.stored(first, Lane.COMMAND) is not None
            if line.stop_epoch != epoch:
                raise line.overtaken()
            unanswered = None
            try:
                await self._conversation.ask(command, unit.number)
            except NoReply as error:
                unanswered = error
            await _see_cleared(unit, command, (first, last))
            if unanswered is not None and not was_set and first != last:
                raise unanswered
        return answered_now()


async def _upload(conversation: Conversation, runs: list[Run], epoch: int) -> None:
    """Store runs of positions, unless there is a stop after `epoch`; call it with the sequence lock held.

    :raises UploadBrokenOff: positions were sent before the one that failed, or before a stop.
    :raises GatewayError: nothing was stored.
    """
    sent = 0
    for first, commands in runs:
        begun = False
        try:
            async with _open(conversation, first, epoch):
                begun = True
                for number, command in enumerate(commands, first):
                    await conversation.tell(command, epoch)
                    sent = number
        except GatewayError as error:
            if sent or (begun and isinstance(error, OVERTAKEN)):
                raise UploadBrokenOff(conversation.robot_id, sent, error) from error
            raise


@asynccontextmanager
async def _open(conversation: Conversation, first: int, epoch: int) -> AsyncIterator[None]:
    """Open an upload, and end it whatever has happened in between.

    Where its end is not heard, the line sees to that before anything else is said.
    """
    try:
        await conversation.tell(BeginPositionUpload(first=first), epoch)
        yield
    finally:
        if conversation.line.uploading:
            with suppress(GatewayError):
                await conversation.say(EndPositionUpload())


async def _see_cleared(unit: RobotUnit, command: ClearPositions, numbers: Sequence[int]) -> None:
    sent = f"{command.text} was sent to {unit.address}"
    for number in dict.fromkeys(numbers):
        try:
            still_set = await _is_set(unit, number)
        except GatewayError as unread:
            raise NotReadBack(sent, unread) from unread
        if still_set:
            raise NotDone(f"{sent}, and position {number} is still set: that was not done as asked.", command)


async def _is_set(unit: RobotUnit, number: int) -> bool:
    """True if a position is set, however often it is read."""
    for _ in range(READINGS):
        if await unit.stored(number, Lane.COMMAND) is None:
            return False
    return True


def agrees(sent: UploadPosition, held: StoredPosition | None) -> bool:
    """True if a stored position is the one that was sent, as a robot displays it.

    That it has no coordinate for an axis that was left out, whatever it had before, is an assumption.
    """
    if held is None or len(held.coordinates) != len(sent.coordinates):
        return False  # neither list ends with an axis that is left out
    return all(
        one == other if one is None or other is None else same_number(one, other, DISPLAYED)
        for one, other in zip(sent.coordinates, held.coordinates, strict=True)
    )


def _differ(
    unit: RobotUnit,
    differing: Sequence[int],
    wanted: Mapping[int, UploadPosition],
    found: Mapping[int, StoredPosition],
) -> RobotPositionsDiffer:
    cases = []
    for number in differing[:TOLD]:
        holds = f"holds {found[number].written()}" if number in found else "is not set"
        cases.append(f"{number} {holds} and was sent as {wanted[number].written()}")
    more = f"; so do {len(differing) - TOLD} more" if len(differing) > TOLD else ""
    return RobotPositionsDiffer(
        f"Of {len(wanted)} positions that were sent to {unit.address}, {len(differing)} differ: "
        f"{'; '.join(cases)}{more}. A line was lost, doubled or garbled on its way; "
        "others may be overwritten.",
        "Move to none of them. Read the table, and upload what differs again.",
    )


def commands_of(runs: Iterable[Run]) -> list[FicsCommand[Any]]:
    """All that an upload sends, in its order."""
    return [
        command
        for first, positions in runs
        for command in (BeginPositionUpload(first=first), *positions, EndPositionUpload())
    ]


def runs_of(positions: Sequence[tuple[int, Sequence[float | None]]]) -> list[Run]:
    """Cut positions into runs of consecutive numbers, in ascending order.

    :raises InvalidRequest: a number comes twice or does not exist, or a coordinate is not possible.
    """
    runs: list[Run] = []
    last = 0
    for number, coordinates in sorted(positions, key=lambda position: position[0]):
        if not 1 <= number <= LAST_POSITION:
            raise InvalidRequest(
                f"There is no position {number}: they go from 1 to {LAST_POSITION}; nothing was sent."
            )
        if number == last:
            raise InvalidRequest(f"Position {number} is given twice; nothing was sent.")
        if not runs or number != last + 1:
            runs.append((number, []))
        runs[-1][1].append(_command(number, coordinates))
        last = number
    return runs


def _command(number: int, coordinates: Sequence[float | None]) -> UploadPosition:
    values = [None if value is None else float(value) for value in coordinates]
    try:
        return UploadPosition(coordinates=values)
    except ValidationError as error:
        raise InvalidRequest(f"Position {number}: {sentence(error.errors()[0])}; nothing was sent.") from None
