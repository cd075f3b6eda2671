"""The session with a robot: motion that is answered a minute later, uploads without stops, silent modes.

Answers are matched by name. A fence is the query of a variable, whose number comes back.
"""

import random
from collections import deque
from collections.abc import Iterable
from functools import lru_cache
from itertools import cycle
from math import inf
from typing import Any

from gateway.core.errors import Cancelled, GatewayError, NoReply, StoppedFirst
from gateway.core.exchange import ExpectedReply, Lane, RememberedReply
from gateway.core.fence import FENCE_TRIES
from gateway.core.session import READ_REPEATS, Awaited, Session
from gateway.fics.errors import NotProved, RobotOffline
from gateway.fics.exchange import ROBOT, SET_UP, FicsExchange, Proof, ReplyFrame, RobotAnswered
from protocols.fics.alarms import GetErrorDetail
from protocols.fics.link import Completion, FicsRefusal, Terminator, Ver3Reader, credit, line_of
from protocols.fics.link import frame as framed
from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.positions import BeginPositionUpload, EndPositionUpload
from protocols.fics.row import BLOCK_ERRORS, UPLOAD_ERROR, Block, FicsCommand, WhenAnswered
from protocols.fics.status import GetAxisSensors
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import GetSystemVersion, HostMode, SetCommunicationMode
from protocols.fics.variables import GetVariable
from protocols.table import Retry

NO_UPLOAD = "E08"
"""The refusal of a position where no upload is open (C-HOST manual 2-12); that of POF 2 is an assumption."""
OF_AN_END_IN_VAIN = (NO_UPLOAD, BLOCK_ERRORS[Block.MOTION])
"""The refusals of the end of an upload where none is open, or the robot moves (C-HOST manual 1-7)."""


class UploadState:
    """The knowledge of the upload of one robot."""

    def __init__(self) -> None:
        self.is_open = False
        """True if one is open, as far as is known: its end was not sent, or not taken."""
        self.may_be_open = False
        """True if one is, or was ended in Ver.2, where no answer tells that it was heard."""
        self._begun = 0
        """The number of the frame that began the last one: only what was written later can prove its end."""
        self._ended_at_try: int | None = None
        """The try of the fence before which POF 2 was sent, or was not needed."""

    def doubt(self) -> None:
        """A command was refused as it is in an upload: POF 2 goes before whatever follows."""
        self.is_open = self.may_be_open = True

    def note_written(self, command: FicsCommand[Any], number: int, *, silent: bool) -> None:
        """Note a written frame by its number; a `silent` one gets no answer."""
        if isinstance(command, BeginPositionUpload):
            self._begun = number
            self.doubt()
        elif silent and isinstance(command, EndPositionUpload):
            self.is_open = False

    def note_outcome(self, command: FicsCommand[Any], number: int, outcome: object) -> bool:
        """Note an answer to a frame; tells whether only an open upload explains it.

        No upload is open if its end was taken, or anything else that an upload does not let through.
        """
        ends, begins = isinstance(command, EndPositionUpload), isinstance(command, BeginPositionUpload)
        if not isinstance(outcome, FicsRefusal):
            closed = (ends or not command.during_upload) and number > self._begun
        else:
            closed = (begins and outcome.error != UPLOAD_ERROR) or (ends and outcome.error == NO_UPLOAD)
        if closed:
            self.is_open = self.may_be_open = False
            return False
        doubtful = isinstance(outcome, FicsRefusal) and _only_an_upload_explains(command, outcome)
        if doubtful:
            self.doubt()
        return doubtful

    def begin_fence(self, *, in_doubt: bool) -> None:
        """A fence begins. Where nothing was `in_doubt`, an upload may be open only if its first try fails."""
        self._ended_at_try = None if in_doubt or self.is_open else 0

    def must_end_before(self, fence_try: int, mode: int) -> bool:
        """True if POF 2 goes before a try of the fence: once, where an upload may be open.

        In Ver.2 an upload of another host would be as silent.
        """
        due = (self.may_be_open or mode == HostMode.VER_2) and self._ended_at_try != fence_try
        if due:
            self._ended_at_try = fence_try
        return due


