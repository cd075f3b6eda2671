"""What a backup that is being read tells: how far it has come, and the text in the end."""

from datetime import datetime
from typing import Literal

from pydantic import Field

from gateway.core.origin import current
from gateway.core.records import Record
from gateway.core.restore_record import RestoreError

Status = Literal["running", "succeeded", "failed", "cancelled"]


class BackupError(RestoreError):
    """Why there is no backup, in the words of a problem detail."""


class Backup(Record):
    """One backup that is being read, or was."""

    id: str
    target: str = Field(description="The path of what it is of.")
    status: Status = "running"
    controllers: list[str] = Field(description="The bodies, or the robot, it is read from, in their order.")
    controller: str | None = Field(None, description="Which of them is being read, or was when it ended.")
    read: int = Field(0, description="Answers so far.")
    expected: int | None = Field(
        0,
        description="Answers it takes at most, as far as is known: what was never set is not asked for. Null "
        "where nobody knows.",
    )
    text: str | None = Field(
        None, description="The backup, once it has succeeded. Events leave it out: ask for the record."
    )
    error: BackupError | None = Field(None, description="Why there is none.")
    request_id: str | None = Field(
        default_factory=lambda: current().request_id,
        description="The X-Request-Id of the request that asked for it.",
    )
    started_at: datetime
    ended_at: datetime | None = None
