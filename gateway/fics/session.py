"""What is being said to a robot: what goes next, what awaits its answer, and whether the line is in step.

Answers are matched by name, so a motion under way may be answered a minute later, between the answers to
queries. Besides it, one exchange is under way at a time; only stops may be written while it waits. When an
answer stays away or cannot be understood, a fence, the query of a variable whose number comes back, proves
that every earlier answer was seen or will never come.

No clock and no port: times are given, frames are taken and handed out.
"""

import random
from collections import Counter, deque
from collections.abc import Callable, Iterable
from itertools import cycle
from typing import Any

from gateway.core.errors import (
    Cancelled,
    Expired,
    GarbledReply,
    GatewayError,
    NoReply,
    Overtaking,
    StoppedFirst,
)
from gateway.core.lanes import Lane
from gateway.fics.copies import Copies
from gateway.fics.errors import NotProved, RobotOffline
from gateway.fics.exchange import Answered, Exchange, Outcome, Proof
from gateway.fics.upload_state import UploadState
from protocols.fics import row
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.link import Frame, Garbage, Refusal, Terminator, encode
from protocols.fics.positions import EndPositionUpload
from protocols.fics.row import FicsCommand
from protocols.fics.stops import StopAllDecelerating, StopAllImmediately
from protocols.fics.system import GetSystemVersion, HostMode, SetCommunicationMode
from protocols.fics.variables import GetVariable
from protocols.table import Reply, Retry

FENCE_TRIES = 3
FENCES = GetVariable.code, GetSystemVersion.code
"""The names of the queries that are fences."""
VARIABLES = 100
"""Variables a fence can ask for. All take their turn, so that no late echo is the next fence's own."""
STANDSTILL_S = 10.0
"""A decelerating stop is answered when all axes stand: it may take so long."""
READ_REPEATS = 2
"""How often a query without a usable answer is repeated, each time after a passed fence."""


