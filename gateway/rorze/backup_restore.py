"""A body that is brought back to what a backup has of it (RC-420 manual 18)."""

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from gateway.core.backup_record import ScaleDifference
from gateway.core.errors import BodyBusy, ControllerRefused, GatewayError, NoReply
from gateway.core.exchange import Lane, Series
from gateway.core.restores import Comparison, ComparisonListener, Watcher
from gateway.rorze import backup
from gateway.rorze.asked_body import is_mark
from gateway.rorze.backup import Contents
from gateway.rorze.backup_places import Command, place_of
from gateway.rorze.bodies import Body
from gateway.rorze.errors import SaveUncertain
from gateway.rorze.program_uploads import BLOCK, WRITTEN_DOWN, ProgramUploads, blocks, require_rest
from gateway.rorze.session import RorzeExchange
from protocols.rorze.flash import SavePositions, SaveProgram, SaveSettings
from protocols.rorze.programs import AddProgramInstruction, ClearProgram
from protocols.rorze.status import GetInformation, SetUserComment
from protocols.rorze.user_program.assembler import Assembled
from protocols.table import Effect

ATTEMPTS = 3
"""Tries in all of a command that gets no reply and is seen not to have worked."""
READINGS = 3
"""Tries in all of a reading amid which the power was lost."""
CYCLE_SEEN_S = 0.5
"""Seconds between looks whether the power was off and on."""
CYCLE_WITHIN_S = 3600.0
"""Seconds within which a person has to switch the body off and on."""

UPLOADED = (ClearProgram, AddProgramInstruction, SaveProgram)
"""Commands of an upload, whose own guard keeps out those of others."""


