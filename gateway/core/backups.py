"""Backups that are read from controllers, and comparisons of controllers with backups."""

import asyncio
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Protocol, TypeVar

from gateway.core.backup_record import Backup, BackupComparison
from gateway.core.move_log import new_id
from gateway.core.pace import left_s
from gateway.core.readings import ProgressListener, Readings
from gateway.core.restore_record import Difference, differing
from gateway.core.restores import RestoredController, Restores, answers_of, baud_of, scales_of

C = TypeVar("C", bound=RestoredController)


class BackupSource(Protocol):
    """A controller that is read."""

    @property
    def address(self) -> str:
        """Unique address of the controller."""

    @property
    def baud(self) -> int | None:
        """The speed of its line; None where its port does not tell."""

    async def require_ready(self) -> None:
        """Make sure that it answers, and is not being changed as a whole.

        :raises GatewayError: it does not, or it is.
        """

    async def read(self, progress: ProgressListener, /) -> str:
        """Read all that it keeps, as text.

        :raises GatewayError: it was not read.
        """


class Backups(Readings[Backup]):
    """The backups of a plant, one at a time of each target."""

    noun = "backup"

    async def start(self, target: str, preamble: str, sources: Sequence[BackupSource]) -> Backup:
        """Begin to read controllers, one after the other.

        :raises BodyBusy: a backup of the same is being read.
        :raises GatewayError: one of them does not answer, or is being changed.
        """
        self.require_none(target)
        for source in sources:
            await source.require_ready()
        self.require_none(target)
        now = datetime.now(UTC)
        addresses = [source.address for source in sources]
        baud = next((source.baud for source in sources), None)
        record = Backup(id=new_id(now), target=target, controllers=addresses, baud=baud, started_at=now)
        return self.follow(record, partial(_read, record, preamble, sources))


async def _read(
    record: Backup, preamble: str, sources: Sequence[BackupSource], progress: ProgressListener
) -> None:
    text = preamble
    for source in sources:
        record.controller = source.address
        text += await source.read(progress)
    record.text = text


class Comparisons(Readings[BackupComparison]):
    """The comparisons of controllers with backups, one at a time of each target."""

    noun = "comparison"

    def start(self, target: str, restores: Restores[C], controllers: Sequence[C]) -> BackupComparison:
        """Begin to tell what a restore would do, controller by controller.

        :raises BodyBusy: a comparison of the same is under way, or a controller is being restored.
        """
        self.require_none(target)
        for controller in controllers:
            restores.require_none(controller.address)
        now = datetime.now(UTC)
        addresses = [controller.address for controller in controllers]
        record = BackupComparison(
            id=new_id(now),
            target=target,
            controllers=addresses,
            scales=scales_of(controllers),
            baud=baud_of(controllers),
            started_at=now,
        )
        return self.follow(record, partial(_compare, record, restores, controllers))


async def _compare(
    record: BackupComparison, restores: Restores[C], controllers: Sequence[C], progress: ProgressListener
) -> None:
    began_at = asyncio.get_running_loop().time()
    commands: list[str] = []
    differences: list[Difference] = []
    progress.expect(answers_of(controllers))
    for controller in controllers:
        record.controller = controller.address
        found = await restores.plan(record.target, [controller], progress)
        commands += found.commands
        differences += found.differences
    record.commands, record.differences, record.differing = commands, differences, differing(differences)
    took_s = asyncio.get_running_loop().time() - began_at
    record.restore_s = left_s(3 * record.read + len(commands), record.read, took_s, record.baud)
