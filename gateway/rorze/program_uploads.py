"""Uploads of user programs: never half done silently (RC-420 manual 14.U, 15.2.6)."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Literal, Self, TypeVar

from pydantic import Field

from gateway.core.backup_record import JobStatus
from gateway.core.errors import (
    BodyBusy,
    BodyOffline,
    Cancelled,
    ControllerRefused,
    GatewayEnding,
    GatewayError,
    NoReply,
    NotFound,
    PowerCycled,
    StoppedFirst,
)
from gateway.core.exchange import Lane, Series
from gateway.core.origin import new_id
from gateway.core.records import Record, request_id_field
from gateway.core.works import GATEWAY_ENDED, CutOff, DurableJobs
from gateway.rorze.asked_body import closely
from gateway.rorze.bodies import Body
from gateway.rorze.errors import ProgramDiffers, SaveUncertain
from gateway.rorze.session import RorzeExchange
from gateway.rorze.stored_program import EndlessPrograms, instruction_at, runs
from protocols.rorze.flash import EraseFlash, LoadProgram, SaveProgram
from protocols.rorze.programs import STEPS, AddProgramInstruction, ClearProgram, GetLastProgramAddress
from protocols.rorze.user_program.assembler import Assembled
from protocols.table import Effect

T = TypeVar("T")

HISTORY = 100
BLOCK = 2
"""Instructions sent in one turn of the body's lock: then waiting reads have theirs.

