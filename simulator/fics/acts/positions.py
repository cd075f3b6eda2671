"""The table of positions (C-HOST manual 2-17 to 2-20)."""

from itertools import zip_longest

from protocols.fics.positions import (
    LAST_POSITION,
    BeginPositionUpload,
    ClearPositions,
    DownloadPositions,
    EndPositionUpload,
    StoredPosition,
    UploadPosition,
)
from protocols.table import Reply
from simulator.fics.actions import Code, Refused, acts_out
from simulator.fics.robot import Robot


@acts_out(BeginPositionUpload)
def _begin_upload(robot: Robot, command: BeginPositionUpload, now: float) -> None:
    robot.upload = command.first or 1


@acts_out(EndPositionUpload)
def _end_upload(robot: Robot, command: EndPositionUpload, now: float) -> None:
    """Close the upload; where there is none, POF 2 is refused as POS is, an assumption."""
    if robot.upload is None and robot.settings.upload_end == "refused":
        raise Refused(Code.NO_UPLOAD)
    robot.upload = None


@acts_out(UploadPosition)
def _upload_position(robot: Robot, command: UploadPosition, now: float) -> None:
    """Store the next position; E11 is given for too many positions and for too many axes alike."""
    if robot.upload is None:
        raise Refused(Code.NO_UPLOAD)
    if robot.upload > LAST_POSITION or len(command.coordinates) > len(robot.unit.users):
        raise Refused(Code.TOO_MANY)
    before = robot.unit.positions.get(robot.upload, ()) if robot.settings.left_out == "kept" else ()
    pairs = zip_longest(command.coordinates, before)
    robot.unit.positions[robot.upload] = tuple(old if new is None else new for new, old in pairs)
    robot.upload += 1


@acts_out(DownloadPositions)
def _download_positions(robot: Robot, command: DownloadPositions, now: float) -> list[Reply]:
    """Tell positions up to the first number without one, for an answer carries no number: an assumption."""
    answers: list[Reply] = []
    for number in _range(command):
        position = robot.unit.positions.get(number)
        if position is None and robot.settings.download_end == "skips_holes":
            continue
        if position is None:
            break
        answers.append(StoredPosition(coordinates=list(position)))
    return answers


@acts_out(ClearPositions)
def _clear_positions(robot: Robot, command: ClearPositions, now: float) -> None:
    for number in _range(command):
        robot.unit.positions.pop(number, None)


def _range(command: DownloadPositions | ClearPositions) -> range:
    first = command.first or 1
    return range(first, min(first + (command.count or LAST_POSITION), LAST_POSITION + 1))
