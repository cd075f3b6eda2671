"""Restores of backups: compared, written, read back; they end verified, or with all that differs told."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Generic, NamedTuple, Protocol, TypeVar

from gateway.core.backup_record import (
    Difference,
    Phase,
    Restore,
    RestoreError,
    RestorePlan,
    RestoreStatus,
    ScaleDifference,
    differing,
)
from gateway.core.errors import BodyBusy, Cancelled, GatewayEnding, GatewayError, NotFound, StoppedFirst
from gateway.core.origin import new_id
from gateway.core.works import CutOff, DurableJobs, left_s

HISTORY = 20
TOLD = 20
"""Differences that an event tells; the record has all."""
ROUNDS = 3
"""Rounds of writing and reading back: some settings change others, so that differences remain."""
PROGRESS_S = 1.0
"""Progress is told at most this often."""
BACK_WITHIN_S = 120.0
"""A controller that was lost meanwhile is asked for this time what it holds."""
ASK_AGAIN_S = 0.5
CANCELLED_WITHIN_S = 10.0


class Comparison(NamedTuple):
    """The differences between a controller and a backup."""

    commands: list[str]
    """Commands that would make it hold the backup."""
    differences: list[Difference]
    proved: bool
    """True if it is proved that the power was kept while it was read."""


class ComparisonListener(Protocol):
    """A listener to the progress of a comparison."""

    def has_read(self) -> None:
        """One more answer was read."""


class Watcher(ComparisonListener, Protocol):
    """A listener to the progress of the work at a controller, which can end it."""

    def require_wanted(self) -> None:
        """Go on only if the work is not cancelled.

        :raises Cancelled: a caller has cancelled it.
        """

    def has_written(self) -> None:
        """One more command was taken."""


class RestoredController(Protocol):
    """A controller that is brought back to what a backup has of it."""

    @property
    def address(self) -> str:
        """Unique address of the controller."""

    @property
    def scale(self) -> ScaleDifference | None:
        """Difference between its scale and that of the backup, if any."""

    @property
    def answers(self) -> int | None:
        """Answers that a comparison takes at most; None if unknown."""

    @property
    def baud(self) -> int | None:
        """The speed of its line; None where its port does not tell."""

    async def require_rest(self) -> None:
        """Make sure that nothing moves, or runs a program.

        :raises GatewayError: it does, or it could not be asked.
        """

    async def compare(
        self, reader: ComparisonListener, /, *, lasting: bool = False, sure: bool = True
    ) -> Comparison:
        """Read all that the backup has; `lasting` leaves out what is gone with the power.

        To be `sure`, what differs is read again: without a checksum one reading proves nothing.

        :raises GatewayError: it was not read.
        """

    async def write(self, watcher: Watcher) -> None:
        """Write what differed in the last comparison.

        :raises GatewayError: a command was refused, or is not known to be taken, or a stop came.
        """

    async def save(self, watcher: Watcher, /) -> None:
        """Write it to flash memory, just after it was read back.

        :raises GatewayError: it was not written, or that is unknown.
        """

    async def power_cycled(self, watcher: Watcher, /) -> None:
        """Wait until its power was off and on.

        :raises GatewayError: that could not be seen.
        """


C = TypeVar("C", bound=RestoredController)


@dataclass(eq=False)
class _Work:
    """A restore under way."""

    record: Restore
    works: DurableJobs[Restore]
    answers: int | None
    """Answers that the two readings of all controllers take at most; None if unknown."""
    baud: int | None
    unwanted: bool = False
    saved: int = 0
    """Controllers whose flash memory holds the backup."""
    told_at: float = field(default_factory=lambda: asyncio.get_running_loop().time())
    began_at: float = field(default_factory=lambda: asyncio.get_running_loop().time())

    def require_wanted(self) -> None:
        if self.unwanted:
            raise Cancelled("The restore was cancelled by request.", "Restore the backup again.")

    def has_read(self) -> None:
        self.record.read += 1
        self._progress()

    def has_written(self) -> None:
        self.record.written += 1
        self._progress()

    def begin(self, phase: Phase) -> None:
        self.record.phase = phase
        self._estimate()
        self.works.on_change(self.record)

    def has_compared(self, expected: int | None, read: int) -> None:
        """Expect no more of the second reading of a controller than the first has taken."""
        if self.answers is not None and expected is not None:
            self.answers -= 2 * (expected - read)

    def _estimate(self) -> float:
        now, record = asyncio.get_running_loop().time(), self.record
        expected = None if self.answers is None else self.answers + record.commands
        record.left_s = left_s(expected, record.read + record.written, now - self.began_at, self.baud)
        return now

    def _progress(self) -> None:
        now = self._estimate()
        if now - self.told_at >= PROGRESS_S:
            self.told_at = now
            self.works.tell("progress", self.record)


class Restores(DurableJobs[Restore], Generic[C]):
    """The restores of a family, one at a time for each controller."""

    record_type = Restore

    def __init__(self, publish: Callable[[str, Restore], None]) -> None:
        super().__init__(
            HISTORY,
            "restore",
            lambda record: record.target,
            lambda what, record: publish(what, _short(record)),
        )
        self._current: dict[str, tuple[_Work, C]] = {}
        """Work and controller, by the address of each controller."""

    async def plan(
        self, target: str, controllers: Sequence[C], reader: ComparisonListener | None = None
    ) -> RestorePlan:
        """Tell what a restore would do.

        :raises BodyBusy: a controller is being restored.
        :raises GatewayError: one was not read.
        """
        for controller in controllers:
            self.require_none(controller.address)
        commands: list[str] = []
        differences: list[Difference] = []
        for controller in controllers:
            found = await controller.compare(reader or _Nobody())
            commands += found.commands
            differences += found.differences
        return RestorePlan(
            target=target,
            commands=commands,
            differences=differences,
            differing=differing(differences),
            scales=scales_of(controllers),
        )

    async def start(
        self, target: str, controllers: Sequence[C], *, flash: bool = False, power_cycle: bool = False
    ) -> Restore:
        """Begin to bring controllers back to a backup, one after the other.

        :raises BodyBusy: one moves, runs a program, or is being restored; nothing was changed.
        :raises GatewayError: one could not be asked; nothing was changed.
        """
        for controller in controllers:
            self.require_none(controller.address)
        now = datetime.now(UTC)
        record = Restore(
            id=new_id(now),
            target=target,
            controllers=[controller.address for controller in controllers],
            scales=scales_of(controllers),
            flash=flash,
            power_cycle=power_cycle,
            started_at=now,
        )
        answers = answers_of(controllers)
        work = _Work(record, self, answers and 2 * answers, baud_of(controllers))
        self._current |= {controller.address: (work, controller) for controller in controllers}
        try:
            for controller in controllers:
                await controller.require_rest()
            task = self.begin(record, self._run(work, controllers), "restore")
            task.add_done_callback(lambda _: self._forget(work))
        except BaseException:
            self._forget(work)
            raise
        self.tell("started", record)
        return record

    def is_under_way(self, address: str) -> bool:
        """Say whether a backup is being restored to a controller."""
        return address in self._current

    def require_none(self, address: str) -> None:
        """Make sure that a controller is not being restored.

        :raises BodyBusy: it is.
        """
        if address in self._current:
            raise _being_restored(address)

    def require_free(self, address: str) -> None:
        """Make sure that others may change a controller: `amid` gives none.

        :raises BodyBusy: it is being restored.
        """
        if self.amid(address) is not None:
            raise _being_restored(address)

    def amid(self, address: str) -> C | None:
        """The controller while it is written or read back, when no other client may change it; else None."""
        work, controller = self._current.get(address, (None, None))
        return None if work is None or work.record.phase == "awaiting_power_cycle" else controller

    async def cancel(self, target: str) -> Restore:
        """Write no more, and give the record; the controllers are still read back.

        A second call ends it at once, and leaves unknown what they hold.

        :raises NotFound: none is under way.
        """
        work = next((work for work, _ in self._current.values() if work.record.target == target), None)
        if work is None or not self.goes_on(work.record):
            raise NotFound(f"No backup is being restored to {target}.")
        record = work.record
        if work.unwanted:
            self.break_off(record)
        work.unwanted = True
        await self.wait(record, CANCELLED_WITHIN_S)
        return record

    def _forget(self, work: _Work) -> None:
        self._current = {address: entry for address, entry in self._current.items() if entry[0] is not work}

    # the work

    async def _run(self, work: _Work, controllers: Sequence[C]) -> None:
        record, error = work.record, None
        differences: list[Difference] | None = []
        try:
            for controller in controllers:
                ended = await _restored(work, controller)
                error = error or ended.error
                if ended.differences is None or differences is None:
                    differences = None
                else:
                    differences += ended.differences
        except asyncio.CancelledError:
            error, differences = error or (_unwanted(work) or GatewayEnding()), None
        record.differences = differences
        record.saved = record.flash and work.saved == len(controllers)
        self._end(work, _status(work, error), error)

    def _end(self, work: _Work, status: RestoreStatus, error: GatewayError | None) -> None:
        record = work.record
        record.status, record.ended_at, record.left_s = status, datetime.now(UTC), None
        record.error = None if error is None else RestoreError.amid(error, record.written, record.commands)
        if status == "verified":
            record.phase = "done"
        self._forget(work)
        self.tell(status, record)

    def note_cut_off(self, record: Restore, why: CutOff, /) -> None:
        """Say how far it had come, as far as is known."""
        record.status, record.differences, record.ended_at = "failed", None, datetime.now(UTC)
        some = f"{record.written} of {record.commands} commands had been written, perhaps more"
        far = some if record.written else "No command is known to have been written"
        record.error = RestoreError(
            type=why.kind,
            detail=f"{why.what}. {far}; nobody knows what {', '.join(record.controllers)} holds now.",
            remedy="Restore the backup again: what differs is written, and all is read back.",
        )
        self.tell("failed", record)


def answers_of(controllers: Sequence[RestoredController]) -> int | None:
    """Answers that a comparison of all controllers takes at most; None if unknown."""
    each = [controller.answers for controller in controllers]
    return None if None in each else sum(filter(None, each))


def baud_of(controllers: Sequence[RestoredController]) -> int | None:
    """The speed of their line; None where its port does not tell."""
    return next((controller.baud for controller in controllers), None)


def scales_of(controllers: Sequence[RestoredController]) -> list[ScaleDifference]:
    """The controllers whose scale is not that of the backup."""
    return [controller.scale for controller in controllers if controller.scale is not None]


def _short(record: Restore) -> Restore:
    """A record as an event tells it."""
    return record.model_copy(update={"differences": record.differences and record.differences[:TOLD]})


class _Ended(NamedTuple):
    """The end of the restore of one controller."""

    differences: list[Difference] | None
    error: GatewayError | None


async def _restored(work: _Work, controller: RestoredController) -> _Ended:
    """Restore one controller, and in any case read its settings back then."""
    record, lasting = work.record, False
    try:
        differences = await _written(work, controller)
        if record.flash and not differences:
            work.begin("saving")
            await controller.save(work)
            work.saved += 1
        if record.power_cycle and not differences:
            work.begin("awaiting_power_cycle")
            await controller.power_cycled(work)
            work.begin("verifying")
            lasting = True
            differences = (await _compared(work, controller, lasting=True)).differences
    except GatewayError as error:
        work.begin("comparing")
        return _Ended(await _found_out(work, controller, lasting=lasting), error)
    return _Ended(differences, None)


async def _written(work: _Work, controller: RestoredController) -> list[Difference]:
    """Write what differs, and give what differs still."""
    work.begin("comparing")
    read = work.record.read
    found = await _compared(work, controller, sure=False)
    work.has_compared(controller.answers, work.record.read - read)
    for _ in range(ROUNDS):
        if not found.commands:
            break
        work.begin("writing")
        work.record.commands += len(found.commands)
        await controller.write(work)
        work.begin("reading_back")
        found = await _compared(work, controller)
    return found.differences


async def _compared(
    work: _Work, controller: RestoredController, *, lasting: bool = False, sure: bool = True
) -> Comparison:
    work.require_wanted()
    found = await controller.compare(work, lasting=lasting, sure=sure)
    work.record.power_proved &= found.proved
    return found


async def _found_out(
    work: _Work, controller: RestoredController, *, lasting: bool
) -> list[Difference] | None:
    """Read what a controller holds, as soon as it answers; None where it does not."""
    loop = asyncio.get_running_loop()
    until = loop.time() + BACK_WITHIN_S
    while loop.time() < until:
        try:
            found = await controller.compare(work, lasting=lasting)
        except GatewayEnding:
            return None
        except GatewayError:
            await asyncio.sleep(ASK_AGAIN_S)
        else:
            work.record.power_proved &= found.proved
            return found.differences
    return None


def _unwanted(work: _Work) -> GatewayError | None:
    try:
        work.require_wanted()
    except Cancelled as cancelled:
        return cancelled
    return None


def _status(work: _Work, error: GatewayError | None) -> RestoreStatus:
    record = work.record
    if work.unwanted or isinstance(error, StoppedFirst | GatewayEnding):
        return "cancelled"
    if record.differences is None:
        return "failed"
    if record.differences:
        return "differs"
    unsaved = record.flash and not record.saved
    return "failed" if error is not None and (unsaved or record.power_cycle) else "verified"


class _Nobody:
    """A listener that reports nowhere."""

    def has_read(self) -> None:
        """Say nothing."""


def _being_restored(address: str) -> BodyBusy:
    return BodyBusy(
        f"A backup is being restored to {address}; nothing was sent.", "Wait for its end or cancel it."
    )
