"""Software stops: sent ahead of everything, repeated, believed only when the controller stands still."""

import asyncio
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Literal

from pydantic import Field

from gateway.bodies import Body, Group
from gateway.errors import ControllerRefused, GatewayError, StoppedFirst
from gateway.events import EventHub
from gateway.exchange import Answered, Lane, Outcome
from gateway.records import Record
from protocols.rorze.interpolation import StartInterpolation
from protocols.rorze.position import GetPosition
from protocols.rorze.programs import EndProgram, GetProgramStatus
from protocols.rorze.status import GetControllerStatus
from protocols.rorze.stops import StopDecelerating, StopImmediately

StopMode = Literal["decelerate", "immediate"]

REPEAT_S = 0.1
"""A stop is repeated this often until standstill is proved."""
CONFIRM_WITHIN_S = 2.0
"""After this time without standstill an event calls for the hardware stop; the stop is still repeated."""
GIVE_UP_AFTER_S = 60.0
RECORD_WITHIN_S = 1.0
UNCONFIRMED = "Standstill is not confirmed: use the hardware stop."
PROGRAM_RUNS = 1
"""Bit 0 of a program's status (URD)."""


class StopReport(Record):
    """How far the stop of one body has come."""

    body_id: str
    state: Literal["requested", "sent", "acknowledged", "confirmed", "not_sent"] = Field(
        "requested", description="Only confirmed means that the controller itself reports standstill."
    )
    position: int | None = Field(None, description="In pulses, at standstill.")
    detail: str | None = Field(None, description="Why it is not confirmed.")


