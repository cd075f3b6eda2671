"""Runs of user programs: followed to their ends by what the controller says (RC-420 manual 14.U)."""

import asyncio
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime
from functools import partial
from typing import Any, Literal

from pydantic import Field

from gateway.core.errors import BodyBusy, ControllerRefused, GatewayError, NoReply, NotFound
from gateway.core.origin import RESTART, acting, new_id
from gateway.core.records import Record, request_id_field
from gateway.core.supervisor import supervise
from gateway.core.works import CutOff, DurableJobs
from gateway.rorze.bodies import Body
from gateway.rorze.body_states import BodyNews
from gateway.rorze.power import PowerSeen
from gateway.rorze.stored_program import RUNS, EndlessPrograms, addresses, as_written, instruction_at, runs
from protocols.rorze.programs import (
    AddressReply,
    GetProgramAddress,
    GetProgramStatus,
    ProgramStatus,
    RunProgram,
    StepProgram,
)

HISTORY = 100
POLL_S = 0.5
"""A program that runs is asked for its status this often."""

POWER_ON_ADDRESS = 0
"""An assumption: where a controller says that its program is (UND) when it has been switched on."""

RUNS_ALREADY = "0x5A"
"""Refusal of a start while a program runs (RC-420 manual 21)."""

END_CAUSES = {
    0x02: "stopped",
    0x04: "command_error",
    0x08: "nothing_there",
    0x10: "error_end",
    0x20: "move_while_moving",
    0x80: "single_step",
}
"""Bits of URD; none is a normal end."""


class ProgramRun(Record):
    """One run of a body's user program."""

    id: str
    body_id: str
    status: Literal["running", "ended", "unknown"] = "running"
    label: str | None = Field(description="Label at which the program began, if at one.")
    address: int | None = Field(description="Address at which the program began, if at one.")
    single_step: bool = Field(description="True if only one instruction is executed.")
    end_cause: str | None = Field(
        None,
        description="normal, stopped (by UES), command_error, nothing_there (a branch to an empty address), "
        "error_end (by EED), move_while_moving or single_step, or several joined by +.",
    )
    ended_at_address: int | None = None
    detail: str | None = Field(None, description="Reason for which its end is unknown.")
    request_id: str | None = request_id_field()
    started_at: datetime
    ended_at: datetime | None = None

    @property
    def target(self) -> str:
        """The path of the body."""
        return f"/bodies/{self.body_id}"


class ProgramState(Record):
    """A body's answer about its user program, and the last run that the gateway has started."""

    body_id: str
    running: bool
    end_cause: str | None = Field(
        description="End cause of the last program; null while one runs, and if the end of `run` is unknown."
    )
    address: int = Field(description="The address it is at, or has ended at (UND).")
    line: int = Field(description="The line of that address in the program's text, from 1.")
    instruction: str | None = Field(description="Instruction at that address; null where there is none.")
    elapsed_s: float | None = Field(
        description=(
            "Duration of `run` in seconds, so far or in all; null without one, or where another program runs."
        )
    )
    run: ProgramRun | None = Field(
        description="Last run that the gateway has started; null where it has started none."
    )


def cause_of(status: int) -> str | None:
    """Say why a program has ended, by its status (URD); None while it runs."""
    if status & RUNS:
        return None
    return "+".join(name for bit, name in END_CAUSES.items() if status & bit) or "normal"