def _only_an_upload_explains(command: FicsCommand[Any], refusal: FicsRefusal) -> bool:
    """True if neither the teaching terminal nor motion refuses this command so (C-HOST manual 1-7)."""
    edited = Block.TERMINAL_EDITS in command.blocked
    return refusal.error == UPLOAD_ERROR and not command.during_upload and not edited


NEVER_FORBIDDEN: tuple[type[FicsCommand[Any]], ...] = (
    GetSystemVersion,
    GetErrorDetail,
    GetAxisSensors,
    GetMotorPosition,
)
"""Queries that no state forbids (C-HOST manual 1-7) and that are seldom put: fences in place of VAR."""
FENCES = (GetVariable.code, *(query.code for query in NEVER_FORBIDDEN))
"""The names of the queries that are fences."""
REPLIES_REMEMBERED = 1000
VARIABLES = 100
"""Variables a fence can ask for. All take their turn, so that no late echo is the next fence's own."""
STANDSTILL_S = 10.0
"""A decelerating stop is answered when all axes stand: it may take this time."""
QUICK_S = 0.1
"""Patience in Ver.2 for an answer that a state of the system seems to forbid, in seconds.

A fence that no state forbids is certain then: it tells, and an answer that comes before its echo counts.
"""
_RANKS: dict[type[FicsCommand[Any]], int] = {EndPositionUpload: -2, StopAllImmediately: -1}
"""Order of the stops that wait: the end of an upload, an immediate stop, all others."""


