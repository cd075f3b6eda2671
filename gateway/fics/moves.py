"""The moves of robots: started at most once each, remembered when they are over."""

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from typing import Any, NamedTuple

from gateway.core.errors import (
    Cancelled,
    ControllerRefused,
    Expired,
    GatewayError,
    NoReply,
    NotSent,
    PowerCycled,
)
from gateway.core.exchange import Lane
from gateway.core.move_record import RESTARTED, START_WITHIN_S, MoveStatus
from gateway.core.move_runs import Found, Motion, MoveRun, MoveRuns, found
from gateway.core.next_calls import NextCall
from gateway.core.origin import new_id
from gateway.core.supervisor import Deed
from gateway.core.verdicts import AXES, AtRest, Begun, Place, PowerCycle, Stop, Told, VerdictWords
from gateway.fics.axes import at_rest, in_trouble
from gateway.fics.calls import calls_for_robot
from gateway.fics.conversation import Accepted
from gateway.fics.errors import (
    CANNOT_BE_CARRIED_OUT,
    IN_MOTION,
    RefusedUnhomed,
    RobotBusy,
    RobotFailed,
    preparing,
    refused,
)
from gateway.fics.exchange import Outcome, RobotAnswered
from gateway.fics.line import FicsLine
from gateway.fics.move_record import KINDS, RobotMove, check
from gateway.fics.plans import PATIENCE, PATIENCE_S, RobotTrajectory, longest_move_s
from gateway.fics.power import ACKNOWLEDGE
from gateway.fics.robot import Robot
from gateway.fics.session import OF_AN_END_IN_VAIN
from gateway.fics.settings import name_limits
from gateway.fics.targets import PlaceProof, end_of, places_it_needs, target_of
from gateway.fics.units import RobotUnit
from protocols.fics.commands import read
from protocols.fics.homing import HomeRobot
from protocols.fics.link import FicsRefusal, SystemFailure
from protocols.fics.moves import MoveToPosition
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisStatus
from protocols.fics.system import HostMode

REFUSAL_SHOWS_POWER = True
"""Only ERR and a loss of power clear the last refusal: an assumption.

Without it, a robot in Ver.2 that is not homed does not show whether it kept its power.
"""
ANSWER_AFTER_REST_S = 0.5
"""An answer that comes later than this after standstill is taken for lost."""
VERIFY = Lane.VERIFY
"""The lane of the proof of a move's end, which goes before all that clients want of the robot."""

AT_TARGET = "The axes stand at the target."


class AxesSeen(NamedTuple):
    """The axes of a unit, as they told."""

    axes: Sequence[AxisStatus]
    runs: bool
    """True while neither standstill is certain nor the robot has answered."""


