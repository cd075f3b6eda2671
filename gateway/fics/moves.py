"""The moves of robots: started at most once each, remembered when they are over."""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from typing import Any

from gateway.core.errors import (
    Cancelled,
    ControllerRefused,
    Expired,
    GatewayError,
    NoReply,
    NotSent,
    PowerCycled,
    refused_in_motion,
    restarted_in_motion,
)
from gateway.core.events import Event
from gateway.core.exchange import Lane
from gateway.core.journal.intents import OF_MOVES
from gateway.core.move_record import RESTARTED, START_WITHIN_S, MoveStatus
from gateway.core.move_runs import MoveRuns, Silence, until_answered
from gateway.core.next_calls import NextCall
from gateway.core.origin import new_id, working
from gateway.core.preparation import in_time
from gateway.core.trajectories import Trajectories
from gateway.core.verdicts import (
    AXES,
    AtRest,
    Begun,
    Finding,
    Place,
    PowerCycle,
    Sight,
    Stop,
    Told,
    Unseen,
    judge,
)
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


class MoveRun:
    """One move on its way; `runs` write down how it goes."""

    def __init__(
        self,
        robot: Robot,
        unit: RobotUnit,
        command: FicsCommand[Any],
        move: RobotMove,
        runs: "MoveRuns[MoveRun, RobotMove]",
    ) -> None:
        self.robot, self.unit = robot, unit
        self._command = command
        self._move = move
        self._talk, self._line = robot.conversation, robot.line
        self._runs = runs
        self._epoch = self._line.stop_epoch
        self.begun: asyncio.Future[GatewayError | None] = asyncio.get_running_loop().create_future()
        """Known when the robot has taken the command, or why it has not."""
        self._stops_before = self._line.stops
        self._overdue_at: float | None = None
        self._left: int | None = None
        """`FicsLine.unheard` when a refusal was left unread, which a loss of power clears."""
        self._doubt: NoReply | None = None
        """The reason why it is not known if the command was executed."""
        self._power_kept = False
        """True if something proves that the robot has not lost its power on the way."""

    async def make(self, start_within_s: float) -> None:
        """Follow the move from the queue to its end."""
        OF_MOVES.set([self._move.id])
        expires_at = asyncio.get_running_loop().time() + start_within_s
        try:
            with (
                preparing(self._move.robot_id, self._command),
                self._talk.sending(self._command, self.unit),
            ):
                await in_time(expires_at, self._wait_to_know_the_way())
                accepted = await self._talk.begin(
                    self._command,
                    self.unit,
                    epoch=self._epoch,
                    expires_at=expires_at,
                    on_written=self._sent,
                )
        except GatewayError as error:
            self._never_begun(error)
            self._tell(error)
            return
        try:
            with working("followers"):
                await self._follow(accepted)
        finally:
            self._talk.end(accepted)
            self._tell(None)

    async def take_over(self) -> None:
        """Follow a move of an earlier life, whose answer will not come, by what the axes do."""
        self.robot.known.motion.begin(self._command, self.unit.number)
        self._tell(None)
        try:
            await self._resolve(restarted_in_motion(self._move.robot_id))
        finally:
            self._talk.end()

    def _end(self, finding: Finding, error: GatewayError | None = None, **more: Any) -> None:
        """End the move by what was found, unless it is over."""
        move, address = self._move, self.unit.address
        if move.status.final:
            return
        reply = "and answered" if move.completion == "reply" else "and not answered"
        words = AXES._replace(
            who=address,
            sending=f"{move.command} was sent to {address} {reply}",
            position=move.position,
            target=move.target_position,
        )
        self._runs.end(self, move, judge(finding, words._replace(**more), error))

    def _never_begun(self, error: GatewayError) -> None:
        if not self._move.status.final:
            self._runs.unbegun(self, self._move, error, refused=isinstance(error, ControllerRefused))

    def withdraw(self, why: str) -> None:
        """End the watch over the move: its command is not written any more."""
        cancelled = Cancelled(f"{why} Nothing was sent.", "Try again.")
        self._line.cancel(lambda exchange: exchange.lane is Lane.COMMAND, cancelled)
        if self.robot.known.motion.command is self._command:
            self._talk.end()

    def _tell(self, refusal: GatewayError | None) -> None:
        if not self.begun.done():
            self.begun.set_result(refusal)

    def _sent(self, now: float) -> None:
        if self._move.longest_s is not None:
            self._overdue_at = now + PATIENCE * self._move.longest_s + PATIENCE_S
        self._runs.advance(self, self._move, MoveStatus.SENT)

    # before

    async def _wait_to_know_the_way(self) -> None:
        """Know it, however long others have the robot: the caller of the move limits that."""
        while True:
            try:
                return await self._know_the_way()
            except Expired:
                continue

    async def _know_the_way(self) -> None:
        """Know where the axes stand and should come to: what the move needs, and what proves its end."""
        unit, move = self.unit, self._move
        try:
            start = await unit.position(move.coordinates, Lane.COMMAND)
            stored = await self._stored()
        except NoReply as error:
            raise NotSent(
                f"{unit.address} did not tell its position before the move; the move was not sent.",
                error.remedy,
            ) from None
        move.start_position = move.position = start
        if None in start.values():
            await self._talk.see_power()  # what has lost its power is not merely unhomed
        move.target_position = target_of(unit, self._command, start, stored)
        needed = places_it_needs(unit, self._command, start, move.target_position)
        if None in needed.values():
            await unit.require_places(needed, self._command)
        if move.target_position:
            target = move.target_position
            move.longest_s = await longest_move_s(unit, move.coordinates, start, target)

    async def _stored(self) -> list[float | None] | None:
        """The position it is to go to, if it goes by a number; the robot refuses one that is not set."""
        if not isinstance(self._command, MoveToPosition):
            return None
        return await self.unit.stored(self._command.position, Lane.COMMAND)

    # on the way

    async def _follow(self, accepted: Accepted) -> None:
        """Ask until the axes have come to rest, unless the robot says so first."""
        await self._leave_refusal()
        while not accepted.outcome.done():
            axes = await self._status()
            if axes is None:
                return
            if at_rest(axes) and await self._rests_without_answer(accepted):
                await self._infer(axes)
                return
            if self._move.status.final:
                return
            if not accepted.outcome.done():
                # Commands are taken in their order: with this answer a refusal would have come.
                self._moves()
            await asyncio.wait({accepted.outcome}, timeout=self.robot.poll_interval_s)
        await self._conclude(accepted.outcome.result())

    async def _leave_refusal(self) -> None:
        """In Ver.2, where no axis is homed, leave what a loss of power clears: nothing else tells of one."""
        if not REFUSAL_SHOWS_POWER or self._line.mode != HostMode.VER_2:
            return
        known = [place for place in (self._move.start_position or {}).values() if place is not None]
        if not known and not isinstance(self._command, HomeRobot):
            self._left = await self._talk.leave_refusal(VERIFY)

    def _moves(self) -> None:
        """The axes were seen to move."""
        if self._runs.seen_to_move(self, self._move):
            self._tell(None)
        now = asyncio.get_running_loop().time()
        if self._overdue_at is not None and now > self._overdue_at:
            self._overdue_at = None
            self._move.evidence.append("It takes longer than its distance and speed account for.")
            told = self._move.model_dump(include={"longest_s", "request_id"}) | {"move_id": self._move.id}
            self.robot.publish("robot.move.overdue", told, self.unit, self._move.id)

    async def _rests_without_answer(self, accepted: Accepted) -> bool:
        """True if the axes stand still for certain, and the answer, where there is one, stays away."""
        begins_late = self._move.status is MoveStatus.SENT  # as it may
        if begins_late or self._line.mode != HostMode.VER_2:
            await asyncio.wait({accepted.outcome}, timeout=ANSWER_AFTER_REST_S)
            if accepted.outcome.done():
                return False
        axes = await self._status()
        return axes is not None and at_rest(axes) and not accepted.outcome.done()

    async def _status(self) -> list[AxisStatus] | None:
        """Ask for the state of the axes; None when the move is lost, or they were out of reach for too long.

        After a loss of power they are asked, too: only what was seen is told of them.
        """
        line, power = self._line, self.robot.known.power
        longest_s = line.reply_timeout_s + line.late_reply_s + self.robot.poll_interval_s
        silence = Silence(asyncio.get_running_loop().time(), longest_s)

        def gives_up() -> bool:
            if power.cycled and silence.silent_s + silence.out_of_reach_s > line.late_reply_s:
                return True
            self._tell(None)  # its client need not wait longer
            return False

        axes = await until_answered(
            self._ask_status,
            silence,
            shows_silence=line.shows_silence,
            pause_s=self.robot.poll_interval_s,
            gives_up=gives_up,
        )
        if power.cycled:
            self._lose_sight(_seen(axes), happened=power.what_happened(), acknowledge=ACKNOWLEDGE)
            return None
        if axes is None:
            sight = Sight.SILENT if silence.of_body else Sight.OUT_OF_REACH
            begun = Begun.SEEN if self._doubt is None else Begun.IN_DOUBT
            self._lose_sight(Unseen(sight, begun=begun), who=self._move.robot_id, unheard=silence.told)
        return axes

    async def _ask_status(self) -> list[AxisStatus]:
        return list((await self.unit.status(VERIFY)).values())

    async def _come_to_rest(self) -> list[AxisStatus] | None:
        """Wait until the axes stand still, and give what they tell; None when the move is lost."""
        axes = await self._status()
        while axes is not None and not at_rest(axes):
            self._moves()
            await asyncio.sleep(self.robot.poll_interval_s)
            axes = await self._status()
        return axes

    def _lose_sight(self, finding: Finding, **more: Any) -> None:
        if not self._move.status.final:
            self._move.position = None
        self._end(finding, self._doubt, **more)

    # the end

    async def _conclude(self, outcome: Outcome) -> None:
        """End the move by its answer, or without one."""
        if isinstance(outcome, FicsRefusal):
            await self._rejected(outcome.error)
        elif isinstance(outcome, RobotAnswered | SystemFailure):
            self._move.completion = "reply"
            if await self._come_to_rest():
                await (self._failed(outcome.error) if isinstance(outcome, SystemFailure) else self._ended())
        elif isinstance(outcome, NoReply):
            await self._outlive(outcome)
        else:
            self._never_begun(outcome)
            self._tell(outcome)

    async def _rejected(self, error: str) -> None:
        """It was refused; axes that have moved although their unit could be selected contradict that.

        A line that has doubled the command had them set going by the first copy.
        """
        axes = await self._status() if error == IN_MOTION else []
        if axes is None:
            return
        if error != IN_MOTION or (at_rest(axes) and await self._stands_as_before()):
            refusal = await self._refusal(error)
            self._never_begun(refusal)
            self._tell(refusal)
            return
        self._move.evidence.append(
            f"It refused {self._move.command} as in motion ({error}), and had stood still: the line has "
            "doubled the command, or something else moves the axes."
        )
        await self._resolve(refused_in_motion(self.unit.address, self._move.command))

    async def _stands_as_before(self) -> bool:
        """True if axes at rest have not been elsewhere: a stop may have brought them to rest."""
        if self._stopped():
            return False
        await self._read_position()
        return self._move.position is not None and not self._places().ran()

    async def _refusal(self, error: str) -> ControllerRefused:
        """As the robot tells it; that an axis is not homed it does not tell."""
        move, target = self._move, self._move.target_position or {}
        unknown = {name: None for name in target if (move.start_position or {}).get(name) is None}
        if error == CANNOT_BE_CARRIED_OUT:
            for axis, reason in (await self.unit.why_unknown(unknown)).items():
                if reason == "not_homed":
                    return RefusedUnhomed(move.robot_id, self._command, axis)
        return refused(move.robot_id, self._command, error)

    async def _infer(self, axes: list[AxisStatus]) -> None:
        """The axes stand still, and nothing more will be said about it."""
        self._move.completion = "inferred"
        self._move.evidence.append("The axes were seen to stand still twice (ACD).")
        if self._line.mode != HostMode.VER_2:
            self._move.evidence.append("The answer of the robot stayed away.")
        if await self._lost_power():
            return
        told = await self._talk.poll_error()
        if self._left == self._line.unheard and told in OF_AN_END_IN_VAIN:
            self._power_kept = True
            self._move.evidence.append(
                f"The refusal {told} was left unread, and no loss of power has cleared it."
            )
        await self._read_position()
        if self._stopped():
            await self._ended()
        else:
            await self._weigh(axes)

    async def _lost_power(self) -> bool:
        """True if the move is lost with the power; the robot may prove that it was kept."""
        try:
            self._power_kept = await self._talk.see_power(self.unit)
        except PowerCycled:
            await self._status()  # it is lost with that
            return True
        except GatewayError as unseen:
            self._move.evidence.append(unseen.detail)
        return False

    async def _weigh(self, axes: list[AxisStatus]) -> None:
        """Judge the end of axes that no stop has stopped, by what they tell."""
        error = self.robot.known.error.latched
        if error is not None:
            await self._failed(error.code or "999", looked=True)
        elif any(map(in_trouble, axes)):
            self._end(AtRest(Told.ALARM))
        elif self._places().place() is Place.START:
            self._end(AtRest(begun=Begun.UNREFUSED, place=Place.START))
        else:
            await self._ended()

    async def _ended(self) -> None:
        """It has ended without an error, perhaps by a stop."""
        await self._read_position()
        places, stopped = self._places(), self._stopped()
        place = places.place()
        if place is Place.UNKNOWN and not stopped and places.ran_its_course():
            place = Place.WITHOUT_TARGET if await self._has_kept_power(places) else place
        if place is Place.TARGET and self._move.completion == "inferred":
            self._move.evidence.append(AT_TARGET)
        stop = Stop.SENT if stopped else Stop.NONE
        self._end(AtRest(stop=stop, begun=places.begun(), place=place))

    async def _failed(self, code: str, *, looked: bool = False) -> None:
        """It has ended with an error of the system: that of a stop, or another."""
        await self._read_position()
        if not looked:
            await self._talk.poll_error()
        text = self.robot.known.error.details_of(code)
        failure = RobotFailed(self._move.robot_id, self._move.command, code, text)
        if self._places().stayed():
            failure.moved = "no"
        stop = Stop.SENT if self._stopped() else Stop.NONE
        self._end(AtRest(Told.ERROR, stop=stop), failure, cause=f"error_{code}")

    async def _outlive(self, error: NoReply) -> None:
        """Its answer will not come: a move that was seen to run is followed to its end, as in Ver.2."""
        if self._move.status is not MoveStatus.MOVING:
            await self._resolve(error)
        elif await self._come_to_rest() and (axes := await self._come_to_rest()):
            await self._infer(axes)

    async def _resolve(self, error: NoReply) -> None:
        """Judge a move that was not seen to begin by the axes, where they can prove it."""
        self._doubt = error
        if not await self._come_to_rest() or await self._lost_power():
            return
        self._move.completion = "inferred"
        await self._read_position()
        place = Place.TARGET if self._places().place() is Place.TARGET else Place.UNKNOWN
        if place is Place.TARGET:
            self._move.evidence.append(AT_TARGET)
        self._end(AtRest(begun=Begun.IN_DOUBT, place=place), error)

    # what positions prove

    async def _read_position(self) -> None:
        """A place that cannot be read is not known: the one before proves nothing."""
        self._move.position = None
        with suppress(GatewayError):
            self._move.position = await self.unit.position(self._move.coordinates, VERIFY)

    def _stopped(self) -> bool:
        """True if a stop was sent since the move was admitted."""
        return self._line.stops != self._stops_before

    def _places(self) -> PlaceProof:
        move = self._move
        return PlaceProof(
            command=self._command,
            start=move.start_position or {},
            target=move.target_position,
            position=move.position,
            moved=move.status is MoveStatus.MOVING,
            replied=move.completion == "reply",
        )

    async def _has_kept_power(self, places: PlaceProof) -> bool:
        """True if that is proved: by the mode, by what was left unread, or by places."""
        if not self._power_kept and self._line.mode != HostMode.VER_2:
            await self._lost_power()
            return self._power_kept
        return self._power_kept or places.shows_power()


def _seen(axes: list[AxisStatus] | None) -> PowerCycle:
    if axes is None:
        return PowerCycle.UNTOLD
    return PowerCycle.STANDS if at_rest(axes) else PowerCycle.MOVES


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