@dataclass(eq=False)
class BodyRestore:
    """One body, and what it is to hold."""

    body: Body
    wanted: Contents
    uploads: ProgramUploads
    scale: ScaleDifference | None = None
    """Difference between the scales of the body and the backup, if there is one."""
    held: Contents = field(default_factory=Contents)
    """Contents of the body at the last comparison."""
    epoch: int = field(init=False)
    """Stop epoch of the body at the beginning: a stop ends the restore."""
    series: Series | None = None

    def __post_init__(self) -> None:
        self.epoch = self.body.line.gate.epoch(self.body.number)

    @property
    def address(self) -> str:
        """Its unique address."""
        return self.body.address

    @property
    def baud(self) -> int | None:
        """The speed of its line; None where its port does not tell."""
        return self.body.line.baud

    @property
    def answers(self) -> int:
        """As many as the sections have places at most."""
        return backup.answers_of(self.wanted)

    def lets_pass(self, exchange: RorzeExchange) -> bool:
        """True if an exchange may go while the body is restored: stops, reads, its own, the mark."""
        command = exchange.command
        if command.effect in (Effect.STOP, Effect.READ):
            return True
        if exchange.series is not None and exchange.series is self.series:
            return True
        if isinstance(command, SetUserComment):
            return command.comment_number == self.body.power.mark.comment and is_mark(command.text)
        return isinstance(command, UPLOADED) and self.uploads.is_under_way(self.body)

    async def require_rest(self) -> None:
        """Make sure that its motor stands and no program runs or is uploaded; errors as of `require_rest`."""
        self.body.line.require_fit()
        self.uploads.require_none(self.body)
        await require_rest(self.body)
        self._require_no_stop()

    # compared

    async def compare(
        self, reader: ComparisonListener, *, lasting: bool = False, sure: bool = True
    ) -> Comparison:
        """Read what the backup has, with a mark that proves that the power was kept meanwhile.

        :raises GatewayError: it was not read, or it loses its power again and again.
        """
        wanted = self.wanted.lasting() if lasting else self.wanted
        for _ in range(READINGS):
            await self.body.mark.ensure(Lane.VERIFY)
            losses = self.body.power.losses
            held = await backup.read(self.body, wanted.sections, reader.has_read)
            self.held = held.lasting() if lasting else held
            if sure:
                await backup.confirm(self.body, wanted, self.held)
            stands = await self.body.mark.stands(Lane.VERIFY)
            if stands is not False and self.body.power.losses == losses:
                break
        else:
            raise BodyBusy(f"{self.address} loses its power again and again.", "See to its power supply.")
        return Comparison(
            list(self._frames(wanted)),
            backup.differences(self.address, wanted, self.held),
            proved=bool(stands),
        )

    def _frames(self, wanted: Contents) -> Iterator[str]:
        commands: list[Command] = backup.commands(wanted, self.held, self.body.flash.may_be_unset)
        if self._program_differs(wanted):
            instructions = map(AddProgramInstruction.read, wanted.instructions)
            commands = [ClearProgram(), *instructions, *commands]
        line = self.body.line
        return (line.frame_of(self.body.number, command).removesuffix("\\r") for command in commands)

    def _program_differs(self, wanted: Contents) -> bool:
        return wanted.program is not None and wanted.instructions != self.held.instructions

    # written

    async def write(self, watcher: Watcher) -> None:
        """Write what differs; refused commands are reported at the end by the places that differ still.

        :raises GatewayError: a caller has ended the restore, or a command is not known to be taken.
        """
        if self._program_differs(self.wanted) and isinstance(self.wanted.program, Assembled):
            await self._upload(self.wanted.program, watcher)
        commands = backup.commands(self.wanted, self.held, self.body.flash.may_be_unset)
        for part in blocks(commands, WRITTEN_DOWN):
            with self.body.line.sending(self.body.number, part):
                await self._write(part, watcher)
        # A copy of a command that a terminal server repeats must not come after what proves it.
        await asyncio.sleep(self.body.line.late_reply_s)

    async def _write(self, commands: Sequence[Command], watcher: Watcher) -> None:
        for block in blocks(commands, BLOCK):
            async with self.body.line.undivided([self.body.number]) as self.series:
                for command in block:
                    await self._send(command, watcher)

    async def _upload(self, program: Assembled, watcher: Watcher) -> None:
        upload = await self.uploads.start(self.body, program)
        while upload.status == "running":
            await self.uploads.wait(upload, CYCLE_SEEN_S)
            try:
                self._require_wanted(watcher)
            except GatewayError:
                if upload.status == "running":
                    await self.uploads.cancel(self.body.address)
                raise
        for _ in range(1 + upload.written):  # UCS, and each UWS
            watcher.has_written()

    async def _send(self, command: Command, watcher: Watcher) -> None:
        """Send a command; where no reply tells, see whether it has worked, and else send it again."""
        for attempt in range(1, ATTEMPTS + 1):
            self._require_wanted(watcher)
            try:
                await self.body.ask(command)
            except (NoReply, ControllerRefused) as lost:
                if isinstance(lost, ControllerRefused) and lost.lasting:
                    return
                if await self._has_worked(command, lost):
                    break
                if attempt == ATTEMPTS:
                    raise
            else:
                break
        watcher.has_written()

    async def _has_worked(self, command: Command, lost: GatewayError) -> bool:
        """Read what a command sets. One of which reading proves nothing is sent again: it is absolute."""
        place = place_of(command)
        if place is None or self.body.flash.may_be_unset(command):
            return False
        try:
            reply, _ = await self.body.ask(place.question, lane=Lane.VERIFY)
        except GatewayError:
            raise lost from None
        return place.setting(reply) == (None if command == place.emptied else command)

    def _require_wanted(self, watcher: Watcher) -> None:
        watcher.require_wanted()
        self._require_no_stop()

    def _require_no_stop(self) -> None:
        gate = self.body.line.gate
        if gate.epoch(self.body.number) != self.epoch:
            raise gate.overtaken(self.body.number)

    # kept without power

    async def save(self, watcher: Watcher) -> None:
        """Write to flash memory what was read back just now; with the settings, what starts a program, last.

        The mark is read before a new one can be written: if it is unchanged, the written contents are those
        that were read back.

        :raises SaveUncertain: the body has lost its power since.
        :raises GatewayError: a command was not taken, or its outcome is unknown.
        """
        mark, written = self.body.power.mark, self.body.power.mark.text
        async with self.body.line.undivided([self.body.number]) as self.series:
            for command in self._saving():
                self._require_wanted(watcher)
                await self.body.ask(command)
            if written is not None:
                told, _ = await self.body.ask(GetInformation(comment_number=mark.comment), lane=Lane.VERIFY)
                if told.text != written:
                    raise SaveUncertain(self.address, "the backup", "Restore it again.")

    def _saving(self) -> Iterator[Command]:
        sections = self.wanted.sections
        if "positions" in sections:
            yield SavePositions()
        if "program" in sections:
            yield SaveProgram()
        if any(section in sections for section in ("settings", "speed-sets", "patterns")):
            yield SaveSettings()

    async def power_cycled(self, watcher: Watcher) -> None:
        """Wait until the body has lost its power and answers again.

        :raises BodyBusy: it was not switched off and on in time, or no mark could show that.
        :raises GatewayError: a caller has ended the restore.
        """
        await self.body.mark.ensure(Lane.VERIFY)
        losses, loop = self.body.power.losses, asyncio.get_running_loop()
        until = loop.time() + CYCLE_WITHIN_S
        while self.body.power.losses == losses or not self.body.online:
            watcher.require_wanted()
            if loop.time() > until:
                detail = f"{self.address} was not switched off and on within an hour."
                raise BodyBusy(detail, "Restore the backup again.")
            await asyncio.sleep(CYCLE_SEEN_S)