At 9600 baud, with a fence before each, that takes 0.1 s.
"""
WRITTEN_DOWN = 16
"""Instructions whose intents are written down at once: a disk write for each would let the line rest."""
ATTEMPTS = 3
"""Attempts to send an instruction that is proved not to be stored; a refused one may have been garbled."""
PROGRESS_S = 1.0
"""Progress is told at most this often."""
CANCELLED_WITHIN_S = 10.0

KEPT_OUT = (ClearProgram, AddProgramInstruction, LoadProgram, SaveProgram, EraseFlash)
"""Commands that would divide an upload, besides all that move the motor or run a program."""

FLASH_AS_IT_WAS = "Flash memory is as it was."

UNSURE = (BodyOffline, NoReply, ControllerRefused, ProgramDiffers, SaveUncertain)
"""Errors after which the last instruction may be stored or not, or a late copy of one be added: a refusal may
be that of a garbled question, and a line that loses replies doubles requests, too."""

POWER_LOST = (
    "RAM holds what flash memory held, and perhaps some of the instructions. Flash memory is as it was."
)
"""Outcome of a loss of power in an upload: the program is loaded, and UWS appends (RC-420 manual 14.U)."""

Phase = Literal["clearing", "writing", "verifying", "saving", "done"]


class UploadError(Record):
    """Why an upload did not succeed, in the words of a problem detail."""

    type: str = Field(description="The kind of error; stable.")
    detail: str
    remedy: str
    line: int | None = Field(description="The first line of the source that differs, from 1.")

    @classmethod
    def of(cls, error: GatewayError) -> Self:
        """An error as it stands in an upload."""
        line = error.line if isinstance(error, ProgramDiffers) else None
        return cls(type=error.kind, detail=error.detail, remedy=error.remedy, line=line)


class ProgramUpload(Record):
    """One upload of a user program to one body."""

    id: str
    body_id: str
    status: JobStatus = "running"
    phase: Phase = Field("clearing", description="Phase of the upload now, or when it was broken off.")
    instructions: int = Field(description="Number of instructions of the program.")
    steps: int = Field(description="The room they take, of 6039 steps.")
    written: int = Field(0, description="Instructions that the controller has taken.")
    verified: int = Field(0, description="Instructions that were read back and are those of the source.")
    flash: bool = Field(description="True if the program is to be written to flash memory, too.")
    saved: bool = Field(False, description="True if it was written to flash memory.")
    stored: str = Field("", description="Contents of the body now, as far as is known.")
    error: UploadError | None = None
    request_id: str | None = request_id_field()
    started_at: datetime
    ended_at: datetime | None = None

    @property
    def target(self) -> str:
        """The path of the body."""
        return f"/bodies/{self.body_id}"


@dataclass(eq=False)
class _Work:
    """An upload under way."""

    body: Body
    program: Assembled
    record: ProgramUpload
    epoch: int
    """Stop epoch of the body at its beginning: a stop ends it."""
    series: Series | None = None
    unwanted: bool = False
    """True if a caller has asked to cancel it."""
    unsure: bool = False
    """An instruction was sent, and no reply has told yet whether it is there."""
    told_at: float = field(default_factory=lambda: asyncio.get_running_loop().time())

    def require_wanted(self) -> None:
        """Go on only where neither a stop nor a request has ended it."""
        gate = self.body.line.gate
        if gate.epoch(self.body.number) != self.epoch:
            raise gate.overtaken(self.body.number)
        if self.unwanted:
            raise Cancelled("The upload was cancelled by request.", "Upload the program again.")

    def line_of(self, address: int) -> int:
        """The line of the source that an address comes from; beyond the program, the one after the last."""
        lines = self.program.lines
        return lines[address] if address < len(lines) else (lines[-1] if lines else 0) + 1


class ProgramUploads(DurableJobs[ProgramUpload]):
    """The uploads of all bodies, one at a time for each."""

    record_type = ProgramUpload

    def __init__(self, publish: Callable[[str, ProgramUpload], None], endless: EndlessPrograms) -> None:
        super().__init__(HISTORY, "program upload", lambda upload: upload.body_id, publish)
        self._endless = endless
        self._current: dict[Body, _Work] = {}

    async def start(self, body: Body, program: Assembled, *, flash: bool = False) -> ProgramUpload:
        """Begin to replace a body's program.

        :raises InvalidText: it has a move without an end, and the configuration allows none.
        :raises BodyBusy: the motor moves, a program runs or is uploaded; nothing was changed.
        :raises GatewayError: it could not be asked, or the gateway ends; nothing was changed.
        """
        body.line.require_fit()
        self._endless.forbid(program.instructions, program.lines, "Nothing was sent")
        self.require_none(body)
        now = datetime.now(UTC)
        record = ProgramUpload(
            id=new_id(now),
            body_id=body.address,
            instructions=len(program.instructions),
            steps=program.steps,
            flash=flash,
            started_at=now,
        )
        work = _Work(body, program, record, body.line.gate.epoch(body.number))
        self._current[body] = work
        try:
            await require_rest(body)
            work.require_wanted()
            task = self.begin(record, self._run(work), "program upload")
            task.add_done_callback(lambda _: self._forget(work))
        except BaseException:
            self._forget(work)
            raise
        self.tell("started", record)
        return record

    def require_none(self, body: Body) -> None:
        """Make sure that no program is being uploaded.

        :raises BodyBusy: one is.
        """
        if self.is_under_way(body):
            raise BodyBusy(
                f"A program is being uploaded to {body.address}; nothing was sent.",
                "Wait for its end or cancel it.",
            )

    def is_under_way(self, body: Body) -> bool:
        """True if a program is being uploaded to a body."""
        return body in self._current

    def keeps_out(self, body: Body, exchange: RorzeExchange) -> bool:
        """True if an exchange would divide the upload to a body."""
        work = self._current.get(body)
        if work is None or (exchange.series is not None and exchange.series is work.series):
            return False
        return exchange.command.effect is Effect.MOTION or isinstance(exchange.command, KEPT_OUT)

    async def cancel(self, address: str) -> ProgramUpload:
        """End the upload under way before its next instruction, and give its record.

        :raises NotFound: there is none.
        """
        work = next((upload for upload in self._current.values() if upload.body.address == address), None)
        if work is None:
            raise NotFound(f"No program is being uploaded to {address}.")
        work.unwanted = True
        await self.wait(work.record, CANCELLED_WITHIN_S)
        return work.record

    # the work

    async def _run(self, work: _Work) -> None:
        record = work.record
        try:
            await self._transfer(work)
        except ProgramDiffers as error:
            self._end(work, "failed", await _why_it_differs(work.body, error))
        except GatewayError as error:
            ended = work.unwanted or isinstance(error, StoppedFirst | GatewayEnding)
            self._end(work, "cancelled" if ended else "failed", error)
        except asyncio.CancelledError:
            self._end(work, "cancelled", GatewayEnding())
        else:
            record.phase = "done"
            self._end(work, "succeeded", None)

    def _end(self, work: _Work, status: JobStatus, error: GatewayError | None) -> None:
        record = work.record
        lost = isinstance(error, PowerCycled)
        # A line that doubles frames may bring a copy of the last instruction later still.
        unsure = work.unsure or work.body.line.strict or isinstance(error, UNSURE)
        record.stored = POWER_LOST if lost else _stored(record, unsure=unsure)
        if status == "succeeded" and (fault := work.program.missing_end()) is not None:
            record.stored += f" Line {fault.line}: {fault.reason}"
        record.status, record.ended_at = status, datetime.now(UTC)
        record.error = None if error is None else UploadError.of(error)
        self._forget(work)
        self.tell(status, record)

    def _forget(self, work: _Work) -> None:
        if self._current.get(work.body) is work:
            del self._current[work.body]

    def note_cut_off(self, record: ProgramUpload, why: CutOff, /) -> None:
        """Say what the body holds, as far as is known."""
        record.status, record.ended_at = "failed", datetime.now(UTC)
        record.stored = _left_at_the_end(record) if why is GATEWAY_ENDED else _stored(record, unsure=True)
        record.error = UploadError(
            type=why.kind,
            detail=f"{why.what}: the program is not to be run.",
            remedy="Upload the program again.",
            line=None,
        )
        self.tell("failed", record)

    async def _transfer(self, work: _Work) -> None:
        record = work.record
        async with work.body.line.undivided([work.body.number]) as work.series:
            await _clear(work)
        self._enter(record, "writing")
        for part in blocks(list(enumerate(work.program.texts())), WRITTEN_DOWN):
            commands = [AddProgramInstruction(instruction=text) for _, text in part]
            with work.body.line.sending(work.body.number, commands):
                await self._write(work, part)
        self._enter(record, "verifying")
        await self._verify(work)
        if record.flash:
            self._enter(record, "saving")
            async with work.body.line.undivided([work.body.number]) as work.series:
                await _save(work)
            record.saved = True

    def _enter(self, record: ProgramUpload, phase: Phase) -> None:
        record.phase = phase
        self.on_change(record)

    async def _write(self, work: _Work, part: Sequence[tuple[int, str]]) -> None:
        for block in blocks(part, BLOCK):
            async with work.body.line.undivided([work.body.number]) as work.series:
                for address, text in block:
                    await _add(work, address, text)
                    work.record.written = address + 1
                    self._progress(work)

    async def _verify(self, work: _Work) -> None:
        """See that the body holds the program and nothing behind it.

        Its end is looked at when no copy of UCS or UWS is to come: these take all away, or add at the end.

        :raises ProgramDiffers: it does not.
        """
        length = len(work.program.instructions)
        loop = asyncio.get_running_loop()
        copies_until = loop.time() + work.body.line.late_reply_s
        async for _ in closely(_verify_at(work, address) for address in range(length)):
            work.record.verified += 1
            self._progress(work)
        await asyncio.sleep(copies_until - loop.time())
        for address in range(max(length - 1, 0), min(length + 1, STEPS)):
            await _verify_at(work, address)

    def _progress(self, work: _Work) -> None:
        now = asyncio.get_running_loop().time()
        if now - work.told_at >= PROGRESS_S:
            work.told_at = now
            self.tell("progress", work.record)


async def require_rest(body: Body) -> None:
    """Ask whether the motor stands still and no program runs: only then what it keeps may be changed.

    :raises BodyBusy: it moves, or runs one.
    :raises GatewayError: it did not tell.
    """
    if body.move is not None:
        raise BodyBusy(f"{body.address} still has the move {body.move.id}; nothing was sent.", "Wait for it.")
    if await runs(body):
        raise BodyBusy(f"A user program runs in {body.address}; nothing was changed.", "End it by a stop.")
    if (await body.poll()).runs:
        raise BodyBusy(f"{body.address} moves; nothing was changed.", "Wait for standstill.")


def blocks(items: Sequence[T], size: int) -> Iterator[Sequence[T]]:
    """Cut into parts of a size."""
    return (items[first : first + size] for first in range(0, len(items), size))


async def _clear(work: _Work) -> None:
    """Clear the program (UCS); where no reply tells, see that it is empty (UED), or clear it again."""
    for attempt in range(1, ATTEMPTS + 1):
        work.require_wanted()
        try:
            await work.body.ask(ClearProgram())
        except (NoReply, ControllerRefused) as lost:
            end, _ = await _told(work.body.ask(GetLastProgramAddress(), lane=Lane.VERIFY), lost)
            if end.address == 0:
                return
            if attempt == ATTEMPTS:
                raise
        else:
            return


async def _add(work: _Work, address: int, text: str) -> None:
    """Add an instruction (UWS); where no reply tells, see whether it is there, and else send it again.

    UWS appends: only what is proved not to be there is sent a second time.
    """
    for attempt in range(1, ATTEMPTS + 1):
        work.require_wanted()
        try:
            await work.body.ask(AddProgramInstruction(instruction=text))
        except (NoReply, ControllerRefused) as lost:
            work.unsure = True
            found = await _told(instruction_at(work.body, address, Lane.VERIFY), lost)
            if found is not None:
                await _require_same(work, address)
                work.unsure = False
                return
            if attempt == ATTEMPTS:
                raise
        else:
            work.unsure = False
            return


async def _told(question: Awaitable[T], lost: GatewayError) -> T:
    """Ask for the outcome of a command; without an answer, the error is the loss of its reply."""
    try:
        return await question
    except GatewayError:
        raise lost from None


async def _save(work: _Work) -> None:
    """Write the program to flash memory (FUS), and see that the body has kept in RAM what was read back.

    :raises SaveUncertain: it has lost its power since.
    """
    work.require_wanted()
    await work.body.ask(SaveProgram())
    if await work.body.mark.stands(Lane.VERIFY) is False:
        raise SaveUncertain(work.body.address, "its program", "Upload it again before it is run.")


async def _why_it_differs(body: Body, error: ProgramDiffers) -> GatewayError:
    """A loss of power, where the mark tells of one: then what differs tells nothing."""
    try:
        kept = await body.mark.stands(Lane.VERIFY)
    except GatewayError:
        return error
    if kept is not False:
        return error
    return PowerCycled(
        f"{body.address} has lost its power in the middle of the upload; RAM does not hold the program.",
        "See to its power, then upload again.",
    )


async def _verify_at(work: _Work, address: int) -> None:
    work.require_wanted()
    await _require_same(work, address)


async def _require_same(work: _Work, address: int) -> None:
    """Compare what stands at an address with the program; one garbled reading proves nothing.

    :raises ProgramDiffers: it is something else.
    """
    texts = work.program.texts()
    wanted = texts[address] if address < len(texts) else None
    found = await instruction_at(work.body, address)
    if found != wanted:
        found = await instruction_at(work.body, address)
    if found != wanted:
        line = work.line_of(address)
        raise ProgramDiffers(
            f"Line {line}: address {address} of {work.body.address} holds {found or 'nothing'}, not "
            f"{wanted or 'nothing'}.",
            line,
        )


def _left_at_the_end(record: ProgramUpload) -> str:
    """The content of a body whose upload the gateway has left: the record may be behind by a second."""
    if record.phase != "writing":
        return f"When the gateway ended: {_stored(record, unsure=True)}"
    some = f"{record.written} of {record.instructions} instructions"
    return f"When the gateway ended, RAM held the first {some}, and perhaps more. {FLASH_AS_IT_WAS}"


def _stored(record: ProgramUpload, *, unsure: bool) -> str:
    """The content of a body when an upload ends in its present phase."""
    flash = FLASH_AS_IT_WAS
    whole = f"RAM holds the program: {record.instructions} instructions"
    match record.phase:
        case "clearing" if unsure:
            return f"Nobody knows whether the former program was cleared in RAM. {flash}"
        case "clearing":
            return f"RAM holds the former program. {flash}"
        case "writing":
            maybe = ", and perhaps one more" if unsure else ""
            some = f"{record.written} of {record.instructions} instructions"
            return f"RAM holds the first {some}{maybe}. {flash}"
        case "verifying":
            return (
                f"All {record.instructions} instructions were sent, and {record.verified} of them were read "
                f"back as they should be. {flash}"
            )
        case "saving" if unsure:
            return f"{whole} when it was read back. Nobody knows what flash memory holds."
    return f"{whole}, read back. " + ("Flash memory holds it too." if record.saved else flash)
