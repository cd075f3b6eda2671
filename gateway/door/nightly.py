"""Backups of everything, by night: kept as files, each with what differs from the one before."""

import asyncio
import logging
from datetime import datetime, time, timedelta
from difflib import unified_diff
from pathlib import Path
from typing import Final

from pydantic import Field

from gateway.core.errors import GatewayError, NotFound
from gateway.core.operation import PlainText, Rows
from gateway.core.origin import Origin, acting
from gateway.core.records import AnswerModel
from gateway.core.supervisor import supervise
from gateway.core.whole_files import write_whole
from gateway.door.backups import AS_TEXT, ENDING, Night, ReadingOrder, folder_of_nights, text_of_night
from gateway.door.doors import doors
from gateway.door.swaps import Recognition
from gateway.plant import Plant

log = logging.getLogger(__name__)

ROWS: Final = Rows("backups")
TEXTS: Final = Rows("backups")
DIFF: Final = ".diff"
QUIET_S: Final = 60.0
"""A target is read after nothing of it has moved for this long."""
LOOK_S: Final = 5.0
TRIES_FOR_S: Final = 4 * 3600.0
"""Seconds after the hour for which a moving part is waited for, before it is left out that night."""
ORIGIN: Final = Origin("gateway: nightly backup")


class NightlyBackup(AnswerModel):
    """A backup of one line, or one robot, that was read by night and kept."""

    target: str = Field(description="The line or the robot.")
    date: str = Field(description="Night in which it was read, as YYYY-MM-DD.")
    changed: int | None = Field(
        description="Number of lines that differ from the backup before it; null where there was none."
    )


class NightlyBackups(AnswerModel):
    """The backups that are kept."""

    backups: list[NightlyBackup] = Field(description="Kept backups, the newest first.")


