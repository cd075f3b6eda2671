"""What is being said on a line: what goes next, what awaits its reply, and whether the line is in step.

One exchange is under way at a time; only stops may be written while it waits for its reply. When a reply
stays away or cannot be understood, the line is out of step: nothing but stops is sent until a fence, the read
of a position entry whose number comes back, has proved that every earlier reply was seen or will never come.

No clock and no port: times are given, frames are taken and handed out.
"""

import random
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import cycle
from math import inf
from typing import Any

from gateway.core.errors import BodyOffline, Cancelled, GarbledReply, GatewayError, NoReply, Overtaking
from gateway.core.lanes import IMPATIENT, STOPS, Lane
from gateway.core.origin import Origin, acting
from gateway.rorze.copies import Copies, ReplyFrame
from gateway.rorze.exchange import Answered, Exchange
from gateway.rorze.gate import Gate
from gateway.rorze.scheduler import Scheduler
from protocols.rorze.link import Refusal, encode
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry
from protocols.rorze.row import LAST_BODY, LINK_MASTER, RorzeCommand
from protocols.table import Retry

FENCE_TRIES = 3
NONCES = 2048
"""Position entries a fence can ask for. All take their turn, so that no late echo is the next fence's own."""
READ_REPEATS = 2
"""How often a read without a usable reply is repeated, each time after a passed fence."""
SILENT_BODIES = 3
"""When so many have been fenced in vain and not a byte was heard, nobody on the line is asked any more.

Two may hang on one fuse.
"""
TURN_S = 0.5
"""Commands and reads that others went before for so long have one turn, ahead of all but stops."""
STRICT_S = 3600.0
"""A line on which a reply came twice brackets its acknowledgements until so long after the last such copy."""

CLEAN_AFTER_S = 10.0
"""A line without an error for so long is clean: who answers neither a question nor a fence there is gone."""

NEW_STOPS = (Lane.STOP,)
LANES = tuple(Lane)


