"""A body as the gateway sees it: its address, what was last known of it, and how to ask it something."""

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from typing import Any, Final, TypeVar, cast

from gateway.core.errors import BodyBusy, ControllerRefused, GatewayError, InvalidRequest, NoReply
from gateway.core.exchange import Lane
from gateway.core.move_log import Trajectory
from gateway.core.move_record import CountedIn, Move, MoveStatus
from gateway.core.targets import Looked
from gateway.rorze.asked_body import believed, counted_in
from gateway.rorze.body_states import BodyAction, BodyLife, BodyNews
from gateway.rorze.config import Events
from gateway.rorze.errors import refused
from gateway.rorze.knowledge import (
    COMMAND_ERROR,
    PROGRAM_RUNS,
    PULSES_RUNNING,
    RENAMING,
    STARTS_PROGRAM,
    BodyFacts,
    FlashState,
    MotorState,
    OwnRefusals,
    Prepared,
    SensorEdges,
    Tell,
    Tracker,
    Trackers,
)
from gateway.rorze.line import Line, lane_of
from gateway.rorze.power import POWER_ON_POSITION, BodyPower, Mark
from gateway.rorze.session import Answered, Outcome, RorzeExchange
from gateway.rorze.units import Scale
from protocols.rorze.commands import COMMANDS
from protocols.rorze.link import Refusal
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.origin import GetHomingDistance
from protocols.rorze.patterns import GetPattern
from protocols.rorze.position import GetPosition, SignedPulses
from protocols.rorze.profile import SpeedParameters
from protocols.rorze.programs import EndProgram, GetProgramStatus
from protocols.rorze.row import ModeName, RorzeCommand
from protocols.rorze.status import (
    CONTROLLER_STATUS_BITS,
    ClearControllerStatus,
    ControllerStatus,
    GetControllerStatus,
    SetUserComment,
    names_of,
)
from protocols.table import Effect, Reply

R = TypeVar("R", bound=Reply)

STATUS: Final = GetControllerStatus()
"""A question that is asked all the time is built once."""
POSITION: Final = GetPosition()
NO_PROGRAM_S = 120.0
"""Time for which an answer that no program runs is believed: an autostart may be unseen."""
ENCODER_SWAYS = 16
"""Encoder counts by which a shaft at rest may sway through 0, where one would stand that was switched on."""
BELIEVED_S = 0.5
"""Age of a reading at rest after which it is asked again before a move: power is lost at rest too."""


@dataclass(frozen=True)
class Configured:
    """A body's part of the configuration."""

    name: str = ""
    scale: Scale | None = None
    input_names: Mapping[int, str] = field(default_factory=dict)
    output_names: Mapping[int, str] = field(default_factory=dict)
    position_tolerance: int = 0
    """Pulses by which, in encoder mode, the final position may miss the target of a successful move."""
    in_position: bool = False
    """True if a move in servo mode has succeeded only when INP is on."""
    slow_pattern: int | None = None
    """The pattern that is reserved for moves with a speed of their own; None: not configured."""
    poll_interval_s: float = 0.2
    """While it has a move, its state is asked for this often."""
    events: Events | None = None
    """The changes that it reports unasked."""


