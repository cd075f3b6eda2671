"""How positions to be stored are cut into uploads: a robot numbers them by itself from a first one on."""

from collections.abc import Sequence

from pydantic import ValidationError

from gateway.errors import InvalidRequest
from protocols.fics.positions import LAST_POSITION, BeginPositionUpload, UploadPosition

UPLOAD = BeginPositionUpload()
"""Stands for an upload as a whole where it is asked what may be sent."""

Run = tuple[int, list[UploadPosition]]


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
        reason = error.errors()[0]["msg"].removeprefix("Value error, ")
        raise InvalidRequest(f"Position {number}: {reason}; nothing was sent.") from None
