"""Backups: all that controllers keep, read as text, compared with one, brought back."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from gateway.core.backup_record import Backup, BackupComparison, Restore, RestorePlan
from gateway.core.backups import BackupSource
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.operation import Rows, Run
from gateway.core.records import RequestModel
from gateway.core.restores import RestoredController, Restores
from gateway.core.rights import Right
from gateway.core.works import Jobs
from gateway.door.records import Find, list_records
from gateway.plant import Plant

MAX_BACKUP_BYTES: Final = 2_097_152
"""A line of 120 bodies, each with a table of 200 positions."""
OVER: Final = "With `dry_run` the plan; else the restore is over."
TEXT: Final = "text/plain"
AS_TEXT: Final[Mapping[str, Any]] = {"media": TEXT, "answered": "The backup."}
ENDING: Final = ".backup"
LAST: Final = "last"
Night = Annotated[
    str,
    Field(
        pattern=r"^\d{4}-\d\d-\d\d$", description="The night's date, as YYYY-MM-DD.", examples=["2026-11-28"]
    ),
]
WITHOUT: Final = "Sections of the backup that are left as they are, such as positions."
NO_MORE: Final = "Read no more."
WRITE_NO_MORE: Final = "Write no more; what differs is still read and told, unless it is cancelled once more."


class ReadingOrder(NamedTuple):
    """Controllers that are to be read."""

    target: str
    """The path of what is asked for."""
    preamble: str
    sources: Sequence[BackupSource]


def folder_of_nights(plant: Plant) -> Path:
    """Where the backups lie that are read by night, by their targets.

    :raises NotFound: none are.
    """
    if plant.works.nightly_backups is None:
        raise NotFound("No backups are kept by night here; nothing was sent.", "Set [backups] nightly_at.")
    return plant.works.nightly_backups


async def text_of_night(plant: Plant, target: str, night: str, ending: str = ENDING) -> str:
    """Give the backup of a line or a robot that was read in a night, or in the last one.

    :raises NotFound: there is none.
    """
    own = folder_of_nights(plant) / target
    try:
        return await asyncio.to_thread(_read_night, own, night, ending)
    except FileNotFoundError:
        raise NotFound(f"There is no {target}/{night}{ending}; nothing was sent.") from None


def _read_night(own: Path, night: str, ending: str) -> str:
    files = sorted(own.glob(f"*{ending}")) if night == LAST else [own / f"{night}{ending}"]
    if not files:
        raise FileNotFoundError(own)
    return files[-1].read_text("utf-8")


class ComparisonOrder(NamedTuple):
    """Controllers, and what they are to hold."""

    target: str
    """The path of what was asked for."""
    restores: Restores[Any]
    controllers: Sequence[RestoredController]
    no_flash: str | None = None
    """Why nothing can be kept without power, if so."""


async def read(plant: Plant, reading: ReadingOrder, wait_s: float) -> Backup:
    """Begin to read a backup, and give its record after `wait_s` at most.

    :raises BodyBusy: one is being read, or restored, or a program is uploaded.
    :raises GatewayError: a controller does not answer.
    """
    begun = await plant.works.backups.start(*reading)
    await plant.works.backups.wait(begun, wait_s)
    return begun


async def text(reading: ReadingOrder) -> str:
    """Read a backup to its end; errors as of `read`, and where something was not read.

    A caller that gives up ends it.
    """
    for source in reading.sources:
        await source.require_ready()
    return reading.preamble + "".join([await source.read(_Nobody()) for source in reading.sources])


class _Nobody:
    """A progress that is reported nowhere."""

    def expect(self, _: int | None) -> None:
        """Say nothing."""

    def has_read(self) -> None:
        """Say nothing."""


async def plan(plant: Plant, wanted: ComparisonOrder) -> RestorePlan:
    """Tell what a restore would write, and what differs; nothing is written but the mark of the gateway.

    :raises BodyBusy: a controller is being restored.
    :raises GatewayError: one was not read.
    """
    plant.admission.require()
    return await wanted.restores.plan(wanted.target, wanted.controllers)


async def start(
    plant: Plant, wanted: ComparisonOrder, flash: bool, power_cycle: bool, wait_s: float
) -> Restore:
    """Begin to bring controllers back to a backup, and give the record after `wait_s` at most.

    :raises InvalidRequest: it cannot be kept without power, and is to be verified after a power cycle.
    :raises GatewayError: errors as of `Restores.start`.
    """
    plant.admission.require()
    if flash and wanted.no_flash is not None:
        raise InvalidRequest(f"flash: {wanted.no_flash}", "Leave it out.")
    if power_cycle and not flash:
        raise InvalidRequest(
            "power_cycle: what is not written to flash memory is lost with the power; nothing was sent.",
            "Ask for flash, too.",
        )
    restores = wanted.restores
    begun = await restores.start(wanted.target, wanted.controllers, flash=flash, power_cycle=power_cycle)
    await restores.wait(begun, wait_s)
    return begun


async def compare(plant: Plant, wanted: ComparisonOrder, wait_s: float) -> BackupComparison:
    """Begin to tell what a restore would write, and what differs; give the record after `wait_s` at most.

    :raises BodyBusy: a controller is being restored or compared.
    """
    plant.admission.require()
    begun = plant.works.comparisons.start(wanted.target, wanted.restores, wanted.controllers)
    await plant.works.comparisons.wait(begun, wait_s)
    return begun


class ComparisonRequest(RequestModel):
    """A backup to be compared with, as text or of a night. A section that it lacks is not looked at."""

    backup: str | None = Field(None, description="The text of a backup; comments after `;` mean nothing.")
    nightly: Literal["last"] | Night | None = Field(
        None, description="Night of a kept backup to be used in the place of `backup`: the last, or a date."
    )

    @model_validator(mode="after")
    def _one_backup(self) -> Self:
        if (self.backup is None) == (self.nightly is None):
            raise ValueError("give backup or nightly")
        return self


class RestoreRequest(ComparisonRequest):
    """A backup to be restored. A section that it does not have is left as it is."""

    dry_run: bool = Field(
        False, description="True to be told what would be written and what differs; nothing is written."
    )
    flash: bool = Field(
        False, description="True to write the settings to flash memory, too, once they were read back."
    )
    power_cycle: bool = Field(
        False, description="True to wait, with `flash`, until the power was off and on, and compare again."
    )


async def text_of(plant: Plant, target: str, wanted: ComparisonRequest) -> str:
    """Give the backup of a request; errors as of `text_of_night`."""
    if wanted.backup is not None:
        return wanted.backup
    return await text_of_night(plant, target, wanted.nightly or LAST)


async def begin(
    plant: Plant, target: ComparisonOrder, wanted: RestoreRequest, wait_s: float
) -> Restore | RestorePlan:
    """Begin a restore, or tell what it would do; errors as of `plan` and `start`."""
    if wanted.dry_run:
        return await plan(plant, target)
    return await start(plant, target, wanted.flash, wanted.power_cycle, wait_s)


class _Kind(NamedTuple):
    """Long work with backups, and how its records are found and cancelled."""

    noun: str
    record: Any
    works: Callable[[Plant], Jobs[Any]] | None
    """Finds the records of the work in a plant; None where the family finds them."""
    right: Right
    cancelled: str
    told: Mapping[str, Any]


_KINDS: Final = (
    _Kind("backup", Backup, lambda plant: plant.works.backups, Right.VIEW, NO_MORE, {"over": "It is over."}),
    _Kind(
        *("restore", Restore, None, Right.SETUP, WRITE_NO_MORE),
        {"over": OVER, "result": Restore, "planned": RestorePlan, "most_bytes": MAX_BACKUP_BYTES},
    ),
    _Kind(
        *("comparison", BackupComparison, lambda plant: plant.works.comparisons, Right.SETUP, NO_MORE),
        {"over": "It is over.", "leased": False, "most_bytes": MAX_BACKUP_BYTES},
    ),
)


def list_work(rows: Rows, place: str, what: str, beginnings: Sequence[Run], find_restores: Find) -> None:
    """List backups, restores and comparisons of what stands at a place: how each is begun, found, cancelled.

    `find_restores` finds who knows the restores of what a path names, and that path in full.
    """
    for kind, begins in zip(_KINDS, beginnings, strict=True):

        def find(plant: Plant, *, of: _Kind = kind, **named: str) -> tuple[Jobs[Any], str]:
            restores, subject = find_restores(plant, **named)
            return of.works(plant) if of.works else restores, subject

        rows.add("POST", f"{place}/{kind.noun}s", kind.right, begins, **kind.told)
        found_by = "_record" if kind.noun == "backup" else ""
        list_records(
            rows,
            f"{place}/{kind.noun}s",
            kind.record,
            find,
            one=f"a {kind.noun}",
            names=(f"get_{what}_{kind.noun}{found_by}", f"cancel_{what}_{kind.noun}"),
            cancelled=kind.cancelled,
            right=kind.right,
            leased=False,
        )
