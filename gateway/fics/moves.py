"""The life of a robot's move: sent at most once, followed to its end by what the robot itself says."""

import asyncio
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any, Literal

from pydantic import Field

from gateway.errors import GatewayError, InvalidRequest, MoveFailed, NoReply, NotExecuted, NotSent
from gateway.fics.errors import PowerCycled, RobotBusy, RobotFailed, RobotRefused
from gateway.fics.exchange import Answered, Outcome
from gateway.fics.line import SILENT
from gateway.fics.robot import Accepted, Coordinates, Robot, RobotUnit, at_rest, in_trouble
from gateway.move_log import MoveLog, new_id
from gateway.moves import LOST_AFTER_S, MoveError, MoveStatus
from gateway.records import Record
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis
from protocols.fics.link import Failure, Refusal
from protocols.fics.macros import RunMacro
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.moves import AxesMove, MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.notation import Quantity
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisStatus

RobotMoveKind = Literal["absolute", "relative", "position", "home", "step", "macro"]
Places = dict[str, float | None]

TOLERANCE = 0.01
"""A successful move may end so far from its target, in the unit of the axis: displays round."""
ANSWER_AFTER_REST_S = 0.5
"""An answer that comes later than this after standstill is taken for lost."""

_KINDS: dict[type[FicsCommand[Any]], RobotMoveKind] = {
    MoveAbsolute: "absolute",
    MoveMotorsAbsolute: "absolute",
    MoveRelative: "relative",
    MoveMotorsRelative: "relative",
    MoveToPosition: "position",
    HomeRobot: "home",
    StepAxis: "step",
    RunMacro: "macro",
}


class RobotMove(Record):
    """One move of one unit, from the request to its end; positions are in the units of the axes."""

    id: str
    robot_id: str
    unit: int
    body_id: str = Field(description="Address of the unit, ROBOT/units/1.")
    kind: RobotMoveKind
    coordinates: Coordinates = Field(description="Which axes positions are told of.")
    status: MoveStatus = MoveStatus.QUEUED
    end_cause: str | None = Field(
        default=None,
        description="normal, stop_command or error_nnn as the robot says; not_executed, power_cycled or "
        "position_mismatch as the gateway found.",
    )
    command: str = Field(description="The three characters of the robot's command.")
    frame: str = Field(description="The exact bytes, CR as \\r.")
    start_position: Places | None = Field(default=None, description="By axis, before the move.")
    target_position: Places | None = Field(
        default=None, description="By axis, where it can be known beforehand."
    )
    position: Places | None = Field(
        default=None, description="By axis, as last read; null while an axis does not know it."
    )
    completion: Literal["reply", "inferred"] | None = Field(
        default=None, description="Whether the robot has answered the move or was seen to have come to rest."
    )
    evidence: list[str] = Field(default_factory=list, description="How the gateway knows what it says.")
    error: MoveError | None = None
    created_at: datetime
    sent_at: datetime | None = None
    acknowledged_at: datetime | None = None
    ended_at: datetime | None = None
    event_cursor: str = Field(
        default="", description="Events after this cursor include all later news of the move."
    )


class RobotMoves:
    """All moves of all robots: starts them, follows them, remembers them."""

    def __init__(self) -> None:
        self._log = MoveLog[RobotMove]()
        self._tasks: set[asyncio.Task[None]] = set()

    def get(self, move_id: str) -> RobotMove:
        """Find a move by its id.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return self._log.get(move_id)

    def of(self, unit: RobotUnit) -> list[RobotMove]:
        """The unit's moves, newest first."""
        return self._log.of(unit.address)

    async def wait(self, move_id: str, timeout_s: float) -> RobotMove:
        """Give the move when it is over, or as it is when the time is up.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return await self._log.wait(move_id, timeout_s)

    async def start(
        self, robot: Robot, unit: int, command: FicsCommand[Any], start_within_s: float = 5.0
    ) -> RobotMove:
        """Send a motion command, and give its move when the robot has not refused it.

        :raises RobotBusy: the robot still moves; nothing was sent.
        :raises RobotRefused: the robot refused; nothing moved.
        :raises NotSent: power was lost, an error stands, or the line or the robot is away; nothing was sent.
        """
        axes = robot.unit(unit)
        check(axes, command)
        robot.require_fit_for_motion(command)
        if not robot.idle.is_set():
            raise RobotBusy(f"A move of {robot.id} is not over; nothing was sent.", "Wait for it or stop it.")
        epoch = robot.line.stop_epoch
        journey = _Journey(self, axes, command, self._new(axes, command), epoch)
        task = asyncio.create_task(journey.make(start_within_s), name=f"move {journey.move.id}")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        task.add_done_callback(lambda _: journey.begun.cancel())
        refusal = await asyncio.shield(journey.begun)
        if refusal is not None:
            raise refusal
        return journey.move

    async def close(self) -> None:
        """Stop following; the robots keep doing what they do."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _new(self, unit: RobotUnit, command: FicsCommand[Any]) -> RobotMove:
        now = datetime.now(UTC)
        move = RobotMove(
            id=new_id(now),
            robot_id=unit.robot.id,
            unit=unit.number,
            body_id=unit.address,
            kind=_KINDS[type(command)],
            coordinates=_coordinates_of(unit, command),
            command=command.wire_name(),
            frame=unit.robot.line.frame_of(command),
            created_at=now,
        )
        self._log.add(move)
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
            move.error = describe(error)
        if status is MoveStatus.SENT:
            move.sent_at = datetime.now(UTC)
        if status.final:
            move.ended_at = datetime.now(UTC)
            unit.move = None
            unit.robot.idle.set()
            self._log.end(move)
        _publish("started" if status is MoveStatus.MOVING else status, unit, move)


