"""The session with an RC-400: its exchanges, silent bodies, witnesses, and replies that come twice."""

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import cycle
from math import inf
from typing import Any, NamedTuple

from gateway.core.errors import BodyOffline, Cancelled, GatewayError, NoReply
from gateway.core.exchange import STOPS, Exchange, ExpectedReply, Lane, RememberedReply, remedy_of
from gateway.core.session import READ_REPEATS as READ_REPEATS
from gateway.core.session import Awaited, Session, Settle
from gateway.rorze.errors import is_evasive
from gateway.texts import Text
from protocols.rorze.errors import lookup
from protocols.rorze.link import HALF_COMMAND_ENDS, Answer, GroupAnswer, HalfCommandEnd, Refusal
from protocols.rorze.link import frame as framed
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry
from protocols.rorze.row import LAST_BODY, LINK_MASTER, RorzeCommand
from protocols.rorze.status import SetUserComment
from protocols.table import Reply, WireFault

ReplyFrame = Answer | Refusal | GroupAnswer


@dataclass(frozen=True, slots=True)
class Answered:
    """A reply was credited; for a group, one reply or refusal for each member that is in it."""

    replies: dict[int, Reply | Refusal]
    at: float
    late: bool = False
    """True if it came after its deadline, but before the line was proved to be in step again."""
    text: str = field(default="", compare=False)
    """The text behind the code in the reply of one body, as it came."""


Outcome = Answered | Refusal | GatewayError
"""A refusal by the controller, an answer, or the reason why there is neither."""


@dataclass(eq=False, slots=True)
class RorzeExchange(Exchange[RorzeCommand[Any], ReplyFrame, Answered | Refusal]):
    """A command for a body, a group or the link master."""

    @property
    def key(self) -> tuple[int, str]:
        """Body and code, by which a reply is matched first."""
        return self.target, self.command.code

    @property
    def sent(self) -> str:
        """Code and body."""
        return f"{self.command.code} was sent to body {self.target:02X}"

    @property
    def remedy(self) -> str:
        """A command that steps the position index may have changed that, too."""
        if self.command.steps_index:
            return "Read status, position and the position index (3ID) before anything else."
        return remedy_of(self.command)

    def credit(self, frame: ReplyFrame, now: float) -> Answered | Refusal | None:
        """Read a frame as the reply to this exchange; None unless body, code and the whole grammar match."""
        if frame.code != self.command.code or frame.body != self.target:
            return None
        if isinstance(frame, Refusal):
            return None if self.reply.self_identifying else frame  # a refusal does not carry the number
        try:
            if isinstance(frame, GroupAnswer):
                replies, text = self._member_replies(frame), ""
            else:
                replies, text = {frame.body: self.command.read_reply(frame.payload)}, frame.payload
        except WireFault:
            return None
        return Answered(replies, now, self.reply.doubt is not None, text)

    def mistakes(self, said: RememberedReply) -> bool:
        """True if a copy would be credited, and be wrong (decision 10).

        It is right where the very same was asked, and asking changes nothing: that was true a moment ago.
        """
        if said.exchange.frame == self.frame:
            return not self.command.may_repeat
        return self.credit(said.frame, 0.0) is not None

    def _member_replies(self, frame: GroupAnswer) -> dict[int, Reply | Refusal]:
        return {
            member: self.command.read_reply(answer.payload) if isinstance(answer, Answer) else answer
            for member, answer in frame.members.items()
        }


REPLIES_REMEMBERED = 32
STOP_REPLY_BYTES = 24
"""Bytes of the reply to a stop, and of the message that a move has ended."""
GROUP_REPLY_BYTES, MEMBER_REPLY_BYTES = 8, 8
"""Bytes of a group's reply to a stop, and of each member's part in it, where some members were moving."""
NONCES = 2048
"""Position entries a fence can ask for. All take their turn, so that no late echo is the next fence's own."""
SILENT_BODIES = 3
"""Bodies fenced in vain without a byte heard, after which no body on the line is asked any more.

Two may hang on one fuse.
"""
STRICT_S = 3600.0
"""A line on which a reply came twice brackets its acknowledgements for this time after the last such copy."""

EVASIVE_S = 2.0
"""A body whose only answer for this time is @4C is not there; flash commands take 1.5 s (decision 61)."""
CLEAN_AFTER_S = 10.0
"""A line without an error for this time is clean: a body that answers no question and no fence is gone."""


