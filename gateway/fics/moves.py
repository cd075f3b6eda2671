"""The moves of robots: started at most once each, remembered when they are over."""

import asyncio
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any

from gateway.core.errors import GatewayError
from gateway.core.events import Event
from gateway.core.move_log import new_id
from gateway.core.move_record import RESTARTED, START_WITHIN_S
from gateway.core.move_runs import MoveRuns
from gateway.core.next_calls import NextCall
from gateway.core.trajectories import Trajectories
from gateway.fics.calls import calls_for_robot
from gateway.fics.errors import RobotBusy
from gateway.fics.move_record import KINDS, RobotMove, check
from gateway.fics.move_runs import MoveRun
from gateway.fics.robot import Robot
from gateway.fics.samples import RobotTrajectory
from gateway.fics.soft_limits import name_limits
from gateway.fics.targets import end_of
from gateway.fics.units import RobotUnit
from protocols.fics.commands import read
from protocols.fics.row import FicsCommand


class RobotMoves(MoveRuns[MoveRun, RobotMove]):
    """All moves of all robots."""

    def __init__(self, on_trajectory: Callable[[], None] = lambda: None) -> None:
        super().__init__()
        self._on_trajectory = on_trajectory
        """Called when the trajectory of a move begins, or has ended."""
        self.trajectories = Trajectories[RobotTrajectory]()

    def of(self, unit: RobotUnit) -> list[RobotMove]:
        """The unit's moves, newest first."""
        return self.log.of(unit.address)

    async def start(
        self,
        robot: Robot,
        unit: RobotUnit,
        command: FicsCommand[Any],
        start_within_s: float = START_WITHIN_S,
    ) -> RobotMove:
        """Send a motion command, and give its move when the robot has not refused it.

        :raises RobotBusy: the robot still moves; nothing was sent.
        :raises ControllerRefused: the robot refused; nothing moved.
        :raises NotSent: power was lost, an error stands, the line or the robot is away, or the gateway ends
            or was held up; nothing was sent.
        """
        robot.line.require_fit()
        check(unit, command)
        robot.known.require_fit(command)
        if not robot.known.motion.idle.is_set():
            raise RobotBusy(f"A move of {robot.id} is not over; nothing was sent.", "Wait for it or stop it.")
        move = _new(robot, unit, command)
        run = MoveRun(robot, unit, command, move, self)
        refusal = await self._start([(run, move)], partial(run.make, start_within_s), run.begun)
        if refusal is not None:
            end = end_of(unit, command, move.start_position or {}, move.target_position)
            await name_limits(unit, move.coordinates, end, refusal)
            raise refusal
        return move

    def take_over(self, robot: Robot, move: RobotMove, *, begun: bool, since: str = RESTARTED) -> None:
        """Go on with a move of an earlier life: ask the robot, and follow the move to its end."""
        unit, command = robot.unit(move.unit), _command_of(move)
        run = MoveRun(robot, unit, command, move, self)
        if self._take_over(run, move, begun=begun, asked="the robot", since=since):
            self._see_through(move.id, run.take_over, run.begun, partial(self._give_up, [(run, move)]))

    def _move_of(self, who: MoveRun) -> RobotMove | None:
        return who.unit.move

    def _calls(self, who: MoveRun, error: GatewayError) -> Sequence[NextCall]:
        return calls_for_robot(error, who.robot.id, who.robot.line.id, who.unit.number)

    def _publish(self, news: str, who: MoveRun, move: RobotMove, /) -> Event:
        return who.robot.publish(f"robot.move.{news}", move, who.unit, move.id)

    def _was_sent(self, who: MoveRun, move: RobotMove) -> None:
        began_at = move.sent_at or datetime.now(UTC)
        who.unit.trajectory = RobotTrajectory(who.unit, move, began_at, asyncio.get_running_loop().time())
        self.trajectories.begin(move.id, who.unit.trajectory)
        self._on_trajectory()

    def _claim(self, who: MoveRun, move: RobotMove, /) -> None:
        who.unit.move = move
        who.robot.known.motion.idle.clear()

    def _free(self, who: MoveRun) -> None:
        who.unit.move = who.unit.trajectory = None
        who.robot.known.motion.idle.set()
        self._on_trajectory()

    def _lose(self, who: MoveRun, why: str, /) -> None:
        who.withdraw(why)


def _new(robot: Robot, unit: RobotUnit, command: FicsCommand[Any]) -> RobotMove:
    now, coordinates = datetime.now(UTC), unit.coordinates_of(command)
    return RobotMove(
        id=new_id(now),
        robot_id=robot.id,
        unit=unit.number,
        body_id=unit.address,
        kind=KINDS[type(command)],
        coordinates=coordinates,
        units=unit.counted_in(coordinates),
        command=command.wire_name(),
        frame=robot.line.frame_of(command),
        created_at=now,
    )


def _command_of(move: RobotMove) -> FicsCommand[Any]:
    """The command of a move, read from its frame."""
    arguments = move.frame.replace("\\r", "").replace("\\n", "").removeprefix(move.command)
    return read(move.command, arguments.strip())