class RobotRun(MoveRun[RobotMove, AxesSeen]):
    """A move of a unit."""

    controller = "the robot"
    _sight_acknowledges = True  # in Ver.2 nothing else does
    line: FicsLine

    def __init__(
        self, moves: "RobotMoves", robot: Robot, unit: RobotUnit, command: FicsCommand[Any], move: RobotMove
    ) -> None:
        super().__init__(moves, move, unit, robot.line, robot.id, robot.poll_interval_s)
        self.robot, self.unit, self.command = robot, unit, command
        self.tell: Callable[[GatewayError | None], object] = lambda _: None
        """Tells the caller that the robot has taken the command, or why it has not."""
        self._accepted: Accepted | None = None
        self._answer: asyncio.Future[Outcome] | None = None
        """The outcome of the command, while it may still come."""
        self._refusal: GatewayError | None = None
        self._stops_before = self.line.stops
        self._overdue_at: float | None = None
        self._left: int | None = None
        """`FicsLine.unheard` when a refusal was left unread, which a loss of power clears."""
        self._power_kept = False
        """True if something proves that the robot has not lost its power on the way."""
        self._cycle = PowerCycle.UNTOLD
        """The motion that was seen after the robot told of a loss of power."""

    # the unit

    def _calls(self, error: GatewayError, /) -> Sequence[NextCall]:
        return calls_for_robot(error, self.robot.id, self.line.id, self.unit.number)

    def _free(self) -> tuple[Deed, ...]:
        return *super()._free(), partial(self._moves.on_trajectory, self.unit)

    def _was_sent(self) -> None:
        now, move = asyncio.get_running_loop().time(), self.move
        if move.longest_s is not None:
            self._overdue_at = now + PATIENCE * move.longest_s + PATIENCE_S
        self.unit.trajectory = RobotTrajectory(self.unit, move, move.sent_at or datetime.now(UTC), now)
        self._moves.trajectories.begin(move.id, self.unit.trajectory)
        self._moves.on_trajectory(self.unit)

    def _lose(self, why: str, /) -> None:
        cancelled = Cancelled(f"{why} Nothing was sent.", "Try again.")
        self.line.cancel(lambda exchange: exchange.lane is Lane.COMMAND, cancelled)
        if self.robot.known.motion.command is self.command:
            self.robot.conversation.end()

    def _words(self) -> VerdictWords:
        move, address = self.move, self.unit.address
        reply = "and answered" if move.completion == "reply" else "and not answered"
        sending = f"{move.command} was sent to {address} {reply}"
        return AXES._replace(
            who=address, sending=sending, position=move.position, target=move.target_position
        )

    # on the way

    def accept(self, accepted: Accepted) -> None:
        """Take the command that was written, whose answer is to come."""
        self._accepted, self._answer = accepted, accepted.outcome

    async def follow(self, doubt: NoReply | None = None) -> None:
        """Look until the axes rest, unless the robot says so first."""
        motion = self.robot.known.motion
        try:
            if self._accepted is None:  # an earlier life has written it, and its answer will not come
                motion.begin(self.command, self.unit.number)
            else:
                await self._leave_refusal()
            await super().follow(doubt)
        finally:
            self.robot.conversation.end(self._accepted)
            self.tell(self._refusal)

    async def _leave_refusal(self) -> None:
        """In Ver.2, where no axis is homed, leave what a loss of power clears: nothing else tells of one."""
        if not REFUSAL_SHOWS_POWER or self.line.mode != HostMode.VER_2:
            return
        known = [place for place in (self.move.start_position or {}).values() if place is not None]
        if not known and not isinstance(self.command, HomeRobot):
            self._left = await self.robot.conversation.leave_refusal(VERIFY)

    async def _look(self) -> AxesSeen | None:
        """Ask for the state of the axes, twice where they rest, unless the robot has answered."""
        if self._is_answered():
            return AxesSeen((), runs=False)
        axes = await self._axes()
        if axes is None or self._answer is None:
            return None if axes is None else AxesSeen(axes, not at_rest(axes))
        rests = at_rest(axes)
        if rests and not await self._answers_late(self._answer):
            again = await self._axes()
            if again is None:
                return None
            rests = at_rest(again)
        return AxesSeen(axes, runs=not (rests or self._is_answered()))

    def _is_answered(self) -> bool:
        return self._answer is not None and self._answer.done()

    async def _answers_late(self, answer: "asyncio.Future[Outcome]") -> bool:
        """True if the answer comes after the standstill."""
        begins_late = self.move.status is MoveStatus.SENT  # as it may
        if begins_late or self.line.mode != HostMode.VER_2:
            await asyncio.wait({answer}, timeout=ANSWER_AFTER_REST_S)
        return answer.done()

    async def _pause(self) -> None:
        self.tell(None)  # the axes were seen to move
        self._note_overdue()
        if self._answer is None:
            await super()._pause()
        else:
            # Commands are taken in their order: with the answer of the axes a refusal would have come.
            await asyncio.wait({self._answer}, timeout=self._every_s)

    def _note_overdue(self) -> None:
        move = self.move
        if self._overdue_at is not None and asyncio.get_running_loop().time() > self._overdue_at:
            self._overdue_at = None
            move.evidence.append("It takes longer than its distance and speed account for.")
            told = move.model_dump(include={"longest_s", "request_id"}) | {"move_id": move.id}
            self.robot.publish("robot.move.overdue", told, self.unit, move.id)

    async def _axes(self) -> list[AxisStatus] | None:
        """Ask for the state of the axes; None when the move is lost, or they were out of reach for too long.

        After a loss of power they are asked, too: only what was seen is told of them.
        """
        told = await self._answer_to(partial(self.unit.status, VERIFY))
        axes = None if told is None else list(told.values())
        if self.robot.known.power.cycled:
            self._cycle = _seen(axes)
            return None
        return axes

    def _gives_up(self) -> bool:
        unheard_s = self._silence.silent_s + self._silence.out_of_reach_s
        if self.robot.known.power.cycled and unheard_s > self.line.late_reply_s:
            return True
        self.tell(None)  # its client need not wait longer
        return False

    def _unseen(self) -> Found:
        self.move.position, power = None, self.robot.known.power
        if not power.cycled:
            return super()._unseen()
        return found(self._cycle, self._doubt, happened=power.what_happened(), acknowledge=ACKNOWLEDGE)

    # the end

    async def _finding(self, seen: AxesSeen, /) -> Found:
        """Take the robot's answer, or what the axes tell without one."""
        answer, self._answer = self._answer, None
        if answer is not None and answer.done():
            return await self._conclude(answer.result())
        return await self._infer(seen.axes)

    async def _conclude(self, outcome: Outcome) -> Found:
        if isinstance(outcome, FicsRefusal):
            return await self._rejected(outcome.error)
        if isinstance(outcome, RobotAnswered | SystemFailure):
            self.move.completion = "reply"
            if await self._come_to_rest() is None:
                return self._unseen()
            return await (
                self._failed(outcome.error) if isinstance(outcome, SystemFailure) else self._ended()
            )
        if isinstance(outcome, NoReply):
            return await self._outlive(outcome)
        self._refusal = outcome
        return self._unbegun(outcome)

    async def _rejected(self, error: str) -> Found:
        """It was refused; axes that have moved although their unit could be selected contradict that.

        A line that has doubled the command had them set going by the first copy.
        """
        axes = await self._axes() if error == IN_MOTION else []
        if axes is None:
            return self._unseen()
        if error != IN_MOTION or (at_rest(axes) and await self._stands_as_before()):
            self._refusal = await self._refusal_of(error)
            return self._unbegun(self._refusal)
        return await self._resolve(self._executed_after_all(error, "axes"))

    async def _stands_as_before(self) -> bool:
        """True if axes at rest have not been elsewhere: a stop may have brought them to rest."""
        if self._stopped():
            return False
        await self._read_position()
        return self.move.position is not None and not self._places().ran()

    async def _refusal_of(self, error: str) -> ControllerRefused:
        """As the robot tells it; that an axis is not homed it does not tell."""
        move, target = self.move, self.move.target_position or {}
        unknown = {name: None for name in target if (move.start_position or {}).get(name) is None}
        if error == CANNOT_BE_CARRIED_OUT:
            for axis, reason in (await self.unit.why_unknown(unknown)).items():
                if reason == "not_homed":
                    return RefusedUnhomed(move.robot_id, self.command, axis)
        return refused(move.robot_id, self.command, error)

    async def _infer(self, axes: Sequence[AxisStatus]) -> Found:
        """The axes stand still, and nothing more will be said about it."""
        self.move.completion = "inferred"
        self.move.evidence.append("The axes were seen to stand still twice (ACD).")
        if self.line.mode != HostMode.VER_2:
            self.move.evidence.append("The answer of the robot stayed away.")
        if await self._lost_power():
            return self._unseen()
        told = await self.robot.conversation.poll_error()
        if self._left == self.line.unheard and told in OF_AN_END_IN_VAIN:
            self._power_kept = True
            self.move.evidence.append(
                f"The refusal {told} was left unread, and no loss of power has cleared it."
            )
        await self._read_position()
        return await (self._ended() if self._stopped() else self._weigh(axes))

    async def _lost_power(self) -> bool:
        """True if the move is lost with the power; the robot may prove that it was kept."""
        try:
            self._power_kept = await self.robot.conversation.see_power(self.unit)
        except PowerCycled:
            await self._axes()  # it is lost with that
            return True
        except GatewayError as unseen:
            self.move.evidence.append(unseen.detail)
        return False

    async def _weigh(self, axes: Sequence[AxisStatus]) -> Found:
        """Take the end of axes that no stop has stopped, by what they tell."""
        error = self.robot.known.error.latched
        if error is not None:
            return await self._failed(error.code or "999", looked=True)
        if any(map(in_trouble, axes)):
            return found(AtRest(Told.ALARM))
        if self._places().place() is Place.START:
            return found(AtRest(begun=Begun.UNREFUSED, place=Place.START))
        return await self._ended()

    async def _ended(self) -> Found:
        """It has ended without an error, perhaps by a stop."""
        await self._read_position()
        places, stopped = self._places(), self._stopped()
        place = places.place()
        if place is Place.UNKNOWN and not stopped and places.ran_its_course():
            kept = await self._has_kept_power(places)
            if kept is None:
                return self._unseen()
            place = Place.WITHOUT_TARGET if kept else place
        if place is Place.TARGET and self.move.completion == "inferred":
            self.move.evidence.append(AT_TARGET)
        stop = Stop.SENT if stopped else Stop.NONE
        return found(AtRest(stop=stop, begun=places.begun(), place=place))

    async def _failed(self, code: str, *, looked: bool = False) -> Found:
        """It has ended with an error of the system: that of a stop, or another."""
        await self._read_position()
        if not looked:
            await self.robot.conversation.poll_error()
        text = self.robot.known.error.details_of(code)
        failure = RobotFailed(self.move.robot_id, self.move.command, code, text)
        if self._places().stayed():
            failure.moved = "no"
        stop = Stop.SENT if self._stopped() else Stop.NONE
        return found(AtRest(Told.ERROR, stop=stop), failure, cause=f"error_{code}")

    async def _outlive(self, error: NoReply) -> Found:
        """Its answer will not come: a move that was seen to run is followed to its end, as in Ver.2."""
        if self.move.status is not MoveStatus.MOVING:
            return await self._resolve(error)
        rested = await self._come_to_rest() and await self._come_to_rest()
        return await self._infer(rested.axes) if rested else self._unseen()

    async def _resolve(self, doubt: NoReply, /) -> Found:
        """Take what axes prove of a move that was not seen to begin."""
        self._doubt = doubt
        if await self._come_to_rest() is None or await self._lost_power():
            return self._unseen()
        self.move.completion = "inferred"
        await self._read_position()
        place = Place.TARGET if self._places().place() is Place.TARGET else Place.UNKNOWN
        if place is Place.TARGET:
            self.move.evidence.append(AT_TARGET)
        return found(AtRest(begun=Begun.IN_DOUBT, place=place), doubt)

    # what positions prove

    async def _read_position(self) -> None:
        """A place that cannot be read is not known: the one before proves nothing."""
        self.move.position = None
        with suppress(GatewayError):
            self.move.position = await self.unit.position(self.move.coordinates, VERIFY)

    def _stopped(self) -> bool:
        """True if a stop was sent since the move was admitted."""
        return self.line.stops != self._stops_before

    def _places(self) -> PlaceProof:
        move = self.move
        return PlaceProof(
            command=self.command,
            start=move.start_position or {},
            target=move.target_position,
            position=move.position,
            moved=move.status is MoveStatus.MOVING,
            replied=move.completion == "reply",
        )

    async def _has_kept_power(self, places: PlaceProof) -> bool | None:
        """True if that is proved: by the mode, by what was left unread, or by places; None if it was lost."""
        if self._power_kept or self.line.mode == HostMode.VER_2:
            return self._power_kept or places.shows_power()
        return None if await self._lost_power() else self._power_kept