class Conversation:
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
        self.robot_id = robot_id
        self.terminator = terminator
        self.reply_timeout_s = reply_timeout_s
        self.late_reply_s = late_reply_s
        self.mode: int = HostMode.VER_2
        """The mode the robot is believed to be in."""
        self.online = True
        self.in_step = True
        self.upload = UploadState()
        self.stops = 0
        """How many stops there have been."""
        self.stop_epoch = 0
        self._last_overtaking: Overtaking = StoppedFirst
        self.doubts = 0
        """How often an answer stayed away, could not be understood, or came though nobody had asked."""
        self._said_silently = 0
        self.counters: Counter[str] = Counter()
        self.on_silence: Callable[[], None] = lambda: None
        self.on_stray: Callable[[Frame], None] = lambda _: None
        """Told an answer that nobody has asked for."""
        dice = rng or random.Random()  # noqa: S311  # against mix-ups, not against people
        self._variables = cycle(dice.sample(range(VARIABLES), VARIABLES))
        self._copies = Copies(late_reply_s)
        self._asked_for: deque[int] = deque(maxlen=VARIABLES // 2)
        self._stops: deque[Exchange] = deque()
        self._urgent: deque[Exchange] = deque()
        self._queue: deque[Exchange] = deque()
        self._awaiting: Exchange | None = None
        self._stopping: list[Exchange] = []
        self._motion: Exchange | None = None
        self._suspect: Exchange | None = None
        self._fence: Exchange | None = None
        self._fence_tries = 0
        self._written = 0

    @property
    def unheard(self) -> int:
        """How often something was said that may have been refused without a word."""
        return self.doubts + self._said_silently

    # what goes next

    def exchange(self, command: FicsCommand[Any], lane: Lane) -> Exchange:
        """Build an exchange: its frame, its stop epoch, and how often it is repeated."""
        return Exchange(
            command,
            encode(command, self.terminator),
            lane,
            epoch=self.stop_epoch,
            timeout_s=self.reply_timeout_s,
            repeats=READ_REPEATS if command.retry is Retry.READ else 0,
        )

    def submit(self, exchange: Exchange) -> None:
        """Queue an exchange; a stop goes first, and in the middle of an upload the upload's end before it."""
        if exchange.lane is Lane.COMMAND and exchange.epoch != self.stop_epoch:
            exchange.settle(self.overtaken())
        elif exchange.lane is not Lane.STOP:
            self._queue.append(exchange)
        else:
            self._submit_stop(exchange)

    def _submit_stop(self, stop: Exchange) -> None:
        """Queue a stop: once where an equal one still waits, and an immediate one before all others.

        Where an upload may be open its end goes first of all, as often as nobody has heard it.
        """
        for waiting in self._stops:
            if waiting.frame == stop.frame:
                waiting.joined.append(stop)
                return
        if self.upload.may_be_open and not self._closing():
            self._stops.appendleft(self.exchange(EndPositionUpload(), Lane.STOP))
        if isinstance(stop.command, StopAllImmediately):
            first = sum(isinstance(it.command, EndPositionUpload) for it in self._stops)
            self._stops.insert(first, stop)
        else:
            self._stops.append(stop)

    def put_first(self, exchange: Exchange) -> None:
        """Queue an exchange of the line's own set-up ahead of everything but stops and fences."""
        self._urgent.append(exchange)

    def begin_stop(self) -> None:
        """Begin a new stop epoch: no command admitted earlier can be written any more."""
        self.stops += 1
        self.revoke(StoppedFirst)

    def revoke(self, why: Overtaking) -> None:
        """Begin a new epoch that is not that of a stop."""
        self.stop_epoch += 1
        self._last_overtaking = why
        self._withdraw_commands(why())

    def overtaken(self) -> GatewayError:
        """Why what was admitted in an earlier epoch is not written."""
        return self._last_overtaking()

    def fence(self) -> None:
        """Prove anew that no earlier answer is still to come."""
        self._lose_step()

    def _withdraw_commands(self, reason: GatewayError) -> None:
        for exchange in [it for it in self._queue if it.lane is Lane.COMMAND]:
            self.withdraw(exchange, reason)

    def has_something(self) -> bool:
        """Whether anything could go; asked first, because it costs less than asking the port."""
        if self._stops or (self._awaiting is None and not self.in_step):
            return True
        return self._awaiting is None and bool(self._urgent or self._queue)

    def next(self, now: float, *, ready: bool) -> Exchange | None:
        """Take the exchange that is to be written now; None if none may go."""
        if self._stops:
            return self._stops.popleft()
        if self._awaiting is not None or self._closing():
            return None
        if not self.in_step:
            return self._recovery()
        if self._urgent:
            return self._urgent.popleft()
        return self._due(now) if ready else None

    def _due(self, now: float) -> Exchange | None:
        """What waits longest; what was stopped or has come too late meanwhile is not sent any more."""
        while self._queue:
            refusal = self._refuses(self._queue[0], now)
            if refusal is None:
                return self._interposed(now)
            self._queue.popleft().settle(refusal)
        return None

    def _refuses(self, exchange: Exchange, now: float) -> GatewayError | None:
        if exchange.lane is Lane.COMMAND and exchange.epoch != self.stop_epoch:
            return self.overtaken()
        if exchange.expires_at is not None and now >= exchange.expires_at:
            return Expired("robot")
        if exchange.needs is not None and not self._holds(exchange.needs, now):
            return NotProved(self.robot_id)
        return None

    def _holds(self, proof: Proof, now: float) -> bool:
        """Whether a motion may be written that follows the last question of its proof."""
        return proof.doubts == self.doubts and proof.last == self._written and now < proof.holds_until

    def _interposed(self, now: float) -> Exchange:
        """Before what could be given a copy of an earlier answer goes a fence, but never in an upload.

        Before what an upload would not let through goes a fence, too, if one may be open; it ends the upload.
        """
        first = self._queue[0]
        in_upload = self.upload.may_be_open
        may_go = first.command.during_upload if in_upload else not self._may_get_a_copy(first, now)
        if may_go:
            return self._queue.popleft()
        self._call_for_fence()
        return self._recovery()

    def _may_get_a_copy(self, exchange: Exchange, now: float) -> bool:
        return self._copies.may_answer(exchange.command, now, fresh=exchange.fresh)

    def rule_out_copies(self, commands: Iterable[FicsCommand[Any]], now: float) -> None:
        """Put a fence before whatever comes next, if a copy could be taken for the answer to one of these."""
        if self.in_step and any(self._copies.may_answer(it, now, fresh=True) for it in commands):
            self._call_for_fence()

    def _call_for_fence(self) -> None:
        """Nothing was doubtful so far."""
        self._lose_step(in_doubt=False)

    def withdraw(self, exchange: Exchange, reason: GatewayError) -> None:
        """Take back an exchange that is not written yet; one that is stays as it is."""
        if exchange in self._queue:
            self._queue.remove(exchange)
            exchange.settle(reason)

    def waiting(self, lane: Lane) -> int:
        """How many exchanges of a lane wait to be written."""
        return sum(it.lane is lane for it in (*self._stops, *self._urgent, *self._queue))

    def _closing(self) -> bool:
        """Whether the end of an upload is on its way."""
        return any(isinstance(it.command, EndPositionUpload) for it in (*self._stops, *self._stopping))

    def _recovery(self) -> Exchange:
        """What brings the line into step again: an open upload must be ended before anything is answered."""
        if self.upload.must_end_before(self._fence_tries, self.mode):
            return self.exchange(EndPositionUpload(), Lane.STOP)
        # A variable cannot be asked for while the teaching terminal runs the robot; the version always can.
        last = self._fence_tries == FENCE_TRIES - 1
        query = GetSystemVersion() if last else GetVariable(number=self._fresh_variable())
        self._fence = self.exchange(query, Lane.READ)
        self._fence.timeout_s = max(self.reply_timeout_s, self.late_reply_s / FENCE_TRIES)
        self.counters["fences"] += 1
        return self._fence

    def _fresh_variable(self) -> int:
        """A variable that nobody has asked for lately: an answer with its number is the fence's own."""
        return next(number for number in self._variables if number not in self._asked_for)

    def written(self, exchange: Exchange, now: float, deadline: float) -> None:
        """Note that the frame has been handed to the port, and until when its answer is waited for."""
        self.counters["frames_sent"] += 1
        self._written += 1
        exchange.number = self._written
        command = exchange.command
        if isinstance(command, GetVariable) and exchange is not self._fence:
            self._asked_for.append(command.number)
        silent = self._is_silent(command)
        if command.code == EndPositionUpload.code:  # POF, with which an upload begins, too
            self.upload.note_written(command, exchange.number, silent=silent)
        if exchange.proves is not None:
            exchange.proves.note_asked(exchange.number, deadline)
        self._copies.note_written(command, exchange.number, now, silent=silent)
        if silent:
            self._said_silently += 1
        exchange.unheard = self.unheard
        if silent:
            exchange.settle(Answered(confirmed=False))
        elif exchange.lane is Lane.STOP:
            exchange.deadline = deadline + (STANDSTILL_S if isinstance(command, StopAllDecelerating) else 0.0)
            self._stopping.append(exchange)
        elif command.starts_motion() and command.answered is not row.WhenAnswered.AT_ONCE:
            self._motion = exchange
        else:
            exchange.deadline = deadline
            self._awaiting = exchange
        exchange.tell_written(now)

    def _is_silent(self, command: FicsCommand[Any]) -> bool:
        """Whether it gets no answer in this mode; a change of mode is answered as the new mode answers."""
        mode = command.mode if isinstance(command, SetCommunicationMode) else self.mode
        return mode == HostMode.VER_2 and not command.is_query()

    # what comes back

    def heard(self, frame: Frame, now: float) -> Callable[[], None] | None:
        """Credit a frame. What it gives back tells who waits; it can be called after the next write."""
        if isinstance(frame, Garbage):
            self.counters["garbage"] += 1
            self._noise(frame.why)
            return None
        for exchange in self._under_way():
            outcome = exchange.take(frame)
            if outcome is not None:
                self._copies.note(exchange.command, exchange.number, frame, now)
            if isinstance(outcome, Reply):
                exchange.deadline = now + exchange.timeout_s
                return None
            if outcome is not None:
                self.counters["replies"] += 1
                if self.upload.may_be_open or isinstance(outcome, Refusal):
                    self._learn_of_upload(exchange, outcome)
                if exchange is self._fence and isinstance(outcome, Refusal):
                    self._let_go(exchange)
                    self._fence_failed()  # a refusal has no number of its own, so it proves nothing
                    return None
                self._answered(exchange)
                return lambda: exchange.settle(outcome)
        if self._is_late(frame):
            return None
        self.counters["strays"] += 1
        self._noise("an answer to another command")
        self.on_stray(frame)
        return None

    def _learn_of_upload(self, exchange: Exchange, outcome: Outcome) -> None:
        doubtful = self.upload.note_outcome(exchange.command, exchange.number, outcome)
        if doubtful and self.in_step:
            self._lose_step()  # the fence ends the upload

    def _under_way(self) -> list[Exchange]:
        """What awaits its answer, in the order in which it was written: a robot answers equal names so."""
        waiting = [self._awaiting, *self._stopping, self._motion]
        return sorted((it for it in waiting if it is not None), key=lambda it: it.number)

    def _noise(self, what: str) -> None:
        """Something came that nobody can have wanted: whatever is awaited may have been it."""
        self.doubts += 1
        exchange = self._awaiting
        if exchange is not None and exchange is not self._fence:
            self._doubt(exchange, _unusable(GarbledReply, exchange, f"{what} came back"))

    def _is_late(self, frame: Frame) -> bool:
        """An answer that comes before the fence can only belong to the exchange in doubt.

        A refusal of the fence's name may be that of a fence that was given up, for it has no number.
        """
        suspect = self._suspect
        if isinstance(frame, Refusal) and frame.name in FENCES:
            return False
        outcome = suspect.take(frame) if suspect and suspect.late_answer is None else None
        if suspect is None or outcome is None:
            return False
        self.counters["late_replies"] += 1
        if not isinstance(outcome, Reply):
            suspect.late_answer = outcome
        return True

    def _answered(self, exchange: Exchange) -> None:
        self._let_go(exchange)
        self.online = True
        if exchange is self._fence:
            self._fence = None
            self._rule_out_answers_before(exchange)
            self._copies.rule_out()
            self._regain_step()

    def _rule_out_answers_before(self, fence: Exchange) -> None:
        """What was to be answered at once and was not never will be; a decelerating stop is at standstill."""
        for stop in [it for it in self._stopping if it.number < fence.number]:
            if not isinstance(stop.command, StopAllDecelerating):
                self._doubt(stop, _unusable(NoReply, stop, "no answer came"))

    def _let_go(self, exchange: Exchange) -> None:
        if exchange in self._stopping:
            self._stopping.remove(exchange)
        elif exchange is self._motion:
            self._motion = None
        else:
            self._awaiting = None

    # time

    def deadline(self) -> float | None:
        """When the next answer is overdue."""
        return min((it.deadline for it in self._under_way() if it.deadline is not None), default=None)

    def pass_deadlines(self, now: float, resumes_at: float | None) -> None:
        """Give up waiting for what is overdue; `resumes_at` is set while a line has begun and may go on."""
        for exchange in self._under_way():
            if exchange.deadline is None or exchange.deadline > now:
                continue
            if resumes_at is not None and now < resumes_at:
                exchange.deadline = resumes_at
                continue
            self.counters["timeouts"] += 1
            self._doubt(exchange, _unusable(NoReply, exchange, "no answer came"))

    def give_up(self, motion: Exchange) -> None:
        """A motion has ended, and its answer will not come: fence now, so that none comes late."""
        if motion is self._motion:
            self._motion = None
            self._lose_step()

    # doubt and certainty

    def _doubt(self, exchange: Exchange, reason: NoReply) -> None:
        """An exchange has no usable answer: fence the line before its outcome is told."""
        self._let_go(exchange)
        self.doubts += 1
        if exchange is self._fence:
            self._fence_failed()
        elif exchange.lane is Lane.STOP:
            exchange.settle(reason)
        else:
            exchange.doubt = reason
            self._suspect = exchange
            self._lose_step()

    def _lose_step(self, *, in_doubt: bool = True) -> None:
        self.in_step = False
        self._fence_tries = 0
        self.upload.begin_fence(in_doubt=in_doubt)

    def _fence_failed(self) -> None:
        self._fence = None
        self._fence_tries += 1
        if self._fence_tries < FENCE_TRIES:
            return
        self._went_silent()
        if self._suspect is not None:
            self._suspect.repeats = 0
        self._regain_step()

    def _went_silent(self) -> None:
        was_online, self.online = self.online, False
        waiting, self._queue = self._queue, deque()
        for exchange in waiting:
            exchange.settle(offline_error(self.robot_id))
        if was_online:
            self.on_silence()

    def _regain_step(self) -> None:
        self.in_step = True
        suspect, self._suspect = self._suspect, None
        if suspect is None:
            return
        if suspect.late_answer is not None:
            suspect.settle(suspect.late_answer)
        elif suspect.repeats > 0:
            suspect.repeats -= 1
            self.counters["repeats"] += 1
            suspect.start_over()
            self._urgent.appendleft(suspect)
        elif suspect.doubt is not None:
            suspect.settle(suspect.doubt)

    # the end

    def lose_motion(self, reason: NoReply, unsent: Cancelled) -> None:
        """The robot has forgotten what it was doing; what was to follow is not written."""
        self.doubts += 1
        motion, self._motion = self._motion, None
        if motion is not None:
            motion.settle(reason)
        self._withdraw_commands(unsent)

    def break_off(self, lost: NoReply, unsent: Cancelled) -> None:
        """The port has gone: what was written may have been executed, what waited was not."""
        self.doubts += 1
        written = [*self._under_way(), *([self._suspect] if self._suspect else [])]
        waiting = [*self._stops, *self._urgent, *self._queue]
        self._awaiting = self._motion = self._suspect = self._fence = None
        self._stopping, self.in_step = [], True
        self._stops, self._urgent, self._queue = deque(), deque(), deque()
        for exchange in written:
            exchange.settle(exchange.late_answer or NoReply(lost.detail, _remedy(exchange), exchange.command))
        for exchange in waiting:
            exchange.settle(unsent)


def offline_error(robot_id: str) -> RobotOffline:
    """The error of whoever asks a robot that does not answer."""
    return RobotOffline(
        f"Robot {robot_id} gives no usable answer; nothing was sent.",
        "Check its power, its cable, its port and its teaching terminal.",
    )


def _unusable(kind: type[NoReply], exchange: Exchange, what: str) -> NoReply:
    sent = f"{exchange.command.wire_name()} was sent, and {what}."
    return kind(sent, _remedy(exchange), exchange.command)


def _remedy(exchange: Exchange) -> str:
    if isinstance(exchange.command, TakeCurrentError):
        return "What it would have told is gone: read the details of the latest error (ERD)."
    if exchange.command.retry is Retry.READ:
        return "Ask again."
    if exchange.command.retry is Retry.SETTING:
        return "Read back whether it was set."
    return "Read status and position before anything else."
