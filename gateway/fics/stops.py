"""Software stops of a robot: sent ahead of everything, repeated, believed only when all axes stand still."""

import asyncio
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from gateway.errors import GatewayError
from gateway.exchange import Lane
from gateway.fics.exchange import Answered, Outcome
from gateway.fics.line import SILENT
from gateway.fics.units import RobotUnit, at_rest
from gateway.records import Record
from gateway.stops import CONFIRM_WITHIN_S, GIVE_UP_AFTER_S, RECORD_WITHIN_S, REPEAT_S, UNCONFIRMED, StopMode
from protocols.fics.errors import ErrorKind, lookup
from protocols.fics.link import Failure, Refusal
from protocols.fics.row import UPLOAD_ERROR, FicsCommand
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
    units_unknown: list[int] = Field(
        default_factory=list, description="Units of which the robot has not told whether they stand still."
    )


@dataclass(eq=False)
class _Stop:
    """A stop that is under way, and everything that keeps it from being confirmed."""

    mode: StopMode
    report: RobotStopReport
    refusal: str | None = None
    """The error the robot refused it with, last."""
    units: dict[int, str] = field(default_factory=dict)
    """Units that were not seen to stand still, and why."""
    trouble: str | None = None
    """Why it was not sent."""
    overdue: bool = False

    def seen(self, unit: int, why_not_still: str | None) -> None:
        """Note what a unit has told, and tell it."""
        if why_not_still is None:
            self.units.pop(unit, None)
        else:
            self.units[unit] = why_not_still
        self.tell()

    def tell(self) -> None:
        """Write all reasons into the report."""
        reasons = [self.trouble] if self.trouble else []
        if self.refusal is not None:
            reasons.append(f"The robot refused the stop with {self.refusal}.")
        reasons += self.units.values()
        if self.overdue or self.refusal is not None:
            reasons.append(UNCONFIRMED)
        self.report.detail = " ".join(reasons) or None
        self.report.units_unknown = sorted(self.units)