@dataclass(eq=False)
class OwnSpeed:
    """The speed that was written last for a move with a speed of its own."""

    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Held from when the speed of a move is written until the move has started."""
    written: SpeedParameters | None = None
    companions: "Sequence[Body]" = ()
    """The bodies that move only together, itself among them: their ramps may be in its pattern, too."""

    def was_written(self, speeds: SpeedParameters) -> None:
        """The reserved pattern has these speeds now."""
        self.written = speeds

    def shares_ramps_with(self, bodies: "Sequence[Body]") -> None:
        """These bodies, itself among them, move only together."""
        self.companions = bodies


@dataclass(eq=False)
class BodyMotion:
    """The move of a body that is not over yet, and the signs of its end."""

    move: Move | None = None
    trajectory: Trajectory[int] | None = None
    """The places at which it is seen during the move."""
    announced: asyncio.Event = field(default_factory=asyncio.Event)
    """The link master has announced the end of a move."""
    end_due: asyncio.Event = field(default_factory=asyncio.Event)
    """The move seems to be over: the link master has announced it, or a stop is confirmed."""
    free: asyncio.Event = field(default_factory=asyncio.Event)
    """The last move is over and recorded: the next one may begin."""
    watched: bool = False
    """True if its robot is asked as a whole, so that this body is asked alone now and then only."""
    stopped_at: int | None = None
    """The place where a stop was confirmed since its last move was sent."""
    stop_was_proved: bool = False
    """True if the last stop was being proved already when it was called late."""

    def claim(self, move: Move) -> None:
        """Let no other move begin."""
        self.move = move
        self.free.clear()

    def trace(self, trajectory: Trajectory[int]) -> None:
        """Keep where it is seen from now on."""
        self.trajectory = trajectory

    def release(self) -> None:
        """Let another move begin."""
        self.move = self.trajectory = None
        self.free.set()

    def was_sent(self) -> None:
        """No sign of an end so far is one of this move."""
        self.stopped_at = None
        self.announced.clear()
        self.end_due.clear()

    def was_stopped(self, position: int | None) -> None:
        """A stop was confirmed there."""
        self.stopped_at = position
        self.end_due.set()

    def end_was_announced(self) -> None:
        """A reason to ask now, never a proof."""
        self.announced.set()
        self.end_due.set()

    def forget_signs(self, *, announced: bool, due: bool) -> None:
        """Forget the signs that had come before the motor was seen to run: they are of an earlier move."""
        if announced:
            self.announced.clear()
        if due:
            self.end_due.clear()

    def stop_is_confirmed(self, *, disproves_its_alarm: bool) -> None:
        """A stop is proved; the proof may have been under way when the hardware stop was called for."""
        self.stop_was_proved = disproves_its_alarm

    @contextmanager
    def watched_as_a_whole(self) -> Iterator[None]:
        """Its robot is asked as a whole meanwhile."""
        self.watched = True
        try:
            yield
        finally:
            self.watched = False
            self.end_due.set()


class _Looking(AbstractAsyncContextManager[None]):
    """A look at a body; as a generator it would cost each read of a body a tenth of its time."""

    def __init__(self, refusals: OwnRefusals, clear: Callable[[], Awaitable[None]]) -> None:
        self._refusals, self._clear = refusals, clear

    async def __aenter__(self) -> None:
        self._refusals.look()

    async def __aexit__(self, *_: object) -> None:
        if self._refusals.have_to_be_cleared():
            await self._clear()


@dataclass(eq=False)
class Body(Looked):
    """One RC-420 axis controller."""

    line: Line
    number: int
    configured: Configured = field(default_factory=Configured)
    power: BodyPower = field(default_factory=BodyPower)
    on_news: Tell = lambda _kind, _facts: None
    """Called with what it does unasked: the kind of event, and its data."""
    told: BodyFacts = field(default_factory=BodyFacts)
    flash: FlashState = field(default_factory=FlashState)
    prepared: Prepared = field(default_factory=Prepared)
    life: BodyLife = field(default_factory=BodyLife)
    motion: BodyMotion = field(default_factory=BodyMotion)
    own_speed: OwnSpeed = field(default_factory=OwnSpeed)
    changing: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Held while its settings are being changed."""
    mark: Mark = field(init=False)
    _own_refusals: OwnRefusals = field(default_factory=OwnRefusals, init=False)
    _trackers: Trackers = field(init=False)
    """All that hear of each exchange with it."""

    def __post_init__(self) -> None:
        self.power.on_news = self._power_news
        self.mark = Mark(self)
        edges = SensorEdges(self.input_names, lambda kind, facts: self.on_news(kind, facts))
        told = (self.flash, self.flash.positions, self.told, self.prepared, edges)
        self._trackers = Trackers(*told, self._own_refusals, self.power)

    # what is known of it

    @property
    def scale(self) -> Scale | None:
        """Its pulses in a unit; None: not configured."""
        return self.configured.scale

    @property
    def input_names(self) -> Mapping[int, str]:
        """The names of its inputs, by their numbers."""
        return self.configured.input_names

    @property
    def output_names(self) -> Mapping[int, str]:
        """The names of its outputs, by their numbers."""
        return self.configured.output_names

    @property
    def poll_interval_s(self) -> float:
        """While it has a move, its state is asked for this often."""
        return self.configured.poll_interval_s

    @property
    def sent_count(self) -> int:
        """Counts the commands sent to it that are no reads."""
        return self.told.sent_count

    @property
    def moving(self) -> bool | None:
        """True if its motor runs; None until its status has been read since it was out of reach."""
        return self.life.moving

    @property
    def move(self) -> Move | None:
        """The move that is not over yet."""
        return self.motion.move

    @cached_property
    def short(self) -> str:
        """Its two hexadecimal digits."""
        return f"{self.number:02X}"

    @cached_property
    def address(self) -> str:
        """Its address that is always unique, such as `LINE.3F`."""
        return f"{self.line.id}.{self.short}"

    @property
    def online(self) -> bool:
        """True if it can be asked now, as far as is known."""
        return self.line.state != "down" and self.number not in self.line.presence.silent

    @property
    def settings(self) -> tuple[int, int]:
        """Tells whether its settings may have changed: by a command, or with its power."""
        return self.told.changes, self.power.losses

    @property
    def last_heard_at(self) -> float | None:
        """When it last answered anything, in the event loop's time."""
        at, in_group = self.line.presence.heard_at(self.number), self.told.heard_at
        return in_group if at is None or (in_group is not None and in_group > at) else at

    # asking

    def looking(self) -> AbstractAsyncContextManager[None]:
        """Leave no command error of questions that are refused inside, where no caller has caused one."""
        return _Looking(self._own_refusals, self._clear_own_error)

    async def _clear_own_error(self) -> None:
        """Clear a command error that stands alone: 9CS clears all errors but STALL (RC-420 manual 14.9).

        An error that cannot be cleared is left: nothing depends on it.
        """
        with suppress(GatewayError):
            async with self.line.undivided([self.number]):
                status, _ = await self.ask(STATUS)
                if status.bits == COMMAND_ERROR and self._own_refusals.are_ours:
                    await self.ask(ClearControllerStatus())

    async def ask(
        self,
        command: RorzeCommand[R],
        *,
        lane: Lane | None = None,
        expires_at: float | None = None,
        on_written: Callable[[float], None] | None = None,
    ) -> tuple[R, Answered]:
        """Send a command and give its reply.

        :raises GatewayError: it was refused, not sent, or not answered; the error says which.
        """
        forbid_stop(self.address, command)
        self.forbid_renaming(command)
        lane = lane_of(command) if lane is None else lane
        future = self.line.submit(self.number, command, lane, expires_at=expires_at, on_written=on_written)
        if command.effect is Effect.READ:
            outcome = await future
        else:
            self.was_sent(command)
            outcome = await future
            self.was_sent(command)
        if isinstance(outcome, NoReply):
            self.perhaps_did(command)
        try:
            answered = answer_or_raise(self.address, command, outcome)
            reply = reply_of(self.number, command, answered, self.address)
        except ControllerRefused:
            self.has_refused(command)
            raise
        self.has_replied(command, reply, answered.at)
        return cast("R", reply), answered

    async def poll(self, lane: Lane = Lane.READ) -> MotorState:
        """Read its status and where it stands.

        :raises GatewayError: it did not tell.
        """
        sent = self.sent_count
        state, at = await self._read(lane)
        self.told.rests(state, at, sent)
        if self.told.rest is not None:
            await self._weigh(state, lane, at)
        return state

    async def _read(self, lane: Lane) -> tuple[MotorState, float]:
        status, _ = await self.ask(STATUS, lane=lane)
        position, answer = await self.ask(POSITION, lane=lane)
        return MotorState(status.bits or 0, position.pulses), answer.at

    @property
    def counted_in(self) -> CountedIn | None:
        """The unit of its positions; None while its operating mode is not known."""
        return None if self.told.mode is None else counted_in(self.told.mode)

    async def know_mode(self) -> ModeName:
        """Its operating mode, which is asked for where it is not known (EAD).

        :raises GatewayError: it did not tell.
        """
        if self.told.mode is None:
            return (await self.ask(GetOperatingMode()))[0].mode
        return self.told.mode

    async def where_it_rests(self) -> MotorState:
        """Give the state it was seen at rest in a moment ago; otherwise ask: it may run.

        While the line errs a single poll is not believed.

        :raises GatewayError: it did not tell.
        """
        rest, told = self.told.rest, self.told
        fresh = asyncio.get_running_loop().time() - told.rest_at <= BELIEVED_S
        if rest is not None and fresh and self.power.is_vouched and not self.line.errs():
            return rest
        return await believed(self.line, lambda: self.poll(Lane.VERIFY), self._both_may_be_true)

    def _both_may_be_true(self, one: MotorState, other: MotorState) -> bool:
        if one.runs or other.runs:
            return one.runs and other.runs
        return (
            abs(one.position - other.position) <= self.configured.position_tolerance
            and one.bits == other.bits
        )

    # its power

    async def _weigh(self, state: MotorState, lane: Lane, at: float) -> None:
        """Find out whether it has lost its power, where its answer at rest contradicts an earlier one."""
        if self.power.signs.contradicts(state.position, state.bits, self.configured.position_tolerance):
            why = await self._why_lost(state, lane)
            if why is not None:
                self.power.lost(certain=False, why=why)
        if self.told.rest is state:  # it was told nothing meanwhile
            target = None if self.move is None else self.move.target_position
            self.power.rests(state.position, state.bits, at, target)

    async def _why_lost(self, state: MotorState, lane: Lane) -> str | None:
        """Say why it seems to have lost its power; None where it has kept it, or its loss is known now.

        A mark that stands does not outvote what has changed without a cause: a comment may outlast the power.
        """
        losses = self.power.losses
        stands = await self.mark.stands(lane)
        if self.power.losses != losses:
            return None
        in_move = self.move is not None and self.move.status is not MoveStatus.QUEUED
        changed = None if in_move else await self._changed_by_itself(state, lane)
        if changed is not None or (stands and self.power.is_vouched):
            return changed
        if self.power.signs.looks_switched_on(state.position) and not await self.remembers_homing(lane):
            position, _ = await self.ask(POSITION, lane=lane)
            if self.power.signs.looks_switched_on(position.pulses):
                return f"it was silent, and stands at {position.pulses}"
        return None

    async def _changed_by_itself(self, state: MotorState, lane: Lane) -> str | None:
        """Say what has changed that only a loss of power can have changed, as far as is known; ask twice."""
        setting = self.power.signs.changed
        if setting is not None and await self._has_changed(setting, lane):
            return f"{setting.code} is not answered as before"
        if not await self._jumped(state):
            return None
        again, _ = await self._read(lane)
        if again.runs or await self._is_moved_by_a_program(lane):
            return None
        why = await self._jumped(again)
        if why is None:  # the first reading was garbled
            self.told.rest_in_doubt()
        return why

    async def _jumped(self, state: MotorState) -> str | None:
        """Say how it has changed at rest; a shaft that an encoder measures may be turned by hand."""
        tolerance = self.configured.position_tolerance
        why = self.power.signs.jumped(state.position, state.bits, tolerance)
        if why is None or await self.know_mode() != "encoder":
            return why
        sways = max(tolerance, ENCODER_SWAYS if self.power.signs.looks_switched_on(state.position) else inf)
        return self.power.signs.jumped(state.position, state.bits, sways)

    async def _is_moved_by_a_program(self, lane: Lane) -> bool:
        """True if a user program moves it that ran before: one that runs since may have begun at power-on."""
        if self.life.in_program or self.told.no_program_at is not None:
            return self.life.in_program
        status, _ = await self.ask(GetProgramStatus(), lane=lane)
        return bool(status.status & PROGRAM_RUNS)

    async def _has_changed(self, setting: RorzeCommand[Any], lane: Lane) -> bool:
        """Ask for a setting once more: one garbled digit must not prove anything."""
        reply, _ = await self.ask(setting, lane=lane)
        return self.power.signs.differs(setting, reply)

    async def remembers_homing(self, lane: Lane) -> bool:
        """True if it knows how far its last homing went (0PD), which a loss of power would have taken.

        Asked twice: one garbled digit must not prove anything.

        :raises GatewayError: it did not tell.
        """
        first, _ = await self.ask(GetHomingDistance(), lane=lane)
        second, _ = await self.ask(GetHomingDistance(), lane=lane)
        return first == second and first.pulses != POWER_ON_POSITION

    async def prove_power(self) -> None:
        """Find out whether it has kept its power since it was last seen at rest.

        :raises GatewayError: it did not tell.
        """
        if await self.mark.stands(Lane.VERIFY) is not True or not self.power.is_vouched:
            await self.mark.ensure(Lane.VERIFY)
            await self.poll(Lane.VERIFY)

    def require_power(self, command: RorzeCommand[Any]) -> None:
        """Refuse a motion to a place that it has lost with its power.

        :raises PowerCycled: it has.
        """
        refusal = self.power.refusal(self.address, command)
        if refusal is not None:
            raise refusal

    async def acknowledge_power_cycle(self) -> None:
        """Let it go to places again; a loss of power from now on will be seen.

        :raises PowerCycled: it has lost its power once more.
        :raises GatewayError: it did not tell.
        """
        if not self.power.cycled:
            return
        if await self.mark.stands(Lane.VERIFY) is False:
            raise self.power.lost_again(self.address)
        await self.mark.ensure(Lane.VERIFY)
        self.power.acknowledge("request")

    def drop(self, unwanted: Callable[[RorzeExchange], bool], reason: GatewayError) -> None:
        """Take commands out of its queue."""
        self.line.cancel(lambda exchange: exchange.target == self.number and unwanted(exchange), reason)

    def runs_no_program(self) -> bool:
        """True if it has said so of late, and nothing was seen since that could start one.

        A program is started by URG and USG, and when the power comes back (RC-420 manual 14, UAS).
        """
        at = self.told.no_program_at
        return at is not None and asyncio.get_running_loop().time() - at < NO_PROGRAM_S

    def _power_news(self, kind: str, facts: dict[str, object]) -> None:
        if kind == "body.power_cycled":
            for tracker in self._trackers.heeding(Tracker.powered_on):
                tracker.powered_on(certain=bool(facts["certain"]))
        self.told.power_in_question()
        self.look_soon()
        self.on_news(kind, facts)

    def look_soon(self) -> None:
        """Have its state read now, not at the next poll."""
        self.life.look_due.set()

    def forbid_renaming(self, command: RorzeCommand[Any]) -> None:
        """A move's end is judged by its position: that is not called otherwise before.

        :raises BodyBusy: it has a move that is not over.
        """
        if type(command) in RENAMING and self.move is not None:
            raise BodyBusy(
                f"{self.address} still has the move {self.move.id}; {command.code} was not sent.",
                "Wait for its end or stop it.",
            )

    # what is heard of it

    def was_sent(self, command: RorzeCommand[Any]) -> None:
        """Note what a command may change, when it is queued and again when its outcome is known.

        A read that was written before it is answered in between; the second time undoes what that noted.
        """
        if command.effect is Effect.READ:
            return
        is_known, row = command.code in COMMANDS, type(command)
        if row is SetUserComment:  # `isinstance` of another model takes ten times as long, at every command
            self.flash.sent(command, is_known=is_known)
            return
        for tracker in self._trackers.heeding(Tracker.sent):
            tracker.sent(command, is_known=is_known)
        if row in RENAMING:
            self.look_soon()
        if row in STARTS_PROGRAM or not is_known:
            self.may_move()

    def has_refused(self, command: RorzeCommand[Any]) -> None:
        """Note that it has refused a command, which leaves a command error."""
        for tracker in self._trackers.heeding(Tracker.refused):
            tracker.refused(command)

    def perhaps_did(self, command: RorzeCommand[Any]) -> None:
        """Note a command that may have been executed without a reply."""
        for tracker in self._trackers.heeding(Tracker.done):
            tracker.done(command, certain=False)

    def has_replied(self, command: RorzeCommand[Any], reply: Reply, at: float) -> None:
        """Note what a reply tells of the motor.

        While it has a move, not a single reading but the judgement of the move says whether it moves.
        """
        status_before = self.told.status_bits
        if command.effect is not Effect.READ:
            for tracker in self._trackers.heeding(Tracker.done):
                tracker.done(command, certain=True)
        for tracker in self._trackers.heeding(Tracker.replied):
            tracker.replied(command, reply, at)
        if self.power.signs.changed is not None:
            self.look_soon()
        if type(reply) is ControllerStatus:
            if reply.bits is not None:
                self._tell_status(status_before, reply.bits)
                self._saw_motion(runs=bool(reply.bits & PULSES_RUNNING))
            elif command == _RUNS:
                self._saw_motion(runs=bool(reply.on))
        elif type(command) is GetPosition and type(reply) is SignedPulses:
            self._saw_position(reply.pulses, at)

    def _saw_position(self, pulses: int, at: float) -> None:
        if self.motion.trajectory is not None:
            self.motion.trajectory.add(at, pulses)
        if not self.moving and self.power.signs.contradicts(pulses, 0xFF, self.configured.position_tolerance):
            self.look_soon()

    def _tell_status(self, before: int | None, bits: int) -> None:
        """Announce what has changed; that a move of ours makes pulses run is no news."""
        expected = 0 if self.move is None else PULSES_RUNNING
        if before is None or (before ^ bits) & ~expected:
            self.on_news("body.status.changed", {"status": names_of(bits, CONTROLLER_STATUS_BITS)})

    def _saw_motion(self, *, runs: bool) -> None:
        if self.life.in_move:
            return
        action = self.life.hear(BodyNews.RUNS if runs else BodyNews.STANDS)
        if runs:
            self.moved_by_itself()
        if action is BodyAction.TELL and not self.life.in_program:
            self.on_news("body.motion.foreign", {})

    def moved_by_itself(self) -> None:
        """It moves, or has moved, by no move of the gateway."""
        self.told.runs_by_itself()
        self.power.signs.forget_place()

    def reported(self, fields: Mapping[str, int]) -> None:
        """It has reported a change of its state unasked (RC-420 manual 13.11): a reason to ask, no proof."""
        for tracker in self._trackers.heeding(Tracker.reported):
            tracker.reported(fields)
        if "C" in fields:
            self.look_soon()

    # its move

    def claim(self, move: Move) -> None:
        """Let no other move begin."""
        self.motion.claim(move)
        self.life.hear(BodyNews.CLAIMED)
        self.line.followed.add(self.number)

    def release(self) -> None:
        """The move is over and recorded: another may begin."""
        self.line.followed.discard(self.number)
        self.life.hear(BodyNews.OVER)
        self.motion.release()

    def was_set_going(self, command: RorzeCommand[Any]) -> None:
        """A motion command is on the wire."""
        self.prepared.moves(command)
        self.life.hear(BodyNews.SENT)
        self.motion.was_sent()

    async def know_pattern(self, command: RorzeCommand[Any]) -> None:
        """Know the speed sets of a motion's pattern, for its stop: in motion it does not tell them."""
        pattern = self.prepared.pattern_of(command)
        if pattern is not None and pattern not in self.told.pattern_sets:
            with suppress(GatewayError):  # the motion does not hang on it
                await self.ask(GetPattern(pattern=pattern), lane=Lane.VERIFY)

    def moved_unseen(self) -> None:
        """A motion has ended that is no move of this gateway, or not any more."""
        self.power.signs.forget_place()
        self.look_soon()

    def stands(self) -> None:
        """Its move is judged to have come to rest."""
        self.life.hear(BodyNews.RESTS)

    def was_refused(self) -> None:
        """It did not take a motion command: what it does is what it did before, whatever that was."""
        self.life.hear(BodyNews.REFUSED)
        self.may_move()

    def was_stopped(self, position: int | None) -> None:
        """A stop is confirmed by its standstill."""
        self.stands()
        self.motion.was_stopped(position)

    # what may have happened unseen

    def may_move(self) -> None:
        """Ask for its state: if it stood still, it may move now."""
        self.life.hear(BodyNews.MAY_MOVE)
        for tracker in self._trackers.heeding(Tracker.may_move):
            tracker.may_move()

    def out_of_sight(self, news: BodyNews = BodyNews.OUT_OF_REACH) -> None:
        """It cannot be asked: it may move, or lose its power."""
        self.life.hear(news)
        for tracker in self._trackers.heeding(Tracker.silent):
            tracker.silent()

    def fell_silent(self) -> None:
        """It does not answer any more itself."""
        self.out_of_sight(BodyNews.SILENT)


