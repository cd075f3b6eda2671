"""One port with its Fics: keeps it open and in its mode, and carries the session over it in time."""

import asyncio
import logging
import random
import re
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from functools import partial
from typing import Any

from gateway.core.errors import Cancelled, Expired, GarbledReply, GatewayError, NoReply, NotSent, QueueFull
from gateway.core.exchange import Lane
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState
from gateway.core.origin import SET_UP as SET_UP_ORIGIN
from gateway.core.origin import acting
from gateway.core.supervisor import insist
from gateway.fics.exchange import ROBOT, SET_UP, FicsExchange, Outcome, Proof, ReplyFrame, RobotAnswered
from gateway.fics.session import FicsSession, offline_error
from gateway.texts import text
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.link import FicsRefusal, Terminator, Ver2Reader, Ver3Reader, encode
from protocols.fics.row import BLOCK_ERRORS, Block, FicsCommand
from protocols.fics.system import (
    CommunicationMode,
    GetCommunicationMode,
    GetSystemVersion,
    HostMode,
    SetCommunicationMode,
    SystemVersion,
)
from transports.base import Transport
from transports.trace import UNNAMED, FrameSubject

log = logging.getLogger(__name__)

_NAME = re.compile(rb"\s*([0-9A-Z]{3})(?![0-9A-Z])")
ASK_AGAIN_S = (0.5, 2.0)
"""First and longest pause before a robot that is silent, or in the wrong mode, is asked again."""
READY_WITHIN_S = 2.0
"""A request during the set-up waits this time for its end, reckoned from its beginning."""
SILENT = text("phrases.line-down.robot-silent").en
NO_MODES = text("phrases.line-down.robot-without-modes").en
GARBLED = text("phrases.line-down.robot-garbled").en
CLEARING = b"!\rPOF 2\r"
"""Spoils a half command, and ends an upload that an earlier life may have left open: that takes no stop.

With `!` no command is written correctly (E06, C-HOST manual 2-12). CR alone would let a robot execute
what was cut off, such as a move to half of its place.

The question for the mode, which no robot in an upload answers, shows if that was heard.
"""


