"""One port with its RC-400: keeps it open and set up, and carries the session over it in time."""

import asyncio
import logging
import random
import re
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any, cast, get_args

from gateway.core.errors import BodyOffline, GarbledReply, GatewayError, NoReply
from gateway.core.exchange import STOPS, Lane
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState as LineState
from gateway.core.line_state import PortNews
from gateway.core.origin import PROBE, SET_UP, acting
from gateway.core.times import happens
from gateway.rorze.errors import refused
from gateway.rorze.session import Answered, Outcome, Presence, ReplyFrame, RorzeExchange, RorzeSession
from gateway.texts import text
from protocols.rorze.link import (
    HalfCommandEnd,
    LinkReader,
    Message,
    Refusal,
)
from protocols.rorze.link_master import IdentifyControllers, SetGroup, SetReplyFormat
from protocols.rorze.row import LINK_MASTER, RorzeCommand
from protocols.table import Effect
from transports.base import Transport
from transports.trace import UNNAMED, FrameSubject

log = logging.getLogger(__name__)

SET_UP_AGAIN_S = 60.0
"""Least seconds between requests to the link master to announce ends of moves, where it does not."""

_ADDRESS = re.compile(b"&([0-9A-F]{2})|[$#]([0-9A-F])")
_MEMBER = re.compile(rb"\[([0-7][0-9A-F]):")
WRITTEN_WITHIN_S = 5.0
"""A command or read that could not be written within this time is not sent any more, as a move is not."""
PEOPLE_WAIT = (Lane.COMMAND, Lane.READ)
ALL_SILENT = text("phrases.line-down.all-silent").en
GARBLED = text("phrases.line-down.garbled").en
BODIES_SILENT = text("phrases.line-down.bodies-silent").en
NO_LINK_MASTER = (
    "bodies answer, and the link master does not answer XID; ends of moves are found by asking, and "
    "groups may not work"
)
PROBE_S = (1.0, 10.0)
"""First and longest pause between probes of the bodies that do not answer."""
PROBE_SHARE = 0.1
"""Share of the line's time that probes may take while other bodies answer."""
ROLL = ((True, Lane.READ), (True, Lane.BACKGROUND), (False, Lane.BACKGROUND), (False, Lane.BACKGROUND))
"""Order and lane of probes after a line recovers: (from the front?, lane).

One at a time goes among clients' reads, for those may take the whole line. From both ends, for a fuse takes
neighbours: a body that does not answer ends one of these.
"""


class RollCall:
    """The bodies that fell silent, and those of them that are asked first when their line lives again."""

    def __init__(self) -> None:
        self.unasked: set[int] = set()
        """Bodies that count as silent because the whole line fell silent, and were not asked since."""
        self.members: set[int] = set()
        """The bodies that fell silent with the whole line, and were not asked since it lives again."""
        self.due = False
        """True if they are to be asked now."""
        self.called = asyncio.Event()
        """Not set while these are being asked: other questions of the gateway itself can wait."""
        self.called.set()
        self._silent_since: dict[int, float] = {}

    def fell_silent(self, body: int, now: float, *, asked: bool) -> None:
        """A body does not answer; `asked`: it was asked itself."""
        self._silent_since.setdefault(body, now)
        if asked:
            self.unasked.discard(body)
        else:
            self.unasked.add(body)

    def came_back(self, body: int) -> None:
        """A body answers."""
        self._silent_since.pop(body, None)
        self.unasked.discard(body)
        self.members.discard(body)

    def line_fell_silent(self, heard_at: float) -> None:
        """No body answers any more; the last answer came at `heard_at`."""
        self.members = {body for body, since in self._silent_since.items() if since > heard_at}

    def line_lives(self) -> bool:
        """The line was set up and a body answers; True if bodies are to be asked."""
        self.due |= bool(self.members)
        return bool(self.members)

    @contextmanager
    def calling(self) -> Iterator[None]:
        """They are asked inside."""
        self.due = False
        self.called.clear()
        try:
            yield
        finally:
            self.called.set()


