"""JOG with a dead-man: an axis moves for as long as somebody says so twice a second."""

import asyncio
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from gateway.errors import GatewayError, NotFound
from gateway.exchange import Lane
from gateway.fics.errors import JogOver
from gateway.fics.line import SILENT
from gateway.records import Record
from protocols.fics.jog import StartJog, StopJog

if TYPE_CHECKING:
    from gateway.fics.robot import Accepted, Robot

HEARTBEAT_S = 0.5
"""A heartbeat comes at most so long after the one before, or the axis is stopped."""
STILL_WITHIN_S = 1.0
"""An axis that still moves so long after its JOG was ended makes the robot stop as a whole."""
LOOK_AGAIN_S = 0.1
START_WITHIN_S = 2.0
KEPT = 100
"""Ended sessions that are remembered, to tell why they have ended."""


class JogSession(Record):
    """An axis that jogs, or has jogged."""

    id: str
    unit: int
    axis: str
    direction: Literal["+", "-"]
    state: Literal["jogging", "ended", "lost", "stopped"] = Field(
        "jogging", description="ended by request, lost for want of a heartbeat, or stopped with the robot."
    )
    heartbeat_within_ms: int = Field(
        default=int(HEARTBEAT_S * 1000), description="The next heartbeat has to come within this."
    )


@dataclass(eq=False)
class _Running:
    session: JogSession
    alarm: asyncio.TimerHandle
    """Ends it, unless the next heartbeat comes first."""


class Jogs:
    """The JOG sessions of a robot."""

    def __init__(self, robot: "Robot") -> None:
        self._robot = robot
        self._running: dict[str, _Running] = {}
        self._over: dict[str, JogSession] = {}
        self._stopping: set[asyncio.Task[None]] = set()

    async def start(self, unit: int, axis: str, direction: Literal["+", "-"]) -> JogSession:
        """Start to jog an axis (C-HOST manual 2-2).

        :raises NotFound: the unit has no such axis; nothing was sent.
        :raises RobotRefused: the robot refused; nothing moved.
        :raises NotSent: it was not sent; the error says why.
        """
        robot = self._robot
        axes = robot.unit(unit)
        if axis not in (*axes.axes, *axes.motor_axes):
            known = ", ".join(dict.fromkeys((*axes.axes, *axes.motor_axes)))
            raise NotFound(f"Unit {unit} of {robot.id} has no axis {axis}, but {known}; nothing was sent.")
        loop = asyncio.get_running_loop()
        command = StartJog(axis=axis, direction=direction)
        session = JogSession(id=secrets.token_hex(8), unit=unit, axis=axis, direction=direction)

        def written(_: float) -> None:  # the axis may move from now on, answered or not
            alarm = loop.call_later(HEARTBEAT_S, self._missed, session)
            self._running[session.id] = _Running(session, alarm)

        accepted = await robot.begin(
            command,
            unit,
            epoch=robot.line.stop_epoch,
            expires_at=loop.time() + START_WITHIN_S,
            on_written=written,
        )
        await self._hear(session, command, accepted)
        robot.publish("robot.jog.started", session.model_dump())
        return session

    async def _hear(self, session: JogSession, command: StartJog, accepted: "Accepted") -> None:
        """Wait for the answer, which comes at once; in Ver.2 there is only one where it was refused."""
        if self._robot.mode == SILENT and not accepted.outcome.done():
            return
        try:
            self._robot.dialogue.answered(command, await accepted.outcome)
        except GatewayError as error:
            self._end(session, "ended")
            if error.moved != "no":
                self._stop_axis(session)
            elif not self._running:
                self._robot.end_motion()
            raise

    def heartbeat(self, session_id: str) -> JogSession:
        """Keep an axis jogging for another half second.

        :raises NotFound: there was no such session.
        :raises JogOver: the axis was stopped.
        """
        running = self._find(session_id)
        running.alarm.cancel()
        running.alarm = asyncio.get_running_loop().call_later(HEARTBEAT_S, self._missed, running.session)
        return running.session

    async def end(self, session_id: str) -> JogSession:
        """Stop an axis, and give its session when it stands still or the robot is being stopped.

        :raises NotFound: there was no such session.
        :raises JogOver: the axis was stopped before.
        """
        session = self._find(session_id).session
        self._end(session, "ended")
        await asyncio.shield(self._stop_axis(session))
        return session

    def robot_stops(self) -> None:
        """The whole robot is being stopped: no session goes on."""
        for running in list(self._running.values()):
            self._end(running.session, "stopped")
        if isinstance(self._robot.motion, StartJog):
            self._robot.end_motion()

    async def close(self) -> None:
        """Stop every axis that jogs: nobody will send heartbeats any more."""
        for running in list(self._running.values()):
            self._end(running.session, "lost")
            self._stop_axis(running.session)
        await asyncio.gather(*self._stopping, return_exceptions=True)

    def _find(self, session_id: str) -> _Running:
        if session_id in self._running:
            return self._running[session_id]
        if session_id in self._over:
            session = self._over[session_id]
            raise JogOver(
                f"The JOG of axis {session.axis} is over ({session.state}); the axis was stopped.",
                "Start a new JOG if it is still wanted.",
            )
        raise NotFound(f"There is no JOG session {session_id}.")

    def _missed(self, session: JogSession) -> None:
        self._end(session, "lost")
        self._stop_axis(session)

    def _end(self, session: JogSession, state: Literal["ended", "lost", "stopped"]) -> None:
        running = self._running.pop(session.id, None)
        if running is not None:
            running.alarm.cancel()
        session.state = state
        self._over[session.id] = session
        while len(self._over) > KEPT:
            del self._over[next(iter(self._over))]
        self._robot.publish(f"robot.jog.{state}", session.model_dump())

    def _stop_axis(self, session: JogSession) -> "asyncio.Task[None]":
        self._send_stop(session)
        task = asyncio.create_task(self._see_still(session), name=f"end of a JOG of {self._robot.id}")
        self._stopping.add(task)
        task.add_done_callback(self._stopping.discard)
        return task

    def _send_stop(self, session: JogSession) -> None:
        line = self._robot.line
        try:
            line.submit(line.exchange(StopJog(axis=session.axis), Lane.STOP))
        except GatewayError:
            return  # the line is down; it is seen below that the axis does not stand still

    async def _see_still(self, session: JogSession) -> None:
        """Repeat the end of the JOG until the axis stands still; stop the whole robot if it does not."""
        loop = asyncio.get_running_loop()
        patient_until = loop.time() + STILL_WITHIN_S
        while not await self._stands_still(session):
            if loop.time() >= patient_until:
                self._robot.publish("robot.jog.not_stopped", session.model_dump())
                await self._robot.stop("immediate")
                break
            await asyncio.sleep(LOOK_AGAIN_S)
            self._send_stop(session)
        if not self._running:
            self._robot.end_motion()

    async def _stands_still(self, session: JogSession) -> bool:
        try:
            axes = await self._robot.unit(session.unit).status()
        except GatewayError:
            return False
        if session.axis in axes:
            return not axes[session.axis].moving
        return not any(axis.moving for axis in axes.values())
