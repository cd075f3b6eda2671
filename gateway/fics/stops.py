"""Software stops of a robot: sent ahead of everything, repeated, believed only when all axes stand still."""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Protocol

from pydantic import Field

from gateway.core.errors import GatewayError
from gateway.core.exchange import Lane
from gateway.core.records import request_id_field
from gateway.core.stops import (
    RECORD_WITHIN_S,
    REPEAT_S,
    BilingualReport,
    StopMode,
    StopNews,
    Stopping,
    StopsOfOne,
    StopState,
    standstill_unknown,
)
from gateway.core.times import happens
from gateway.fics.axes import Places, Tell, at_rest
from gateway.fics.conversation import Conversation
from gateway.fics.errors import UnitMissing
from gateway.fics.exchange import Outcome, RobotAnswered
from gateway.fics.line import FicsLine
from gateway.fics.units import RobotUnit
from gateway.texts import Text, text
from protocols.fics.link import FicsRefusal, SystemFailure
from protocols.fics.row import BLOCK_ERRORS, UPLOAD_ERROR, Block, FicsCommand
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import HostMode

STOPPING_ALREADY = "E04"
"""The refusal of a stop while another is under way (C-HOST manual 2-12)."""
REFUSALS = (BLOCK_ERRORS[Block.TERMINAL_EDITS], UPLOAD_ERROR, STOPPING_ALREADY)
"""The refusals of a stop; any other error is that of something else (C-HOST manual 1-7, 2-12)."""
TOLD_TIMEOUTS = 2
"""Reply timeouts after which a robot that has not told tells no more that it moves."""
BRAKES_FOR_S = 0.05
"""Seconds between two looks at motors that may brake: in less, a slow one would not change its display."""


class RobotStopReport(BilingualReport):
    """The state of the stop of a robot, and its evidence."""

    robot_id: str
    state: StopState = Field(
        "requested", description="Only confirmed means that the robot itself reports standstill of all axes."
    )
    detail: str | None = Field(None, description="Why it is not confirmed.")
    request_id: str | None = request_id_field("the request that asked for it first")
    units_unknown: list[int] = Field(
        default_factory=list, description="Units of which the robot has not told whether they stand still."
    )


class EndsWithStops(Protocol):
    """Motion that ends with a stop of the whole robot: its jogs."""

    def robot_stops(self) -> None:
        """The robot is being stopped."""

    def robot_stands_still(self) -> None:
        """Its stop is confirmed."""


class RobotStops(StopsOfOne["_RobotStop"]):
    """The stops of a robot that are under way. A second one of the same kind joins the first."""

    def __init__(
        self, units: Sequence[RobotUnit], conversation: Conversation, jogs: EndsWithStops, tell: Tell
    ) -> None:
        super().__init__(conversation.robot_id, partial(_RobotStop, units, conversation, tell))
        self._conversation, self._line = conversation, conversation.line
        self._motion, self._jogs = conversation.known.motion, jogs
        self.was_proved = False
        """True if the last stop was being proved already when it was called late."""
        conversation.on_told = self._hear_error

    @property
    def unconfirmed(self) -> RobotStopReport | None:
        """The report of a stop that is not confirmed yet; None without one."""
        report: RobotStopReport | None = self.unconfirmed_among(self._tasks)
        return report

    def _before(self) -> Sequence[Callable[[], object]]:
        return self._line.begin_stop, self._jogs.robot_stops

    def _count(self, _: "_RobotStop") -> None:
        self._motion.stops = len(self._tasks)

    def _hear_error(self, error: str, asked_after: int) -> None:
        """In Ver.2 a refusal is told only to who asks for the error next: each stop hears of its own."""
        if self._line.mode != HostMode.VER_2:
            return
        judged = [stop for stop in self._tasks if stop.is_judged_by(asked_after)]
        one_brakes = any(stop.mode == "decelerate" for stop in judged)
        for stop in judged:
            stop.hear_error(error, one_brakes=one_brakes)

    def _at_standstill(self, stop: "_RobotStop") -> Sequence[Callable[[], object]]:
        self.was_proved = stop.disproves_its_alarm
        return self._motion.confirm_stop, self._jogs.robot_stands_still

    async def _record(self, _: "_RobotStop") -> None:
        await self._conversation.poll_error()
        await happens(self._motion.idle, RECORD_WITHIN_S)


