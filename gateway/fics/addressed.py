"""Robots and their units as the operations see them."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any, Final

from gateway.core.errors import ControllerRefused, GatewayError, InvalidRequest
from gateway.core.move_record import START_WITHIN_S
from gateway.core.next_calls import NextCall
from gateway.core.stops import StopMode
from gateway.core.targets import BegunMoves, CommandReplies, MemberAnswers, Opened, Stopped, Target, stopped
from gateway.fics.axes import CoordinateSystem
from gateway.fics.calls import calls_for_robot
from gateway.fics.move_requests import RobotMoveRequest
from gateway.fics.moves import RobotMoves
from gateway.fics.plans import PlannedRobotMove, RobotSamples, plan_of, samples_of
from gateway.fics.robot import Robot
from gateway.fics.settings import SETTINGS, require_fit, uncrossed
from gateway.fics.units import RobotUnit
from protocols.fics import commands
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.row import FicsCommand
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.table import RangeFault, SyntaxFault

_SETTING: Final[dict[CoordinateSystem, str]] = {"user": "speed_percent", "motor": "motor_speed_percent"}


@asynccontextmanager
async def at_own_speed(
    robot: Robot, unit: RobotUnit, request: RobotMoveRequest
) -> AsyncIterator[RobotMoveRequest]:
    """Set the `speed_percent` of a move, if it has one, and keep others from setting it until it has begun.

    It is not put back: that would make whatever moves next faster than the person at the machine has seen.

    :raises GatewayError: it was not set and read back, or a stop came meanwhile; the move must not start.
    """
    percent = getattr(request, "speed_percent", None)
    if percent is None:
        yield request
        return
    epoch = robot.line.stop_epoch
    robot.known.motion.require_still(request.command(unit))
    async with robot.own_speed:
        setting = SETTINGS[_SETTING[getattr(request, "coordinates", "user")]]
        found = getattr(await unit.read(setting.read()), setting.field)
        wanted = [float(percent)] * len(unit.names(setting.coordinates))
        if list(found) != wanted:
            await unit.change(setting.write(**{setting.field: wanted}))
        if robot.line.stop_epoch != epoch:
            raise robot.line.overtaken()
        yield request


STOP_MODES: Final[dict[type[Any], StopMode]] = {
    StopAllDecelerating: "decelerate",
    StopAllImmediately: "immediate",
}


NAME_LENGTH: Final = 3


class RobotTarget(Target):
    """A robot as a whole."""

    stop_modes = STOP_MODES

    def __init__(self, robot: Robot, moves: RobotMoves) -> None:
        self.robot = robot
        self.address = robot.id
        self.path = f"/robots/{robot.id}"
        self._moves, self.log = moves, moves.log

    async def ask(self, command: Any) -> CommandReplies:
        """Send a command that starts no move; errors as of `Robot.ask`."""
        return await self._ask(command, None)

    async def _ask(self, command: FicsCommand[Any], unit: int | None) -> CommandReplies:
        replies, at, texts = await self.robot.ask_all(command, unit)
        listed = bool(command.ends_with)
        told = replies if replies or listed else (command.reply_type()(),)
        return CommandReplies(told, at if command.is_query() else None, listed, texts)

    async def start(self, command: Any, start_within_s: float = START_WITHIN_S) -> BegunMoves | Opened:
        """Start a move on the only unit; errors as of `RobotMoves.start`."""
        return await self._only_unit().start(command, start_within_s)

    async def stop_by(self, command: Any) -> CommandReplies | MemberAnswers | Stopped:
        """Stop all axes, or one of the only unit."""
        if isinstance(command, StopJog):
            return await self._only_unit().stop_by(command)
        return await super().stop_by(command)

    def _only_unit(self) -> "UnitTarget":
        if len(self.robot.units) > 1:
            raise InvalidRequest(
                f"unit: {self.robot.id} has several units; nothing was sent.", "Say on which."
            )
        return UnitTarget(self.robot, self.robot.units[0], self._moves)

    def calls_for(self, error: GatewayError) -> Sequence[NextCall]:
        """The calls that help where a request about it has failed."""
        units = self.robot.units
        only = units[0].number if len(units) == 1 else None
        return calls_for_robot(error, self.robot.id, self.robot.line.id, only)

    def read(self, text: str) -> FicsCommand[Any]:
        """Read a command as it stands on the line, without its terminator.

        :raises InvalidRequest: it is not in the form of its page.
        """
        try:
            return commands.read(text[:NAME_LENGTH], text[NAME_LENGTH:].strip())
        except (SyntaxFault, RangeFault) as fault:
            raise InvalidRequest(f"text: {fault}; nothing was sent.") from None

    async def stop(self, mode: StopMode) -> Stopped:
        """Stop all axes: a robot knows no stop of a single unit."""
        return await stopped("robots", asyncio.gather(self.robot.stop(mode)))


class UnitTarget(RobotTarget):
    """A unit of a robot."""

    def __init__(self, robot: Robot, unit: RobotUnit, moves: RobotMoves) -> None:
        super().__init__(robot, moves)
        self.unit = unit
        self.address = unit.address
        self.path = f"/robots/{unit.address}"

    async def ask(self, command: Any) -> CommandReplies:
        """Send a command that the unit can take; errors as of `Robot.ask`, and of `uncrossed`."""
        require_fit(self.unit, command)
        (settled,) = await uncrossed(self.unit, {"coordinates": command})
        return await self._ask(settled, self.unit.number)

    async def start(self, command: Any, start_within_s: float = START_WITHIN_S) -> BegunMoves | Opened:
        """Start a move, or open a JOG session; errors as of `RobotMoves.start` and `Jogs.start`."""
        if isinstance(command, StartJog):
            return await self.jog(command)
        try:
            move = await self._moves.start(self.robot, self.unit, command, start_within_s)
        except ControllerRefused as refusal:
            self.robot.macros.note(command, refusal)
            raise
        self.robot.macros.note(command, None)
        return BegunMoves(self.path, [move])

    async def samples(self, move_id: str) -> RobotSamples:
        """Give where it was seen during a move; errors as of `Trajectories.of`."""
        return await samples_of(self._moves.trajectories.of(move_id))

    async def jog(self, command: StartJog) -> Opened:
        """Jog an axis, only as long as heartbeats come; errors as of `Jogs.start`."""
        session = await self.robot.jogs.start(self.unit.number, command.axis, command.direction)
        return Opened(f"/robots/{self.robot.id}/jogs/{session.id}", session)

    async def stop_by(self, command: Any) -> CommandReplies | MemberAnswers | Stopped:
        """Stop one axis, with its session, or all axes."""
        if not isinstance(command, StopJog):
            return await super().stop_by(command)
        require_fit(self.unit, command)
        await self.robot.jogs.stop(self.unit.number, command.axis)
        return CommandReplies((command.reply_type()(),))

    def calls_for(self, error: GatewayError) -> Sequence[NextCall]:
        """The calls that help where a request about the unit has failed."""
        return calls_for_robot(error, self.robot.id, self.robot.line.id, self.unit.number)

    def command_for(self, request: RobotMoveRequest) -> FicsCommand[Any]:
        """Put a wish for a move into a command; errors as of `amounts.numbers`."""
        return request.command(self.unit)

    def at_own_speed(self, request: RobotMoveRequest) -> AbstractAsyncContextManager[RobotMoveRequest]:
        """Set the `speed_percent` of a move; errors as of `own_speed.at_own_speed`."""
        return at_own_speed(self.robot, self.unit, request)

    async def plan(self, command: Any, _: object = None) -> PlannedRobotMove:
        """Work out a move at the speeds that are set now; errors as of `plan_of`."""
        return await plan_of(self.unit, command)
