"""A body as the gateway sees it: its address, what was last known of it, and how to ask it something."""

import asyncio
from collections.abc import Callable, Mapping
from contextlib import AbstractAsyncContextManager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from typing import Any, Final, NamedTuple, TypeVar, cast

from gateway.core.errors import BodyBusy, ControllerRefused, GatewayError, InvalidRequest, NoReply
from gateway.core.lanes import Lane
from gateway.core.move_record import CountedIn, Move, MoveStatus
from gateway.core.targets import Looked
from gateway.core.trajectories import Trajectory
from gateway.core.waiting import happens
from gateway.rorze.edges import SensorEdges
from gateway.rorze.errors import refused
from gateway.rorze.exchange import Answered, Outcome, RorzeExchange
from gateway.rorze.flash_state import FlashState
from gateway.rorze.line import Line, lane_of
from gateway.rorze.mark import Mark
from gateway.rorze.own_refusals import OwnRefusals
from gateway.rorze.position_flash import PositionFlash
from gateway.rorze.power import POWER_ON_POSITION, RENAMING, BodyPower
from gateway.rorze.readings import believed, errs
from gateway.rorze.units import Scale
from protocols.rorze.commands import COMMANDS
from protocols.rorze.flash import LoadProgram
from protocols.rorze.interpolation import Preparation, SetStartPosition
from protocols.rorze.link import Refusal
from protocols.rorze.modes import GetOperatingMode, OperatingMode, SetOperatingMode
from protocols.rorze.origin import GetHomingDistance
from protocols.rorze.patterns import GetPattern, PatternSpeedSets, SetPattern
from protocols.rorze.position import GetPosition, SetPosition, SignedPulses
from protocols.rorze.profile import SpeedParameters
from protocols.rorze.programs import (
    AddProgramInstruction,
    ClearProgram,
    EndProgram,
    GetProgramStatus,
    ProgramStatus,
    RunProgram,
    StepProgram,
)
from protocols.rorze.row import ModeName, RorzeCommand
from protocols.rorze.status import (
    CONTROLLER_STATUS_BITS,
    ClearControllerStatus,
    ControllerStatus,
    GetControllerStatus,
    SetUserComment,
    names_of,
)
from protocols.table import Ack, Effect, Reply

R = TypeVar("R", bound=Reply)

STATUS: Final = GetControllerStatus()
"""A question that is asked all the time is built once."""
POSITION: Final = GetPosition()
PULSES_RUNNING = 0x01
"""Bit of the controller status (9CD)."""
PROGRAM_RUNS = 1
"""Bit 0 of a program's status (URD)."""
NO_PROGRAM_S = 120.0
"""That no program runs is believed for this time: an autostart after a short loss of power may be unseen."""
ENCODER_SWAYS = 16
"""Encoder counts by which a shaft at rest may sway through 0, where one would stand that was switched on."""
CHANGE_PROGRAM: Final = (ClearProgram, AddProgramInstruction, LoadProgram)
"""After these a body has another program in RAM."""
BELIEVED_S = 0.5
"""Where a motor rests is asked again before a move when it was read longer ago: power is lost at rest too."""


def counted_in(mode: ModeName | None) -> CountedIn:
    """What positions and amounts are counted in (RC-420 manual 13.1)."""
    return "encoder_counts" if mode == "encoder" else "pulses"


class MotorState(NamedTuple):
    """What a controller says of its motor."""

    bits: int
    position: int
    cause: int = 0
    """Of the end (9MD), where it was asked for."""

    @property
    def runs(self) -> bool:
        """Whether pulses run."""
        return bool(self.bits & PULSES_RUNNING)


