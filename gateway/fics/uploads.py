"""Positions to be stored: a robot numbers them from a first one on, and takes no stop meanwhile."""

from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Any

from pydantic import ValidationError

from gateway.core.errors import OVERTAKEN, GatewayError, InvalidRequest
from gateway.fics.commander import Commander
from gateway.fics.errors import UploadBrokenOff
from protocols.fics.positions import LAST_POSITION, BeginPositionUpload, EndPositionUpload, UploadPosition
from protocols.fics.row import FicsCommand
from protocols.wording import sentence

UPLOAD = BeginPositionUpload()
"""Stands for an upload as a whole where it is asked what may be sent."""

Run = tuple[int, list[UploadPosition]]


async def upload(commander: Commander, runs: list[Run], epoch: int) -> None:
    """Store runs of positions, unless there is a stop after `epoch`; call it with the sequence lock held.

    :raises UploadBrokenOff: positions were sent before the one that failed, or before a stop.
    :raises GatewayError: nothing was stored.
    """
    sent = 0
    for first, commands in runs:
        begun = False
        try:
            async with _open(commander, first, epoch):
                begun = True
                for number, command in enumerate(commands, first):
                    await commander.ask(command, epoch)
                    sent = number
        except GatewayError as error:
            if sent or (begun and isinstance(error, OVERTAKEN)):
                raise UploadBrokenOff(commander.robot_id, sent, error) from error
            raise


@asynccontextmanager
async def _open(commander: Commander, first: int, epoch: int) -> AsyncIterator[None]:
    """Open an upload, and end it whatever has happened in between.

    Where its end is not heard, the line sees to that before anything else is said.
    """
    try:
        await commander.ask(BeginPositionUpload(first=first), epoch)
        yield
    finally:
        if commander.line.uploading:
            with suppress(GatewayError):
                await commander.say(EndPositionUpload())


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
