"""JOG with a dead-man: an axis moves only while a heartbeat comes twice a second."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from gateway.core.errors import ControllerRefused, GatewayError, NoReply
from gateway.core.jogs import (
    HEARTBEAT_S,
    KEPT,
    START_WITHIN_S,
    Jog,
    JogEnd,
    JogOutOfReach,
    JogOver,
    no_such_jog,
)
from gateway.core.lanes import Lane
from gateway.core.origin import Origin, acting, working
from gateway.core.own_faults import all_of, carry_on, insist, survived
from gateway.fics.axes import Places, at_rest, unit_of
from gateway.fics.errors import IN_MOTION, RobotBusy, UnitNotSelected, preparing
from gateway.fics.exchange import answered
from gateway.fics.motion_state import Tell
from gateway.fics.motions import Accepted, Motions
from gateway.fics.units import RobotUnit
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.status import AxisStatus
from protocols.fics.system import HostMode

STILL_WITHIN_S = 1.0
"""An axis that still moves after this time since the end of its JOG makes the whole robot stop; one that says
so has the time of its ramp."""
AFTER_RAMP_S = 0.5
"""So much later than its ramp can be over it is to be seen to stand still."""
RECHECK_S = 0.1
STILL_LOOKS = 2
"""An axis seen to stand still so often in turn jogs no more; a single look may come before it begins."""


class JogSession(Jog):
    """An axis that jogs, or has jogged."""

    unit: int
    axis: str
    direction: Literal["+", "-"]

    @property
    def what(self) -> str:
        """The axis in words."""
        return f"axis {self.axis} of unit {self.unit}"


@dataclass(eq=False)
class _Running:
    session: JogSession
    until: float
    """Deadline of the next heartbeat, on the event loop's clock."""
    alarm: asyncio.TimerHandle
    """Ends it, unless the next heartbeat comes first."""
    rest: "asyncio.Task[None] | None" = None
    """Ends it when the axis stands still without a stop."""