@dataclass(eq=False)
class Body(Looked):
    """One RC-420 axis controller."""

    line: Line
    number: int
    name: str = ""
    scale: Scale | None = None
    input_names: Mapping[int, str] = field(default_factory=dict)
    output_names: Mapping[int, str] = field(default_factory=dict)
    position_tolerance: int = 0
    """Pulses by which, in encoder mode, the final position may miss the target of a successful move."""
    in_position: bool = False
    """In servo mode a move has succeeded when INP is on."""
    slow_pattern: int | None = None
    """The pattern that is reserved for moves with a speed of their own; None: not configured."""
    poll_interval_s: float = 0.2
    """While it has a move, its state is asked for this often."""
    on_news: Callable[[str, dict[str, object]], None] = lambda _kind, _facts: None
    """Called with what it does unasked: the kind of event, and its data."""
    power: BodyPower = field(default_factory=BodyPower)
    flash: FlashState = field(default_factory=FlashState)
    position_flash: PositionFlash = field(default_factory=PositionFlash)
    mark: Mark = field(init=False)
    edges: SensorEdges = field(init=False)
    _own_refusals: OwnRefusals = field(init=False)
    moving: bool | None = None
    """None until its status has been read since it was out of reach."""
    changing: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Held while its settings are being changed."""
    limiting: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Held from when the speed of a move is written until the move has started."""
    slow_written: SpeedParameters | None = None
    """The speeds that were written last for a move with a speed of its own."""
    companions: "list[Body]" = field(default_factory=list)
    """Those that move only together, itself among them."""
    poll_due: asyncio.Event = field(default_factory=asyncio.Event)
    """Its state is to be read now, not at the next poll."""
    rest: MotorState | None = None
    """What it said when it was last seen at rest; None once it may have moved since."""
    rest_at: float = 0.0
    status_bits: int | None = None
    position: int | None = None
    position_at: float | None = None
    trajectory: Trajectory[int] | None = None
    """Where it is seen during the move that is not over yet."""
    changes: int = 0
    """Counts what may have changed its settings."""
    mode: ModeName | None = None
    """Its operating mode; None where it may have changed since it was read."""
    prepared: bool | None = None
    """Whether an interpolated move was prepared since it got positions or moved; None: not known."""
    prepared_pattern: int | None = None
    """The acceleration pattern of the interpolated move that was prepared last; None: the standard one."""
    pattern: int | None = None
    """The acceleration pattern of its move; None: the standard one, or not known."""
    pattern_sets: dict[int, PatternSpeedSets] = field(default_factory=dict)
    """The speed sets of its patterns, as it has told them: in motion it does not."""
    sent_count: int = 0
    """Counts the commands sent to it that are no reads: a poll around one of these has seen two states."""
    no_program_at: float | None = None
    """When it last said that no user program runs; None where one may have been started since."""
    program_ends: bool = False
    """Whether its program was read, has no move without an end, and was not changed since."""
    in_program: bool = False
    """Whether a program that the gateway has started is not over, as far as is known: it moves the motor."""
    move: Move | None = None
    """The move that is not over yet."""
    move_ended: asyncio.Event = field(default_factory=asyncio.Event)
    """The link master has announced the end of a move."""
    end_due: asyncio.Event = field(default_factory=asyncio.Event)
    """The move seems to be over: the link master has announced it, or a stop is confirmed."""
    watched: bool = False
    """Whether the robot it belongs to is asked as a whole, so that nobody need ask it again and again."""
    being_stopped: bool = False
    stop_was_proved: bool = False
    """Whether the last stop was being proved already when it was called late."""
    """Whether a stop is under way that is not confirmed yet."""
    stopped_at: int | None = None
    """Where it stood when a stop was confirmed since its last move was sent."""
    free: asyncio.Event = field(default_factory=asyncio.Event)
    """The last move is over and recorded: the next one may begin."""
    went_silent: bool = False
    """Whether it has been offline since its last move was sent: it may have lost its power meanwhile."""
    _heard_at: float | None = None

    def __post_init__(self) -> None:
        self.power.on_news = self._power_news
        self.mark = Mark(self)
        self._own_refusals = OwnRefusals(self)
        self.edges = SensorEdges(self.input_names, lambda kind, facts: self.on_news(kind, facts))

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
        """Whether it can be asked now, as far as is known."""
        return self.line.state != "down" and self.number not in self.line.silent

    @property
    def settings(self) -> tuple[int, int]:
        """Tells whether its settings may have changed: by a command, or with its power."""
        return self.changes, self.power.losses

    @property
    def last_heard_at(self) -> float | None:
        """When it last answered anything, in the event loop's time."""
        at, in_group = self.line.heard_at(self.number), self._heard_at
        return in_group if at is None or (in_group is not None and in_group > at) else at

    # asking

    def looking(self) -> AbstractAsyncContextManager[None]:
        """Leave no command error of what is asked inside."""
        return self._own_refusals.cleared()

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
        self.note_sent(command)
        outcome = await future
        self.note_sent(command)
        if isinstance(outcome, NoReply):
            self.perhaps_did(command)
        try:
            answered = answer_or_raise(self.address, command, outcome)
            reply = reply_of(self.number, command, answered, self.address)
        except ControllerRefused:
            self.note_refused(command)
            raise
        self.note_reply(command, reply, answered.at)
        return cast("R", reply), answered

    async def poll(self, lane: Lane = Lane.READ) -> MotorState:
        """Read its status and where it stands.

        :raises GatewayError: it did not tell.
        """
        sent = self.sent_count
        state, at = await self._read(lane)
        self.rest = None if state.runs or self.sent_count != sent else state
        self.rest_at = at
        if self.rest is not None:
            await self._weigh(state, lane, at)
        return state

    async def _read(self, lane: Lane) -> tuple[MotorState, float]:
        status, _ = await self.ask(STATUS, lane=lane)
        position, answer = await self.ask(POSITION, lane=lane)
        return MotorState(status.bits or 0, position.pulses), answer.at

    @property
    def counted_in(self) -> CountedIn | None:
        """What its positions are counted in; None while its operating mode is not known."""
        return None if self.mode is None else counted_in(self.mode)

    async def know_mode(self) -> ModeName:
        """Its operating mode, which is asked for where it is not known (EAD).

        :raises GatewayError: it did not tell.
        """
        if self.mode is None:
            return (await self.ask(GetOperatingMode()))[0].mode
        return self.mode

    async def where_it_rests(self) -> MotorState:
        """Give the state it was seen at rest in a moment ago; otherwise ask: it may run.

        While the line errs a single poll is not believed.

        :raises GatewayError: it did not tell.
        """
        fresh = asyncio.get_running_loop().time() - self.rest_at <= BELIEVED_S
        if self.rest is not None and fresh and self.power.is_vouched and not errs(self.line):
            return self.rest
        return await believed(self.line, lambda: self.poll(Lane.VERIFY), self._both_may_be_true)

    def _both_may_be_true(self, one: MotorState, other: MotorState) -> bool:
        if one.runs or other.runs:
            return one.runs and other.runs
        return abs(one.position - other.position) <= self.position_tolerance and one.bits == other.bits

    # its power

    async def _weigh(self, state: MotorState, lane: Lane, at: float) -> None:
        """What it says at rest may tell of a loss of power: then find out."""
        if self.power.contradicts(state.position, state.bits, self.position_tolerance):
            why = await self._why_lost(state, lane)
            if why is not None:
                self.power.lost(certain=False, why=why)
        if self.rest is state:  # it was told nothing meanwhile
            target = None if self.move is None else self.move.target_position
            self.power.note_rest(state.position, state.bits, at, target)

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
        if self.power.looks_switched_on(state.position) and not await self.remembers_homing(lane):
            position, _ = await self.ask(POSITION, lane=lane)
            if self.power.looks_switched_on(position.pulses):
                return f"it was silent, and stands at {position.pulses}"
        return None

    async def _changed_by_itself(self, state: MotorState, lane: Lane) -> str | None:
        """Say what has changed that only a loss of power can have changed, as far as is known; ask twice."""
        setting = self.power.changed
        if setting is not None and await self._has_changed(setting, lane):
            return f"{setting.code} is not answered as before"
        if not await self._jumped(state):
            return None
        again, _ = await self._read(lane)
        if again.runs or await self._is_moved_by_a_program(lane):
            return None
        why = await self._jumped(again)
        if why is None:  # the first reading was garbled
            self.rest = None
        return why

    async def _jumped(self, state: MotorState) -> str | None:
        """Say how it has changed at rest; a shaft that an encoder measures may be turned by hand."""
        tolerance = self.position_tolerance
        why = self.power.jumped(state.position, state.bits, tolerance)
        if why is None or await self.know_mode() != "encoder":
            return why
        sways = max(tolerance, ENCODER_SWAYS if self.power.looks_switched_on(state.position) else inf)
        return self.power.jumped(state.position, state.bits, sways)

    async def _is_moved_by_a_program(self, lane: Lane) -> bool:
        """Whether a user program moves it that ran before: one that runs since may have begun at power-on."""
        if self.in_program or self.no_program_at is not None:
            return self.in_program
        status, _ = await self.ask(GetProgramStatus(), lane=lane)
        return bool(status.status & PROGRAM_RUNS)

    async def _has_changed(self, setting: RorzeCommand[Any], lane: Lane) -> bool:
        """Ask for a setting once more: one garbled digit must not prove anything."""
        reply, _ = await self.ask(setting, lane=lane)
        return self.power.differs(setting, reply)

    async def remembers_homing(self, lane: Lane) -> bool:
        """Whether it knows how far its last homing went (0PD), which a loss of power would have taken.

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
        self.line.cancel(lambda it: it.body == self.number and unwanted(it), reason)

    def runs_no_program(self) -> bool:
        """Whether it has said so of late, and nothing was seen since that could start one.

        A program is started by URG and USG, and when the power comes back (RC-420 manual 14, UAS).
        """
        at = self.no_program_at
        return at is not None and asyncio.get_running_loop().time() - at < NO_PROGRAM_S

    def _power_news(self, kind: str, facts: dict[str, object]) -> None:
        if kind == "body.power_cycled":
            self.flash.note_power_on(certain=bool(facts["certain"]))
            self.position_flash.note_power_on()
            self.prepared = False
        self.no_program_at = self.mode = None
        self.program_ends = False
        self.pattern_sets.clear()
        self.poll_due.set()
        self.on_news(kind, facts)

    def forbid_renaming(self, command: RorzeCommand[Any]) -> None:
        """A move's end is judged by its position: that is not called otherwise before.

        :raises BodyBusy: it has a move that is not over.
        """
        if self.move is not None and isinstance(command, RENAMING):
            raise BodyBusy(
                f"{self.address} still has the move {self.move.id}; {command.code} was not sent.",
                "Wait for its end or stop it.",
            )

    # what it was sent and has answered

    def note_refused(self, command: RorzeCommand[Any]) -> None:
        """Note that it has refused a command, which leaves a command error."""
        self._own_refusals.note_refused(command)

    def note_sent(self, command: RorzeCommand[Any]) -> None:
        """Note what a command may change, when it is queued and again when its outcome is known.

        A read that was written before it is answered in between; the second time undoes what that noted.
        """
        if command.effect is Effect.READ:
            return
        is_known, row = command.code in COMMANDS, type(command)
        self.flash.note_sent(command, is_known=is_known)
        self.position_flash.note_sent(command, is_known=is_known)
        if row is SetUserComment:  # `isinstance` of another model takes ten times as long, at every command
            return
        self.sent_count += 1
        self.changes += command.effect in (Effect.SETTING, Effect.CLEARING, Effect.MAINTENANCE)
        self.rest = None
        self.power.note_sent(command)
        if row is SetOperatingMode:
            self.mode = None
        if row in CHANGE_PROGRAM or not is_known:
            self.program_ends = False
        if row is SetPattern or not is_known:
            self.pattern_sets.clear()
        if row in RENAMING:
            self.position = self.position_at = None
            self.poll_due.set()
        if row is RunProgram or row is StepProgram or not is_known:
            self.may_move()

    def note_reply(self, command: RorzeCommand[Any], reply: Reply, at: float) -> None:
        """Note what a reply tells of the motor.

        While it has a move, not a single reading but the judgement of the move says whether it moves.
        """
        self._heard_at = at
        if command.effect is not Effect.READ:
            self._was_done(command)
        self._saw_setting(command, reply)
        if type(reply) is Ack:
            return
        if type(command) is GetPosition and isinstance(reply, SignedPulses):
            self._saw_position(reply.pulses, at)
        elif type(reply) is ProgramStatus:
            self.no_program_at = None if reply.status & PROGRAM_RUNS else at
        elif type(reply) is ControllerStatus and reply.bits is not None:
            self._saw_status(reply.bits)
            self._saw_motion(bool(reply.bits & PULSES_RUNNING))
        elif type(reply) is ControllerStatus and command == _RUNS:
            self._saw_motion(bool(reply.on))
        else:
            self.edges.read(reply)

    def perhaps_did(self, command: RorzeCommand[Any]) -> None:
        """Note what may have been done without a reply."""
        self.power.note_done(command)
        self.flash.note_done(command, certain=False)
        self.position_flash.note_done(command, certain=False)
        self._note_preparation(command, certain=False)

    def _was_done(self, command: RorzeCommand[Any]) -> None:
        if type(command) is ClearControllerStatus:
            self._own_refusals.note_status(0)
        self.power.note_done(command)
        self.flash.note_done(command, certain=True)
        self.position_flash.note_done(command, certain=True)
        self._note_preparation(command, certain=True)
        if type(command) is SetPosition:
            self.power.note_position_set(command)

    def _note_preparation(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """What was prepared counts from the positions told before it (HPS; RC-420 manual 13.10.7)."""
        if isinstance(command, Preparation):
            self.prepared, self.prepared_pattern = certain, command.pattern
        elif type(command) is SetStartPosition:
            self.prepared = False

    def _saw_setting(self, question: RorzeCommand[Any], reply: Reply) -> None:
        self.power.note_read(question, reply)
        self.flash.note_read(question, reply)
        self.position_flash.note_read(reply)
        if type(reply) is OperatingMode:
            self.mode = reply.mode
        elif type(reply) is PatternSpeedSets:
            number = getattr(question, "pattern", None)
            if number is not None:
                self.pattern_sets[number] = reply
        if self.power.changed is not None:
            self.poll_due.set()

    def _saw_position(self, pulses: int, at: float) -> None:
        self.position, self.position_at = pulses, at
        if self.trajectory is not None:
            self.trajectory.add(at, pulses)
        if not self.moving and self.power.contradicts(pulses, 0xFF, self.position_tolerance):
            self.poll_due.set()

    def _saw_status(self, bits: int) -> None:
        """Announce what has changed; that a move of ours makes pulses run is no news."""
        before, self.status_bits = self.status_bits, bits
        self._own_refusals.note_status(bits)
        self.power.note_status(bits)
        expected = 0 if self.move is None else PULSES_RUNNING
        if before is None or (before ^ bits) & ~expected:
            self.on_news("body.status.changed", {"status": names_of(bits, CONTROLLER_STATUS_BITS)})

    def reported(self, fields: Mapping[str, int]) -> None:
        """It has reported a change of its state unasked (RC-420 manual 13.11): a reason to ask, no proof."""
        self.edges.reported(fields)
        if "C" in fields:
            self.poll_due.set()

    def _saw_motion(self, runs: bool) -> None:
        if self.move is not None:
            return
        is_news, self.moving = runs and not self.moving and not self.in_program, runs
        if runs:
            self.no_program_at = None
            self.power.note_motion()
        if is_news:
            self.on_news("body.motion.foreign", {})

    def was_set_going(self, command: RorzeCommand[Any]) -> None:
        """A motion command is on the wire; an interpolated one has the pattern of its preparation."""
        self.pattern = self._pattern_of(command)
        self.moving, self.went_silent, self.stopped_at = True, False, None
        self.prepared = False
        self.move_ended.clear()
        self.end_due.clear()

    def _pattern_of(self, command: RorzeCommand[Any]) -> int | None:
        """The acceleration pattern of a motion command; None: the standard one, or not known."""
        prepared = None if self.prepared is False else self.prepared_pattern
        pattern: int | None = getattr(command, "pattern", prepared)
        return pattern

    async def know_pattern(self, command: RorzeCommand[Any]) -> None:
        """Know the speed sets of a motion's pattern, for its stop: in motion it does not tell them."""
        pattern = self._pattern_of(command)
        if pattern is not None and pattern not in self.pattern_sets:
            with suppress(GatewayError):  # the motion does not hang on it
                await self.ask(GetPattern(pattern=pattern), lane=Lane.VERIFY)

    def announced(self) -> None:
        """The link master has announced the end of its move: a reason to ask now, never a proof."""
        self.move_ended.set()
        self.end_due.set()

    def moved_unseen(self) -> None:
        """A motion has ended that is no move of this gateway, or not any more."""
        self.power.note_motion()
        self.poll_due.set()

    def stands(self) -> None:
        """Its move is judged to have come to rest."""
        self.moving = False

    def was_stopped(self, position: int | None) -> None:
        """A stop is confirmed by its standstill."""
        self.stands()
        self.stopped_at = position
        self.end_due.set()

    def refused(self) -> None:
        """It did not take a motion command: what it does is what it did before, whatever that was."""
        self.moving = None
        self.may_move()

    def may_move(self) -> None:
        """What was moving counts as moving, what stood still may move: ask."""
        self._forget_rest()
        self.poll_due.set()

    def _forget_rest(self) -> None:
        self.moving = self.moving or None
        self.rest = self.no_program_at = self.mode = None
        self.power.mark_due = True

    def out_of_sight(self) -> None:
        """It cannot be asked: it may move, or lose its power."""
        self.program_ends = False
        self._forget_rest()
        self.power.note_silence()

    def fell_silent(self) -> None:
        """It does not answer any more itself."""
        self.out_of_sight()
        self.went_silent = True

    # what is waited for

    async def end_announced(self, within_s: float) -> bool:
        """Whether the link master announces the end of a move in time."""
        return await happens(self.move_ended, within_s)

    async def end_seems_due(self, within_s: float) -> None:
        """Wait until the move seems to be over, at the latest when the time is up."""
        await happens(self.end_due, within_s)

    async def poll_wanted(self, within_s: float) -> None:
        """Wait until its state is to be read, at the latest when the time is up."""
        await happens(self.poll_due, within_s)