class Presence:
    """The bodies of a line that answer, and those that do not, or refuse all they are asked."""

    def __init__(self, offline: set[int]) -> None:
        self.offline = offline
        """The bodies that are not asked any more, but by probes."""
        self.silent: set[int] = set()
        """The offline bodies, and one that seems to be silent while the line is still being fenced."""
        self.answered_late: set[int] = set()
        """The bodies that were called silent last, and answered before they were given up."""
        self.mute: set[int] = set()
        """The bodies that did not answer their last stop."""
        self.on_online: Callable[[int], None] = lambda _body: None
        self.on_offline: Callable[[int, bool], None] = lambda _body, _asked: None
        """Called with a body that counts as silent, and True if it was asked itself."""
        self._heard_at: dict[int, float] = {}
        self._evasive_since: dict[int, float] = {}
        self._refused_fence: dict[int, int | None] = {}
        """The error with which each body has refused its last fences."""

    def heard_at(self, body: int) -> float | None:
        """When a body last answered, in the event loop's time; not as a member of a group."""
        return self._heard_at.get(body)

    @property
    def last_heard_at(self) -> float:
        """Time of the last answer of any body; a group's answer is that of its members."""
        return max((at for body, at in self._heard_at.items() if body != LINK_MASTER), default=-inf)

    def latest_first(self, bodies: Iterable[int]) -> list[int]:
        """Order bodies by how well they can witness that the line still works."""
        return sorted(
            bodies, key=lambda body: (body not in self.mute, self._heard_at.get(body, -inf)), reverse=True
        )

    def answered(self, body: int, now: float, *, fence: bool) -> None:
        """A body has answered what it was asked."""
        self._heard_at[body] = now
        if fence:
            self._refused_fence.pop(body, None)

    def evades(self, body: int, now: float) -> bool:
        """True if @4C has been its only answer for so long that it is not there."""
        return now - self._evasive_since.setdefault(body, now) >= EVASIVE_S

    def is_there(self, body: int) -> None:
        """It has told something, alone or as the member of a group."""
        self._evasive_since.pop(body, None)
        self.mute.discard(body)
        if body in self.silent or body in self.offline:
            if body not in self.offline:
                self.answered_late.add(body)
            self.offline.discard(body)
            self.silent.discard(body)
            self.on_online(body)

    def call_silent(self, body: int, *, asked: bool) -> None:
        """It does not answer; `asked`: it was asked itself."""
        if body not in self.silent:
            self.silent.add(body)
            self.answered_late.discard(body)
            self.on_offline(body, asked)

    def note_refused_fence(self, body: int, error: int | None) -> None:
        """It has refused a fence."""
        self._refused_fence[body] = error

    def fence_begins(self, body: int) -> None:
        """It is asked a fence: earlier refusals of fences do not count."""
        self._refused_fence.pop(body, None)

    def offline_error(self, body: int) -> BodyOffline:
        """The error of a request to a body that does not answer, or refuses whatever it is asked."""
        if body not in self._refused_fence:
            return BodyOffline.worded("body.offline", body=f"{body:02X}")
        error = self._refused_fence[body]
        refused = lookup(error)
        return BodyOffline.worded(
            "body.refuses-questions",
            body=f"{body:02X}",
            code="" if error is None else f" (error {error:02X}h)",
            refusal=Text(refused.en, refused.ja),
            remedy=Text(refused.remedy_en, refused.remedy_ja),
        )

    def break_off(self) -> None:
        """The port has gone: only probes find out from now on which bodies are there."""
        self.mute.clear()
        self._evasive_since.clear()
        self.offline |= self.silent


@dataclass
class Witness:
    """The body that the fences of a line ask, in the place of others that are a group or dead."""

    target: int = 0
    """The target whose copies the fence rules out."""
    body: int = 0
    in_silence: int = 0
    """Bodies that were fenced in vain since a byte was heard."""
    was_clean: bool = True
    """True if the line had no error when it lost its step."""


class FrameForm(NamedTuple):
    """The form in which commands are written on a line."""

    introducer: str
    half_command_end: bytes
    """Ends a half command without executing it."""