class Stops:
    """The stops under way. A second stop of the same kind joins the first."""

    def __init__(self, events: EventHub, groups_of: Callable[[Body], list[Group]]) -> None:
        self._events = events
        self._groups_of = groups_of
        self._running: dict[tuple[Body, StopMode], asyncio.Task[None]] = {}
        self._reports: dict[tuple[Body, StopMode], StopReport] = {}

    def stop(self, bodies: Iterable[Body], mode: StopMode) -> "asyncio.Task[list[StopReport]]":
        """Stop bodies; every stop frame is queued before this returns, first those that reach whole groups.

        The result comes when all stand still, or after two seconds with what is known then.
        """
        wanted = self._with_interpolation_partners(bodies)
        for body in wanted:
            self._forbid_what_waits(body)
        for group in self._groups_within(wanted):
            _submit_quietly(group, mode)
        keys = [self._begin(body, mode) for body in wanted]
        return asyncio.create_task(self._report(keys), name="stop report")

    def under_way(self, body: Body) -> bool:
        """Whether a stop of the body is not confirmed yet."""
        return any(stopping is body for stopping, _ in self._running)

    async def close(self) -> None:
        """Give up repeating."""
        tasks = list(self._running.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _with_interpolation_partners(self, bodies: Iterable[Body]) -> list[Body]:
        """An axis of an interpolated move takes the others of its group with it."""
        wanted = dict.fromkeys(bodies)
        for body in list(wanted):
            if body.move is not None and body.move.command == StartInterpolation.code:
                for group in self._groups_of(body):
                    if group.address == body.move.group_id:
                        wanted |= dict.fromkeys(group.members)
        return list(wanted)

    def _groups_within(self, bodies: list[Body]) -> list[Group]:
        groups = dict.fromkeys(group for body in bodies for group in self._groups_of(body))
        return [group for group in groups if set(group.members) <= set(bodies)]

    def _forbid_what_waits(self, body: Body) -> None:
        """Nothing admitted before the stop, for the body or a group it is in, can be written after it."""
        numbers = {body.number, *(group.number for group in self._groups_of(body))}
        for number in numbers:
            body.line.gate.stop(number)
        body.line.cancel(
            lambda it: it.body in numbers and it.lane is Lane.COMMAND and not it.command.may_repeat(),
            StoppedFirst(),
        )

    def _begin(self, body: Body, mode: StopMode) -> tuple[Body, StopMode]:
        key = (body, mode)
        if key not in self._running:
            self._reports[key] = report = StopReport(body_id=body.address)
            first = _submit(body, mode, report)
            task = asyncio.create_task(
                self._see_through(body, mode, report, first), name=f"stop {body.address}"
            )
            self._running[key] = task
            task.add_done_callback(lambda _: self._running.pop(key, None))
            self._publish("body.stop.requested", body, report)
        return key

    async def _report(self, keys: list[tuple[Body, StopMode]]) -> list[StopReport]:
        reports = [self._reports[key] for key in keys]
        tasks = [self._running[key] for key in keys if key in self._running]
        if tasks:
            await asyncio.wait(tasks, timeout=CONFIRM_WITHIN_S)
        return reports

    async def _see_through(
        self, body: Body, mode: StopMode, report: StopReport, first: "asyncio.Future[Outcome] | None"
    ) -> None:
        """Repeat the stop until the controller stands still and runs no program that could move it again."""
        loop = asyncio.get_running_loop()
        warning = loop.call_later(CONFIRM_WITHIN_S, self._warn, body, report)
        patient_until = loop.time() + CONFIRM_WITHIN_S
        attempt = first
        try:
            async with asyncio.timeout(GIVE_UP_AFTER_S):
                while True:
                    if attempt is not None:
                        await self._note(attempt, report)
                        await self._end_program(body, mode)
                    if await self._stands_still(body, report):
                        break
                    await asyncio.sleep(REPEAT_S)
                    decelerates = mode == "decelerate" and report.state == "acknowledged"
                    wait = decelerates and loop.time() < patient_until
                    attempt = None if wait else _submit(body, mode, report)
        except TimeoutError:
            return
        finally:
            warning.cancel()
        body.moving = False
        report.state, report.detail = "confirmed", None
        self._publish("body.stop.confirmed", body, report)
        await _move_recorded(body)

    def _warn(self, body: Body, report: StopReport) -> None:
        report.detail = UNCONFIRMED
        self._publish("body.stop.unconfirmed", body, report)

    @staticmethod
    async def _note(attempt: "asyncio.Future[Outcome]", report: StopReport) -> None:
        outcome = await attempt
        if isinstance(outcome, Answered):
            report.state = "acknowledged"
        elif isinstance(outcome, GatewayError):
            report.detail = outcome.detail

    @staticmethod
    async def _end_program(body: Body, mode: StopMode) -> None:
        """A user program could start the next move: end it too (RC-420 manual 14, UES)."""
        try:
            await body.ask(
                EndProgram(motor="stop_immediately" if mode == "immediate" else "stop_decelerating")
            )
        except GatewayError:
            return

    @staticmethod
    async def _stands_still(body: Body, report: StopReport) -> bool:
        """Whether the status says so twice, and no program runs that could move the motor again."""
        try:
            if await _runs_pulses(body) or await _runs_program(body):
                return False
            position, _ = await body.ask(GetPosition(), lane=Lane.COMMAND)
            if await _runs_pulses(body):
                return False
        except GatewayError as error:
            if report.detail != UNCONFIRMED:
                report.detail = error.detail
            return False
        report.position = position.pulses
        return True

    def _publish(self, kind: str, body: Body, report: StopReport) -> None:
        self._events.publish(kind, f"/bodies/{body.address}", report.model_dump())


async def _move_recorded(body: Body) -> None:
    """Wait a little until the stopped move is over in the records too: a new one may then follow at once."""
    if body.move is not None:
        with suppress(TimeoutError):
            async with asyncio.timeout(RECORD_WITHIN_S):
                await body.free.wait()


async def _runs_pulses(body: Body) -> bool:
    status, _ = await body.ask(GetControllerStatus(bit=0), lane=Lane.COMMAND)
    return bool(status.on)


async def _runs_program(body: Body) -> bool:
    try:
        program, _ = await body.ask(GetProgramStatus(), lane=Lane.COMMAND)
    except ControllerRefused:  # it has no programs
        return False
    return bool(program.status & PROGRAM_RUNS)


def _submit(body: Body, mode: StopMode, report: StopReport) -> "asyncio.Future[Outcome] | None":
    def written(_: float) -> None:
        if report.state in ("requested", "not_sent"):
            report.state = "sent"

    command = StopImmediately() if mode == "immediate" else StopDecelerating()
    try:
        return body.line.submit(body.number, command, Lane.STOP, on_written=written)
    except GatewayError as error:
        if report.state == "requested":
            report.state, report.detail = "not_sent", error.detail
        return None


def _submit_quietly(group: Group, mode: StopMode) -> None:
    """One frame for all members; the single frames behind it do not depend on it."""
    command = StopImmediately() if mode == "immediate" else StopDecelerating()
    try:
        group.line.submit(group.number, command, Lane.STOP)
    except GatewayError:
        return
