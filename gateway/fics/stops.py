"""Software stops of a robot: sent ahead of everything, repeated, believed only when all axes stand still."""

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from gateway.errors import GatewayError
from gateway.exchange import Lane
from gateway.fics.exchange import Answered, Outcome
from gateway.fics.line import SILENT
from gateway.records import Record
from gateway.stops import CONFIRM_WITHIN_S, GIVE_UP_AFTER_S, RECORD_WITHIN_S, REPEAT_S, UNCONFIRMED, StopMode
from protocols.fics.link import Failure, Refusal
from protocols.fics.row import FicsCommand
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately

if TYPE_CHECKING:
    from gateway.fics.robot import Robot

STOPPING_ALREADY = "E04"
"""The refusal of a second stop while the first is under way: as good as an answer (C-HOST manual 2-12)."""


class RobotStopReport(Record):
    """How far the stop of a robot has come."""

    robot_id: str
    state: Literal["requested", "sent", "acknowledged", "confirmed", "not_sent"] = Field(
        "requested", description="Only confirmed means that the robot itself reports standstill of all axes."
    )
    detail: str | None = Field(None, description="Why it is not confirmed.")


class RobotStops:
    """The stops of a robot that are under way. A second one of the same kind joins the first."""

    def __init__(self, robot: "Robot") -> None:
        self._robot = robot
        self._running: dict[StopMode, tuple[RobotStopReport, asyncio.Task[None]]] = {}

    def stop(self, mode: StopMode) -> "asyncio.Task[RobotStopReport]":
        """Stop all axes; the stop is queued before this returns, and nothing older is sent after it.

        The result comes when all stand still, or after two seconds with what is known then.
        """
        self._robot.line.begin_stop()
        self._robot.jogs.robot_stops()
        if mode not in self._running:
            self._robot.stopping = True
            report = RobotStopReport(robot_id=self._robot.id)
            self._submit(mode, report)
            task = asyncio.create_task(self._see_through(mode, report), name=f"stop {self._robot.id}")
            self._running[mode] = report, task
            task.add_done_callback(lambda _: self._over(mode))
            self._robot.publish("robot.stop.requested", report.model_dump())
        return asyncio.create_task(self._report(*self._running[mode]), name="stop report")

    async def close(self) -> None:
        """Give up repeating."""
        tasks = [task for _, task in self._running.values()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _over(self, mode: StopMode) -> None:
        self._running.pop(mode, None)
        self._robot.stopping = bool(self._running)

    @staticmethod
    async def _report(report: RobotStopReport, task: "asyncio.Task[None]") -> RobotStopReport:
        await asyncio.wait({task}, timeout=CONFIRM_WITHIN_S)
        return report

    async def _see_through(self, mode: StopMode, report: RobotStopReport) -> None:
        """Repeat the stop until every axis of every unit stands still."""
        loop = asyncio.get_running_loop()
        warning = loop.call_later(CONFIRM_WITHIN_S, self._warn, report)
        patient_until = loop.time() + CONFIRM_WITHIN_S
        try:
            async with asyncio.timeout(GIVE_UP_AFTER_S):
                while not await self._stands_still(report):
                    await self._hear_why_not(report)
                    await asyncio.sleep(REPEAT_S)
                    decelerates = mode == "decelerate" and report.state == "acknowledged"
                    if not (decelerates and loop.time() < patient_until):
                        self._submit(mode, report)
        except TimeoutError:
            return
        finally:
            warning.cancel()
        self._robot.moves_by_itself = False
        report.state, report.detail = "confirmed", None
        self._robot.publish("robot.stop.confirmed", report.model_dump())
        await self._robot.look_for_errors()
        await self._moves_recorded()

    def _warn(self, report: RobotStopReport) -> None:
        report.detail = UNCONFIRMED
        self._robot.publish("robot.stop.unconfirmed", report.model_dump())

    def _submit(self, mode: StopMode, report: RobotStopReport) -> None:
        """Send a stop, and note what becomes of it whenever that is known."""

        def written(_: float) -> None:
            if report.state in ("requested", "not_sent"):
                report.state = "sent"

        line = self._robot.line
        command: FicsCommand[Any] = StopAllImmediately() if mode == "immediate" else StopAllDecelerating()
        exchange = line.exchange(command, Lane.STOP)
        exchange.on_written = written
        try:
            future = line.submit(exchange)
        except GatewayError as error:
            if report.state == "requested":
                report.state, report.detail = "not_sent", error.detail
            return
        future.add_done_callback(lambda outcome: self._note(outcome.result(), report))

    def _note(self, outcome: Outcome, report: RobotStopReport) -> None:
        if report.state == "confirmed":
            return
        if isinstance(outcome, Answered):
            report.state = "acknowledged" if outcome.confirmed else "sent"
        elif isinstance(outcome, Refusal | Failure):
            self._refused(outcome.error, report)
        elif report.state == "requested":
            report.state, report.detail = "not_sent", outcome.detail

    def _refused(self, error: str, report: RobotStopReport) -> None:
        if error == STOPPING_ALREADY:
            report.state = "acknowledged"
            return
        detail = f"The robot refused the stop with {error}. {UNCONFIRMED}"
        if report.detail != detail:
            report.detail = detail
            self._robot.publish("robot.stop.refused", {**report.model_dump(), "error": error})

    async def _hear_why_not(self, report: RobotStopReport) -> None:
        """In Ver.2 a refused stop has to be asked for."""
        if self._robot.mode != SILENT:
            return
        try:
            error = await self._robot.take_error()
        except GatewayError:
            return
        if error.startswith("E") and error != "E00":
            self._refused(error, report)

    async def _stands_still(self, report: RobotStopReport) -> bool:
        """Whether every unit says so, twice."""
        try:
            return await self._robot.all_at_rest() and await self._robot.all_at_rest()
        except GatewayError as error:
            report.detail = report.detail or error.detail
            return False

    async def _moves_recorded(self) -> None:
        """Wait a little until the stopped moves are over in the records too: a new one may follow at once."""
        with suppress(TimeoutError):
            async with asyncio.timeout(RECORD_WITHIN_S):
                await self._robot.idle.wait()
