"""JOG with a dead-man: an axis moves only while a heartbeat comes twice a second."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Literal

from gateway.core.errors import ControllerRefused, GatewayError, NoReply
from gateway.core.exchange import Lane
from gateway.core.jogs import START_WITHIN_S, Jog, Jogging, JogNews, JogOutOfReach, JogOver, Jogs
from gateway.core.supervisor import insist
from gateway.fics.axes import Places, Tell, at_rest, unit_of
from gateway.fics.conversation import Accepted, Conversation
from gateway.fics.errors import IN_MOTION, RobotBusy, UnitNotSelected, answered, preparing
from gateway.fics.units import RobotUnit
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.status import AxisStatus
from protocols.fics.system import HostMode

STILL_WITHIN_S = 1.0
"""An axis that still moves after this time since the end of its JOG makes the whole robot stop; one that says
so has the time of its ramp."""
AFTER_RAMP_S = 0.5
"""Patience after the longest ramp until the axis is seen to stand still, in seconds."""
RECHECK_S = 0.1
STILL_LOOKS = 2
"""Looks in turn at an axis that stands still until it jogs no more; a single look may come too early."""


class JogSession(Jog):
    """An axis that jogs, or has jogged."""

    unit: int
    axis: str
    direction: Literal["+", "-"]

    @property
    def what(self) -> str:
        """The axis in words."""
        return f"axis {self.axis} of unit {self.unit}"


_Session = Jogging[JogSession, None]


class RobotJogs(Jogs[JogSession, None]):
    """The JOG sessions of a robot."""

    def __init__(
        self,
        units: Sequence[RobotUnit],
        conversation: Conversation,
        tell: Tell,
        stop_robot: Callable[[], Awaitable[object]],
        poll_interval_s: float,
    ) -> None:
        super().__init__(lambda news, session: tell(f"robot.jog.{news}", session.jog.model_dump()))
        self._units = units
        self._conversation, self._known = conversation, conversation.known
        self._line, self._robot_id = conversation.line, conversation.robot_id
        self._poll_interval_s = poll_interval_s
        self._tell = tell
        self._stop_robot = stop_robot
        """Called when an axis does not stop."""
        self._unsettled: list[_Session] = []
        """Jogs, from before the start is sent until the axis stands still or the robot is stopped."""
        self._places: dict[tuple[int, str], Places] = {}
        """Places of motors at the last look whether an axis of a unit stands still."""

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
        for other in self._unsettled_with(unit, axis):  # whose end could stop it
            raise RobotBusy(
                f"The JOG of {other.what} of {self._robot_id} is not over: the axis was not seen to stand "
                "still since; nothing was sent.",
                "Try again when it stands still.",
            )
        loop = asyncio.get_running_loop()
        axes, command = unit_of(self._units, unit), StartJog(axis=axis, direction=direction)
        jog, epoch = JogSession(unit=unit, axis=axis, direction=direction), self._line.stop_epoch
        session = Jogging(jog, jog.what, self._line, None)
        self._unsettled.append(session)
        accepted: Accepted | None = None
        try:
            with preparing(self._robot_id, command), self._conversation.sending(command, axes):
                accepted = await self._conversation.begin(
                    command,
                    axes,
                    epoch=epoch,
                    expires_at=loop.time() + START_WITHIN_S,
                    on_written=lambda _: self._begin(session),
                )
        finally:
            unwritten = accepted is None or accepted.was_not_written()
            if unwritten and not self._was_sent(session):
                insist("the end of a JOG", partial(self._settled, session))
        if not (unwritten or self._was_sent(session)):  # a fault of our own has met it while it was written
            self._begin(session)
        await self._await_answer(session, command, accepted, epoch)
        if not session.jogs:
            raise JogOver(jog.what, jog)
        return jog

    async def _await_answer(
        self, session: _Session, command: StartJog, accepted: Accepted, epoch: int
    ) -> None:
        """Wait for the answer, which comes at once; in Ver.2 there is only one where it was refused."""
        if self._line.mode == HostMode.VER_2 and not accepted.outcome.done():
            return
        try:
            answered(self._robot_id, command, await accepted.outcome)
        except GatewayError as error:
            ran = await self._may_have_run(error, session, epoch)
            if self._was_sent(session):
                self._take(session, JogNews.END if ran or error.moved != "no" else JogNews.REFUSED)
            if ran:
                raise _perhaps_begun(self._robot_id, session.jog) from error
            raise

    async def _may_have_run(self, error: GatewayError, session: _Session, epoch: int) -> bool:
        """True if it was refused as in motion, and its axis moves: by a first copy of a doubled start.

        An axis that was stopped meanwhile may stand still because of that.
        """
        if not isinstance(error, ControllerRefused) or error.error_code != IN_MOTION:
            return False
        still = await self._stands_still(session.jog.unit, session.jog.axis)
        was_stopped = not session.jogs or self._line.stop_epoch != epoch
        return was_stopped or not still

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
        self.take_all(JogNews.END, sent)
        if sent:
            await asyncio.wait([session.end for session in sent if session.end is not None])
            if any(session.jog.state == "stopping" for session in sent):
                raise self._not_seen_still(unit, axis)
        else:
            await self._stop_unknown(unit, axis)

    async def _stop_unknown(self, unit: int, axis: str) -> None:
        """Stop an axis that has no session: the robot may jog it for an earlier life of the gateway."""
        line, command = self._line, StopJog(axis=axis)
        if self._known.unit.number == unit:
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
            await self._conversation.select(unit, afresh=False)  # in motion it does not tell
        except (RobotBusy, ControllerRefused, UnitNotSelected) as error:
            raise UnitNotSelected(
                f"Axis {axis} of unit {unit} was not stopped, for JOG {axis} might stop another unit's: "
                f"{error.detail}",
                "Stop the whole robot if it must not move.",
            ) from None

    def robot_stops(self) -> None:
        """The whole robot is being stopped, which sees to its standstill: no session goes on."""
        self._unsettled.clear()
        self.take_all(JogNews.STOP)
        self._end_motion()

    def robot_stands_still(self) -> None:
        """The stop of the whole robot is confirmed."""
        self.take_all(JogNews.STILL)

    def _require_in_reach(self, session: _Session) -> None:
        if not self._line.online:
            raise JogOutOfReach(f"Robot {self._robot_id}", session.what)

    async def _rests(self, session: _Session) -> None:
        looks = 0
        while looks < STILL_LOOKS:
            await asyncio.sleep(self._poll_interval_s)
            looks = looks + 1 if await self._stands_still(session.jog.unit, session.jog.axis) else 0
        session.jog.note_end("came to rest without a stop, as at a limit")
        self._stop(session)

    def _stop(self, session: _Session) -> None:
        line = self._line
        with suppress(GatewayError):  # it is repeated until the axis is seen to stand still
            line.submit(line.exchange(StopJog(axis=session.jog.axis), Lane.STOP))

    async def _see_still(self, session: _Session) -> bool:
        """Repeat the end of the JOG until the axis stands still; stop the whole robot if it does not tell so.

        That stop is never given up.
        """
        try:
            began_at = asyncio.get_running_loop().time()
            async with asyncio.timeout(STILL_WITHIN_S) as patience:
                while session in self._unsettled:  # or else the stop of the whole robot sees to it
                    still = await self._stands_still(session.jog.unit, session.jog.axis)
                    if still:
                        return True
                    patience.reschedule(began_at + self._patience_s(tells=still is not None))
                    await asyncio.sleep(RECHECK_S)
                    if session in self._unsettled:
                        self._stop(session)
        except TimeoutError:
            stop = self._stop_robot()
            self._tell("robot.jog.not_stopped", session.jog.model_dump())
            await stop
        return False

    def _patience_s(self, *, tells: bool) -> float:
        """Seconds for an axis to stand still; one that `tells` that it moves may be on its ramp."""
        ramp_s = self._known.motion.ramps.longest_s if tells else None
        return STILL_WITHIN_S if ramp_s is None else max(STILL_WITHIN_S, ramp_s + AFTER_RAMP_S)

    def _settled(self, session: _Session) -> None:
        if session in self._unsettled:
            self._unsettled.remove(session)
        self._end_motion()

    def _end_motion(self) -> None:
        """End the motion when the last axis stands still."""
        if not self._unsettled and self._known.motion.jogs:
            self._conversation.end()

    def _was_sent(self, session: _Session) -> bool:
        return session.jog.id in self._sessions

    async def _stands_still(self, unit: int, axis: str) -> bool | None:
        """True if an axis stands still; None where the robot did not tell."""
        jogged = unit_of(self._units, unit)
        try:
            axes = await jogged.status(Lane.VERIFY)  # no read of others wears out patience
            motors = {motor: axes[motor] for motor in self._motors(unit, axis)}
            if at_rest(motors.values()):
                return True
            alone = [session.jog.axis for session in self._unsettled if session.jog.unit == unit] == [axis]
            return not alone and await self._stays(jogged, axis, motors)
        except GatewayError:
            return None

    async def _stays(self, unit: RobotUnit, axis: str, motors: Mapping[str, AxisStatus]) -> bool:
        """True if an axis stands still while others of the unit jog: its motors are where they were before.

        Where their places are not known, only the second digit of ACD tells (C-HOST manual 2-10), if it does.
        """
        now = await unit.position("motor", Lane.VERIFY)
        before = self._places.get((unit.number, axis), {})
        self._places[unit.number, axis] = now
        if any(now[motor] is None for motor in motors):
            return not any(map(self._known.bits.may_move, motors.values()))
        return all(before.get(motor) == now[motor] for motor in motors)

    def _unsettled_with(self, unit: int, axis: str) -> list[_Session]:
        """The sessions that share a motor with an axis."""
        motors = self._motors(unit, axis)
        sessions = [session for session in self._unsettled if session.jog.unit == unit]
        return [session for session in sessions if motors & self._motors(unit, session.jog.axis)]

    def _motors(self, unit: int, axis: str) -> set[str]:
        """The motors that move an axis; all of them where it is not known which.

        :raises InvalidRequest: the unit has no such axis.
        """
        axes = unit_of(self._units, unit)
        axes.require_axis(axis)
        return set(axes.motors_behind(axis) or axes.motor_axes)


def _perhaps_begun(robot_id: str, jog: JogSession) -> NoReply:
    return NoReply(
        f"{robot_id} refused to jog {jog.what} as in motion, and the axis moves, or was stopped before "
        "it could be asked: a first copy of the command has set it going, or something else has. The axis "
        "is being stopped.",
        "See that it stands still, then try again.",
    )