class ProgramRuns(DurableJobs[ProgramRun]):
    """The runs of all bodies."""

    record_type = ProgramRun

    def __init__(
        self,
        publish: Callable[[str, ProgramRun], None],
        find_body: Callable[[str], Body],
        endless: EndlessPrograms,
    ) -> None:
        super().__init__(HISTORY, "program run", lambda run: run.body_id, publish)
        self._find_body = find_body
        self._endless = endless
        self._before: dict[str, PowerSeen] = {}
        """The state of each body's power before its run that is not over, by address."""

    async def start(self, body: Body, command: RunProgram | StepProgram) -> ProgramRun:
        """Run a program, or one instruction of it.

        :raises BodyBusy: a move of the gateway is not over, or a program runs.
        :raises PowerCycled: the body has lost its power, and the program would go to other places.
        :raises Cancelled: a stop came first; it was not sent.
        :raises InvalidText: the program has a move without an end, and the configuration allows none.
        :raises ControllerRefused: nothing stands at that place.
        :raises GatewayError: it was not started, or may or may not have been.
        """
        body.line.require_fit()
        if body.move is not None:
            raise BodyBusy(
                f"{body.address} still has the move {body.move.id}; no program was started.", "Wait for it."
            )
        body.require_power(command)
        last, epoch = self.find(body.address), body.line.gate.epoch(body.number)
        if last is not None and last.status == "running" and await self._look(body, last):
            raise BodyBusy(
                f"The program run {last.id} of {body.address} is not over; {command.code} was not sent.",
                "Wait for it or stop it.",
            )
        await self._order(body, command, epoch)
        now = datetime.now(UTC)
        run = ProgramRun(
            id=new_id(now),
            body_id=body.address,
            label=command.label,
            address=command.address,
            single_step=isinstance(command, StepProgram),
            started_at=now,
        )
        self._see_through(body, run, self._follow)
        self.tell("started", run)
        return run

    async def _order(self, body: Body, command: RunProgram | StepProgram, epoch: int) -> None:
        """Send the command where no program runs; one that runs then has been started, whatever was answered.

        A line may double the command: then the second copy is refused, and its reply may be all that arrives.
        """
        if await runs(body):
            raise BodyBusy(
                f"{body.address} runs a program already; {command.code} was not sent.",
                "Wait for its end or stop it.",
            )
        await self._endless.learn(body)
        await body.prove_power()
        body.require_power(command)
        if body.line.gate.epoch(body.number) != epoch:
            raise body.line.gate.overtaken(body.number)
        body.life.hear(BodyNews.PROGRAM)
        self._before[body.address] = body.power.seen
        try:
            await self._sent(body, command)
        except BaseException:
            body.life.hear(BodyNews.PROGRAM_OVER)
            raise

    @staticmethod
    async def _sent(body: Body, command: RunProgram | StepProgram) -> None:
        try:
            await body.ask(command)
        except (NoReply, ControllerRefused) as error:
            doubtful = isinstance(error, NoReply) or error.error_code == RUNS_ALREADY
            if not doubtful or not await runs(body):
                raise

    async def state(self, body: Body) -> ProgramState:
        """Ask a body where its program is (URD, UND, UED, UPD); errors as of `Body.ask`."""
        run = self.find(body.address)
        status, _ = await body.ask(GetProgramStatus())
        at, _ = await body.ask(GetProgramAddress())
        running = bool(status.status & RUNS)
        if run is not None and not running:
            await self._judge(body, run, status, at)
        is_another = running and run is not None and run.status != "running"
        is_there = running or at.address in await addresses(body)
        there = await instruction_at(body, at.address) if is_there else None
        return ProgramState(
            body_id=body.address,
            running=running,
            end_cause=None if run is not None and run.status == "unknown" else cause_of(status.status),
            address=at.address,
            line=at.address + 1,
            instruction=None if there is None else as_written(there),
            elapsed_s=None if run is None or is_another else _elapsed_s(run),
            run=run,
        )

    def _see_through(
        self, body: Body, run: ProgramRun, follow: Callable[[Body, ProgramRun], Coroutine[Any, Any, None]]
    ) -> None:
        """Follow a run to its end, after a fault of the gateway itself, too: that is merely asking."""

        async def following() -> None:
            await supervise(f"the watch over the program of {body.address}", partial(follow, body, run))

        self.begin(run, following(), "program run")

    async def _follow(self, body: Body, run: ProgramRun) -> None:
        """Ask until the program has ended; one that cannot be asked is asked on."""
        while run.status == "running":
            await asyncio.sleep(POLL_S)
            try:
                await self._look(body, run)
            except GatewayError as error:
                run.detail = error.detail

    async def _look(self, body: Body, run: ProgramRun) -> bool:
        """Ask whether a run goes on, and note its end."""
        status, _ = await body.ask(GetProgramStatus())
        if status.status & RUNS and self._why_lost(body) is None:
            run.detail = None
            return True
        at, _ = await body.ask(GetProgramAddress())
        await self._judge(body, run, status, at)
        return False

    async def _judge(self, body: Body, run: ProgramRun, status: ProgramStatus, at: AddressReply) -> None:
        """Find out how a run has ended. A controller that was switched on tells of a normal end, too.

        :raises GatewayError: the body did not tell; the run is not over yet.
        """
        if run.status != "running":
            return
        await body.prove_power()
        cause = cause_of(status.status)
        why = await self._why_unknown(body, at) if cause in (None, "normal") else self._why_lost(body)
        self._end(body, run, why, cause, at)

    def _why_lost(self, body: Body) -> str | None:
        """Say that a loss of power hides how a run has ended, where one is known."""
        if body.power.kept_since(self._before[body.address]) is not False:
            return None
        return f"{body.address} {'has' if body.power.certain else 'seems to have'} lost its power."

    async def _why_unknown(self, body: Body, at: AddressReply) -> str | None:
        """Say why what is called a normal end may be none; None where nothing speaks against it."""
        lost = self._why_lost(body)
        if lost is not None:
            return lost
        if at.address == POWER_ON_ADDRESS and not await _ends_at(body, at.address):
            return (
                f"{body.address} tells of a normal end at address {at.address}, where no END stands: it "
                "seems to have lost its power."
            )
        if body.life.was_silent and body.power.kept_since(self._before[body.address]) is None:
            return (
                f"{body.address} was out of reach and may have lost its power: no mark proves that it has "
                "kept it, and it tells of a normal end after a loss of power, too."
            )
        return None

    def _end(
        self, body: Body, run: ProgramRun, why_unknown: str | None, cause: str | None, at: AddressReply
    ) -> None:
        """Note how a run has ended, once."""
        if run.status != "running":
            return
        run.ended_at, run.detail = datetime.now(UTC), why_unknown
        body.life.hear(BodyNews.PROGRAM_OVER)
        if why_unknown is not None:
            run.status = "unknown"
        else:
            run.status, run.end_cause, run.ended_at_address = "ended", cause, at.address
        self.tell("ended", run)

    def note_cut_off(self, run: ProgramRun, why: CutOff, /) -> None:
        """Follow a run that goes on without the gateway; if its body has gone, its end is unknown."""
        try:
            body = self._find_body(run.body_id)
        except NotFound:
            run.status, run.detail, run.ended_at = "unknown", f"{why.what}.", datetime.now(UTC)
            self.tell("ended", run)
            return
        body.life.hear(BodyNews.CUT_OFF)
        self._before[body.address] = body.power.seen
        with acting(RESTART):
            self._see_through(body, run, self._take_over)

    async def _take_over(self, body: Body, run: ProgramRun) -> None:
        """Follow a run of an earlier life, once it is known whether the body has kept its power."""
        proved = False
        while not proved:
            await asyncio.sleep(POLL_S)
            try:
                await body.prove_power()
            except GatewayError as error:
                run.detail = error.detail
            else:
                proved = True
        await self._follow(body, run)


def _elapsed_s(run: ProgramRun) -> float:
    return round(((run.ended_at or datetime.now(UTC)) - run.started_at).total_seconds(), 3)


async def _ends_at(body: Body, address: int) -> bool:
    """Ask whether a program can end normally at an address: something stands there, and it is END."""
    if address not in await addresses(body):
        return False
    there = await instruction_at(body, address)
    return there is not None and as_written(there) == "END"