_RUNS = GetControllerStatus(bit=0)


@dataclass(eq=False)
class Group:
    """A virtual body: several bodies of one line under one number."""

    line: Line
    number: int
    members: list[Body]
    name: str = ""
    kept_for: str | None = None
    """The thing it stands for, if it must not be defined anew."""
    position_tolerance: int | None = None
    """Pulses by which a member may miss its target, where they are others than for the body alone."""
    in_force: bool = True
    """True if the link master means these members by the number: False while, and once, it is told others."""
    on_strangers: Callable[[set[int]], None] = lambda _numbers: None
    """Called with bodies that have obeyed a command to the group and are no members."""

    @property
    def short(self) -> str:
        """Its two hexadecimal digits."""
        return f"{self.number:02X}"

    @property
    def address(self) -> str:
        """Its unique address, such as `LINE.80`."""
        return f"{self.line.id}.{self.short}"

    def keep_for(self, what: str, position_tolerance: int) -> None:
        """Forbid other definitions: it stands for a thing whose members may end beside their targets."""
        self.kept_for, self.position_tolerance = what, position_tolerance

    def require_in_force(self) -> None:
        """Make sure that its number reaches its members alone.

        :raises BodyBusy: it is being defined anew, or has been.
        """
        if not self.in_force:
            raise self.redefined()

    def redefined(self) -> BodyBusy:
        """The error of a command that would reach other bodies than were meant."""
        return BodyBusy(f"{self.address} is being defined anew; nothing was sent.", "See who is in it now.")

    async def ask(
        self,
        command: RorzeCommand[Any],
        *,
        lane: Lane | None = None,
        expires_at: float | None = None,
        on_written: Callable[[float], None] | None = None,
    ) -> dict[Body, Reply | GatewayError]:
        """Send a command to all members in one frame and give one reply or error for each.

        :raises GatewayError: no member can have executed it, or none answered.
        """
        forbid_stop(self.address, command)
        self.require_in_force()
        for member in self.members:
            member.forbid_renaming(command)
        lane = lane_of(command) if lane is None else lane
        future = self.line.submit(self.number, command, lane, expires_at=expires_at, on_written=on_written)
        self._was_sent(command)
        outcome = await future
        self._was_sent(command)
        answered = answer_or_raise(self.address, command, self._perhaps_done(command, outcome))
        strangers = answered.replies.keys() - {member.number for member in self.members}
        if strangers:
            self.on_strangers(strangers)
        results = {member: _member_result(member, command, answered) for member in self.members}
        for member, result in results.items():
            if isinstance(result, Reply):
                member.has_replied(command, result, answered.at)
            elif isinstance(result, ControllerRefused):
                member.has_refused(command)
            elif isinstance(result, NoReply):
                member.perhaps_did(command)
        return results

    def _was_sent(self, command: RorzeCommand[Any]) -> None:
        for member in self.members:
            member.was_sent(command)

    def _perhaps_done(self, command: RorzeCommand[Any], outcome: Outcome) -> Outcome:
        """Note what may have been done without a reply."""
        if isinstance(outcome, NoReply):
            for member in self.members:
                member.perhaps_did(command)
        return outcome