class RorzeSession(Session[RorzeExchange, ReplyFrame]):
    """The exchanges of one line."""

    answers_all = True

    def __init__(
        self,
        bodies: Iterable[int],
        groups: Mapping[int, list[int]] | None = None,
        *,
        introducer: str = "&",
        half_commands: HalfCommandEnd = "overlong",
        reply_timeout_s: float = 0.5,
        late_reply_s: float = 2.0,
        interject_stops: bool = True,
        rng: random.Random | None = None,
    ) -> None:
        super().__init__(
            target="body",
            replies_remembered=REPLIES_REMEMBERED,
            set_up_target=LINK_MASTER,
            reply_timeout_s=reply_timeout_s,
            late_reply_s=late_reply_s,
            interject_stops=interject_stops,
        )
        self.bodies = list(bodies)
        self.groups = dict(groups or {})
        self.scheduler.members = self.groups
        self.byte_time_s = 0.0
        self.form = FrameForm(introducer, HALF_COMMAND_ENDS[half_commands])
        self.presence = Presence(self.offline)
        self.others_prove: Callable[[int], bool] = lambda _body: False
        """Asked with a body: have others, who answer, yet to tell whether their stops have worked?"""
        self.last_error_at: float | None = None
        self.on_strict: Callable[[bool], None] = lambda _on: None
        """Called when acknowledgements begin to be bracketed by fences, and when that is over."""
        self.on_given_up: Callable[[], None] = lambda: None
        """Called when a body is not asked any more, but by probes."""
        dice = rng or random.Random()  # noqa: S311  # against mix-ups, not against people
        order = dice.sample(range(NONCES), NONCES)
        self._questions = map(_questions().__getitem__, cycle(order))
        self._witness = Witness()
        self._fenced: set[int] = set()
        """The bodies that have said nothing since a fence."""
        self._last: dict[int, ReplyFrame] = {}
        """The last reply of each body."""
        self._strict_until: float | None = None

    # what goes next

    def next(self, now: float, *, ready: bool) -> RorzeExchange | None:
        """Take the exchange that is to be written now, behind the end of a half comment where one may be.

        A comment takes in what follows it if its end is lost, unless that begins with `&`, which none has.
        """
        exchange = super().next(now, ready=ready)
        if exchange is not None and self.form.introducer != "&" and self._has_half_comment():
            exchange.frame = self.form.half_command_end + self.frame_of(exchange.target, exchange.command)
        return exchange

    def _has_half_comment(self) -> bool:
        """Tell whether a user comment was written, and neither answered nor followed by a fence."""
        in_doubt = self.sent if self._suspect is None else (*self.sent, self._suspect)
        return any(sent.command.code == SetUserComment.code for sent in in_doubt)

    def frame_of(self, body: int, command: RorzeCommand[Any]) -> bytes:
        """Build the frame of a command as this line writes it.

        The old forms have one digit of body number: groups and the link master have no place in it.
        """
        return framed(body, command.frame_text, self.form.introducer if body <= 0xF else "&")

    def exchange(self, body: int, command: RorzeCommand[Any], lane: Lane) -> RorzeExchange:
        """Build an exchange: its frame, its stop epoch, how long it takes, and how often it is repeated."""
        return RorzeExchange(
            command,
            self.frame_of(body, command),
            lane,
            target=body,
            epoch=self.epoch(body) if lane is Lane.COMMAND else 0,
            reply=ExpectedReply(
                timeout_s=self.terms.reply_timeout_s + 2 * command.takes_s,
                repeats=READ_REPEATS if command.may_repeat else 0,
                names=(command.code,),
            ),
        )

    def self_identifying_read(self, body: int) -> RorzeExchange:
        """Build a read whose reply nothing else can be mistaken for: its number is used once in 2048."""
        exchange = self.exchange(body, next(self._questions), Lane.READ)
        exchange.reply.self_identifying = True
        exchange.reply.repeats = 0
        return exchange

    def fence_query(self) -> RorzeExchange:
        """Ask the witness for a position entry: its number comes back."""
        return self.self_identifying_read(self._witness.body)

    def put_first(self, exchange: RorzeExchange) -> None:
        """Queue an exchange of the line's own set-up ahead of everything but stops and fences."""
        exchange.reply.repeats = READ_REPEATS  # absolute and harmless: saying it again changes nothing
        super().put_first(exchange)

    def was_written(self, exchange: RorzeExchange, _now: float) -> Awaited:
        """The replies to many stops come one after the other, with the ends of their moves between them."""
        if exchange.lane not in STOPS:
            return Awaited.FIRST
        if exchange.reply.deadline is not None:
            queued = sum(map(self._stop_reply_bytes, [*self.sent, exchange]))
            queue_s = queued * self.byte_time_s - self.terms.reply_timeout_s / 2
            exchange.reply.await_until(exchange.reply.deadline + max(0.0, queue_s))
        return Awaited.BESIDE

    def _stop_reply_bytes(self, stop: RorzeExchange) -> int:
        """Bytes that the wire carries to the gateway because of one stop."""
        if stop.target <= LAST_BODY:
            return STOP_REPLY_BYTES
        return GROUP_REPLY_BYTES + MEMBER_REPLY_BYTES * len(self.groups.get(stop.target, ()))

    def holds_up(self, sent: RorzeExchange) -> bool:
        """Only a link that takes one frame at a time has to wait for what the dead do not say."""
        return not (
            self.terms.interject_stops and (sent.target in self.offline or sent.target in self.presence.mute)
        )

    def must_choose(self) -> bool:
        """Nothing else keeps it while all answer."""
        return bool(self.sent or self.presence.mute)

    def may_follow(self, exchange: RorzeExchange) -> bool:
        """Keep exchanges of equal body and code apart, for replies have no numbers.

        A body that may be dead is asked after the bodies that are yet to prove standstill; its stops go on.
        """
        if exchange.lane not in STOPS and self.is_asked_later(exchange.target):
            return False
        return all(exchange.key != sent.key for sent in self.sent)

    def is_asked_later(self, body: int) -> bool:
        """True if it may be dead, and others who answer have yet to tell whether they stand."""
        return body in self.presence.mute and self.others_prove(body)

    def wants_fence(self, exchange: RorzeExchange, now: float) -> bool:
        """Before what a copy would answer, and before what is bracketed."""
        opens_bracket = self.strict and exchange.lane is Lane.COMMAND and exchange.target not in self._fenced
        return opens_bracket or self._copies.could_answer(exchange, exchange.target, now)

    # what comes back

    def receive(self, frame: ReplyFrame, now: float) -> Settle | None:
        """Credit a reply; None if it ends no exchange."""
        self._witness.in_silence = 0
        self._fenced.discard(frame.body)
        if self._denies_probe(frame):
            return None
        if isinstance(frame, Refusal) and self.is_refusal_of_fence(frame) and not _evades(frame):
            self.presence.note_refused_fence(frame.body, frame.error)
        return super().receive(frame, now)

    def _denies_probe(self, frame: ReplyFrame) -> bool:
        """True if it says that a body is absent which is not known to be there: no trouble of the line."""
        is_absent = frame.body in self.offline or frame.body not in self.bodies
        return (
            is_absent
            and frame.body != self._witness.body
            and _evades(frame)
            and self.is_refusal_of_fence(frame)
        )

    def note_reply(self, exchange: RorzeExchange, frame: ReplyFrame, now: float) -> None:
        """Remember it: a copy may come. Where all commands of a code ask the same, it can do no harm."""
        if exchange.lane in STOPS:
            return  # an equal one is repeated before its reply has come
        self._last[exchange.target] = frame
        if not exchange.reply.self_identifying and not exchange.command.is_only_question:
            until = max(now, exchange.reply.deadline or now) + self.terms.late_reply_s
            said = RememberedReply(
                exchange, frame, frame, exchange.number, until
            )  # a status is not a bit of it
            self._copies.note(exchange.target, frame.code, said, now)

    def learn(self, exchange: RorzeExchange, _outcome: Any, frame: ReplyFrame, now: float) -> None:
        """A body has answered: it is there, unless all it says for a while is @4C."""
        self.note_reply(exchange, frame, now)
        body = exchange.target
        self.presence.mute.discard(body)
        if _evades(frame) and body <= LAST_BODY:
            if self.presence.evades(body, now):
                self._went_offline(body, asked=True)
            return
        self.presence.answered(body, now, fence=exchange.reply.self_identifying)
        if exchange.reply.self_identifying:
            self._rule_out_copies(body)
        for answer in frame.members.values() if isinstance(frame, GroupAnswer) else (frame,):
            if not _evades(answer):
                self.presence.is_there(answer.body)

    def is_refusal_of_fence(self, frame: ReplyFrame) -> bool:
        """True if a position entry was refused."""
        return isinstance(frame, Refusal) and frame.code == GetNumberedPositionEntry.code

    def fence_passed(self, _fence: RorzeExchange) -> None:
        """A group, or the link master, that others have stood for has said all it will."""
        if self._witness.target > LAST_BODY:
            self._rule_out_copies(self._witness.target)

    def _rule_out_copies(self, body: int) -> None:
        """Nothing it has said before is on its way any more."""
        self._copies.forget(body)
        self._fenced.add(body)

    def noise(self, what: str, now: float) -> None:
        """Garbage came: it may have been the reply that is awaited."""
        self._witness.in_silence = 0
        self._erred(now)
        super().noise(what, now)

    # strictness

    def _stray(self, frame: ReplyFrame, now: float, kind: str = "strays") -> None:
        """A reply that has been credited before has come twice."""
        if frame == self._last.get(frame.body) or self._copies.include(frame.body, frame):
            kind = "duplicates"
            self._be_strict(now)
        super()._stray(frame, now, kind)

    def _be_strict(self, now: float) -> None:
        was_strict, self.strict, self._strict_until = self.strict, True, now + STRICT_S
        if not was_strict:
            self.on_strict(True)

    def _be_lenient(self) -> None:
        was_strict, self.strict, self._strict_until = self.strict, False, None
        if was_strict:
            self.on_strict(False)

    # time

    def deadline(self) -> float | None:
        """When the next reply is overdue, or the line has been without copies for long enough."""
        overdue = super().deadline()
        return min((at for at in (overdue, self._strict_until) if at is not None), default=None)

    def pass_deadlines(self, now: float, resumes_at: float | None) -> None:
        """Give up waiting for what is overdue; `resumes_at` is set while a reply has begun and may go on."""
        if self._strict_until is not None and self._strict_until <= now:
            self._be_lenient()
        super().pass_deadlines(now, resumes_at)

    def was_missed(self, exchange: RorzeExchange, now: float) -> None:
        """The silence of a body that may well be absent tells nothing of the line."""
        is_probe = exchange.reply.self_identifying and exchange is not self._fence.query
        if not is_probe and exchange.target not in self.offline and exchange.target not in self.presence.mute:
            self._erred(now)
        if exchange.lane in STOPS and exchange.target <= LAST_BODY:
            self.presence.mute.add(exchange.target)

    def errs(self, now: float) -> bool:
        """True if a reply was missing or garbled of late."""
        return self.last_error_at is not None and now - self.last_error_at < CLEAN_AFTER_S

    def _erred(self, now: float) -> None:
        """A reply was missing or garbled."""
        if self.in_step:
            self._witness.was_clean = self.last_error_at is None or now - self.last_error_at > CLEAN_AFTER_S
        self.last_error_at = now

    # silence

    def _lose_step(self, target: int, *, doubtful: bool = True) -> None:
        """Choose the witness: the body, or one that stands for the group or the link master."""
        super()._lose_step(target, doubtful=doubtful)
        witness = self._witness
        witness.target, witness.body, witness.in_silence = target, self._witness_for(target), 0
        self.presence.fence_begins(witness.body)

    def _witness_for(self, body: int) -> int:
        if body <= LAST_BODY:
            return body
        members = self.groups.get(body, self.bodies)
        alive = [body_left for body_left in members if body_left not in self.offline] or [
            body_left for body_left in self.bodies if body_left not in self.offline
        ]
        return next(iter(self.presence.latest_first(alive or members)), 0)

    def _fence_failed(self) -> None:
        """A body that answers neither a question nor a fence on a clean line is silent."""
        if (
            self._witness.was_clean
            and self._suspect is not None
            and self._suspect.target == self._witness.body
        ):
            self.presence.call_silent(self._witness.body, asked=True)
        super()._fence_failed()

    def has_time(self) -> bool:
        """On a clean line give a body that was already silent one fence, so that other stops are proved."""
        body = self._witness.body
        seems_dead = self._witness.was_clean and (body in self.presence.silent or body in self.presence.mute)
        return not (seems_dead and self.others_prove(body))

    def witness_failed(self) -> bool:
        """Take the witness for dead, and choose the one heard last of those that are not."""
        self._witness.in_silence += 1
        self._went_offline(self._witness.body, asked=True)
        alive = [body for body in self.bodies if body not in self.offline]
        if alive and self._witness.in_silence < SILENT_BODIES:
            self._witness.body = self.presence.latest_first(alive)[0]
            return True
        for body in alive:
            self._went_offline(body, asked=False)
        # Late replies have had their time; the probes tell when somebody is back.
        self._rule_out_copies(self._witness.target)
        return False

    def _went_offline(self, body: int, *, asked: bool) -> None:
        if body in self.offline:
            return
        self.offline.add(body)
        self.cancel(
            lambda exchange: (
                exchange.target == body and exchange.lane not in STOPS and not exchange.reply.self_identifying
            ),
            self.presence.offline_error(body),
        )
        self.presence.call_silent(body, asked=asked)
        self.on_given_up()

    # the end

    def break_off(self, lost: NoReply, unsent: Cancelled) -> None:
        """The port has gone: what was written may have been executed, what waited was not."""
        super().break_off(lost, unsent)
        self._copies.forget(LINK_MASTER)  # set up anew, maybe without bodies that could prove anything
        self._be_lenient()
        self.presence.break_off()


def _evades(frame: ReplyFrame) -> bool:
    return isinstance(frame, Refusal) and is_evasive(frame.error)


@cache
def _questions() -> Sequence[GetNumberedPositionEntry]:
    """One of each number; they stand before the gateway runs, so that garbage is not looked for in them."""
    return [GetNumberedPositionEntry(entry=PositionReference(position=number)) for number in range(NONCES)]