_RUNS = GetControllerStatus(bit=0)


@dataclass(eq=False)
class Group:
    """A virtual body: several bodies of one line under one number."""

    line: Line
    number: int
    members: list[Body]
    name: str = ""
    kept_for: str | None = None
    """What it stands for, if it must not be defined anew."""
    position_tolerance: int | None = None
    """By how much a member may end beside its target, where that is otherwise than for the body alone."""
    in_force: bool = True
    """Whether the link master means these members by the number: False while, and once, it is told others."""
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

    def require_in_force(self) -> None:
        """Make sure that its number reaches its members and nobody else.

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

        :raises GatewayError: nobody can have executed it, or nobody answered.
        """
        forbid_stop(self.address, command)
        self.require_in_force()
        for member in self.members:
            member.forbid_renaming(command)
        lane = lane_of(command) if lane is None else lane
        future = self.line.submit(self.number, command, lane, expires_at=expires_at, on_written=on_written)
        self._note_sent(command)
        outcome = await future
        self._note_sent(command)
        answered = answer_or_raise(self.address, command, self._perhaps_done(command, outcome))
        strangers = answered.replies.keys() - {member.number for member in self.members}
        if strangers:
            self.on_strangers(strangers)
        results = {member: _member_result(member, command, answered) for member in self.members}
        for member, result in results.items():
            if isinstance(result, Reply):
                member.note_reply(command, result, answered.at)
            elif isinstance(result, ControllerRefused):
                member.note_refused(command)
            elif isinstance(result, NoReply):
                member.perhaps_did(command)
        return results

    def _note_sent(self, command: RorzeCommand[Any]) -> None:
        for member in self.members:
            member.note_sent(command)

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
    """Refuse a stop that nobody would repeat until standstill is proved.

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
