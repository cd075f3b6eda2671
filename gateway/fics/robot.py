"""A robot as the gateway sees it: composed of its units, what is asked of it, and what moves it."""

import asyncio
from collections.abc import Sequence
from functools import partial
from typing import Any, Self

from pydantic import Field

from gateway.core.controllers import Controllers
from gateway.core.errors import InvalidRequest
from gateway.core.exchange import Lane
from gateway.core.records import Record
from gateway.core.restores import Restores
from gateway.core.stops import StopMode
from gateway.core.supervisor import Deed
from gateway.fics.axes import UnitAxes
from gateway.fics.bits import Bits
from gateway.fics.conversation import Answers, answered_now, deadline_of
from gateway.fics.exchange import ReplyFrame, RobotAnswered
from gateway.fics.jogs import RobotJogs
from gateway.fics.knowledge import Macros
from gateway.fics.line import FicsLine
from gateway.fics.stops import RobotStopReport, RobotStops
from gateway.fics.tables import UPLOAD, Tables
from gateway.fics.units import AskedRobot, Publish, RobotUnit
from protocols.fics.alarms import CurrentError, ResetErrors, TakeCurrentError
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.link import Completion
from protocols.fics.positions import (
    LAST_POSITION,
    BeginPositionUpload,
    ClearPositions,
    DownloadPositions,
    EndPositionUpload,
    UploadPosition,
)
from protocols.fics.row import FicsCommand
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import GetCommunicationMode, GetUnit, SetCommunicationMode
from protocols.table import Reply

_KEPT_BACK: dict[type[FicsCommand[Any]], str] = {
    BeginPositionUpload: "Upload positions as a whole: an open upload takes no stop.",
    UploadPosition: "Upload positions as a whole: an open upload takes no stop.",
    EndPositionUpload: "Upload positions as a whole: the gateway ends each upload itself.",
    StartJog: "Open a JOG session, whose heartbeat keeps the axis moving.",
    StopJog: "Stop the axis, or its JOG session.",
    StopAllDecelerating: "Stop the robot, which sees to its standstill.",
    StopAllImmediately: "Stop the robot, which sees to its standstill.",
    SetCommunicationMode: "Change the mode of the robot, which sees to what goes with it.",
}


