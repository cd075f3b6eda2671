"""Records of what is read from controllers and restored to them: backups, comparisons, restores."""

from collections import Counter
from collections.abc import Iterable
from datetime import datetime
from typing import Final, Literal, Self

from pydantic import Field
from typing_extensions import TypeAliasType

from gateway.core.errors import GatewayError
from gateway.core.records import Record, request_id_field

RestoreStatus = Literal["running", "verified", "differs", "failed", "cancelled"]
Phase = Literal["comparing", "writing", "reading_back", "saving", "awaiting_power_cycle", "verifying", "done"]


Units = Literal["keep_pulses", "convert"]
"""Conversion of a backup for a controller whose pulses are of another length."""


class ScaleDifference(Record):
    """A controller whose scale is not that of the backup."""

    target: str = Field(description="The body.")
    backup: str = Field(description="The scale of the backup: 100 pulses/mm.")
    controller: str = Field(description="The scale of the body: 250 pulses/mm, or no scale.")
    units: Units = Field(description="The requested conversion: keep the pulses, or keep lengths and speeds.")


SCALES = Field(
    default_factory=list[ScaleDifference],
    description="The bodies whose scale is not that of the backup, and what `units` made of that.",
)


class Difference(Record):
    """A difference between a controller and the backup."""

    target: str = Field(description="The body or the robot.")
    section: str
    name: str = Field(description="The setting, position or instruction in words.")
    wanted: str | None = Field(description="Value in the backup; null if it is empty or was never set.")
    held: str | None = Field(description="Value in the controller.")
    restorable: bool = Field(description="False if no command can restore it.")


PROGRAM: Final = "program"
DIFFERING: Final = (
    "Number of differences by kind: settings, positions, program and others; a program counts once."
)


def differing(differences: Iterable[Difference]) -> dict[str, int]:
    """Count differences by their kind; a program that differs in many places is one for each controller."""
    kinds = [(difference.section.split()[-1], difference) for difference in differences]
    found = Counter(kind for kind, _ in kinds)
    if PROGRAM in found:
        found[PROGRAM] = len({difference.target for kind, difference in kinds if kind == PROGRAM})
    return dict(found)


class RestoreError(Record):
    """The error that ended a restore early, in the words of a problem detail."""

    type: str = Field(description="The kind of error; stable.")
    detail: str
    remedy: str

    @classmethod
    def of(cls, error: GatewayError) -> Self:
        """An error as it stands in a record."""
        return cls(type=error.kind, detail=error.detail, remedy=error.remedy)

    @classmethod
    def amid(cls, error: GatewayError, written: int, commands: int) -> Self:
        """An error after some commands were written: that nothing was sent is not true of the whole."""
        told = cls.of(error)
        if not written:
            return told
        detail = told.detail.replace(" Nothing was sent.", "").removesuffix("; nothing was sent.").rstrip(".")
        before = f"{detail}. {written} of {commands} commands had been written."
        return told.model_copy(update={"detail": before})


class RestorePlan(Record):
    """The plan of a restore; nothing was written."""

    target: str = Field(description="Path of the body, line or robot that is restored.")
    dry_run: Literal[True] = True
    commands: list[str] = Field(description="The exact commands, in their order.")
    differences: list[Difference] = Field(
        description="Differences from the backup; empty if the controllers hold it already."
    )
    differing: dict[str, int] = Field(description=DIFFERING)
    scales: list[ScaleDifference] = SCALES


class Restore(Record):
    """One restore of a backup."""

    id: str
    target: str = Field(description="Path of the body, line or robot that is restored.")
    status: RestoreStatus = Field(
        "running",
        description="`verified`: read back, all of the backup is there. `differs`: `differences` is all that "
        "is not. `failed`: it could not be read back, or it is not known what flash memory holds.",
    )
    phase: Phase = "comparing"
    controllers: list[str] = Field(description="Ids of the bodies, or of the robot, that are written.")
    scales: list[ScaleDifference] = SCALES
    commands: int = Field(0, description="Commands to be written, as far as is known.")
    written: int = Field(0, description="Commands written so far.")
    read: int = Field(0, description="Answers read so far, before and after writing.")
    left_s: float | None = Field(None, description="Seconds that the restore still takes; null if unknown.")
    flash: bool = Field(description="True if the settings are to be written to flash memory, too.")
    saved: bool = Field(False, description="True if the flash memory of all controllers was written.")
    power_cycle: bool = Field(
        description="True if the controllers are compared again after the power was off and on."
    )
    power_proved: bool = Field(
        True,
        description="False if no mark could prove that the power was kept while it was read back: a short "
        "loss of power may have gone unseen.",
    )
    differences: list[Difference] | None = Field(
        None,
        description="Differences between the controllers and the backup; null while unknown. "
        "Events tell the first 20.",
    )
    error: RestoreError | None = Field(None, description="The error that ended the restore early.")
    request_id: str | None = request_id_field()
    started_at: datetime
    ended_at: datetime | None = None


JobStatus = TypeAliasType("JobStatus", Literal["running", "succeeded", "failed", "cancelled"])


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
    status: JobStatus = "running"
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