class Conversation:
    """The exchanges of one line."""

    def __init__(
        self,
        bodies: Iterable[int],
        groups: Mapping[int, list[int]] | None = None,
        *,
        introducer: str = "&",
        reply_timeout_s: float = 0.5,
        late_reply_s: float = 2.0,
        interject_stops: bool = True,
        rng: random.Random | None = None,
    ) -> None:
        self.bodies = list(bodies)
        self.groups = dict(groups or {})
        self.introducer = introducer
        self.reply_timeout_s = reply_timeout_s
        self.late_reply_s = late_reply_s
        self.interject_stops = interject_stops
        self.gate = Gate()
        self.scheduler = Scheduler()
        self.offline: set[int] = set()
        """Bodies that are not asked any more, but by probes."""
        self.silent: set[int] = set()
        """Those, and the one that seems to be silent while the line is still being fenced."""
        self.counters: Counter[str] = Counter()
        self.in_step = True
        self.last_error_at: float | None = None
        self.on_online: Callable[[int], None] = lambda _body: None
        self.on_offline: Callable[[int, bool], None] = lambda _body, _asked: None
        """Told which body counts as silent, and whether it was asked itself, or nobody was heard at all."""
        self.on_strict: Callable[[bool], None] = lambda _on: None
        """Told when acknowledgements begin to be bracketed by fences, and when that is over."""
        self.on_given_up: Callable[[], None] = lambda: None
        """Told that a body is not asked any more, but by probes."""
        dice = rng or random.Random()  # noqa: S311  # against mix-ups, not against people
        self._nonces = cycle(dice.sample(range(NONCES), NONCES))
        self._urgent: deque[Exchange] = deque()
        self._awaiting: Exchange | None = None
        self._stops: list[Exchange] = []
        self._passed_over: dict[Lane, float] = {}
        """Since when a lane has had no turn, where people wait for it or a fence has gone ahead."""
        self._suspect: Exchange | None = None
        self._fence: Exchange | None = None
        self._fence_for = self._fence_body = 0
        """Whose copies the fence rules out, and who is asked: others stand for groups and the dead."""
        self._fence_tries = 0
        self._fenced_in_silence = 0
        self._copies = Copies(late_reply_s)
        self._fenced: set[int] = set()
        """Who has said nothing since a fence."""
        self._strict_until: float | None = None
        self._was_clean = True
        """When it lost its step."""
        self._heard_at: dict[int, float] = {}

    # what goes next

    def frame_of(self, body: int, command: RorzeCommand[Any]) -> bytes:
        """Build the frame of a command as this line writes it.

        The old forms have one digit of body number: groups and the link master have no place in it.
        """
        return encode(body, command, self.introducer if body <= 0xF else "&")

    def exchange(self, body: int, command: RorzeCommand[Any], lane: Lane) -> Exchange:
        """Build an exchange: its frame, its stop epoch, how long it takes, and how often it is repeated."""
        return Exchange(
            body,
            command,
            self.frame_of(body, command),
            lane,
            epoch=self.gate.epoch(body),
            timeout_s=self.reply_timeout_s + 2 * command.takes_s,
            repeats=READ_REPEATS if command.may_repeat() else 0,
        )

    def self_identifying_read(self, body: int) -> Exchange:
        """Build a read whose reply nothing else can be mistaken for: its number is used once in 2048."""
        slot = PositionReference(position=next(self._nonces))
        exchange = self.exchange(body, GetNumberedPositionEntry(entry=slot), Lane.READ)
        exchange.self_identifying = True
        exchange.repeats = 0
        return exchange

    def put_first(self, exchange: Exchange) -> None:
        """Queue an exchange of the line's own set-up ahead of everything but stops and fences."""
        exchange.repeats = READ_REPEATS  # absolute and harmless: saying it again changes nothing
        self._urgent.append(exchange)

    def awaits_replies(self) -> bool:
        """Whether anything was written that is neither answered nor given up."""
        return self._awaiting is not None or bool(self._stops)

    def has_something(self) -> bool:
        """Whether anything could go; asked first, because it costs less than asking the port."""
        if self._awaiting is not None:
            return self.scheduler.has_stops()
        return not self.in_step or bool(self._urgent) or bool(self.scheduler)

    def next(self, now: float, *, ready: bool) -> Exchange | None:
        """Take the exchange that is to be written now, the gate's refusals settled; None if none may go."""
        while (exchange := self._choose(now, ready=ready)) is not None:
            refusal = self.gate.refuses(exchange, now)
            if refusal is None:
                return exchange
            if exchange is self._fence:
                self._fence_failed()
            else:
                exchange.withdraw(refusal)
        return None

    def _choose(self, now: float, *, ready: bool) -> Exchange | None:
        if self._held_up():
            return self._interjected() if self.interject_stops else None
        if ready and self.in_step and not self._urgent:
            return self._interposed(self._wanted(now), now, self.scheduler.put_back)
        stop = self.scheduler.next(NEW_STOPS, self._not_under_way)
        if stop is not None:
            return stop
        if not self.in_step:
            return self._new_fence()
        if self._urgent:
            return self._interposed(self._urgent.popleft(), now, self._urgent.appendleft)
        return self.scheduler.next(STOPS, self._not_under_way)

    def _held_up(self) -> bool:
        """Whether nothing but stops may go before a reply has come."""
        return self._awaiting is not None or (bool(self._stops) and any(map(self._holds_up, self._stops)))

    def _holds_up(self, stop: Exchange) -> bool:
        """Only a link that takes one frame at a time has to wait for what the dead do not say."""
        return not self.interject_stops or stop.body not in self.offline

    def _interjected(self) -> Exchange | None:
        """A stop before the reply under way; repeated ones leave gaps, or fences would never have a turn."""
        return self.scheduler.next(NEW_STOPS if self._awaiting is None else STOPS, self._not_under_way)

    def _not_under_way(self, exchange: Exchange) -> bool:
        return all(exchange.key != stop.key for stop in self._stops)

    def _wanted(self, now: float) -> Exchange | None:
        may_go = self._not_under_way if self._stops else None
        while (exchange := self.scheduler.next(self._lanes(now), may_go)) is not None:
            if not exchange.abandoned():
                if self._passed_over or exchange.lane is not Lane.READ:
                    self._note_turn(exchange.lane, now)
                return exchange
        return None

    def _lanes(self, now: float) -> tuple[Lane, ...]:
        """Who goes first: a lane that was passed over for long goes once before all but stops."""
        for lane, since in self._passed_over.items():
            if now - since >= TURN_S:
                return (Lane.STOP, lane, *LANES)
        return LANES

    def _note_turn(self, taken: Lane, now: float) -> None:
        waiting = [lane for lane in IMPATIENT if lane is not taken and self.scheduler.has(lane)]
        self._passed_over = {lane: self._passed_over.get(lane, now) for lane in waiting}

    def _interposed(
        self, exchange: Exchange | None, now: float, put_back: Callable[[Exchange], None]
    ) -> Exchange | None:
        """Where a copy of an earlier reply would answer this command, a fence goes first."""
        if exchange is None or not self._wants_fence(exchange, now) or self.gate.refuses(exchange, now):
            return exchange
        put_back(exchange)
        self._passed_over[exchange.lane] = -inf  # what others are told meanwhile could ask for another fence
        self._lose_step(exchange.body)
        return self._new_fence()

    def _wants_fence(self, exchange: Exchange, now: float) -> bool:
        if exchange.lane in STOPS:
            return False
        opens_bracket = self._is_bracketed(exchange) and exchange.body not in self._fenced
        return opens_bracket or self._copies.could_answer(exchange, now)

    def _is_bracketed(self, exchange: Exchange) -> bool:
        return self.strict and exchange.lane is Lane.COMMAND

    def written(self, exchange: Exchange, now: float, deadline: float) -> None:
        """Note that the frame has been handed to the port, and until when its reply is waited for."""
        self.counters["frames_sent"] += 1
        exchange.written_at, exchange.deadline, exchange.doubt = now, deadline, None
        if exchange.lane in STOPS:
            self._stops.append(exchange)
        else:
            self._awaiting = exchange
        if exchange.on_written is not None:
            exchange.on_written(now)

    # what comes back

    def heard(self, frame: ReplyFrame, now: float) -> Callable[[], None] | None:
        """Credit a reply. What it gives back tells those who wait; it can be called after the next write."""
        self._fenced_in_silence = 0
        self._fenced.discard(frame.body)
        for exchange in (self._awaiting, *self._stops):
            if exchange is not None and (outcome := exchange.credit(frame, now)) is not None:
                self._heard_at[frame.body] = now
                self.counters["replies"] += 1
                if exchange.lane not in STOPS:  # an equal one is repeated before its reply has come
                    self._copies.note(exchange, frame, now)
                self._answered(exchange)
                return self._bracket(exchange, outcome) or partial(exchange.settle, outcome)
        if not self._is_late(frame, now):
            self._stray(frame, now)
        return None

    def _stray(self, frame: ReplyFrame, now: float) -> None:
        is_copy = self._copies.is_one(frame)
        self.counters["duplicates" if is_copy else "strays"] += 1
        if is_copy:
            self._be_strict(now)
        self.noise("the reply to another command", now)

    def noise(self, what: str, now: float) -> None:
        """Something came that nobody can have wanted: whatever is awaited may have been it.

        A fence waits on: noise must not use up its tries, and its own reply cannot be mistaken.
        """
        self._fenced_in_silence = 0
        self._erred(now)
        exchange = self._awaiting
        if exchange is not None and not exchange.self_identifying:
            self._doubt(exchange, _unusable(GarbledReply, exchange, f"{what} came back"))

    def _under_way(self) -> list[Exchange]:
        return self._stops[:] if self._awaiting is None else [self._awaiting, *self._stops]

    def _is_late(self, frame: ReplyFrame, now: float) -> bool:
        """A reply that comes before the fence can only belong to the exchange in doubt.

        A refusal with the fence's code may be that of the fence: it has no number.
        """
        if isinstance(frame, Refusal) and frame.code == GetNumberedPositionEntry.code:
            return False
        suspect = self._suspect
        outcome = suspect.credit(frame, now) if suspect else None
        if suspect is None or outcome is None:
            return False
        if suspect.doubt is not None and isinstance(outcome, Answered):
            outcome = outcome.as_late()
        if suspect.late_answer is None:
            self.counters["late_replies"] += 1
            suspect.late_answer = outcome
        else:
            self._stray(frame, now)
            suspect.late_answer = _last_of(suspect, suspect.late_answer, outcome)
        self._copies.note(suspect, frame, now)
        return True

    def _bracket(self, exchange: Exchange, outcome: Answered | Refusal) -> Callable[[], None] | None:
        """Where replies come twice, a fence has to show that this one was the last before it is told."""
        if not self._is_bracketed(exchange):
            return None
        exchange.late_answer, self._suspect = outcome, exchange
        self._lose_step(exchange.body)
        return _nothing

    def _answered(self, exchange: Exchange) -> None:
        if exchange in self._stops:
            self._stops.remove(exchange)
        else:
            self._awaiting = None
        if exchange.self_identifying:
            self._rule_out_copies(exchange.body)
        if exchange.body in self.silent or exchange.body in self.offline:
            self.offline.discard(exchange.body)
            self.silent.discard(exchange.body)
            self.on_online(exchange.body)
        if exchange is self._fence:
            self._fence = None
            if self._fence_for > LAST_BODY:
                self._rule_out_copies(self._fence_for)
            self._regain_step()

    def _rule_out_copies(self, body: int) -> None:
        """Nothing it has said before is on its way any more."""
        self._copies.forget(body)
        self._fenced.add(body)

    # strictness

    @property
    def strict(self) -> bool:
        """Whether a reply came twice here, so that every acknowledgement is bracketed by fences."""
        return self._strict_until is not None

    def _be_strict(self, now: float) -> None:
        was_strict, self._strict_until = self.strict, now + STRICT_S
        if not was_strict:
            self.on_strict(True)

    def _be_lenient(self) -> None:
        was_strict, self._strict_until = self.strict, None
        if was_strict:
            self.on_strict(False)

    # time

    def deadline(self) -> float | None:
        """When the next reply is overdue, or the line has been without copies for long enough."""
        overdue = [it.deadline for it in self._under_way() if it.deadline is not None]
        return min(overdue if self._strict_until is None else [*overdue, self._strict_until], default=None)

    def pass_deadlines(self, now: float, resumes_at: float | None) -> None:
        """Give up waiting for what is overdue; `resumes_at` is set while a reply has begun and may go on."""
        if self._strict_until is not None and self._strict_until <= now:
            self._be_lenient()
        for exchange in self._under_way():
            if exchange.deadline is None or exchange.deadline > now:
                continue
            written_at = now if exchange.written_at is None else exchange.written_at
            given_up_at = written_at + exchange.timeout_s + self.late_reply_s
            if resumes_at is not None and now < min(resumes_at, given_up_at):
                exchange.deadline = min(resumes_at, given_up_at)
                continue
            self.counters["timeouts"] += 1
            if not self._was_to_be_expected(exchange):
                self._erred(now)
            self._doubt(exchange, _unusable(NoReply, exchange, "no reply came"))

    def _was_to_be_expected(self, silent: Exchange) -> bool:
        """Whether its silence tells nothing of the line: it is that of a body that may well be absent."""
        is_probe = silent.self_identifying and silent is not self._fence
        return is_probe or silent.body in self.offline

    # doubt and certainty

    def _erred(self, now: float) -> None:
        """A reply was missing or garbled."""
        if self.in_step:
            self._was_clean = self.last_error_at is None or now - self.last_error_at > CLEAN_AFTER_S
        self.last_error_at = now

    def _doubt(self, exchange: Exchange, reason: NoReply) -> None:
        """An exchange has no usable reply: fence the line before its outcome is told."""
        if exchange.lane in STOPS:
            self._stops.remove(exchange)
            exchange.settle(reason)
            return
        self._awaiting = None
        if exchange is self._fence:
            self._fence_failed()
        elif exchange.self_identifying:
            exchange.settle(reason)
        else:
            exchange.doubt = reason
            self._suspect = exchange
            self._lose_step(exchange.body)

    def _lose_step(self, body: int) -> None:
        """From now on nothing but stops is sent until a fence has passed."""
        self.in_step = False
        self._fence_for = body
        self._fence_body, self._fence_tries, self._fenced_in_silence = self._fence_target(body), 0, 0

    def _fence_target(self, body: int) -> int:
        """Whom to ask for proof: the body itself, or one that stands for the group or the link master."""
        if body <= LAST_BODY:
            return body
        candidates = self.groups.get(body) or self.bodies
        alive = [it for it in candidates if it not in self.offline]
        return next(iter(self.heard_last_first(alive or candidates)), 0)

    def heard_at(self, body: int) -> float | None:
        """When a body last answered; not as a member of a group."""
        return self._heard_at.get(body)

    def heard_last_first(self, bodies: Iterable[int]) -> list[int]:
        """Order bodies by how well they can witness that the line still works."""
        return sorted(bodies, key=lambda it: self._heard_at.get(it, -inf), reverse=True)

    @acting(Origin("gateway: fence"))
    def _new_fence(self) -> Exchange:
        self._fence = self.self_identifying_read(self._fence_body)
        self._fence.timeout_s = max(self.reply_timeout_s, self.late_reply_s / FENCE_TRIES)
        self.counters["fences"] += 1
        return self._fence

    def _fence_failed(self) -> None:
        self._fence = None
        self._fence_tries += 1
        if self._was_clean and self._suspect is not None and self._suspect.body == self._fence_body:
            self._tell_silent(self._fence_body, asked=True)
        if self._fence_tries < FENCE_TRIES:
            return
        self._fenced_in_silence += 1
        self._went_offline(self._fence_body, asked=True)
        alive = [body for body in self.bodies if body not in self.offline]
        if alive and self._fenced_in_silence < SILENT_BODIES:
            self._fence_body, self._fence_tries = self.heard_last_first(alive)[0], 0
            return
        for body in alive:
            self._went_offline(body, asked=False)
        # Late replies have had their time; the probes tell when somebody is back.
        self._rule_out_copies(self._fence_for)
        if self._suspect is not None:
            self._suspect.repeats = 0
        self._regain_step()

    def _regain_step(self) -> None:
        self.in_step = True
        suspect, self._suspect = self._suspect, None
        if suspect is not None:
            self._resolve(suspect)

    def _resolve(self, exchange: Exchange) -> None:
        if exchange.late_answer is not None:
            exchange.settle(exchange.late_answer)
        elif exchange.repeats > 0 and not exchange.abandoned() and exchange.body not in self.offline:
            exchange.repeats -= 1
            self.counters["repeats"] += 1
            if exchange.lane is Lane.COMMAND:
                self._urgent.appendleft(exchange)
            else:
                self.scheduler.put_back(exchange)
        elif exchange.doubt is not None:
            exchange.settle(exchange.doubt)

    def _went_offline(self, body: int, *, asked: bool) -> None:
        if body in self.offline:
            return
        self.offline.add(body)
        for exchange in self.scheduler.remove(
            lambda it: it.body == body and it.lane not in STOPS and not it.self_identifying
        ):
            exchange.withdraw(offline_error(body))
        self._tell_silent(body, asked=asked)
        self.on_given_up()

    def _tell_silent(self, body: int, *, asked: bool) -> None:
        if body not in self.silent:
            self.silent.add(body)
            self.on_offline(body, asked)

    # the end

    def break_off(self, lost: NoReply, unsent: Cancelled) -> None:
        """The port has gone: what was written may have been executed, what waited was not."""
        written = [*self._under_way(), *([self._suspect] if self._suspect else [])]
        waiting = [*self._urgent, *self.scheduler.remove(lambda _: True)]
        self._awaiting = self._suspect = self._fence = None
        self._stops, self._urgent, self.in_step = [], deque(), True
        self._copies.forget(LINK_MASTER)  # set up anew, maybe without bodies that could prove anything
        self._be_lenient()
        self.offline |= self.silent  # nobody finds out any more, but the probes
        for exchange in written:
            exchange.settle(exchange.late_answer or NoReply(lost.detail, _remedy(exchange), exchange.command))
        for exchange in waiting:
            exchange.withdraw(unsent)

    def revoke(self, why: Overtaking) -> None:
        """Write no command that was admitted before now."""
        self.gate.revoke(why)
        self.cancel(lambda it: it.lane is Lane.COMMAND, why())

    def fence(self) -> None:
        """Prove anew that no earlier reply is still to come."""
        self._lose_step(LINK_MASTER)

    def cancel(self, unwanted: Callable[[Exchange], bool], reason: GatewayError) -> None:
        """Take out of the queue what is not wanted any more."""
        for exchange in self.scheduler.remove(unwanted):
            exchange.withdraw(reason)


def offline_error(body: int) -> BodyOffline:
    """The error of whoever asks a body that does not answer."""
    return BodyOffline(f"Body {body:02X} does not answer; nothing was sent.", "Check its power and cable.")


def _last_of(
    exchange: Exchange, first: Answered | Refusal | NoReply, last: Answered | Refusal
) -> Answered | Refusal | NoReply:
    """What two replies to one command tell: the last counts, but one that contradicts leaves a doubt."""
    if type(first) is type(last):
        return last
    return _unusable(GarbledReply, exchange, "replies that contradict each other came back")


def _nothing() -> None:
    """Tell nobody anything yet."""


def _unusable(kind: type[NoReply], exchange: Exchange, what: str) -> NoReply:
    sent = f"{exchange.command.code} was sent to body {exchange.body:02X}, and {what}."
    return kind(sent, _remedy(exchange), exchange.command)


def _remedy(exchange: Exchange) -> str:
    if exchange.command.may_repeat():
        return "Ask again."
    if exchange.command.retry_class() is Retry.SETTING:
        return "Read back whether it was set."
    if exchange.command.steps_index():
        return "Read status, position and the position index (3ID) before anything else."
    return "Read status and position before anything else."