class RobotStops:
    """The stops of a robot that are under way. A second one of the same kind joins the first."""

    def __init__(self, robot: "Robot") -> None:
        self._robot = robot
        self._running: dict[StopMode, tuple[_Stop, asyncio.Task[None]]] = {}
        self._ending: set[asyncio.Task[None]] = set()
        """Stops that are confirmed, whose moves have not all been recorded."""

    def stop(self, mode: StopMode) -> "asyncio.Task[RobotStopReport]":
        """Stop all axes; a stop is queued before this returns, and nothing older is sent after it.

        The result comes when all stand still, or after two seconds with what is known then.
        """
        self._robot.line.begin_stop()
        self._robot.jogs.robot_stops()
        if mode in self._running:
            self._submit(self._running[mode][0])
        else:
            self._begin(mode)
        stop, task = self._running[mode]
        return asyncio.create_task(self._report(stop.report, task), name="stop report")

    async def close(self) -> None:
        """Give up repeating."""
        tasks = [*(task for _, task in self._running.values()), *self._ending]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _begin(self, mode: StopMode) -> None:
        self._robot.stopping = True
        stop = _Stop(mode, RobotStopReport(robot_id=self._robot.id))
        for unit in self._robot.units:
            stop.seen(unit.number, f"Unit {unit.number} has not been asked yet.")
        self._submit(stop)
        task = asyncio.create_task(self._see_through(stop), name=f"stop {self._robot.id}")
        self._running[mode] = stop, task
        task.add_done_callback(self._over)
        self._robot.publish("robot.stop.requested", stop.report.model_dump())

    def _over(self, ended: "asyncio.Task[None]") -> None:
        self._ending.discard(ended)
        self._running = {mode: it for mode, it in self._running.items() if it[1] is not ended}
        self._robot.stopping = bool(self._running or self._ending)

    @staticmethod
    async def _report(report: RobotStopReport, task: "asyncio.Task[None]") -> RobotStopReport:
        await asyncio.wait({task}, timeout=CONFIRM_WITHIN_S)
        return report

    async def _see_through(self, stop: _Stop) -> None:
        """Repeat the stop until every axis of every unit stands still."""
        loop = asyncio.get_running_loop()
        warning = loop.call_later(CONFIRM_WITHIN_S, self._warn, stop)
        patient_until = loop.time() + CONFIRM_WITHIN_S
        try:
            async with asyncio.timeout(GIVE_UP_AFTER_S):
                while not await self._stands_still(stop):
                    await asyncio.sleep(REPEAT_S)
                    decelerates = stop.mode == "decelerate" and stop.report.state == "acknowledged"
                    if not (decelerates and loop.time() < patient_until):
                        self._submit(stop)
        except TimeoutError:
            self._robot.publish("robot.stop.given_up", stop.report.model_dump())
            return
        finally:
            warning.cancel()
        await self._confirmed(stop)

    async def _confirmed(self, stop: _Stop) -> None:
        """From now on another stop is one of its own; no move may begin before this one is recorded."""
        _, task = self._running.pop(stop.mode)
        self._ending.add(task)
        self._robot.moves_by_itself = False
        stop.report.state, stop.report.detail, stop.report.units_unknown = "confirmed", None, []
        self._robot.publish("robot.stop.confirmed", stop.report.model_dump())
        await self._robot.look_for_errors()
        with suppress(TimeoutError):
            async with asyncio.timeout(RECORD_WITHIN_S):
                await self._robot.idle.wait()

    def _warn(self, stop: _Stop) -> None:
        stop.overdue = True
        stop.tell()
        self._robot.publish("robot.stop.unconfirmed", stop.report.model_dump())

    # sending

    def _submit(self, stop: _Stop) -> None:
        """Send a stop, and note what becomes of it whenever that is known."""
        report = stop.report

        def written(_: float) -> None:
            stop.trouble = None
            if report.state in ("requested", "not_sent"):
                report.state = "sent"

        line = self._robot.line
        command: FicsCommand[Any] = (
            StopAllImmediately() if stop.mode == "immediate" else StopAllDecelerating()
        )
        exchange = line.exchange(command, Lane.STOP)
        exchange.on_written = written
        try:
            future = line.submit(exchange)
        except GatewayError as error:
            self._not_sent(stop, error)
            return
        future.add_done_callback(lambda outcome: self._note(stop, outcome.result()))

    @staticmethod
    def _not_sent(stop: _Stop, error: GatewayError) -> None:
        if stop.report.state == "requested":
            stop.report.state, stop.trouble = "not_sent", error.detail
            stop.tell()

    def _note(self, stop: _Stop, outcome: Outcome) -> None:
        if stop.report.state == "confirmed":
            return
        if isinstance(outcome, Answered):
            stop.report.state = "acknowledged" if outcome.confirmed else "sent"
            stop.refusal = None if outcome.confirmed else stop.refusal
        elif isinstance(outcome, Refusal | Failure):
            self._refused(stop, outcome.error)
        else:
            self._not_sent(stop, outcome)

    def _refused(self, stop: _Stop, error: str) -> None:
        if error == STOPPING_ALREADY:
            stop.report.state = "acknowledged"
            return
        if error == UPLOAD_ERROR:
            self._robot.line.doubt_upload()
        if stop.refusal != error:
            stop.refusal = error
            stop.tell()
            self._robot.publish("robot.stop.refused", {**stop.report.model_dump(), "error": error})

    async def _hear_refusal(self, stop: _Stop) -> None:
        """In Ver.2 a refusal has to be asked for, before anything else is said that could be refused."""
        if self._robot.mode != SILENT:
            return
        try:
            error = await self._robot.errors_of_system.take(Lane.STOP)
        except GatewayError:
            return
        if lookup(error).kind is ErrorKind.COMMUNICATION:
            self._refused(stop, error)
        else:
            stop.refusal = None

    # seeing

    async def _stands_still(self, stop: _Stop) -> bool:
        """Whether every unit says so, twice; if not, the report says which did not, and why."""
        await self._hear_refusal(stop)
        for _ in range(2):
            for unit in self._robot.units:
                stop.seen(unit.number, await self._why_not_still(unit))
            if stop.units:
                return False
        return True

    async def _why_not_still(self, unit: RobotUnit) -> str | None:
        """Why a unit cannot be called standing still; None if it says itself that it does."""
        try:
            axes = (await unit.status(Lane.STOP)).values()
        except GatewayError as error:
            before = " It stood still when it was last asked." if unit.stood_still else ""
            return f"Nobody knows whether unit {unit.number} stands still: {error.detail}{before}"
        return None if at_rest(axes) else f"Unit {unit.number} has not come to rest."