class _Journey:
    """One move on its way."""

    def __init__(
        self, moves: RobotMoves, unit: RobotUnit, command: FicsCommand[Any], move: RobotMove, epoch: int
    ) -> None:
        self.moves = moves
        self.unit = unit
        self.robot = unit.robot
        self.command = command
        self.move = move
        self.epoch = epoch
        """The robot's stop epoch at admission."""
        self.begun: asyncio.Future[GatewayError | None] = asyncio.get_running_loop().create_future()
        """Known when the robot has taken the command, or why it has not."""

    async def make(self, start_within_s: float) -> None:
        """From the queue to the end."""
        try:
            await self._know_the_start()
            accepted = await self.robot.begin(
                self.command,
                self.unit.number,
                epoch=self.epoch,
                expires_at=asyncio.get_running_loop().time() + start_within_s,
                on_written=lambda _: self._advance(MoveStatus.SENT),
            )
        except GatewayError as error:
            rejected = isinstance(error, RobotRefused)
            self._advance(MoveStatus.REJECTED if rejected else MoveStatus.CANCELLED, error)
            self._tell(error)
            return
        try:
            await self._follow(accepted)
        finally:
            self.robot.end_motion(accepted)
            self._tell(None)

    def _advance(self, status: MoveStatus, error: GatewayError | None = None) -> None:
        self.moves.advance(self.unit, self.move, status, error)

    def _tell(self, refusal: GatewayError | None) -> None:
        if not self.begun.done():
            self.begun.set_result(refusal)

    async def _know_the_start(self) -> None:
        """Know where the axes stand and where they should come to: the evidence if the answer is lost."""
        try:
            self.move.start_position = self.move.position = await self._position()
        except NoReply as error:
            raise NotSent(
                f"{self.unit.address} did not tell its position before the move; the move was not sent.",
                error.remedy,
            ) from None
        self.move.target_position = _target_of(self.command, self.move.start_position)

    async def _position(self) -> Places:
        return await self.unit.position(self.move.coordinates)

    async def _follow(self, accepted: Accepted) -> None:
        """Ask until the axes have come to rest, unless the robot says so first."""
        while not accepted.outcome.done():
            axes = await self._status()
            if axes is None:
                return
            if at_rest(axes) and await self._rests_without_answer(accepted):
                await self._infer(axes)
                return
            if self.move.status is MoveStatus.SENT and not accepted.outcome.done():
                # Commands are taken in their order: with this answer a refusal would have come.
                self.move.acknowledged_at = datetime.now(UTC)
                self._advance(MoveStatus.MOVING)
                self._tell(None)
            await asyncio.wait({accepted.outcome}, timeout=self.robot.poll_interval_s)
        await self._conclude(accepted.outcome.result())

    async def _rests_without_answer(self, accepted: Accepted) -> bool:
        """Whether the axes stand still for certain, and the answer, where there is one, stays away."""
        if self.robot.mode != SILENT:
            await asyncio.wait({accepted.outcome}, timeout=ANSWER_AFTER_REST_S)
            if accepted.outcome.done():
                return False
        axes = await self._status()
        return axes is not None and at_rest(axes) and not accepted.outcome.done()

    async def _status(self) -> list[AxisStatus] | None:
        """What the axes do; None when the move is lost."""
        loop = asyncio.get_running_loop()
        give_up_at = loop.time() + LOST_AFTER_S
        while loop.time() < give_up_at:
            if self.robot.power_cycled:
                self._lost("power_cycled", _without_power(self.robot))
                return None
            try:
                return list((await self.unit.status()).values())
            except GatewayError:
                await asyncio.sleep(self.robot.poll_interval_s)
        self._lost(None, _gone(self.robot))
        return None

    def _lost(self, cause: str | None, error: GatewayError) -> None:
        if not self.move.status.final:
            self.move.end_cause = cause
            self._advance(MoveStatus.LOST, error)

    async def _conclude(self, outcome: Outcome) -> None:
        """The robot has answered, or nobody will know its answer."""
        move = self.move
        if isinstance(outcome, Refusal):
            refusal = RobotRefused(self.robot.id, move.command, outcome.error)
            self._advance(MoveStatus.REJECTED, refusal)
            self._tell(refusal)
        elif isinstance(outcome, Failure):
            move.completion = "reply"
            await self._failed(outcome.error)
        elif isinstance(outcome, Answered):
            move.completion = "reply"
            await self._ended()
        elif isinstance(outcome, NoReply):
            await self._resolve(outcome)
        else:
            self._advance(MoveStatus.CANCELLED, outcome)
            self._tell(outcome)

    async def _infer(self, axes: list[AxisStatus]) -> None:
        """The axes stand still, and nothing more will be said about it."""
        self.move.completion = "inferred"
        self.move.evidence.append("The axes were seen to stand still twice (ACD).")
        if self.robot.mode != SILENT:
            self.move.evidence.append("The answer of the robot stayed away.")
        try:
            await self.robot.see_power()
        except PowerCycled as gone:
            self._lost("power_cycled", gone)
            return
        except GatewayError as unseen:
            self.move.evidence.append(unseen.detail)
        await self.robot.look_for_errors()
        await self._read_position()
        error = self.robot.latched_error
        if self._forgot_its_origin():
            self.robot.lost_power(certain=False)
            self._lost("power_cycled", _without_power(self.robot))
        elif error is not None and not self._stopped():
            await self._failed(error.code or "999", looked=True)
        elif any(map(in_trouble, axes)) and not self._stopped():
            self._advance(MoveStatus.FAILED, _in_trouble(self.unit))
        elif self._untouched() and not self._stopped():
            self.move.end_cause = "not_executed"
            self._advance(MoveStatus.FAILED, _lost_on_its_way(self.unit, self.move))
        else:
            await self._ended()

    async def _ended(self) -> None:
        """Without an error: by itself or by a stop."""
        await self._read_position()
        if self._stopped() and not self._on_target():
            self.move.end_cause = "stop_command"
            self._advance(MoveStatus.STOPPED)
        elif self._off_target():
            self.move.end_cause = "position_mismatch"
            self._advance(MoveStatus.FAILED, _missed(self.unit, self.move))
        else:
            self.move.end_cause = "normal"
            self._advance(MoveStatus.SUCCEEDED)

    async def _failed(self, code: str, *, looked: bool = False) -> None:
        """With an error of the system: that of a stop, or one that came by itself."""
        await self._read_position()
        if not looked:
            await self.robot.look_for_errors()
        if self._stopped():
            self.move.end_cause = "stop_command"
            self._advance(MoveStatus.STOPPED)
        else:
            self.move.end_cause = f"error_{code}"
            self._advance(MoveStatus.FAILED, RobotFailed(self.robot.id, self.move.command, code))

    async def _resolve(self, error: NoReply) -> None:
        """The line was lost in the middle: let the axes tell, where they can prove it."""
        axes = await self._status()
        while axes is not None and not at_rest(axes):
            if self.move.status is MoveStatus.SENT:
                self.move.evidence.append("The axes move, so the command was executed.")
                self._advance(MoveStatus.MOVING)
                self._tell(None)
            await asyncio.sleep(self.robot.poll_interval_s)
            axes = await self._status()
        if axes is None:
            return
        self.move.completion = "inferred"
        await self._read_position()
        if self._on_target():
            self.move.evidence.append("The axes stand at the target.")
            self.move.end_cause = "normal"
            self._advance(MoveStatus.SUCCEEDED)
        else:
            self.move.evidence.append("The axes stand still, which proves nothing.")
            self._advance(MoveStatus.UNKNOWN, error)

    def _stopped(self) -> bool:
        """Whether a stop was sent since the move was admitted."""
        return self.robot.line.stop_epoch != self.epoch

    async def _read_position(self) -> None:
        with suppress(GatewayError):
            self.move.position = await self._position()

    def _misses(self) -> list[float] | None:
        """How far the axes stand from their targets; None where that is not known of all of them."""
        target, position = self.move.target_position, self.move.position
        if not target or position is None:
            return None
        misses = []
        for axis, wanted in target.items():
            found = position.get(axis)
            if wanted is None or found is None:
                return None
            misses.append(abs(wanted - found))
        return misses

    def _untouched(self) -> bool:
        """Whether a move that should have gone somewhere has not left its place."""
        has_length = self.move.target_position and self._off_target()
        return bool(has_length) and self.move.position == self.move.start_position

    def _forgot_its_origin(self) -> bool:
        """Whether an axis that knew its position does not any more, as after power-on."""
        before, now = self.move.start_position or {}, self.move.position or {}
        return any(place is not None and now.get(axis) is None for axis, place in before.items())

    def _on_target(self) -> bool:
        misses = self._misses()
        return misses is not None and max(misses) <= TOLERANCE

    def _off_target(self) -> bool:
        misses = self._misses()
        return misses is not None and max(misses) > TOLERANCE