class Jogs:
    """The JOG sessions of a robot."""

    def __init__(
        self,
        units: Sequence[RobotUnit],
        motions: Motions,
        tell: Tell,
        stop_robot: Callable[[], Awaitable[object]],
    ) -> None:
        self._units = units
        self._motions = motions
        self._line, self._robot_id = motions.line, motions.commander.robot_id
        self._tell = tell
        self._stop_robot = stop_robot
        """Called when an axis does not stop."""
        self._running: dict[str, _Running] = {}
        self._unsettled: dict[str, JogSession] = {}
        """From before its start is sent until the axis is seen to stand still."""
        self._with_robot: list[JogSession] = []
        """Those whose standstill the stop of the whole robot sees to."""
        self._over: dict[str, JogSession] = {}
        self._stopping: dict[str, asyncio.Task[None]] = {}
        self._places: dict[tuple[int, str], Places] = {}
        """Where motors stood when it was last looked whether an axis of a unit stands still."""

    async def start(self, unit: int, axis: str, direction: Literal["+", "-"]) -> JogSession:
        """Start to jog an axis (C-HOST manual 2-2).

        :raises InvalidRequest: the unit has no such axis; nothing was sent.
        :raises RobotBusy: the axis was not seen to stand still since its last JOG; nothing was sent.
        :raises ControllerRefused: the robot refused; nothing moved.
        :raises NotSent: it was not sent; the error says why.
        :raises JogOver: it was stopped before it was answered.
        :raises NoReply: it was refused as in motion, and moves: it is being stopped.
        """
        self._line.require_fit()
        self._require_settled(unit, axis)
        loop = asyncio.get_running_loop()
        axes, command = unit_of(self._units, unit), StartJog(axis=axis, direction=direction)
        session, epoch = JogSession(unit=unit, axis=axis, direction=direction), self._line.stop_epoch
        self._unsettled[session.id] = session
        try:
            with preparing(self._robot_id, command), self._motions.sending(command, axes):
                accepted = await self._motions.begin(
                    command,
                    axes,
                    epoch=epoch,
                    expires_at=loop.time() + START_WITHIN_S,
                    on_written=lambda _: self._begun(session),
                )
        except BaseException:
            if not self._was_sent(session):
                self._settle(session)
            raise
        if not self._was_sent(session) and accepted.was_not_written():
            self._settle(session)
        elif not self._was_sent(session):  # a fault of the gateway itself has met it while it was written
            self._begun(session)
        await self._await_answer(session, command, accepted, epoch)
        return self._find(session.id).session

    def _require_settled(self, unit: int, axis: str) -> None:
        """Refuse to start an axis while the end of another JOG could stop it."""
        for other in self._unsettled_with(unit, axis):
            raise RobotBusy(
                f"The JOG of axis {other.axis} of unit {unit} of {self._robot_id} is not over: the axis was "
                "not seen to stand still since; nothing was sent.",
                "Try again when it stands still.",
            )

    def _begun(self, session: JogSession) -> None:
        """The axis may move from now on, answered or not."""
        self._running[session.id] = running = _Running(session, *self._await_heartbeat(session))
        with working("followers"):
            running.rest = asyncio.create_task(self._rests(session), name=f"JOG of {self._robot_id}")
        running.rest.add_done_callback(lambda task: None if task.cancelled() else self._rested(session))
        self._tell("robot.jog.started", session.model_dump())

    def _await_heartbeat(self, session: JogSession) -> tuple[float, asyncio.TimerHandle]:
        loop = asyncio.get_running_loop()
        until = loop.time() + HEARTBEAT_S
        return until, loop.call_at(until, insist, "the end of a JOG", partial(self._missed, session))

    async def _await_answer(
        self, session: JogSession, command: StartJog, accepted: Accepted, epoch: int
    ) -> None:
        """Wait for the answer, which comes at once; in Ver.2 there is only one where it was refused."""
        if self._line.mode == HostMode.VER_2 and not accepted.outcome.done():
            return
        try:
            answered(self._robot_id, command, await accepted.outcome)
        except GatewayError as error:
            if await self._may_have_run(error, session, epoch):
                if session.id in self._running:
                    self._stop_session(session, "ended")
                raise _perhaps_begun(self._robot_id, session) from error
            if session.id in self._running and error.moved == "no":
                self._leave(session, "ended")
                self._settle(session)
            elif session.id in self._running:
                self._stop_session(session, "ended")
            raise

    async def _may_have_run(self, error: GatewayError, session: JogSession, epoch: int) -> bool:
        """Whether it was refused as in motion, and its axis moves: by a first copy of a doubled start.

        An axis that was stopped meanwhile may stand still because of that.
        """
        if not isinstance(error, ControllerRefused) or error.error_code != IN_MOTION:
            return False
        still = await self._stands_still(session.unit, session.axis)
        was_stopped = session.id not in self._running or self._line.stop_epoch != epoch
        return was_stopped or not still

    def heartbeat(self, session_id: str) -> JogSession:
        """Keep an axis jogging for another half second.

        :raises NotFound: there was no such session.
        :raises JogOver: the axis is being stopped, or stands still.
        :raises JogOutOfReach: nobody can keep it, or stop it; the session is lost as if none had come.
        """
        self._line.admission.revise()
        self._end_overdue(session_id)
        running = self._find(session_id)
        if not self._line.online:
            raise JogOutOfReach(f"Robot {self._robot_id}", running.session.what)
        running.alarm.cancel()
        running.until, running.alarm = self._await_heartbeat(running.session)
        return running.session

    def _end_overdue(self, session_id: str) -> None:
        """After a time in which the loop was held, a heartbeat may be read before its alarm goes off."""
        running = self._running.get(session_id)
        if running is not None and asyncio.get_running_loop().time() >= running.until:
            self._stop_session(running.session, "lost")

    async def end(self, session_id: str) -> JogSession:
        """Stop an axis, and give its session when it stands still.

        Its state is `stopping` where that was not seen in time: then the whole robot is being stopped. One
        that is over already is given as it ended.

        :raises NotFound: there was no such session.
        """
        session = self._over.get(session_id) or self._find(session_id).session
        if session.id in self._running:
            self._stop_session(session, "ended")
        if session.id in self._unsettled:
            await asyncio.shield(self._stop_axis(session))
        return session

    async def stop(self, unit: int, axis: str) -> None:
        """Stop an axis until it stands still, with or without a session.

        :raises InvalidRequest: the unit has no such axis; nothing was sent.
        :raises UnitNotSelected: the robot would stop the axis of another unit; nothing was stopped.
        :raises RobotBusy: it was sent, and the axis was not seen to stand still in time.
        :raises GatewayError: it was not sent, or not answered; the error says which.
        """
        sessions = self._unsettled_with(unit, axis)
        if not all(map(self._was_sent, sessions)):
            self._line.begin_stop()  # a start that waits must not follow the stop
        sent = [session for session in sessions if self._was_sent(session)]
        running = [session for session in sent if session.id in self._running]
        all_of(partial(self._stop_session, session, "ended") for session in running)
        if sent:
            await asyncio.gather(*(asyncio.shield(self._stop_axis(it)) for it in sent))
            if any(session.state == "stopping" for session in sent):
                raise self._not_seen_still(unit, axis)
        else:
            await self._stop_unknown(unit, axis)

    async def _stop_unknown(self, unit: int, axis: str) -> None:
        """Stop an axis that has no session: the robot may jog it for an earlier life of the gateway."""
        line, command = self._line, StopJog(axis=axis)
        if self._motions.selection.unit == unit:
            outcome = await line.submit(line.exchange(command, Lane.STOP))
        else:
            async with line.sequence_lock.held(Lane.STOP):
                await self._select(unit, axis)
                outcome = await line.submit(line.exchange(command, Lane.STOP))
        answered(self._robot_id, command, outcome)
        loop = asyncio.get_running_loop()
        patient_until = loop.time() + STILL_WITHIN_S
        while not await self._stands_still(unit, axis):
            if loop.time() >= patient_until:
                raise self._not_seen_still(unit, axis)
            await asyncio.sleep(RECHECK_S)

    def _not_seen_still(self, unit: int, axis: str) -> RobotBusy:
        return RobotBusy(
            f"JOG {axis} was sent to unit {unit} of {self._robot_id}, but the axis was not seen to stand "
            "still.",
            "Stop the whole robot if it must not move.",
        )

    async def _select(self, unit: int, axis: str) -> None:
        try:
            await self._motions.selection.make(unit, afresh=False)  # in motion it does not tell
        except (RobotBusy, ControllerRefused, UnitNotSelected) as error:
            raise UnitNotSelected(
                f"Axis {axis} of unit {unit} was not stopped, for JOG {axis} might stop another unit's: "
                f"{error.detail}",
                "Stop the whole robot if it must not move.",
            ) from None

    def robot_stops(self) -> None:
        """The whole robot is being stopped, which sees to its standstill: no session goes on."""
        sessions = [running.session for running in self._running.values()]
        survived("the end of a JOG", *(partial(self._end, session, "stopped") for session in sessions))
        self._with_robot += [session for session in self._unsettled.values() if session.state == "stopping"]
        self._unsettled.clear()
        self._end_motion()

    def robot_stands_still(self) -> None:
        """The stop of the whole robot is confirmed."""
        sessions, self._with_robot = self._with_robot, []
        survived("the end of a JOG", *(partial(self._stands, session) for session in sessions))

    def end_all(self, state: Literal["lost", "stopped"]) -> None:
        """Stop every axis that jogs: no heartbeat counts any more."""
        sessions = [running.session for running in self._running.values()]
        all_of(partial(self._stop_session, session, state) for session in sessions)

    async def settled(self) -> None:
        """Wait until every axis whose JOG has ended stands still, or the robot is being stopped."""
        if self._stopping:
            await asyncio.wait(self._stopping.values())

    async def close(self) -> None:
        """Give up looking whether axes stand still."""
        self.end_all("stopped")
        tasks = list(self._stopping.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _find(self, session_id: str) -> _Running:
        if session_id in self._running:
            return self._running[session_id]
        if session_id in self._over:
            session = self._over[session_id]
            raise JogOver(session.what, session)
        raise no_such_jog(session_id)

    @acting(Origin("gateway: missing heartbeat"))
    def _missed(self, session: JogSession) -> None:
        if session.state in ("jogging", "stopping"):
            self._stop_session(session, "lost")

    def _stop_session(self, session: JogSession, ends_as: JogEnd) -> None:
        """Stop the axis, and only then see to what is told of it."""
        self._ends(session, ends_as)
        self._stop_axis(session)
        if session.id in self._running:
            self._end(session, ends_as)

    async def _rests(self, session: JogSession) -> None:
        """Return when the axis stands still though nobody has stopped it."""
        looks = 0
        while looks < STILL_LOOKS:
            await asyncio.sleep(self._motions.poll_interval_s)
            looks = looks + 1 if await self._stands_still(session.unit, session.axis) else 0

    def _rested(self, session: JogSession) -> None:
        if session.id in self._running:
            session.note_end("came to rest without a stop, as at a limit")
            self._stop_session(session, "ended")

    def _end(self, session: JogSession, ends_as: JogEnd) -> None:
        """Begin the end of a session that runs, which is done once: its axis may still move."""
        self._leave(session, ends_as)
        self._tell("robot.jog.stopping", session.model_dump())

    def _leave(self, session: JogSession, ends_as: JogEnd) -> None:
        running = self._running.pop(session.id)
        running.alarm.cancel()
        if running.rest is not None:
            running.rest.cancel()
        self._ends(session, ends_as)
        self._over[session.id] = session
        while len(self._over) > KEPT:
            del self._over[next(iter(self._over))]

    @staticmethod
    def _ends(session: JogSession, ends_as: JogEnd) -> None:
        if session.state == "jogging":
            session.state, session.ends_as = "stopping", ends_as

    def _stands(self, session: JogSession) -> None:
        """Its axis was seen to stand still, or has never moved: only now it is over."""
        if session.state == "stopping" and session.ends_as is not None:
            session.state = session.ends_as
            self._tell(f"robot.jog.{session.state}", session.model_dump())

    def _stop_axis(self, session: JogSession) -> "asyncio.Task[None]":
        """Stop the axis of a session that has ended; a second stop joins the first."""
        if session.id in self._stopping:
            return self._stopping[session.id]
        what = f"the end of a JOG of {self._robot_id}"
        with working("stops"):
            task = asyncio.create_task(carry_on(what, partial(self._see_still, session)), name=what)
        self._stopping[session.id] = task
        task.add_done_callback(lambda _: self._stopping.pop(session.id))
        survived(what, partial(self._send_stop, session))  # it is repeated
        return task

    def _send_stop(self, session: JogSession) -> None:
        line = self._line
        try:
            line.submit(line.exchange(StopJog(axis=session.axis), Lane.STOP))
        except GatewayError:
            return  # the line is down; it is seen below that the axis does not stand still

    async def _see_still(self, session: JogSession) -> None:
        """Repeat the end of the JOG until the axis stands still; stop the whole robot if it does not tell so.

        That stop is never given up.
        """
        try:
            began_at = asyncio.get_running_loop().time()
            async with asyncio.timeout(STILL_WITHIN_S) as patience:
                while session.id in self._unsettled:  # or else the stop of the whole robot sees to it
                    still = await self._stands_still(session.unit, session.axis)
                    if still:
                        self._settle(session)
                        return
                    patience.reschedule(began_at + self._patience_s(tells=still is not None))
                    await asyncio.sleep(RECHECK_S)
                    if session.id in self._unsettled:
                        self._send_stop(session)
        except TimeoutError:
            stop = self._stop_robot()
            self._tell("robot.jog.not_stopped", session.model_dump())
            await stop

    def _patience_s(self, *, tells: bool) -> float:
        """How long an axis may take to stand still; one that `tells` that it moves may be on its ramp."""
        ramp_s = self._motions.state.ramps.longest_s if tells else None
        return STILL_WITHIN_S if ramp_s is None else max(STILL_WITHIN_S, ramp_s + AFTER_RAMP_S)

    def _settle(self, session: JogSession) -> None:
        """The axis of a session stands still, or was never told to move."""
        self._unsettled.pop(session.id, None)
        survived("the end of a JOG", partial(self._stands, session))
        insist("the end of the motion of JOGs", self._end_motion)

    def _end_motion(self) -> None:
        """End the motion when the last axis stands still."""
        if not self._unsettled and self._motions.state.jogs:
            self._motions.end()

    def _was_sent(self, session: JogSession) -> bool:
        return session.id in self._running or session.state != "jogging"

    async def _stands_still(self, unit: int, axis: str) -> bool | None:
        """Whether an axis stands still; None where the robot did not tell."""
        jogged = unit_of(self._units, unit)
        try:
            axes = await jogged.status(Lane.VERIFY)  # no read of others wears out patience
            motors = {motor: axes[motor] for motor in self._motors(unit, axis)}
            if at_rest(motors.values()):
                return True
            alone = [it.axis for it in self._unsettled.values() if it.unit == unit] == [axis]
            return not alone and await self._stays(jogged, axis, motors)
        except GatewayError:
            return None

    async def _stays(self, unit: RobotUnit, axis: str, motors: Mapping[str, AxisStatus]) -> bool:
        """Whether an axis stands still while others of the unit jog: its motors are where they were before.

        Where their places are not known, only the second digit of ACD tells (C-HOST manual 2-10), if it does.
        """
        now = await unit.position("motor", Lane.VERIFY)
        before = self._places.get((unit.number, axis), {})
        self._places[unit.number, axis] = now
        if any(now[motor] is None for motor in motors):
            return not any(map(self._motions.commander.bits.may_move, motors.values()))
        return all(before.get(motor) == now[motor] for motor in motors)

    def _unsettled_with(self, unit: int, axis: str) -> list[JogSession]:
        """The sessions that share a motor with an axis."""
        motors = self._motors(unit, axis)
        sessions = [it for it in self._unsettled.values() if it.unit == unit]
        return [it for it in sessions if motors & self._motors(unit, it.axis)]

    def _motors(self, unit: int, axis: str) -> set[str]:
        """The motors that move an axis; all of them where nobody knows which.

        :raises InvalidRequest: the unit has no such axis.
        """
        axes = unit_of(self._units, unit)
        axes.require_axis(axis)
        return set(axes.motors_behind(axis) or axes.motor_axes)


def _perhaps_begun(robot_id: str, session: JogSession) -> NoReply:
    return NoReply(
        f"{robot_id} refused to jog {session.what} as in motion, and the axis moves, or was stopped before "
        "it could be asked: a first copy of the command has set it going, or something else has. The axis "
        "is being stopped.",
        "See that it stands still, then try again.",
    )