def _seen(axes: list[AxisStatus] | None) -> PowerCycle:
    if axes is None:
        return PowerCycle.UNTOLD
    return PowerCycle.STANDS if at_rest(axes) else PowerCycle.MOVES


@dataclass(eq=False)
class RobotMotion(Motion[RobotRun, None]):
    """A motion command of a unit."""

    _waits_for = "robot"

    epoch: int
    """The stop epoch at admission."""

    @asynccontextmanager
    async def _held(self, _expires_at: float) -> AsyncIterator[None]:
        [run] = self.runs
        with preparing(run.who, run.command), run.robot.conversation.sending(run.command, run.unit):
            yield

    async def _prepare(self) -> None:
        """Know the way, however long others have the robot: the caller of the move limits that."""
        while True:
            try:
                return await self._know_the_way()
            except Expired:
                continue

    async def _know_the_way(self) -> None:
        """Know where the axes stand and should come to: what the move needs, and what proves its end."""
        [run] = self.runs
        unit, move, command = run.unit, run.move, run.command
        try:
            start = await unit.position(move.coordinates, Lane.COMMAND)
            stored = await _stored(unit, command)
        except NoReply as error:
            raise NotSent(
                f"{unit.address} did not tell its position before the move; the move was not sent.",
                error.remedy,
            ) from None
        move.start_position = move.position = start
        if None in start.values():
            await run.robot.conversation.see_power()  # what has lost its power is not merely unhomed
        move.target_position = target_of(unit, command, start, stored)
        needed = places_it_needs(unit, command, start, move.target_position)
        if None in needed.values():
            await unit.require_places(needed, command)
        if move.target_position:
            move.longest_s = await longest_move_s(unit, move.coordinates, start, move.target_position)

    async def _write(self, _: None, expires_at: float) -> Mapping[RobotRun, object]:
        """Write the command once all that it depends on is proved; the robot answers on the way."""
        [run] = self.runs
        run.accept(
            await run.robot.conversation.begin(
                run.command,
                run.unit,
                epoch=self.epoch,
                expires_at=expires_at,
                on_written=self.was_written,
            )
        )
        return {}


class RobotMoves(MoveRuns[RobotMove]):
    """All moves of all robots."""

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
        run = RobotRun(self, robot, unit, command, move)
        motion = RobotMotion([run], robot.line.stop_epoch)
        run.tell = motion.answer
        try:
            await self._begin(motion, start_within_s)
        except GatewayError as refusal:
            end = end_of(unit, command, move.start_position or {}, move.target_position)
            await name_limits(unit, move.coordinates, end, refusal)
            raise
        return move

    def take_over(self, robot: Robot, move: RobotMove, *, begun: bool, since: str = RESTARTED) -> None:
        """Go on with a move of an earlier life: ask the robot, and follow the move to its end."""
        run = RobotRun(self, robot, robot.unit(move.unit), _command_of(move), move)
        self._go_on(run, since, begun=begun)


async def _stored(unit: RobotUnit, command: FicsCommand[Any]) -> list[float | None] | None:
    """The position that a command goes to by a number, if it does; the robot refuses one that is not set."""
    return await unit.stored(command.position, Lane.COMMAND) if isinstance(command, MoveToPosition) else None


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