def check(unit: RobotUnit, command: FicsCommand[Any]) -> None:
    """Refuse what the unit cannot do whatever its state.

    :raises InvalidRequest: no move, more axes than there are, no such axis, or a fraction of a pulse.
    """
    if type(command) not in _KINDS:
        raise InvalidRequest(f"{command.wire_name()} starts no move; nothing was sent.")
    names = unit.names(_coordinates_of(unit, command))
    if isinstance(command, StepAxis) and command.axis not in (*unit.axes, *unit.motor_axes):
        raise InvalidRequest(f"{unit.address} has no axis {command.axis}; nothing was sent.")
    if not isinstance(command, AxesMove):
        return
    if len(command.coordinates) > len(names):
        raise InvalidRequest(
            f"{unit.address} has the axes {', '.join(names)}, and {len(command.coordinates)} coordinates "
            "were given; nothing was sent."
        )
    for name, value in zip(names, command.coordinates, strict=False):
        if value is not None and not unit.system.can_hold(Quantity.POSITION, value):
            raise InvalidRequest(f"Axis {name}: pulses are whole, {value} is not; nothing was sent.")


def _coordinates_of(unit: RobotUnit, command: FicsCommand[Any]) -> Coordinates:
    """Which coordinates a command speaks in; a step in those its axis belongs to."""
    if isinstance(command, StepAxis):
        return "user" if command.axis in unit.axes else "motor"
    return "motor" if isinstance(command, MoveMotorsAbsolute | MoveMotorsRelative) else "user"


