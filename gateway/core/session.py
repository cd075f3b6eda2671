"""A line's conversation: the next frame, the frames that await replies, and whether the line is in step.

One exchange is under way at a time; only stops may be written while it waits for its reply. When a reply
stays away or cannot be understood, the line is out of step: nothing but stops is sent until a fence, a query
whose number comes back, has proved that every earlier reply was seen or will never come.

No clock and no port: times are given, frames are taken and handed out.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from enum import Enum, auto
from functools import partial
from typing import Any, ClassVar, Generic, NamedTuple

from gateway.core.errors import Cancelled, GarbledReply, GatewayError, NoReply, Overtaking
from gateway.core.exchange import IMPATIENT, STOPS, Exchange, F, Lane, More, X, current_series
from gateway.core.false_replies import Copies, Echo
from gateway.core.fence import FENCE_TRIES, Action, Fence, FenceEvent, State
from gateway.core.gate import Gate
from gateway.core.load import Load
from gateway.core.origin import FENCE
from gateway.core.scheduler import Scheduler, is_abandoned
from gateway.core.supervisor import insist
from protocols.lines import Garbage
from protocols.members import at_hand

READ_REPEATS = 2
"""Times that a read without a usable reply is repeated, each after a passed fence."""

NEW_STOPS = (Lane.STOP,)

Settle = Callable[[], None]
"""Gives the waiters their outcome; it can be called after the next write."""


@at_hand
class Awaited(Enum):
    """The frames that have to wait for the reply to a frame that was written."""

    FIRST = auto()
    """All but stops."""
    BESIDE = auto()
    """Nothing: others are asked and answered meanwhile."""
    NEVER = auto()
    """Nothing: there is no reply."""


class SessionTerms(NamedTuple):
    """Times in seconds and habits of a line, as it is configured."""

    reply_timeout_s: float
    late_reply_s: float
    interject_stops: bool
    set_up_target: int
    """The target whose exchanges are the set-up."""


class OnWire(list[X], Generic[X]):
    """The exchanges that await their replies, in the order in which they were written."""

    __slots__ = ("all_answered", "first", "written")

    def __init__(self) -> None:
        super().__init__()
        self.first: X | None = None
        """The one for which all but stops have to wait."""
        self.written = 0
        """Count of the frames written."""
        self.all_answered = False
        """True when the reply to the last frame has come, where every frame has one."""

    def let_go(self, exchange: X) -> None:
        """Await the reply to one no longer."""
        self.remove(exchange)
        if exchange is self.first:
            self.first = None


class ReplyOrder(Generic[X]):
    """The replies of late: a fence proves something only where they come in the order of writing."""

    __slots__ = ("numbered", "on_overtaken", "timed_out")

    def __init__(self) -> None:
        self.on_overtaken: Callable[[X, X], None] = lambda _late, _by: None
        """Called with an exchange that was answered too late, and the later fence answered before it."""
        self.numbered: X | None = None
        """The last answered exchange whose reply carries a number."""
        self.timed_out: X | None = None
        """The last exchange that timed out; its reply may still arrive, until a later one has its name."""


class Session(ABC, Generic[X, F]):
    """The exchanges of one line. A family adds how its replies are read, and what else it has to know."""

    answers_all: ClassVar = False
    """True if every frame has a reply: after that to the last one nothing can wait in the port."""

    def __init__(
        self,
        *,
        target: str,
        set_up_target: int,
        replies_remembered: int,
        reply_timeout_s: float,
        late_reply_s: float,
        interject_stops: bool = True,
    ) -> None:
        self.terms = SessionTerms(reply_timeout_s, late_reply_s, interject_stops, set_up_target)
        self.gate: Gate[X] = Gate(set_up_target)
        self.scheduler: Scheduler[X] = Scheduler(target)
        self.offline: set[int] = set()
        """Targets that are not asked any more, but to find out whether they are back."""
        self.counters: Counter[str] = Counter()
        self.load = Load()
        self.strict = False
        """True if a fence has to prove that the reply to a command was the last."""
        self.on_stray: Callable[[F], None] = lambda _: None
        """Called with a reply that comes without a question."""
        self.on_silence: Callable[[], None] = lambda: None
        """Called when the only target does not answer."""
        self.echo: Echo[X] = Echo(self.shows_echo, lambda _found: None)
        self.order: ReplyOrder[X] = ReplyOrder()
        self._copies: Copies[X, F] = Copies(replies_remembered)
        self.sent: OnWire[X] = OnWire()
        """The exchanges that await their replies."""
        self._suspect: X | None = None
        """The exchange in doubt: the fence proves that its reply does not come any more."""
        self._fence = Fence()

    @property
    def doubts(self) -> int:
        """Replies that stayed away, could not be understood, or came unasked."""
        return self._fence.doubts

    # what a family adds

    @abstractmethod
    def fence_query(self) -> X:
        """Build a query whose reply nothing else can be mistaken for."""

    def goes_before_fence(self) -> X | None:
        """Give the frame that has to be sent before the fence can be answered, if any."""
        return None

    def goes_before_stop(self) -> X | None:
        """Give the frame that has to be sent before a stop can be heard, if any."""
        return None

    def wants_fence(self, exchange: X, now: float) -> bool:
        """Say whether a fence has to go before it."""
        return self._copies.could_answer(exchange, exchange.target, now)

    def was_written(self, exchange: X, _now: float) -> Awaited:
        """A frame has been handed to the port: what has to wait for its reply."""
        return Awaited.BESIDE if exchange.lane in STOPS else Awaited.FIRST

    def must_choose(self) -> bool:
        """Say whether each waiting exchange has to be asked if it may be written now."""
        return bool(self.sent)

    def may_follow(self, _exchange: X) -> bool:
        """Say whether it may be written now, before the replies to frames under way."""
        return True

    def holds_up(self, _sent: X) -> bool:
        """Say whether all but stops have to wait for an exchange that is under way beside."""
        return False

    def shows_echo(self, _exchange: X) -> bool:
        """Tell whether its frame shows an echo: no reply to it can equal it."""
        return True

    def line_of(self, _frame: F) -> bytes:
        """The line as which a frame came, without its end; empty where no frame can be an echo."""
        return b""

    def is_answered_in_order(self, exchange: X) -> bool:
        """Say whether its reply comes before that to a later fence, and is known to be its own."""
        return exchange.lane not in STOPS

    def has_time(self) -> bool:
        """Say whether the fence's target may have all its tries, because no other target is waited for."""
        return True

    def witness_failed(self) -> bool:
        """Give up the target that the fences have asked; whether there is another to ask."""
        self.on_silence()
        return False

    def is_refusal_of_fence(self, _frame: F) -> bool:
        """Say whether a frame may be the refusal of a fence, which carries no number."""
        return False

    def note_reply(self, exchange: X, frame: F, now: float) -> None:
        """A reply was credited, or a part of one."""

    def learn(self, exchange: X, _outcome: Any, frame: F, now: float) -> None:
        """An exchange has its whole reply."""
        self.note_reply(exchange, frame, now)

    def fence_passed(self, fence: X) -> None:
        """Note that no reply to an earlier frame is on its way any more."""

    def was_missed(self, exchange: X, now: float) -> None:
        """Note that no reply came in time."""

    # what goes next

    @property
    def in_step(self) -> bool:
        """True while replies can be believed."""
        return self._fence.in_step

    def epoch(self, target: int) -> int:
        """The epoch of what is asked here and now: a series has those of its beginning."""
        now = self.gate.epoch(target)
        series = current_series() if self.scheduler.holders else None
        return now if series is None else series.epochs.get(target, now)

    def submit(self, exchange: X) -> X:
        """Queue an exchange; gives the one that serves it.

        :raises QueueFull: too many wait for its target already.
        """
        if exchange.lane is Lane.COMMAND and self.gate.is_overtaken(exchange):
            exchange.settle(self.gate.overtaken(exchange.target))
            return exchange
        if self.scheduler.holders and exchange.lane in IMPATIENT:
            exchange.series = current_series()
        queued = self.scheduler.submit(exchange)
        if exchange.lane is Lane.STOP and queued is exchange:
            first = self.goes_before_stop()
            if first is not None:
                self.scheduler.submit(first)
        return queued

    def put_first(self, exchange: X) -> None:
        """Queue an exchange of the line's own set-up ahead of everything but stops and fences."""
        self.scheduler.first.append(exchange)

    def waiting(self, lane: Lane) -> int:
        """Number of exchanges of a lane that wait to be written."""
        urgent = sum(first.lane is lane for first in self.scheduler.first) if self.scheduler.first else 0
        return urgent + self.scheduler.waiting(lane)

    def has_something(self) -> bool:
        """Say whether anything could go; asked first, because it costs less than asking the port."""
        if self.sent.first is not None:
            return any(self.scheduler.stops)
        return any(self.scheduler.lanes) or bool(self.scheduler.first) or not self._fence.in_step

    def is_urgent(self) -> bool:
        """Tell whether a stop waits, or a question that a motor waits for."""
        return any(self.scheduler.stops) or bool(self.scheduler.lanes[Lane.VERIFY])

    def next(self, now: float, *, ready: bool) -> X | None:
        """Take the exchange that is to be written now, the gate's refusals settled; None if none may go."""
        while (exchange := self._choose(now, ready=ready)) is not None:
            refusal = self.gate.refuses(exchange, now)
            if refusal is None:
                return exchange
            if exchange is self._fence.query:
                self._fence_failed()
            else:
                exchange.withdraw(refusal)
        return None

    def _choose(self, now: float, *, ready: bool) -> X | None:
        if self.sent.first is not None or (self.sent and any(map(self.holds_up, self.sent))):
            return self._interjected() if self.terms.interject_stops else None
        if ready and self._fence.in_step and not self.scheduler.first:
            wanted = self.scheduler.next_wanted(now, self.may_follow if self.must_choose() else None)
            if wanted is None or wanted.lane in STOPS or not self.wants_fence(wanted, now):
                return wanted
            return self._interposed(wanted, now, self.scheduler.put_back)
        stop = self.scheduler.next(NEW_STOPS, self.may_follow)
        if stop is not None:
            return stop
        if not self._fence.in_step:
            return self._recovery()
        if self.scheduler.first:
            first = self.scheduler.first.popleft()
            wants_fence = self.wants_fence(first, now)
            return self._interposed(first, now, self.scheduler.first.appendleft) if wants_fence else first
        return self.scheduler.next(STOPS, self.may_follow)

    def _interjected(self) -> X | None:
        """A stop before the reply under way; repeated ones leave gaps, or fences would never have a turn."""
        return self.scheduler.next(NEW_STOPS if self.sent.first is None else STOPS, self.may_follow)

    def _interposed(self, exchange: X, now: float, put_back: Callable[[X], None]) -> X | None:
        """A fence goes before what a copy of an earlier reply would answer, if that may be written at all."""
        if self.gate.refuses(exchange, now):
            return exchange
        put_back(exchange)
        self.scheduler.owe_turn(exchange.lane)
        self._lose_step(exchange.target, doubtful=False)
        return self._recovery()

    def _recovery(self) -> X | None:
        """Give the next frame that brings the line into step again."""
        if self._fence.state is State.SILENT:
            return None
        first = self.goes_before_fence()
        if first is not None:
            first.origin = FENCE
            return first
        fence = self._fence.query = self.fence_query()
        fence.origin = FENCE
        fence.reply.timeout_s = max(self.terms.reply_timeout_s, self.terms.late_reply_s / FENCE_TRIES)
        self._fence.take(FenceEvent.ASKED)
        self.counters["fences"] += 1
        return fence

    def written(self, exchange: X, now: float, deadline: float) -> bool:
        """Note that the frame has been handed to the port, and until when its reply is waited for.

        Says whether anything else could go before that.
        """
        self.load.begin("stops" if exchange.lane in STOPS else exchange.origin.work, now)
        self.counters["frames_sent"] += 1
        self.sent.written += 1
        self.sent.all_answered = False
        if self.echo.in_a_row:
            self.echo.passed_over()
        self.echo.written.append(exchange)
        exchange.number, exchange.reply.doubt = self.sent.written, None
        exchange.reply.deadline = exchange.reply.due_at = deadline
        awaited = self.was_written(exchange, now)
        if awaited is not Awaited.NEVER:
            self.sent.append(exchange)
        if awaited is Awaited.FIRST:
            self.sent.first = exchange
        if exchange.on_written is not None:  # whatever it meets: who wrote a motion has to know it
            insist("the note that a command is on the wire", partial(exchange.on_written, now))
        return self.has_something()

    # what comes back

    def awaits_replies(self) -> bool:
        """True if anything was written that is neither answered nor given up."""
        return bool(self.sent)

    def receive(self, frame: F, now: float) -> Settle | None:
        """Credit a reply; None if it ends no exchange."""
        for exchange in self.sent:
            outcome = exchange.credit(frame, now)
            if outcome is More.MORE:
                exchange.reply.await_until(now + exchange.reply.timeout_s)
                self.note_reply(exchange, frame, now)
                return None
            if outcome is not None:
                return self._ended(exchange, outcome, frame, now)
        if self.echo.found and self._is_echo(self.line_of(frame)):
            return None
        if self._fence.take(FenceEvent.STRAY) is Action.DROP or not self._is_late(frame, now):
            self._stray(frame, now)
        return None

    def _ended(self, exchange: X, outcome: Any, frame: F, now: float) -> Settle | None:
        """An exchange has its reply."""
        self.counters["replies"] += 1
        if self.echo.in_a_row:
            self.echo.answered(exchange)
        self.sent.let_go(exchange)
        self._note_order(exchange)
        self.load.end(now)
        if self.answers_all and exchange.number == self.sent.written:
            self.sent.all_answered = True
        self.learn(exchange, outcome, frame, now)
        if exchange is self._fence.query:
            if self.is_refusal_of_fence(frame):
                self._fence_failed()
                return None
            self._fence.query = None
            self.fence_passed(exchange)
            if self._fence.take(FenceEvent.ECHO) is Action.SETTLE:
                self._settle_suspect()
        elif self.strict and exchange.lane is Lane.COMMAND:
            exchange.reply.late, self._suspect = outcome, exchange
            self._lose_step(exchange.target)
            return _nothing
        return partial(exchange.settle, outcome)

    def _is_late(self, frame: F, now: float) -> bool:
        """A reply that comes before the fence can only belong to the exchange in doubt.

        A refusal of the fence's name may be that of a fence: it has no number.
        """
        suspect = self._suspect
        if suspect is None or self.is_refusal_of_fence(frame):
            return False
        outcome = suspect.credit(frame, now)
        if outcome is None:
            return False
        first = suspect.reply.late
        if first is None:
            self.counters["late_replies"] += 1
            self._note_order(suspect)
        else:
            self._stray(frame, now)
        if outcome is not More.MORE:
            suspect.reply.late = outcome if first is None else _last_of(suspect, first, outcome)
        self.note_reply(suspect, frame, now)
        return True

    def _stray(self, frame: F, now: float, kind: str = "strays") -> None:
        """Take a reply that comes without a question."""
        self.echo.heard(self.line_of(frame))
        self.counters[kind] += 1
        late = self.order.timed_out
        if (
            late is not None
            and now < late.reply.due_at + self.terms.late_reply_s
            and late.credit(frame, now) is not None
        ):
            self._note_order(late)
            self.order.timed_out = None
        self.noise("the reply to another command", now)
        self.on_stray(frame)

    def _note_order(self, answered: X) -> None:
        """A fence proves something only on a line that answers in the order of writing."""
        echo, given_up = self.order.numbered, self.order.timed_out
        if answered.reply.self_identifying:
            self.order.numbered = answered
        elif echo is not None and answered.number < echo.number and self.is_answered_in_order(answered):
            self.counters["overtaken"] += 1
            self.order.on_overtaken(answered, echo)
        elif given_up is not None and set(given_up.reply.names) & set(answered.reply.names):
            self.order.timed_out = None

    def garbage(self, what: Garbage, now: float) -> None:
        """Hear what can be no reply."""
        if not self._is_echo(what.data):
            self.counters["garbage"] += 1
            self.noise(what.why, now)

    def _is_echo(self, line: bytes) -> bool:
        """Tell an echo on a line that is known to echo: whatever is awaited may still come."""
        if not (self.echo.heard(line) and self.echo.found):
            return False
        self.counters["echoes"] += 1
        self._fence.doubts += 1  # what is proved now, another echo may seem to answer
        return True

    def noise(self, what: str, _now: float) -> None:
        """Take bytes that make no sense: they may have been any awaited reply.

        A fence waits on: noise must not use up its tries, and its own reply cannot be mistaken.
        """
        self._fence.doubts += 1
        exchange = self.sent.first
        if exchange is not None and not exchange.reply.self_identifying:
            self._doubt(exchange, exchange.unusable(GarbledReply, f"{what} came back"))

    # time

    def deadline(self) -> float | None:
        """When the next reply is overdue."""
        return min(
            (sent.reply.deadline for sent in self.sent if sent.reply.deadline is not None), default=None
        )

    def pass_deadlines(self, now: float, resumes_at: float | None) -> None:
        """Give up waiting for what is overdue; `resumes_at` is set while a reply has begun and may go on."""
        for exchange in self.sent[:]:
            if exchange.reply.deadline is None or exchange.reply.deadline > now or exchange not in self.sent:
                continue
            given_up_at = exchange.reply.due_at + self.terms.late_reply_s
            if resumes_at is not None and now < min(resumes_at, given_up_at):
                exchange.reply.deadline = min(resumes_at, given_up_at)
                continue
            self.counters["timeouts"] += 1
            self.was_missed(exchange, now)
            self._doubt(exchange, exchange.unusable(NoReply, "no reply came"))
        if not self.sent:
            self.load.end(now)

    def wait_longer(self, seconds: float) -> None:
        """Move the deadlines of all replies by `seconds`, for which no reply could be read."""
        for exchange in self.sent:
            exchange.reply.due_at += seconds
            if exchange.reply.deadline is not None:
                exchange.reply.deadline += seconds

    # doubt and certainty

    def fence(self) -> None:
        """Prove anew that no earlier reply is still to come."""
        self._lose_step(self.terms.set_up_target)

    def _doubt(self, exchange: X, reason: NoReply) -> None:
        """An exchange has no usable reply: fence the line before it is settled."""
        self._fence.doubts += 1
        self.sent.let_go(exchange)
        if exchange is self._fence.query:
            self._fence_failed()
        elif exchange.lane in STOPS or exchange.reply.self_identifying:
            exchange.settle(reason)
        else:
            exchange.reply.doubt, self._suspect = reason, exchange
            self._lose_step(exchange.target)

    def _lose_step(self, _target: int, *, doubtful: bool = True) -> None:  # noqa: ARG002  # families heed it
        """From now on nothing but stops is sent until a fence has passed.

        It is not `doubtful` where only copies of replies have to be ruled out.
        """
        self._fence.take(FenceEvent.DOUBT)

    def _fence_failed(self) -> None:
        self._fence.query = None
        action = self._fence.take(FenceEvent.SILENCE if self.has_time() else FenceEvent.NO_TIME)
        if action is Action.GIVE_UP:
            found = self.witness_failed()
            action = self._fence.take(FenceEvent.WITNESS if found else FenceEvent.NOBODY)
        if action is Action.SETTLE:
            if self._suspect is not None:
                self._suspect.reply.repeats = 0  # late replies have had their time
            self._settle_suspect()

    def _settle_suspect(self) -> None:
        """The exchange in doubt has had its late reply, is repeated, or has had none."""
        suspect, self._suspect = self._suspect, None
        if suspect is None:
            return
        if suspect.reply.late is not None:
            suspect.settle(suspect.reply.late)
        elif suspect.reply.repeats > 0 and not is_abandoned(suspect) and suspect.target not in self.offline:
            suspect.reply.repeats -= 1
            self.counters["repeats"] += 1
            if suspect.lane is Lane.COMMAND:
                self.scheduler.first.appendleft(suspect)
            else:
                self.scheduler.put_back(suspect)
        elif suspect.reply.doubt is not None:
            self.order.timed_out = suspect
            suspect.settle(suspect.reply.doubt)

    # the end

    def break_off(self, lost: NoReply, unsent: Cancelled) -> None:
        """The port has gone: what was written may have been executed, what waited was not."""
        self._fence.doubts += 1
        written = [*self.sent, *([self._suspect] if self._suspect else [])]
        waiting = [*self.scheduler.first, *self.scheduler.remove(lambda _: True)]
        self.sent.first = self._suspect = self._fence.query = self.order.timed_out = None
        self.sent.clear()
        self.scheduler.first.clear()
        self.echo.forget()
        self._fence.take(FenceEvent.PORT_LOST)
        for exchange in written:
            exchange.settle(exchange.reply.late or NoReply(lost.detail, exchange.remedy, exchange.command))
        for exchange in waiting:
            exchange.withdraw(unsent)

    def revoke(self, why: Overtaking) -> None:
        """Write no command that was admitted before now."""
        self.gate.revoke(why)
        self.cancel(lambda exchange: exchange.lane is Lane.COMMAND, why())

    def cancel(self, unwanted: Callable[[X], bool], reason: GatewayError) -> None:
        """Take out of the queue what is not wanted any more."""
        for exchange in self.scheduler.remove(unwanted):
            exchange.withdraw(reason)


def _last_of(exchange: Exchange[Any, Any, Any], first: Any, last: Any) -> Any:
    """Decide between two replies to one command: the last counts, but one that contradicts leaves a doubt."""
    if type(first) is type(last):
        return last
    return exchange.unusable(GarbledReply, "replies that contradict each other came back")


def _nothing() -> None:
    """Settle nothing yet."""