class FicsSession(Session[FicsExchange, ReplyFrame]):
    """The exchanges with one robot."""

    def __init__(
        self,
        robot_id: str,
        *,
        terminator: Terminator = "cr",
        reply_timeout_s: float = 0.5,
        late_reply_s: float = 2.0,
        rng: random.Random | None = None,
    ) -> None:
        super().__init__(
            target="robot",
            replies_remembered=REPLIES_REMEMBERED,
            set_up_target=SET_UP,
            reply_timeout_s=reply_timeout_s,
            late_reply_s=late_reply_s,
        )
        self.robot_id = robot_id
        self.terminator = terminator
        self.mode: int = HostMode.VER_2
        """The mode the robot is believed to be in."""
        self.upload = UploadState()
        self._last_action = 0
        """The number of the last frame that was no mere read."""
        self._said_silently = 0
        dice = rng or random.Random()  # noqa: S311  # against mix-ups, not against people
        self._variables = cycle(dice.sample(range(VARIABLES), VARIABLES))
        self._forbidding: frozenset[Block] = frozenset()
        """The states of the system that have refused a question, or a fence, and may go on."""
        self._answers_until: dict[str, float] = {}
        """The time until which an answer without a number may come to an earlier question, by name."""
        self._now = -inf
        """Time at which a frame was last written."""
        self._asked_for: deque[int] = deque(maxlen=VARIABLES // 2)
        self.gate.add(self._not_proved)

    @property
    def online(self) -> bool:
        """True if the robot can be asked, as far as is known."""
        return ROBOT not in self.offline

    @property
    def unheard(self) -> int:
        """The number of commands so far that may have been refused without an answer."""
        return self._fence.doubts + self._said_silently

    # what goes next

    def exchange(self, command: FicsCommand[Any], lane: Lane, target: int = ROBOT) -> FicsExchange:
        """Build an exchange: its frame, its stop epoch, and how often it is repeated."""
        may_be_silent = target == ROBOT and self.may_be_silent(command)
        quick = may_be_silent and not self._forbidding.isdisjoint(command.blocked) and self._fresh_queries()
        return FicsExchange(
            command,
            framed(command.text, self.terminator),
            lane,
            target=target,
            epoch=self.epoch(target) if lane is Lane.COMMAND else 0,
            rank=_RANKS.get(type(command), 0) if lane is Lane.STOP else 0,
            reply=ExpectedReply(
                timeout_s=min(QUICK_S, self.terms.reply_timeout_s) if quick else self.terms.reply_timeout_s,
                repeats=READ_REPEATS if command.retry is Retry.READ and not may_be_silent else 0,
                names=command.reply_names,
            ),
        )

    def goes_before_stop(self) -> FicsExchange | None:
        """The end of an upload, until it was heard."""
        if not self.upload.may_be_open or self._closing():
            return None
        return self.exchange(EndPositionUpload(), Lane.STOP)

    def may_be_silent(self, query: FicsCommand[Any]) -> bool:
        """True if silence may be the refusal of a query: before it is repeated, ERR has to be asked."""
        return self.mode == HostMode.VER_2 and query.is_query() and bool(query.blocked)

    def note_forbidden(self, error: str) -> None:
        """A state of the system refuses questions, as ERR has told, or motion that was seen."""
        self._forbidding = frozenset(block for block, told_as in BLOCK_ERRORS.items() if told_as == error)

    def _closing(self) -> bool:
        """True if the end of an upload is on its way."""
        return any(map(_ends_upload, (*self.scheduler.exchanges(Lane.STOP), *self.sent)))

    def begin_stop(self) -> None:
        """Begin a new stop epoch: no command admitted earlier can be written any more."""
        self.gate.stop(ROBOT)
        self._withdraw_commands(StoppedFirst())

    def _withdraw_commands(self, reason: GatewayError) -> None:
        self.cancel(lambda exchange: exchange.lane is Lane.COMMAND, reason)

    def _not_proved(self, exchange: FicsExchange, now: float) -> NotProved | None:
        if exchange.needs is None or self.holds(exchange.needs, now):
            return None
        return NotProved(self.robot_id)

    def holds_up(self, sent: FicsExchange) -> bool:
        """In an upload nothing else is answered."""
        return _ends_upload(sent)

    def wants_fence(self, exchange: FicsExchange, now: float) -> bool:
        """Before what could be given a copy of an earlier answer, but never in an upload.

        Before what an upload would not let through, too, if one may be open: the fence ends it.
        """
        if exchange.target == SET_UP:
            return False
        if self.upload.may_be_open:
            return not exchange.command.during_upload
        return self._could_get_a_copy(exchange, now)

    def _could_get_a_copy(self, exchange: FicsExchange, now: float) -> bool:
        exchange.outdated_before = self._last_action
        return self._copies.could_answer(exchange, ROBOT, now)

    def rule_out_copies(self, commands: Iterable[FicsCommand[Any]], now: float) -> None:
        """Put a fence before whatever comes next, if a copy could be taken for the answer to one of these."""
        questions = [self.exchange(command, Lane.READ) for command in commands]
        for question in questions:
            question.fresh = True
        if self.in_step and any(self._could_get_a_copy(question, now) for question in questions):
            self._lose_step(doubtful=False)

    def holds(self, proof: Proof, now: float) -> bool:
        """Say whether a motion may be written that follows the last question of its proof."""
        return proof.doubts == self.doubts and proof.last == self.sent.written and now < proof.holds_until

    # the fence

    def _lose_step(self, target: int = ROBOT, *, doubtful: bool = True) -> None:
        """From now on nothing but stops is sent until a fence has passed; an upload is ended before."""
        super()._lose_step(target, doubtful=doubtful)
        self.upload.begin_fence(in_doubt=doubtful)

    def goes_before_fence(self) -> FicsExchange | None:
        """The end of an upload that may be open."""
        if not self.upload.must_end_before(self._fence.tries, self.mode):
            return None
        return self.exchange(EndPositionUpload(), Lane.STOP)

    def fence_query(self) -> FicsExchange:
        """Ask for a variable, whose number comes back, or for what no state forbids (C-HOST manual 1-7).

        In Ver.2 a forbidden question costs its whole time. The answer to another has no number, so no earlier
        one may be on its way; but last it is taken nevertheless.
        """
        last = self._fence.tries == FENCE_TRIES - 1
        fresh = self._fresh_queries()
        query = (fresh or NEVER_FORBIDDEN)[0] if last or (fresh and self._may_forbid_variables()) else None
        question = _question_of(self._fresh_variable()) if query is None else query()
        fence = self.exchange(question, Lane.READ)
        fence.reply.self_identifying = True
        return fence

    def _may_forbid_variables(self) -> bool:
        """True if in Ver.2 a question for a variable may be refused, as the one in doubt may have been."""
        doubted = frozenset[Block]() if self._suspect is None else self._suspect.command.blocked
        forbidden = Block.TERMINAL_RUNS in doubted | self._forbidding or self._fence.tries > 0
        return forbidden and self.mode == HostMode.VER_2

    def _fresh_queries(self) -> list[type[FicsCommand[Any]]]:
        """The queries that no state forbids, and no earlier answer may be on its way to."""
        return [
            question
            for question in NEVER_FORBIDDEN
            if self._answers_until.get(question.code, -inf) <= self._now
        ]

    def _fresh_variable(self) -> int:
        """A variable that was not asked for lately: an answer with its number is the fence's own."""
        return next(number for number in self._variables if number not in self._asked_for)

    def is_refusal_of_fence(self, frame: ReplyFrame) -> bool:
        """True if a query that may be a fence was refused."""
        return isinstance(frame, FicsRefusal) and frame.name in FENCES

    def fence_passed(self, fence: FicsExchange) -> None:
        """Doubt what should have been answered at once; a decelerating stop is answered at standstill."""
        if type(fence.command) in NEVER_FORBIDDEN and self._fence.tries > 0:
            self._forbidding |= {Block.TERMINAL_RUNS}
        for stop in [sent for sent in self.sent if sent.number < fence.number and sent.lane is Lane.STOP]:
            if not isinstance(stop.command, StopAllDecelerating):
                self._doubt(stop, stop.unusable(NoReply, "no reply came"))

    def shows_echo(self, exchange: FicsExchange) -> bool:
        """Not where it would be credited: a completion is the bare name, and `IDI 10` may answer `IDI 10`."""
        [echo] = Ver3Reader().feed(exchange.frame)
        return credit(exchange.command, echo) is None

    def line_of(self, frame: ReplyFrame) -> bytes:
        """The line as which an answer came."""
        return line_of(frame)

    def is_answered_in_order(self, exchange: FicsExchange) -> bool:
        """Motion is answered at its end, and others meanwhile."""
        return super().is_answered_in_order(exchange) and not _is_answered_at_its_end(exchange.command)

    def witness_failed(self) -> bool:
        """There is only the robot to ask."""
        was_online = self.online
        self.offline.add(ROBOT)
        self.cancel(lambda exchange: exchange.lane is not Lane.STOP, offline_error(self.robot_id))
        if was_online:
            self.on_silence()
        return False

    # what is written, and what comes back

    def _is_silent(self, command: FicsCommand[Any]) -> bool:
        """True if it gets no answer in this mode; a change of mode is answered as the new mode answers."""
        mode = command.mode if type(command) is SetCommunicationMode else self.mode
        return mode == HostMode.VER_2 and not command.is_query()

    def was_written(self, exchange: FicsExchange, now: float) -> Awaited:
        """Note what it begins or ends; stops and motion are answered while others are asked."""
        command, silent = exchange.command, self._is_silent(exchange.command)
        exchange.parts.clear()  # of an earlier attempt
        if exchange.proves is not None:
            exchange.proves.note_asked(exchange.number, exchange.reply.due_at)
        self._now = now
        if type(command) in NEVER_FORBIDDEN:
            self._answers_until[command.code] = now + exchange.reply.timeout_s + self.terms.late_reply_s
        if type(command) is GetVariable and exchange is not self._fence.query:
            self._asked_for.append(command.number)
        if command.retry is not Retry.READ:
            self._note_action(exchange, now, silent=silent)
        if command.code == EndPositionUpload.code:  # POF, with which an upload begins, too
            self.upload.note_written(command, exchange.number, silent=silent)
        self._said_silently += silent
        exchange.unheard = self.unheard
        if silent:
            exchange.settle(RobotAnswered(confirmed=False))
            return Awaited.NEVER
        if type(command) is StopAllDecelerating:
            exchange.reply.await_until((exchange.reply.deadline or now) + STANDSTILL_S)
        elif _is_answered_at_its_end(command):
            self._forget_motion()
            exchange.reply.await_until(None)
            return Awaited.BESIDE
        return Awaited.BESIDE if exchange.lane is Lane.STOP else Awaited.FIRST

    def _note_action(self, exchange: FicsExchange, now: float, *, silent: bool) -> None:
        """It outdates what was read before, and its answer may come at any time."""
        self._last_action = exchange.number
        if not silent and not exchange.command.is_query():
            self._remember(exchange, Completion(exchange.command.wire_name()), now, inf)

    def note_reply(self, exchange: FicsExchange, frame: ReplyFrame, now: float) -> None:
        """Remember it, for a copy may come."""
        self._remember(exchange, frame, now, now + self.terms.late_reply_s)

    def _remember(self, exchange: FicsExchange, frame: ReplyFrame, now: float, until: float) -> None:
        said = RememberedReply(
            exchange, frame, type(frame).__name__, exchange.number, until
        )  # whatever it says
        self._copies.note(ROBOT, frame.name, said, now)

    def learn(self, exchange: FicsExchange, outcome: Any, frame: ReplyFrame, now: float) -> None:
        """The robot is there; and an upload that only its refusal shows has to be ended."""
        if exchange is self._fence.query and isinstance(outcome, RobotAnswered):
            self._copies.forget(ROBOT)  # but not its own answer, which has no number in Ver.2
        self.note_reply(exchange, frame, now)
        if type(exchange.command) in NEVER_FORBIDDEN:
            self._answers_until[exchange.command.code] = now + self.terms.late_reply_s
        if not (exchange is self._fence.query and isinstance(outcome, FicsRefusal)):
            self.offline.discard(ROBOT)
        if isinstance(outcome, RobotAnswered):
            self._forbidding -= exchange.command.blocked
        if self.upload.may_be_open or isinstance(outcome, FicsRefusal):
            doubtful = self.upload.note_outcome(exchange.command, exchange.number, outcome)
            if doubtful and self.in_step:
                self._lose_step()  # the fence ends the upload

    def _forget_motion(self) -> FicsExchange | None:
        """No answer to a motion is awaited any more: a robot does one at a time."""
        motion = next((sent for sent in self.sent if _is_answered_at_its_end(sent.command)), None)
        if motion is not None:
            self.sent.let_go(motion)
        return motion

    def give_up(self, motion: FicsExchange) -> None:
        """A motion has ended, and its answer will not come: fence now, so that none comes late."""
        if motion in self.sent:
            self.sent.let_go(motion)
            self._lose_step()

    def lose_motion(self, reason: NoReply, unsent: Cancelled) -> None:
        """The robot has forgotten what it was doing; what was to follow is not written."""
        self._fence.doubts += 1
        motion = self._forget_motion()
        if motion is not None:
            motion.settle(reason)
        self._withdraw_commands(unsent)


@lru_cache(VARIABLES)
def _question_of(variable: int) -> GetVariable:
    return GetVariable(number=variable)


def offline_error(robot_id: str) -> RobotOffline:
    """The error of a request to a robot that does not answer."""
    return RobotOffline.worded("robot.offline", robot=robot_id)


def _ends_upload(exchange: FicsExchange) -> bool:
    return isinstance(exchange.command, EndPositionUpload)


def _is_answered_at_its_end(command: FicsCommand[Any]) -> bool:
    return command.answered is WhenAnswered.ON_COMPLETION and command.starts_motion