def _target_of(command: FicsCommand[Any], start: Places) -> Places | None:
    if not isinstance(command, AxesMove):
        return None
    relative = isinstance(command, MoveRelative | MoveMotorsRelative)
    target: Places = {}
    for (name, place), value in zip(start.items(), command.coordinates, strict=False):
        if value is not None:
            target[name] = value if not relative else None if place is None else place + value
    return target


def _publish(news: str, unit: RobotUnit, move: RobotMove) -> str:
    return unit.robot.publish_of(unit, f"robot.move.{news}", move.model_dump(mode="json"), move.id)


def describe(error: GatewayError) -> MoveError:
    """An error as it stands in a move."""
    code = error.fics_error if isinstance(error, RobotRefused | RobotFailed) else None
    return MoveError(
        type=error.kind,
        title=error.title,
        detail=error.detail,
        moved=error.moved,
        remedy=error.remedy,
        controller_error=code,
    )


def _gone(robot: Robot) -> MoveFailed:
    return MoveFailed(
        f"{robot.id} stopped answering in the middle of the move; it may still be moving.",
        "Check its power and cable, stop it, and home it again.",
    )


def _without_power(robot: Robot) -> MoveFailed:
    return MoveFailed(
        f"{robot.id} has lost its power in the middle of the move; the axes stand still.",
        "Set its speeds, acknowledge the power cycle, then home it.",
    )


def _lost_on_its_way(unit: RobotUnit, move: RobotMove) -> NotExecuted:
    return NotExecuted(
        f"{move.command} was sent to {unit.address} and not answered; the axes have not moved.",
        "Send it again if it is still wanted.",
    )


def _in_trouble(unit: RobotUnit) -> MoveFailed:
    return MoveFailed(
        f"An axis of {unit.address} reports an alarm; the axes stand still.",
        "Read the errors of the robot, remove the cause, then reset them.",
    )


def _missed(unit: RobotUnit, move: RobotMove) -> MoveFailed:
    return MoveFailed(
        f"{unit.address} stands at {move.position}, not at {move.target_position} as was asked.",
        "The command may have been garbled on the line: check the position before the next move.",
    )