class Nightly:
    """Reads all lines and robots once a night, when they are quiet, and keeps the texts as files."""

    def __init__(self, plant: Plant, folder: Path) -> None:
        self._plant, self._folder = plant, folder
        if plant.config.backups.nightly_at is not None:
            plant.works.nightly_backups = folder
        self._recognition = Recognition(plant)
        self._tasks: list[asyncio.Task[None]] = []

    def start(self) -> None:
        """Wait for the nights, if the configuration names an hour."""
        if self._plant.config.backups.nightly_at is not None:
            works = {
                "the nightly backups": self._nights,
                "the recognition of swapped controllers": self._recognition.watch,
            }
            with acting(ORIGIN):
                self._tasks = [supervise(what, work) for what, work in works.items()]

    async def close(self) -> None:
        """Read no more."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _nights(self) -> None:
        while (at := self._plant.config.backups.nightly_at) is not None:
            await asyncio.sleep(seconds_until(at, datetime.now().astimezone()))
            await self.read_all()

    async def read_all(self) -> None:
        """Read everything once, target by target; one that fails has told so by its record and event."""
        targets = readings(self._plant)
        for target, reading in targets.items():
            try:
                await self._read(target, reading)
            except (GatewayError, OSError) as error:
                log.warning("the nightly backup of %s was not kept: %s", target, error)
        await asyncio.to_thread(self._forget_old)

    async def _read(self, target: str, reading: ReadingOrder) -> None:
        if not await self._is_quiet(reading):
            log.warning("the nightly backup of %s was left out: something moved all the time", target)
            return
        backup = await self._plant.works.backups.start(*reading)
        await self._plant.works.backups.wait(backup, TRIES_FOR_S)
        if backup.text is not None:
            night = datetime.now().astimezone().date().isoformat()
            await asyncio.to_thread(keep, self._folder, target, night, backup.text)

    async def _is_quiet(self, reading: ReadingOrder) -> bool:
        """Wait until nothing of it has moved for a while; give up in the morning."""
        loop = asyncio.get_running_loop()
        quiet_since, give_up_at = loop.time(), loop.time() + TRIES_FOR_S
        while loop.time() - quiet_since < QUIET_S:
            await asyncio.sleep(LOOK_S)
            if not _moving(self._plant).isdisjoint(source.address for source in reading.sources):
                quiet_since = loop.time()
            if loop.time() > give_up_at:
                return False
        return True

    def _forget_old(self) -> None:
        oldest = (datetime.now().astimezone() - timedelta(days=self._plant.config.backups.keep_days)).date()
        for file in self._folder.glob(f"*/*{ENDING}"):
            if file.stem < oldest.isoformat():
                file.unlink(missing_ok=True)
                file.with_suffix(DIFF).unlink(missing_ok=True)


def seconds_until(at: str, now: datetime) -> float:
    """Seconds until a clock in this place next shows HH:MM."""
    wanted = datetime.combine(now.date(), time.fromisoformat(at), now.tzinfo)
    return (wanted - now).total_seconds() % timedelta(days=1).total_seconds() or 1.0


def readings(plant: Plant) -> dict[str, ReadingOrder]:
    """All that is read by night, by what is backed up as one."""
    return {
        name: reading for backups in doors("backups") for name, reading in backups.readings(plant).items()
    }


def _moving(plant: Plant) -> set[str]:
    """The addresses of what moves, as far as is known; a unit of a robot moves the robot."""
    moving = (seen.subject for family in plant.packages.families.values() for seen in family.left_moving())
    return {subject.split("/")[2] for subject in moving}


def keep(folder: Path, target: str, night: str, text: str) -> None:
    """Keep a backup, and what it changes, each as a file that is whole or not there.

    :raises OSError: it was not written.
    """
    own = folder / target
    before = max((file for file in own.glob(f"*{ENDING}") if file.stem < night), default=None)
    if before is not None:
        changes = unified_diff(
            before.read_text("utf-8").splitlines(True), text.splitlines(True), before.stem, night, n=1
        )
        write_whole(own / f"{night}{DIFF}", "".join(changes))
    write_whole(own / f"{night}{ENDING}", text)


def kept(folder: Path) -> list[NightlyBackup]:
    """List the backups of a folder, the newest first."""
    files = sorted(folder.glob(f"*/*{ENDING}"), key=lambda file: (file.stem, file.parent.name), reverse=True)
    return [
        NightlyBackup(target=file.parent.name, date=file.stem, changed=_changed(file.with_suffix(DIFF)))
        for file in files
    ]


def _changed(diff: Path) -> int | None:
    """Count the lines that were added or taken out."""
    try:
        lines = diff.read_text("utf-8").splitlines()
    except FileNotFoundError:
        return None
    return sum(line[:1] in "+-" and line[:3] not in ("+++", "---") for line in lines)


def _require_target(plant: Plant, target: str) -> None:
    if target not in readings(plant):
        raise NotFound(f"There is no line of bodies and no robot {target}; nothing was sent.")


@ROWS.get("/backups/nightly")
async def list_nightly_backups(plant: Plant) -> NightlyBackups:
    """List the backups that were read by night, of every line and robot, with how much each changes."""
    return NightlyBackups(backups=await asyncio.to_thread(kept, folder_of_nights(plant)))


@TEXTS.get("/backups/nightly/{target}/{night}", whole_plant=True, **AS_TEXT)
async def get_nightly_backup(plant: Plant, target: str, night: Night) -> PlainText:
    """Give a backup that was read by night, as a restore takes it."""
    _require_target(plant, target)
    return PlainText(await text_of_night(plant, target, night))


@TEXTS.get("/backups/nightly/{target}/{night}/changes", whole_plant=True, **AS_TEXT)
async def get_nightly_changes(plant: Plant, target: str, night: Night) -> PlainText:
    """Give what a nightly backup changes of the one before it, as a unified diff."""
    _require_target(plant, target)
    return PlainText(await text_of_night(plant, target, night, DIFF))
