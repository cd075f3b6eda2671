"""The record of a reading of controllers, one after the other: its progress, and the answers."""

from datetime import datetime
from typing import Literal

from pydantic import Field

from gateway.core.records import Record, request_id_field
from gateway.core.restore_record import DIFFERING, SCALES, Difference, RestoreError, ScaleDifference

Status = Literal["running", "succeeded", "failed", "cancelled"]


class BackupError(RestoreError):
    """Why it was not read, in the words of a problem detail."""


BAUD = Field(
    None, description="Baud rate of the line, if its port tells it: 38400 takes a third of the time of 9600."
)
LEFT_S = Field(
    None,
    description="Seconds that it still takes, by the line's speed first, then by its own pace; null if "
    "unknown.",
)


class Reading(Record):
    """A long reading, under way or over."""

    id: str
    target: str = Field(description="Path of the body, line or robot that is read.")
    status: Status = "running"
    controllers: list[str] = Field(
        description="Ids of the bodies, or of the robot, that are read, in their order."
    )
    controller: str | None = Field(
        None, description="The controller that is being read, or was when the reading ended."
    )
    read: int = Field(0, description="Answers read so far.")
    expected: int | None = Field(
        0,
        description="Answers it takes at most, as far as is known: settings that were never set are not "
        "asked for. Null if unknown.",
    )
    left_s: float | None = LEFT_S
    baud: int | None = BAUD
    error: BackupError | None = Field(None, description="The error that ended the reading early.")
    request_id: str | None = request_id_field()
    started_at: datetime
    ended_at: datetime | None = None


class Backup(Reading):
    """One backup that is being read, or was."""

    text: str | None = Field(
        None, description="The backup, once it has succeeded. Events leave it out: ask for the record."
    )


class BackupComparison(Reading):
    """One comparison of controllers with a backup: what a restore would do; nothing is written."""

    scales: list[ScaleDifference] = SCALES
    commands: list[str] | None = Field(
        None,
        description="The exact commands of a restore, in their order, once it has succeeded. Events leave "
        "them and the differences out: ask for the record.",
    )
    differences: list[Difference] | None = Field(
        None, description="Differences from the backup; empty if the controllers hold it already."
    )
    differing: dict[str, int] | None = Field(None, description=DIFFERING)
    restore_s: float | None = Field(
        None, description="Seconds that a restore and its reading back would take; null if unknown."
    )