class Line(LineDriver[RorzeExchange, ReplyFrame | Message, ReplyFrame]):
    """One port with its RC-400 and bodies."""

    _session: RorzeSession
    _unasked = get_args(Message)

    def __init__(
        self,
        line_id: str,
        transport: Transport,
        bodies: Iterable[int],
        groups: Mapping[int, list[int]] | None = None,
        *,
        introducer: str = "&",
        reply_timeout_s: float = 0.5,
        late_reply_s: float = 2.0,
        interject_stops: bool = True,
        half_commands: HalfCommandEnd = "overlong",
        port_baud: int = 9600,
        rng: random.Random | None = None,
    ) -> None:
        session = RorzeSession(
            bodies,
            groups,
            introducer=introducer,
            half_commands=half_commands,
            reply_timeout_s=reply_timeout_s,
            late_reply_s=late_reply_s,
            interject_stops=interject_stops,
            rng=rng,
        )
        super().__init__(line_id, transport, session, LinkReader)
        if transport.is_bridged:
            self.byte_time_s = 10 / port_baud  # bits of a byte, with start and stop
        session.byte_time_s = self.byte_time_s
        self._garbage_before = 0
        self.controllers = ""
        """The link master's answer to XID."""
        self.set_ups = 0
        self.own_groups: set[int] = set()
        """Groups for sweeps.

        They are defined with a port that is new, and behind everybody when the link master is set up again.
        """
        self._known_since: dict[int, int] = {}
        """The set-up by which the link master knows each group."""
        self.followed: set[int] = set()
        """Bodies with a move that is not over."""
        self.tells_of_stops = False
        """True if one event has told that its stops are not confirmed, since no body on it answers."""
        self.on_message: Callable[[Message], None] = lambda _: None
        self._no_set_up_before = 0.0
        """Time before which a missing announcement is no reason for a set-up, on the event loop's clock."""
        self._news_of_silence = asyncio.Event()
        self._nobody_answers = False
        self.roll = RollCall()
        self.ask_groups: Callable[[], Awaitable[object]] = _ask_nobody
        """Asks many of them in one frame, where the gateway keeps groups for that."""
        self.presence.on_online, self.presence.on_offline = self._came_back, self._fell_silent
        session.on_given_up, session.on_strict = self._gave_up, self._grew_strict

    def _beside(self) -> Iterable[Callable[[], Coroutine[Any, Any, None]]]:
        return (self._probe_offline,)

    # what it is

    @property
    def bodies(self) -> list[int]:
        """The numbers of its bodies."""
        return self._session.bodies

    @property
    def groups(self) -> dict[int, list[int]]:
        """Its groups as they are defined at its link master: their numbers, and those of their members."""
        return self._session.groups

    @property
    def offline(self) -> set[int]:
        """The bodies that do not answer."""
        return self._session.offline

    @property
    def presence(self) -> Presence:
        """The bodies that answer, and those that do not."""
        return self._session.presence

    def note_proofs(self, others_prove: Callable[[int], bool]) -> None:
        """Learn how to see that others than a body, who answer, have yet to tell whether they stand."""
        self._session.others_prove = others_prove

    def is_asked_later(self, body: int) -> bool:
        """True if a body that may be dead has to wait for such others."""
        return self._session.is_asked_later(body)

    @property
    def interject_stops(self) -> bool:
        """True if a stop goes out before the reply under way."""
        return self._session.terms.interject_stops

    @property
    def strict(self) -> bool:
        """True if a reply came twice here lately, so that every acknowledgement is bracketed by fences."""
        return self._session.strict

    @property
    def last_error_at(self) -> float | None:
        """The time at which a reply was last missing, garbled or a copy, on the event loop's clock.

        The silence of bodies that are known not to answer does not count.
        """
        return self._session.last_error_at

    def errs(self) -> bool:
        """True while the line has lately garbled or lost a frame."""
        return self._session.errs(self._loop.time())

    def frame_of(self, body: int, command: RorzeCommand[Any]) -> str:
        """Show the exact frame of a command as text, with its CR escaped."""
        return shown(self._session.frame_of(body, command))

    def subject_of(self, frame: bytes) -> FrameSubject:
        """A frame is about its address; a group's about all members, and a reply about those it names."""
        match = _ADDRESS.search(frame)
        if match is None:
            return FrameSubject(UNNAMED)
        number = int(match[1] or match[2], 16)
        named = (int(member, 16) for member in _MEMBER.findall(frame))
        return FrameSubject(b"%X" % number, frozenset((number, *self.groups.get(number, ()), *named)))

    def shows_silence(self, error: GatewayError) -> bool:
        """True if an error shows that a body does not answer, on a line that works or is another's."""
        if self.state is LineState.STANDBY:
            return True
        if self.state in (LineState.DOWN, LineState.SETTING_UP) or isinstance(error, GarbledReply):
            return False
        others = len(self.bodies) > 1
        all_are_silent = others and self._all_are_offline()
        return isinstance(error, NoReply | BodyOffline) and not all_are_silent

    def missed_an_end(self, body: int) -> None:
        """The end of a move was not announced, as after a restart: set the link master up, now and then."""
        now = asyncio.get_running_loop().time()
        if now >= self._no_set_up_before:
            self._no_set_up_before = now + SET_UP_AGAIN_S
            self.set_up_again(
                f"the link master has not announced the end of a move of {body:02X}, as after a restart"
            )

    def can_address(self, body: int) -> bool:
        """True if the line's way of addressing reaches this body number."""
        return self._session.form.introducer == "&" or body <= 0xF

    def _break_off(self, reason: str) -> None:
        if self._session.awaits_replies():
            self._session.last_error_at = self._loop.time()
        super()._break_off(reason)

    # set-up

    async def _set_up(self, *, fresh: bool) -> None:
        """Tell the link master what it forgets at power-off: XID, XRSM1, the groups (RC-420 manual 17.2)."""
        self._begins_set_up()
        self.set_ups += 1
        if fresh:
            await self._clear_with(self._session.form.half_command_end, self._session.terms.late_reply_s)
            self._garbage_before = self.counters["garbage"]
        identified = await self._tell(IdentifyControllers())
        if isinstance(identified, Answered):
            self.controllers = getattr(identified.replies[LINK_MASTER], "text", "")
        link_answers = isinstance(identified, Answered | Refusal)
        if link_answers or not self._all_are_offline():
            await self._tell(SetReplyFormat(end_of_move=1))
            for group, members in [
                group for group in self.groups.items() if fresh or group[0] not in self.own_groups
            ]:
                self._note_group(group, await self._tell(_group_definition(group, members)), self.set_ups)
        if self._life.is_open:
            self._begin_to_serve(link_answers=link_answers)

    def _begin_to_serve(self, *, link_answers: bool) -> None:
        """The set-up is over: from now on everybody is heard, and the silent are probed."""
        if self._all_are_offline() and (self.bodies or not link_answers):
            self._is_silent(self._why_silent(link_answers=link_answers), PortNews.UNANSWERED)
        else:
            if not link_answers:
                log.warning("line %s: %s", self.id, NO_LINK_MASTER)
            self._came_up({"controllers": self.controllers})
            self._nobody_answers &= not link_answers  # it has heard all this while somebody answered
            if self.roll.line_lives():
                self._news_of_silence.set()
        self._pump()

    def _all_are_offline(self) -> bool:
        return self.offline.issuperset(self.bodies)

    def _why_silent(self, *, link_answers: bool) -> str:
        if link_answers:
            return BODIES_SILENT
        return GARBLED if self.counters["garbage"] > self._garbage_before else ALL_SILENT

    async def _tell(self, command: RorzeCommand[Any]) -> Outcome:
        """Send the link master a command ahead of everything but stops and fences."""
        if not self._life.is_open:
            return self._down()
        with acting(SET_UP):
            exchange = self._session.exchange(LINK_MASTER, command, Lane.COMMAND)
        outcome: Outcome = await self._say_first(exchange)
        return outcome

    async def define_group(self, group: int, members: list[int]) -> None:
        """Define a virtual body at the link master, now and after every restart of it.

        :raises GatewayError: the link master did not take it; the old definition holds, or is sent again if
            the outcome is unknown.
        """
        definition, set_up = _group_definition(group, members), self.set_ups
        outcome = await self.submit(LINK_MASTER, definition, Lane.COMMAND)
        if isinstance(outcome, Refusal):
            raise refused(f"{self.id}.7F", definition, outcome.error)
        if isinstance(outcome, GatewayError):
            if isinstance(outcome, NoReply):
                self.set_up_again(f"nobody knows what group {group:02X} is now")
            raise outcome
        self.groups[group] = members
        self._note_group(group, outcome, set_up)

    def knows_group(self, group: int) -> bool:
        """True if its link master has acknowledged the definition of a group since it was last set up."""
        return self._known_since.get(group) == self.set_ups

    async def define_own_group(self, group: int) -> None:
        """Define a group for sweeps, behind everybody else."""
        set_up = self.set_ups
        with acting(SET_UP):
            command = _group_definition(group, self.groups[group])
            self._note_group(group, await self.submit(LINK_MASTER, command, Lane.BACKGROUND), set_up)

    def _note_group(self, group: int, told: Outcome, set_up: int) -> None:
        if isinstance(told, Answered):
            self._known_since[group] = set_up

    # asking

    def submit(
        self,
        body: int,
        command: RorzeCommand[Any],
        lane: Lane,
        *,
        expires_at: float | None = None,
        on_written: Callable[[float], None] | None = None,
    ) -> "asyncio.Future[Outcome]":
        """Queue a command; the future gives its outcome and never raises.

        A command that people wait for has to be written within `WRITTEN_WITHIN_S` where `expires_at` says no
        other time. Stops, the questions that a motor waits for and those of the gateway itself are never too
        late.

        :raises ShuttingDown, HeldUp: it comes too late, and is neither a read nor a stop.
        :raises LineDown: the port is not open; nothing was queued.
        :raises BodyOffline: the body does not answer (stops are sent nevertheless).
        :raises QueueFull: too many requests wait for this body.
        """
        if lane is Lane.COMMAND:
            self.require_fit()
        if not self._life.is_open:
            raise self._down()
        if body in self._session.offline and lane not in STOPS:
            raise self.presence.offline_error(body)
        exchange = self._session.exchange(body, command, lane)
        if expires_at is None and lane in PEOPLE_WAIT:
            expires_at = self._loop.time() + WRITTEN_WITHIN_S
        exchange.expires_at, exchange.on_written = expires_at, on_written
        return self.queue(exchange)

    def sending(self, body: int, commands: Sequence[RorzeCommand[Any]]) -> AbstractContextManager[None]:
        """Wait for the disk once, whatever of these is sent to a body or group here and now."""
        return self.undertaking(
            lambda: [self._session.exchange(body, command, Lane.COMMAND) for command in commands]
        )

    def probe(self, body: int, timeout_s: float, lane: Lane = Lane.READ) -> "asyncio.Future[Outcome]":
        """Ask a body, known or not, whether it is there, by a read that nothing else can be mistaken for."""
        exchange = self._session.self_identifying_read(body)
        exchange.reply.timeout_s, exchange.lane = timeout_s, lane
        if self._life.is_open:
            return self.queue(exchange)
        future = self._promise(exchange)
        exchange.settle(self._down())
        return future

    # reading

    def _hear(self, message: ReplyFrame | Message) -> None:
        self.counters["messages"] += 1
        self.on_message(cast("Message", message))

    def _grew_strict(self, strict: bool) -> None:
        if strict:
            log.warning("line %s says replies twice: acknowledgements now wait for a fence", self.id)
        else:
            log.info("line %s: acknowledgements are believed at once again", self.id)
        self.on_change("line.strict", {"strict": strict})

    # presence

    def _fell_silent(self, body: int, asked: bool) -> None:
        self.roll.fell_silent(body, self._loop.time(), asked=asked)
        self.on_change("body.offline", {"body": body, "asked": asked})

    def _gave_up(self) -> None:
        """A body is asked no more, but by probes."""
        self._news_of_silence.set()
        if self._all_are_offline():
            self._nobody_answers = True
            self.roll.line_fell_silent(self.presence.last_heard_at)
            if self._life.is_set_up:
                self.set_up_again("nobody answers any more")

    def _came_back(self, body: int) -> None:
        self.roll.came_back(body)
        self.on_change("body.online", {"body": body})
        was_silent = self.state is LineState.SILENT or self._nobody_answers
        if was_silent and self._life.is_set_up and not self._set_up_due:
            self._nobody_answers = False
            self.set_up_again("the line was silent and answers again")

    async def _probe_offline(self) -> None:
        """Ask the bodies that went silent, less and less often, whether they are back."""
        pause_s = PROBE_S[0]
        while True:
            self.on_work()  # a line without bodies has nothing to write
            if self.roll.due:
                await self._call_roll()
            if await self._has_news_of_silence(pause_s):
                pause_s = PROBE_S[0]
                continue
            if self.state is LineState.SILENT and not self.bodies:
                self.set_up_again("there is only the link master to ask")
            with acting(PROBE):
                somebody_came_back = await self._probe_each()
            nobody_is_disturbed = len(self.offline) in (0, len(self.bodies))
            often = somebody_came_back or nobody_is_disturbed
            pause_s = PROBE_S[0] if often else min(2 * pause_s, PROBE_S[1])

    async def _probe_each(self) -> bool:
        """Ask each offline body once, in a small share of the line's time while other bodies answer.

        The body that was heard last comes first, and a body that falls silent begins the round anew: the
        others may be absent for good. A line that lives again is set up first, and its roll is called.
        """
        somebody_came_back = False
        for body in self._in_turn(self.offline):
            if body not in self.offline:
                continue
            began_at = self._loop.time()
            if await self._answers_probe(body, Lane.READ):
                somebody_came_back = True
                if self.roll.members and (self.roll.due or self._set_up_due or not self._life.is_set_up):
                    return True
            elif len(self.offline) < len(self.bodies):
                rest_s = (self._loop.time() - began_at) / PROBE_SHARE
                if await self._has_news_of_silence(rest_s):
                    return True
        return somebody_came_back

    def _in_turn(self, bodies: Iterable[int]) -> list[int]:
        """Order bodies for probes: first those that fell silent with the line, the last heard in front."""
        return sorted(self.presence.latest_first(bodies), key=lambda body: body not in self.roll.members)

    async def _answers_probe(self, body: int, lane: Lane) -> bool:
        """True if the body answers. One that was silent only with its whole line is silent itself if not."""
        outcome = await self.probe(body, self._session.terms.reply_timeout_s, lane)
        if isinstance(outcome, NoReply) and self._life.is_open and not self._all_are_offline():
            self.roll.members.discard(body)
            if body in self.roll.unasked:
                self._fell_silent(body, asked=True)
        return isinstance(outcome, Answered)

    async def _call_roll(self) -> None:
        """Ask all who fell silent with the line, now that it lives, as fast as they answer."""
        with self.roll.calling(), acting(PROBE):
            await self.ask_groups()
            roll = deque(self._in_turn(self.roll.members))
            await asyncio.gather(
                *(self._ask_in_turn(roll, lane, forwards=forwards) for forwards, lane in ROLL)
            )

    async def _ask_in_turn(self, roll: deque[int], lane: Lane, *, forwards: bool) -> None:
        """Ask one after the other until one does not answer: probes of the dead are rare."""
        while roll:
            body = roll.popleft() if forwards else roll.pop()
            if not await self._answers_probe(body, lane):
                return

    async def _has_news_of_silence(self, within_s: float) -> bool:
        """Wait for this time, or until a body falls silent, or a line that was silent is set up."""
        if not await happens(self._news_of_silence, within_s):
            return False
        self._news_of_silence.clear()
        return True


async def _ask_nobody() -> None:
    """There are no groups for that."""


def _group_definition(group: int, members: list[int]) -> SetGroup:
    return SetGroup(group=f"{group:02X}", members=[f"{member:02X}" for member in members])


_LANES = {Effect.STOP: Lane.STOP, Effect.READ: Lane.READ}


def lane_of(command: RorzeCommand[Any]) -> Lane:
    """The lane a command belongs to by its nature."""
    return _LANES.get(command.effect, Lane.COMMAND)


def shown(frame: bytes) -> str:
    """Show a frame as text, with its CR escaped."""
    return frame.decode("ascii").replace("\r", "\\r")