class Robot(AskedRobot):
    """One Fics with its units, its motion and its stops."""

    def __init__(
        self,
        robot_id: str,
        name: str,
        line: FicsLine,
        units: Sequence[UnitAxes],
        publish: Publish,
        *,
        poll_interval_s: float = 0.2,
        bits: Bits | None = None,
        macros: Macros | None = None,
    ) -> None:
        super().__init__(robot_id, name, line, units, publish, bits)
        self.macros = macros or Macros()
        self.poll_interval_s = poll_interval_s
        """Pause between two looks at axes that move, in seconds."""
        talk = self.conversation
        self.tables = Tables(talk)
        self.own_speed = asyncio.Lock()
        """Held from when the speed of a move is set until the move has begun."""
        stop_now = partial(self.stop, "immediate")
        self.jogs = RobotJogs(self.units, talk, self.publish, stop_now, poll_interval_s)
        self.stops = RobotStops(self.units, talk, self.jogs, self.publish)
        line.on_change = self._line_changed
        line.on_stray = self._note_stray

    def closing(self) -> tuple[Deed, ...]:
        """Stop what jogs, give up repeating stops, and close the line; moves run on in the robot."""
        return self.jogs.close, self.stops.close, self.line.close, self.conversation.close

    @property
    def moves_under_way(self) -> list[str]:
        """The ids of its units' moves that are not over."""
        return [unit.move.id for unit in self.units if unit.move is not None]

    # asking

    async def ask(self, command: FicsCommand[Any], unit: int | None = None) -> Reply | Completion:
        """Send a command and give its first reply; errors as of `Conversation.ask`."""
        replies = (await self.ask_all(command, unit)).replies
        return replies[0] if replies else Completion(command.wire_name())

    async def ask_all(self, command: FicsCommand[Any], unit: int | None = None) -> Answers:
        """Send a command and give all its replies; errors as of `Conversation.ask`."""
        _require_alone(command)
        if isinstance(command, TakeCurrentError):
            taken = await self.conversation.take_error(expires_at=deadline_of(Lane.COMMAND))
            return answered_now(RobotAnswered((CurrentError(error=taken),), texts=(taken,)))
        if isinstance(command, ResetErrors):
            return await self.conversation.reset_errors()
        if isinstance(command, DownloadPositions):
            return await self._unit_of(command, unit).download(command)
        if isinstance(command, ClearPositions):
            return await self.tables.clear(self._unit_of(command, unit), command)
        return await self.conversation.ask(command, unit)

    def _unit_of(self, command: FicsCommand[Any], unit: int | None) -> RobotUnit:
        return self.unit(self.conversation.only_unit(command) if unit is None else unit)

    # what takes several commands

    def stop(self, mode: StopMode) -> "asyncio.Task[RobotStopReport]":
        """Stop all axes; the stop is queued before this returns, ahead of everything."""
        return self.stops.stop(mode)

    async def upload_positions(
        self,
        positions: Sequence[tuple[int, Sequence[float | None]]],
        unit: int | None = None,
        *,
        since: int | None = None,
    ) -> None:
        """Store positions of a unit, undivided, and see that it holds them; errors as of `Tables.store`."""
        await self.tables.store(self._unit_of(UPLOAD, unit), positions, since)

    async def positions(
        self, first: int = 1, last: int = LAST_POSITION, unit: int | None = None
    ) -> list[tuple[int, list[float | None]]]:
        """Read the stored positions of a unit in turn; errors as of `RobotUnit.positions`."""
        return await self._unit_of(UPLOAD, unit).positions(first, last)

    def _line_changed(self, what: str, facts: dict[str, object]) -> None:
        self.known.doubt()
        self.known.note_change()
        self.known.bits.compare_again()
        if what == "robot.power_cycled":
            self.known.power_lost()
        elif what.startswith("robot."):
            self.publish(what, dict(facts))
        else:
            if what == "line.up":
                self.known.power.on_memory()
            self._publish(what, f"/lines/{self.line.id}", dict(facts), None)

    def _note_stray(self, frame: ReplyFrame) -> None:
        """An answer to no question of ours came: others may select units, or change the mode."""
        if frame.name == GetUnit.code:
            self.known.unit.doubt()
        elif frame.name == GetCommunicationMode.code:
            self.known.motion.poll_soon()


def _require_alone(command: FicsCommand[Any]) -> None:
    """Refuse what is not sent alone.

    :raises InvalidRequest: it is part of something larger, or moves something.
    """
    if remedy := _KEPT_BACK.get(type(command)):
        raise InvalidRequest(f"{command.wire_name()} is not sent alone; nothing was sent.", remedy)
    if command.starts_motion:
        raise InvalidRequest(f"{command.wire_name()} starts a move; nothing was sent.", "Start a move.")


class RobotNow(Record):
    """A robot, as far as is known."""

    robot_id: str
    online: bool
    mode: int
    moving: bool | None
    power_cycled: bool
    error: str | None = Field(description="The code of the error that stands.")

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Tell it without asking the robot."""
        return cls(
            robot_id=robot.id,
            online=robot.online,
            mode=robot.mode,
            moving=robot.moving,
            power_cycled=robot.power_cycled,
            error=None if robot.latched_error is None else robot.latched_error.code,
        )


class Robots(Controllers[Robot]):
    """The robots of a plant, and the restores of backups to them."""

    restores: Restores[Any]

    def robots(self) -> list[Robot]:
        """All robots, in the order of the configuration."""
        return self.every()

    def robot(self, robot_id: str) -> Robot:
        """Find a robot; errors as of `find`."""
        return self.find(robot_id)