def idle_bodies_of(target: Body | Group) -> list[Body]:
    """The bodies a motion command would move, none of which has a move that is not over.

    :raises BodyBusy: one has, or the group is being defined anew.
    """
    if isinstance(target, Group):
        target.require_in_force()
    bodies = target.members if isinstance(target, Group) else [target]
    for body in bodies:
        if body.move is not None:
            raise BodyBusy(
                f"{body.address} still has the move {body.move.id}; nothing was sent.",
                "Wait for it or stop it.",
            )
    return bodies


def _member_result(member: Body, command: RorzeCommand[Any], answered: Answered) -> Reply | GatewayError:
    try:
        return reply_of(member.number, command, answered, member.address)
    except GatewayError as error:
        return error


def forbid_stop(address: str, command: RorzeCommand[Any]) -> None:
    """Refuse a stop that would not be repeated until standstill is proved.

    :raises InvalidRequest: it is one.
    """
    if command.effect is Effect.STOP and not isinstance(command, EndProgram):
        raise InvalidRequest(
            f"{command.code} is not sent to {address} alone, for nobody would see to its standstill; nothing "
            "was sent.",
            "Stop it.",
        )


def answer_or_raise(address: str, command: RorzeCommand[Any], outcome: Outcome) -> Answered:
    """Turn everything that is no answer into its error."""
    if isinstance(outcome, Answered):
        return outcome
    if isinstance(outcome, Refusal):
        raise refused(address, command, outcome.error)
    raise outcome


def reply_of(number: int, command: RorzeCommand[Any], answered: Answered, address: str) -> Reply:
    """Pick one body's reply out of an answer."""
    reply = answered.replies.get(number)
    if isinstance(reply, Refusal):
        raise refused(address, command, reply.error)
    if reply is None:
        raise NoReply(
            f"The group's reply to {command.code} does not mention {address}.",
            "Read its status and position.",
            command,
        )
    return reply