class FicsLine(LineDriver[FicsExchange, ReplyFrame, ReplyFrame]):
    """One port with its robot."""

    _session: FicsSession

    def __init__(
        self,
        line_id: str,
        transport: Transport,
        robot_id: str,
        *,
        mode: int = HostMode.VER_3,
        terminator: Terminator = "cr",
        reply_timeout_s: float = 0.5,
        late_reply_s: float = 2.0,
        rng: random.Random | None = None,
    ) -> None:
        session = FicsSession(
            robot_id,
            terminator=terminator,
            reply_timeout_s=reply_timeout_s,
            late_reply_s=late_reply_s,
            rng=rng,
        )
        super().__init__(line_id, transport, session, Ver3Reader)
        self.note_forbidden = session.note_forbidden
        self.exchange = session.exchange
        """Build an exchange of this line, admitted now."""
        self.mode = mode
        """The mode the robot is to be in: 3, or 2, in which most commands are silent."""
        self.sequence_lock = self.lock_of(ROBOT)
        """Held from the selection of a unit to the last command that depends on it."""
        session.on_silence = self._robot_is_silent
        self.on_stray: Callable[[ReplyFrame], None] = lambda _: None
        """Called with an answer to no question of the gateway."""
        session.on_stray = lambda frame: self.on_stray(frame)
        self._known = False
        """True if the robot has been set up before."""
        self._was_away = False
        """True if it was silent, or its port gone, since."""
        self.absences = 0
        """Count of its returns after an absence in the mode of power-on, which tells of no loss of power."""
        self._missing = False
        """True if its silence has been reported."""
        self._tells_mode = True
        """True if it has answered MOD, or refused it, when last asked."""
        self._patient_until = 0.0
        """Deadline for requests that wait for the set-up."""

    # what it is now

    @property
    def online(self) -> bool:
        """True if the robot can be asked now, as far as is known."""
        return self._life.is_open and self._session.online

    @property
    def uploading(self) -> bool:
        """True if an upload of positions is open."""
        return self._session.upload.is_open

    @property
    def stops(self) -> int:
        """The number of stops so far."""
        return self.gate.stops(ROBOT)

    @property
    def stop_epoch(self) -> int:
        """Another with each stop, and with whatever else forbids what was admitted before."""
        return self.gate.epoch(ROBOT)

    @property
    def unheard(self) -> int:
        """The number of commands so far that may have been refused without an answer."""
        return self._session.unheard

    def waiting(self) -> dict[str, int]:
        """Requests that wait in each lane: for the robot to be free, or for the line."""
        return {
            lane.name.lower(): self.sequence_lock.waiting(lane) + self._session.waiting(lane) for lane in Lane
        }

    def frame_of(self, command: FicsCommand[Any]) -> str:
        """Show the exact frame of a command as text, with its terminator escaped."""
        frame = encode(command, self._session.terminator)
        return frame.decode("ascii").replace("\r", "\\r").replace("\n", "\\n")

    def subject_of(self, frame: bytes) -> FrameSubject:
        """A frame is about its command: replies name it, those of motion long after others'."""
        named = _NAME.match(frame)
        return FrameSubject(named[1] if named else UNNAMED)

    def address_of(self, _target: int) -> str:
        """The robot's id: it is alone on its line."""
        return self._session.robot_id

    def _break_off(self, reason: str) -> None:
        self._was_away = True
        super()._break_off(reason)

    # set-up

    async def _set_up(self, *, fresh: bool) -> None:
        """Bring the robot into its mode, as often as it takes (C-HOST manual 1-1-1, 2-37)."""
        self._begin_set_up()
        if fresh:
            await self._clear_with(CLEARING, self.late_reply_s)
        pause_s = ASK_AGAIN_S[0]
        while self._life.is_open and not await self._agree_on_mode_or_tell():
            await asyncio.sleep(pause_s)
            pause_s = min(2 * pause_s, ASK_AGAIN_S[1])
        if not self._life.is_open:
            return
        if self.mode == HostMode.VER_2:
            await self._tell(TakeCurrentError())  # what the clearing has left: an error of the system stays
        self._known, self._was_away = True, False
        if not self._life.is_open:
            return
        self._came_up({"mode": self.mode})
        if self._missing:
            self._missing = False
            self.on_change("robot.online", {})
        self._pump()

    def _begin_set_up(self) -> None:
        """From now on only stops are said to the robot, until it is set up."""
        self._begins_set_up()
        self._patient_until = self._loop.time() + READY_WITHIN_S

    async def _agree_on_mode_or_tell(self) -> bool:
        """True if the robot is in its mode now; a robot that says nothing at all is reported silent."""
        replies, garbage = self.counters["replies"], self.counters["garbage"]
        if await self._agree_on_mode():
            return True
        if self._life.is_open and self.counters["replies"] == replies:
            self._is_silent(GARBLED if self.counters["garbage"] > garbage else SILENT)
        elif self._life.is_open and not self._tells_mode:
            self._is_silent(NO_MODES)
        return False

    async def _agree_on_mode(self) -> bool:
        """Find out the robot's mode, and change it if it is another; whether it is right now."""
        self._reader = Ver3Reader()  # reads both, while the mode is not known
        found = await self._find_mode()
        if found is None:
            return False
        if self._known and found != self.mode:
            self._lost_power()
        self.absences += self._was_away and found == HostMode.VER_2
        if found != self.mode:
            await self._tell(SetCommunicationMode(mode=self.mode))
            found = await self._find_mode()
        if found == HostMode.VER_2:
            self._reader = Ver2Reader()
        self._session.mode = found or self.mode
        return found == self.mode

    async def _find_mode(self) -> int | None:
        """Ask for the mode; None if the robot is silent, or refuses everything as in an upload.

        In motion the question is blocked: refused in Ver.3 and not answered in Ver.2. The version is told at
        any time, in Ver.3 with that of C-HOST (C-HOST manual 2-36).
        """
        outcome = await self._tell(GetCommunicationMode())
        self._tells_mode = isinstance(outcome, RobotAnswered | FicsRefusal)
        if isinstance(outcome, FicsRefusal):
            return HostMode.VER_3 if outcome.error == BLOCK_ERRORS[Block.MOTION] else None
        if isinstance(outcome, RobotAnswered) and isinstance(reply := outcome.replies[0], CommunicationMode):
            return reply.mode
        outcome = await self._tell(GetSystemVersion())
        if isinstance(outcome, RobotAnswered) and isinstance(version := outcome.replies[0], SystemVersion):
            return HostMode.VER_2 if version.c_host is None else HostMode.VER_3
        return None

    def was_set_up(self) -> None:
        """The gateway has left it in its mode before: if it is in that of power-on, it has lost its power."""
        self._known = True

    def change_mode(self, mode: int) -> None:
        """Keep the robot in another mode from now on; nothing else is said to it until it is (2-37)."""
        self.mode = mode
        self._known = False
        self._begin_set_up()
        self.set_up_again(f"the robot is brought into mode {mode}")

    def power_was_lost(self, reason: str) -> None:
        """The robot was found in the mode of power-on: nothing is said to it until it is set up again."""
        self._begin_set_up()
        insist("the set-up of a robot", partial(self.set_up_again, reason))
        self._lost_power()
        self._known = False  # only now: the set-up would find it once more

    def _lost_power(self) -> None:
        """The robot is in the mode of power-on, and was left in another."""
        self._was_away = False
        self._session.lose_motion(
            NoReply("The robot has lost its power in the middle of the motion.", "Home it again."),
            Cancelled("The robot has lost its power; nothing was sent.", "Home it again."),
        )
        self.on_change("robot.power_cycled", {})

    def _robot_is_silent(self) -> None:
        self._was_away = True
        self.set_up_again("the robot does not answer")
        if not self._missing:
            self._missing = True
            self.on_change("robot.offline", {})

    async def _tell(self, command: FicsCommand[Any]) -> Outcome:
        """Send a command of the set-up ahead of everything but stops and fences."""
        if not self._life.is_open:
            return self._down()
        with acting(SET_UP_ORIGIN):
            exchange = self._session.exchange(command, Lane.COMMAND, SET_UP)
        outcome: Outcome = await self._say_first(exchange)
        return outcome

    # asking

    def submit(self, exchange: FicsExchange) -> "asyncio.Future[Outcome]":
        """Queue an exchange; the future gives what became of it and never raises.

        :raises LineDown: the port is not open; nothing was queued.
        :raises RobotOffline: the robot does not answer (stops are sent nevertheless).
        :raises NotSent: the robot is being set up, and that takes long (stops are sent nevertheless).
        """
        if not self._life.is_open:
            raise self._down()
        if ROBOT in self._session.offline and exchange.lane is not Lane.STOP:
            raise offline_error(self._session.robot_id)
        if not self._life.is_set_up and exchange.lane is not Lane.STOP:
            self._wait_for_set_up(exchange)
        return self.queue(exchange)

    async def say(self, exchange: FicsExchange) -> Outcome:
        """Queue an exchange, and give what became of it; it is withdrawn when its caller goes.

        Errors as of `submit`.
        """
        try:
            return await self.submit(exchange)
        except asyncio.CancelledError:
            self.forsake(exchange)
            raise

    def forsake(self, exchange: FicsExchange) -> None:
        """Take back an exchange whose caller has gone, if it is not written yet."""
        self.withdraw(exchange, Cancelled("The caller has gone; nothing was sent."))

    def _wait_for_set_up(self, exchange: FicsExchange) -> None:
        """Let an exchange wait for the robot to be set up, but not for long.

        :raises NotSent: it has waited long enough.
        """
        late = NotSent(
            f"Robot {self._session.robot_id} is being set up; nothing was sent.", "Try again later."
        )
        if self._loop.time() >= self._patient_until:
            raise late
        self._loop.call_at(self._patient_until, self._give_up_waiting, exchange, late)

    def _give_up_waiting(self, exchange: FicsExchange, reason: NotSent) -> None:
        if not self._life.is_set_up:
            self.withdraw(exchange, reason)

    def withdraw(self, exchange: FicsExchange, reason: GatewayError) -> None:
        """Take back an exchange that is not written yet; one that is stays as it is."""
        self.cancel(lambda queued: queued is exchange, reason)

    def may_be_silent(self, query: FicsCommand[Any]) -> bool:
        """True if silence may be the refusal of a query."""
        return self._session.may_be_silent(query)

    def shows_silence(self, error: GatewayError) -> bool:
        """True if an error shows that the robot does not answer, on a port that is open."""
        if self.state is LineState.DOWN or isinstance(error, GarbledReply | QueueFull | Expired):
            return False
        return isinstance(error, NoReply | NotSent)

    def sending(self, commands: Callable[[], Iterable[FicsCommand[Any]]]) -> AbstractContextManager[None]:
        """Wait for the disk once, whatever of these is sent here and now."""
        return self.undertaking(lambda: [self.exchange(command, Lane.COMMAND) for command in commands()])

    def begin_proof(self, *commands: FicsCommand[Any]) -> Proof:
        """Begin to prove what a motion depends on.

        A fence goes first where a copy of an earlier answer could be taken for the answer to one of these.
        """
        self._session.rule_out_copies(commands, self._loop.time())
        self._pump()
        return Proof(self._session.doubts)

    def begin_stop(self) -> None:
        """Forbid everything that was admitted before now and is not written yet."""
        self._session.begin_stop()

    def overtaken(self) -> GatewayError:
        """Why what was admitted in an earlier epoch is not sent."""
        return self.gate.overtaken(ROBOT)

    def doubt_upload(self) -> None:
        """A stop was refused as it is in an upload: the end of one goes before the next stop, to be sure."""
        self._session.upload.doubt()

    def give_up(self, motion: FicsExchange) -> None:
        """A motion is seen to have ended without its answer."""
        self._session.give_up(motion)
        self._pump()
