"""The moves of robots: started at most once each, remembered when they are over."""

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from typing import Any

from gateway.core.errors import Cancelled, GatewayError
from gateway.core.events import Event
from gateway.core.lanes import Lane
from gateway.core.move_log import MoveLog, new_id
from gateway.core.move_record import START_WITHIN_S, MoveError, MoveStatus
from gateway.core.move_tasks import MoveTasks
from gateway.core.trajectories import Trajectories
from gateway.core.verdicts import Unbegun, Unwatched, Verdict, Words, judge
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


class RobotMoves:
    """All moves of all robots: starts them, follows them, remembers them."""

    def __init__(self, on_trajectory: Callable[[], None] = lambda: None) -> None:
        self._on_trajectory = on_trajectory
        """Called when the trajectory of a move begins, or has ended."""
        self.log = MoveLog[RobotMove]()
        self.trajectories = Trajectories[RobotTrajectory]()
        self._tasks = MoveTasks()
        """With what is known when the robot has taken the command, or why it has not."""

    def get(self, move_id: str) -> RobotMove:
        """Find a move by its id.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return self.log.get(move_id)

    def of(self, unit: RobotUnit) -> list[RobotMove]:
        """The unit's moves, newest first."""
        return self.log.of(unit.address)

    async def wait(self, move_id: str, timeout_s: float) -> RobotMove:
        """Give the move when it is over, or as it is when the time is up.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return await self.log.wait(move_id, timeout_s)

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
        robot.motions.require_fit(command)
        if not robot.motion.idle.is_set():
            raise RobotBusy(f"A move of {robot.id} is not over; nothing was sent.", "Wait for it or stop it.")
        move = self._new(robot, unit, command)
        give_up = partial(self._give_up, robot, unit, command, move)
        try:
            move.event_cursor = _publish("queued", robot, unit, move).cursor
            self.log.on_change(move)
            run = self._run(robot, unit, command, move)
            self._tasks.add(move.id, partial(run.make, start_within_s), run.begun, give_up)
        except Exception:
            give_up("A fault of the gateway itself came before it was sent.")
            raise
        refusal = await asyncio.shield(run.begun)
        if refusal is not None:
            end = end_of(unit, command, move.start_position or {}, move.target_position)
            await name_limits(unit, move.coordinates, end, refusal)
            raise refusal
        return move

    def take_over(self, robot: Robot, move: RobotMove, *, begun: bool) -> None:
        """Go on with a move of an earlier life: ask the robot, and follow the move to its end."""
        if move.status is MoveStatus.QUEUED and not begun:
            self._end(robot, robot.unit(move.unit), move, judge(Unbegun.GATEWAY_ENDED))
            return
        if move.status is MoveStatus.QUEUED:
            move.status = MoveStatus.SENT
            move.evidence.append("The journal does not tell whether the command was written.")
        move.evidence.append("The gateway was restarted in the middle of the move; the robot was asked.")
        robot.motion.begin_move(move.unit, move)
        unit, command = robot.unit(move.unit), _command_of(move)
        run = self._run(robot, unit, command, move)
        give_up = partial(self._give_up, robot, unit, command, move)
        self._tasks.add(move.id, run.take_over, run.begun, give_up)

    async def begun(self) -> None:
        """Wait until every move that was asked for has been taken or refused."""
        await self._tasks.begun()

    def let_go(self) -> None:
        """Give the waiters for moves what is known now."""
        self.log.let_go()

    async def close(self) -> None:
        """Stop following, once the lines are closed; the robots keep doing what they do."""
        await self._tasks.close()

    def _run(self, robot: Robot, unit: RobotUnit, command: FicsCommand[Any], move: RobotMove) -> MoveRun:
        advance = partial(self.advance, robot, unit)
        publish = partial(robot.publish, unit=unit, correlation=move.id)
        return MoveRun(unit, command, move, robot.motions, robot.durations, advance, publish)

    def _give_up(
        self, robot: Robot, unit: RobotUnit, command: FicsCommand[Any], move: RobotMove, why: str
    ) -> None:
        """Nobody knows how it ends; what is not written yet never is."""
        robot.line.cancel(
            lambda it: it.lane is Lane.COMMAND, Cancelled(f"{why} Nothing was sent.", "Try again.")
        )
        if robot.motion.command is command:
            robot.motions.end()
        if robot.motion.moves.get(unit.number) is move:
            self._end(robot, unit, move, judge(Unwatched.FAULT, Words(why=why)))

    def _end(self, robot: Robot, unit: RobotUnit, move: RobotMove, verdict: Verdict) -> None:
        verdict.write_down(move)
        self.advance(robot, unit, move, verdict.status, verdict.error)

    def _new(self, robot: Robot, unit: RobotUnit, command: FicsCommand[Any]) -> RobotMove:
        now, coordinates = datetime.now(UTC), unit.coordinates_of(command)
        move = RobotMove(
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
        self.log.add(move)
        robot.motion.begin_move(unit.number, move)
        return move

    def advance(
        self,
        robot: Robot,
        unit: RobotUnit,
        move: RobotMove,
        status: MoveStatus,
        error: GatewayError | None = None,
    ) -> None:
        """The only place where a move changes its status."""
        if error is not None:
            calls = calls_for_robot(error, robot.id, robot.line.id, move.unit)
            move.error = MoveError.of(error, calls)
        move.status = status
        if status is MoveStatus.SENT:
            move.sent_at = datetime.now(UTC)
            self._begin_way(unit, move, move.sent_at)
        elif status.final:
            move.ended_at = datetime.now(UTC)
            unit.trajectory = None
            robot.motion.end_move(move.unit)
            self._on_trajectory()
            self.log.end(move)
        _publish("started" if status is MoveStatus.MOVING else status, robot, unit, move)
        self.log.on_change(move)

    def _begin_way(self, unit: RobotUnit, move: RobotMove, sent_at: datetime) -> None:
        unit.trajectory = trajectory = RobotTrajectory(unit, move, sent_at, asyncio.get_running_loop().time())
        self.trajectories.begin(move.id, trajectory)
        self._on_trajectory()


def _command_of(move: RobotMove) -> FicsCommand[Any]:
    """The command of a move, read from its frame."""
    arguments = move.frame.replace("\\r", "").replace("\\n", "").removeprefix(move.command)
    return read(move.command, arguments.strip())


def _publish(news: str, robot: Robot, unit: RobotUnit, move: RobotMove) -> Event:
    return robot.publish(f"robot.move.{news}", move, unit, move.id)
