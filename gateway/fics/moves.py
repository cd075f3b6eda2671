"""The moves of robots: started at most once each, remembered when they are over."""

import asyncio
from datetime import UTC, datetime
from typing import Any

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.move_log import MoveLog, new_id
from gateway.core.move_record import MoveError, MoveStatus
from gateway.fics.errors import RobotBusy
from gateway.fics.move_record import KINDS, RobotMove
from gateway.fics.move_runs import Journey
from gateway.fics.robot import Robot
from gateway.fics.units import RobotUnit, coordinates_of
from protocols.fics.jog import StepAxis
from protocols.fics.moves import AxesMove
from protocols.fics.notation import Quantity
from protocols.fics.row import FicsCommand


class RobotMoves:
    """All moves of all robots: starts them, follows them, remembers them."""

    def __init__(self) -> None:
        self.log = MoveLog[RobotMove]()
        self._tasks: dict[asyncio.Task[None], asyncio.Future[GatewayError | None]] = {}
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
        self, robot: Robot, unit: int, command: FicsCommand[Any], start_within_s: float = 5.0
    ) -> RobotMove:
        """Send a motion command, and give its move when the robot has not refused it.

        :raises RobotBusy: the robot still moves; nothing was sent.
        :raises ControllerRefused: the robot refused; nothing moved.
        :raises NotSent: power was lost, an error stands, the line or the robot is away, or the gateway ends
            or was held up; nothing was sent.
        """
        robot.line.admission.require()
        axes = robot.unit(unit)
        check(axes, command)
        robot.require_fit_for_motion(command)
        if not robot.idle.is_set():
            raise RobotBusy(f"A move of {robot.id} is not over; nothing was sent.", "Wait for it or stop it.")
        epoch = robot.line.stop_epoch
        journey = Journey(axes, command, self._new(axes, command), epoch, self.advance)
        task = asyncio.create_task(journey.make(start_within_s), name=f"move {journey.move.id}")
        self._tasks[task] = journey.begun
        task.add_done_callback(self._tasks.pop)
        task.add_done_callback(lambda _: journey.begun.cancel())
        refusal = await asyncio.shield(journey.begun)
        if refusal is not None:
            raise refusal
        return journey.move

    async def begun(self) -> None:
        """Wait until every move that was asked for has been taken or refused."""
        if self._tasks:
            await asyncio.wait(self._tasks.values())

    def let_go(self) -> None:
        """Give those who wait for moves what is known now."""
        self.log.let_go()

    async def close(self) -> None:
        """Stop following, once the lines are closed; the robots keep doing what they do."""
        await self.begun()
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _new(self, unit: RobotUnit, command: FicsCommand[Any]) -> RobotMove:
        now, coordinates = datetime.now(UTC), coordinates_of(unit, command)
        move = RobotMove(
            id=new_id(now),
            robot_id=unit.robot.id,
            unit=unit.number,
            body_id=unit.address,
            kind=KINDS[type(command)],
            coordinates=coordinates,
            units={name: unit.systems[name].unit(Quantity.POSITION) for name in unit.names(coordinates)},
            command=command.wire_name(),
            frame=unit.robot.line.frame_of(command),
            created_at=now,
        )
        self.log.add(move)
        unit.move = move
        unit.robot.idle.clear()
        move.event_cursor = _publish("queued", unit, move)
        return move

    def advance(
        self, unit: RobotUnit, move: RobotMove, status: MoveStatus, error: GatewayError | None = None
    ) -> None:
        """The only place where a move changes its status."""
        move.status = status
        if error is not None:
            move.error = MoveError.of(error)
        if status is MoveStatus.SENT:
            move.sent_at = datetime.now(UTC)
        if status.final:
            move.ended_at = datetime.now(UTC)
            unit.move = None
            unit.robot.idle.set()
            self.log.end(move)
        _publish("started" if status is MoveStatus.MOVING else status, unit, move)


def check(unit: RobotUnit, command: FicsCommand[Any]) -> None:
    """Refuse what the unit cannot do whatever its state.

    :raises InvalidRequest: no move, more axes than there are, no such axis, or a fraction of a pulse.
    """
    if type(command) not in KINDS:
        raise InvalidRequest(f"{command.wire_name()} starts no move; nothing was sent.")
    if isinstance(command, StepAxis):
        unit.require_axis(command.axis)
    if isinstance(command, AxesMove):
        unit.require_values(coordinates_of(unit, command), command.coordinates)


def _publish(news: str, unit: RobotUnit, move: RobotMove) -> str:
    return unit.robot.publish_of(unit, f"robot.move.{news}", move.model_dump(mode="json"), move.id)