class _RobotStop(Stopping):
    """The stop of all axes, and everything that keeps it from being confirmed."""

    report: RobotStopReport
    _line: FicsLine

    def __init__(
        self,
        units: Sequence[RobotUnit],
        conversation: Conversation,
        tell: Tell,
        mode: StopMode,
    ) -> None:
        line, ramps = conversation.line, conversation.known.motion.ramps
        report = RobotStopReport(robot_id=units[0].robot_id)
        super().__init__(mode, report, line, lambda news, data: tell(f"robot.{news}", data))
        if mode == "decelerate" and ramps.longest_s is not None:
            self.note_ramp(ramps.longest_s)
        self._run: set[int] = set()
        """Units that have told when they were last asked that they move."""
        self._told_at = 0.0
        """Age of the stop, in seconds, when a unit last told that it moves."""
        self._units, self._conversation = units, conversation
        self._refusal: str | None = None
        """The error the robot refused it with, last."""
        self._said_at = self._judged_at = 0
        """`FicsLine.unheard` at the last writing, and at the writing of which the robot has told."""
        self._not_still = {unit.number: text("stops.unit-not-asked", unit=unit.number) for unit in units}
        """Units that were not seen to stand still, and why."""
        self._places: dict[int, Places] = {}
        """Places of the motors of a unit when they were last asked."""
        self.tell()

    # sending

    def _send_stop(self) -> "asyncio.Future[Outcome]":
        line = self._line
        command: FicsCommand[Any] = (
            StopAllImmediately() if self.mode == "immediate" else StopAllDecelerating()
        )
        exchange = line.exchange(command, Lane.STOP)
        exchange.on_written = self._note_written
        return line.submit(exchange)

    def _note_written(self, now: float) -> None:
        self._said_at = self._line.unheard
        self.note_written(now)

    def _note(self, outcome: Outcome) -> None:
        if self.report.state == "confirmed":
            return
        if isinstance(outcome, RobotAnswered):
            if outcome.confirmed:
                self._acknowledged()
        elif isinstance(outcome, FicsRefusal | SystemFailure):
            self._refused(outcome.error)
        else:
            self.note_not_sent(outcome)

    def _acknowledged(self) -> None:
        self.note_acknowledged()
        self._refusal = None

    def _refused(self, error: str) -> None:
        stops = self.mode == "decelerate" or self.report.state == "acknowledged"
        if error == STOPPING_ALREADY and stops:  # the robot does what it is told, since an earlier one
            self._acknowledged()
            return
        self._take(StopNews.REFUSED)
        if error == UPLOAD_ERROR:
            self._line.doubt_upload()
        if self._refusal != error:
            self._refusal = error
            self.tell()
            self.publish("refused", error=error)

    async def _read_refusal(self) -> None:
        """In Ver.2 a refusal has to be asked for, before anything else is said that could be refused."""
        if self._line.mode != HostMode.VER_2:
            return
        with suppress(GatewayError):
            await self._conversation.take_error(Lane.STOP)

    def is_judged_by(self, asked_after: int) -> bool:
        """True if an error that was asked for at this count of `unheard` is that of its last writing."""
        return self.report.state != "confirmed" and self._judged_at < self._said_at <= asked_after

    def hear_error(self, error: str, *, one_brakes: bool) -> None:
        """Heed what a robot in Ver.2 tells after it was written; with it maybe `one` that `brakes`.

        If there are two, only that one is refused with certainty because a stop is under way.
        """
        self._judged_at = self._said_at
        if error == STOPPING_ALREADY and one_brakes and self.mode == "immediate":
            return
        if error in REFUSALS:
            self._refused(error)
        else:
            self._note_no_refusal()

    def _note_no_refusal(self) -> None:
        self._refusal = None
        self._take(StopNews.NOT_REFUSED)

    # seeing

    async def _see(self) -> Sequence[Text]:
        """Ask every unit, twice; the report says which does not stand still, and why."""
        await self._read_refusal()
        for pause_s in (BRAKES_FOR_S, 0.0):
            for unit in self._units:
                self._saw(unit, await self._why_not_still(unit))
            if self._not_still:
                break
            if any(self._places.values()):
                await asyncio.sleep(pause_s)
        return [*self._not_still.values()]

    def _saw(self, unit: RobotUnit, why_not_still: Text | None) -> None:
        if why_not_still is None:
            self._not_still.pop(unit.number, None)
        else:
            self._not_still[unit.number] = why_not_still
        self.tell()

    async def _why_not_still(self, unit: RobotUnit) -> Text | None:
        """Why a unit cannot be called standing still; None if it says itself that it does.

        In an emergency stop in which the axes may brake, the motors have to be where they were before.
        """
        try:
            axes = (await unit.status(Lane.STOP)).values()
            places = (
                await unit.position("motor", Lane.STOP)
                if self._conversation.known.bits.may_brake(axes)
                else {}
            )
        except UnitMissing:
            return None  # the robot itself says that nothing is there to move
        except GatewayError as error:
            self._run.discard(unit.number)
            unknown = standstill_unknown(text("stops.the-unit", unit=unit.number), error)
            return text("stops.unit-stood-still", unknown=unknown) if unit.stood_still else unknown
        stood = self._places.get(unit.number, places) == places
        self._places[unit.number] = places
        if stood and at_rest(axes):
            return None
        self._run.add(unit.number)
        self._told_at = self.waited_s
        return text("stops.unit-not-at-rest", unit=unit.number)

    def tells_of_motion(self) -> bool:
        """Every unit that was not seen to stand still has told of motion; a refused stop brakes nothing."""
        taken = self.report.state == "acknowledged" and self._refusal is None
        is_heard = self.waited_s - self._told_at < TOLD_TIMEOUTS * self._line.reply_timeout_s + REPEAT_S
        return taken and is_heard and bool(self._not_still) and self._run >= self._not_still.keys()

    # telling

    def why_not(self) -> list[Text]:
        """The refusal, and what each unit has told."""
        refusal = [] if self._refusal is None else [text("stops.robot-refused", error=self._refusal)]
        return [*refusal, *self._not_still.values()]

    def calls_for_hardware(self) -> bool:
        """A robot that refuses a stop does not stop."""
        return super().calls_for_hardware() or self._refusal is not None

    def tell(self) -> None:
        """Write into the report why it is not confirmed, and which units have not told."""
        super().tell()
        self.report.units_unknown = sorted(self._not_still)
