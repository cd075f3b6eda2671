"""The proof of a move by the controller's own state: that it was begun, is over, and how it ended."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, TypeVar

from gateway.core.errors import (
    BodyBusy,
    ControllerRefused,
    GarbledReply,
    GatewayError,
    NoReply,
    NotSent,
    QueueFull,
    refused_in_motion,
)
from gateway.core.exchange import Lane
from gateway.core.move_record import Move, MoveStatus
from gateway.core.move_runs import Silence
from gateway.core.times import happens
from gateway.core.verdicts import (
    AtRest,
    Begun,
    Finding,
    Heard,
    Place,
    Power,
    Sight,
    Stop,
    Told,
    Unseen,
    Verdict,
    VerdictWords,
    judge,
)
from gateway.rorze.asked_body import believed
from gateway.rorze.bodies import ENCODER_SWAYS, STATUS, Body
from gateway.rorze.errors import IN_MOTION
from gateway.rorze.knowledge import MotorState
from gateway.rorze.plans import target_of
from gateway.rorze.power import POWER_ON_POSITION, PowerSeen, needs_place
from gateway.rorze.probes import background_of, is_crowded, is_prompt
from protocols.rorze.inputs_outputs import GetSensors
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.origin import CentreStallDog, GetHomingDistance, OriginSearch
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import END_CAUSE_BITS, SENSOR_BITS, GetEndCause, names_of
from protocols.table import Reply

STRAIGHT = ("relative", "absolute", "continuous", "jog")
"""Moves that go from where the motor stands, one way."""
MOTION_ERRORS = 0x66
"""Bits of the controller status: a limit, EMS, the movement range or STALL can end a move (9CD)."""
IN_POSITION_S = 6.0
"""A servo drive that has not arrived by then after the last pulse has been given CLR: after about 5 s (RC-420
manual 17.4.1)."""
IN_POSITION_BIT = SENSOR_BITS.index("in_position")
MISSING_END_FRAME_S = 0.5
"""An end-of-move frame this late tells that the link master has forgotten to send them."""
OVERDUE_S = 2.0
"""A question whether the motor still runs waits this time behind those of clients, then goes before them."""
STOPPING_S = 0.5
"""A question that waits for the stops of others is asked anew after this time."""
SHARE_OF_OVERDUE = 4
"""Multiple of the time of a question that went before clients, for which clients go first afterwards."""
CAUSES: Final = {
    "cw_limit": "ran into its cw limit sensor",
    "ccw_limit": "ran into its ccw limit sensor",
    "ems": "was ended by its EMS input",
    "stall": "stalled",
    "stop_command": "was stopped by a stop command that the gateway has not sent",
}
"""Ends of a move that missed its target, in words, by the cause of its controller (RC-420 manual 9MD)."""
_END_CAUSE: Final = GetEndCause()

_POWER: Final = {True: Power.KEPT, None: Power.UNPROVED, False: Power.LOST}

T = TypeVar("T")


def _same_reply(one: tuple[Reply, object], other: tuple[Reply, object]) -> bool:
    return one[0] == other[0]


class SharedWay(NamedTuple):
    """Where a motor that moves together with others has to start, and should come to, in pulses."""

    start: int
    target: int
    tolerance: int


@dataclass(eq=False)
class MoveProof:
    """The evidence of how the move of one body ends."""

    body: Body
    move: Move
    before: MotorState | None = None
    """The motor's state just before the command was sent."""
    tolerance: int = 0
    """Pulses by which the motor may miss the target."""
    resumed: str = ""
    """Why another life of the gateway, or another gateway, has begun it, which may have had the reply."""
    _needs_proof: bool = False
    _power: PowerSeen = field(default_factory=lambda: PowerSeen(None, 0))
    """The state of the body's power just before the command was sent."""
    _strayed: bool = False
    """True if the motor was seen where its way does not lead."""
    _half: MotorState | None = None
    """A reading that counts when the next one agrees; no cut of the line undoes it."""
    _doubled: NoReply | None = None
    """The error that counts in place of a refusal as in motion, although the motor had stood still."""
    _patience_s: float = OVERDUE_S
    _silence: Silence = field(init=False)
    set_ups: int = field(init=False)
    """The line's count of set-ups when the motor was last seen to run, or when the move began."""

    def __post_init__(self) -> None:
        line = self.body.line
        self.set_ups = line.set_ups
        longest_s = line.reply_timeout_s + line.late_reply_s + self.body.poll_interval_s
        self._silence = Silence(asyncio.get_running_loop().time(), longest_s)

    # before it is sent

    async def know_the_start(self, command: RorzeCommand[Any]) -> None:
        """Prove that the motor rests, its place, and its target: the evidence if no reply comes.

        The parts of the controller's memory that the motion needs are proved last, right before it is sent.

        :raises BodyBusy: it moves; what it does later would prove nothing of this move.
        :raises NotSent: it did not tell.
        :raises PowerCycled: it has lost its power, and would go to another place.
        :raises ControllerRefused: it did not tell where an entry of its position table leads to.
        """
        body, move = self.body, self.move
        try:
            await self._begin_to_guard(command)
            self.before = await body.where_it_rests()
            move.start_position = move.position = self.before.position
            move.target_position = await self._target(command, self.before.position)
            self.tolerance = await self._tolerance()
            await body.know_pattern(command)
            await self._prove_power(command)
        except NoReply as error:
            raise NotSent(
                f"{body.address} did not tell its state before the move; the move was not sent.", error.remedy
            ) from None
        if self.before.runs:
            body.may_move()
            mover = "its user program" if body.life.in_program else "no move of this gateway"
            raise BodyBusy(
                f"{body.address} moves already, by {mover}; {move.command} was not sent.",
                "Wait for its end or stop it.",
            )

    def expect(self, stretch: SharedWay) -> None:
        """Take the target from the plan of the move.

        :raises NotSent: the motor does not stand where the plan begins.
        """
        if self.before is None or self.before.position != stretch.start:
            raise NotSent(
                f"{self.body.address} stands at {self.move.start_position}, and the move was planned from "
                f"{stretch.start}; {self.move.command} was not sent.",
                "See what else moves it, and try again.",
            )
        self.move.target_position, self.tolerance = stretch.target, stretch.tolerance

    async def _target(self, command: RorzeCommand[Any], start: int) -> int | None:
        return await believed(self.body.line, lambda: target_of(self.body, command, start, Lane.VERIFY))

    async def _tolerance(self) -> int:
        """An encoder may find the motor beside its target; pulses put out are counted, and never miss it."""
        if not self.body.configured.position_tolerance or self.move.target_position is None:
            return 0
        operation, _ = await believed(
            self.body.line, lambda: self.body.ask(GetOperatingMode(), lane=Lane.VERIFY), _same_reply
        )
        return self.body.configured.position_tolerance if operation.mode == "encoder" else 0

    async def _begin_to_guard(self, command: RorzeCommand[Any]) -> None:
        """Let the mark stand before what a loss of power would spoil; without one, look afresh."""
        power = self.body.power
        self._needs_proof = power.needs_origin and (needs_place(command) or isinstance(command, OriginSearch))
        if self._needs_proof and power.mark.text is None:
            await self.body.mark.ensure(Lane.VERIFY)
            self.body.told.rest_in_doubt()

    async def _prove_power(self, command: RorzeCommand[Any]) -> None:
        """Ask for the mark; where there is none, what the motor has just said has to do."""
        power = self.body.power
        if self._needs_proof and await self.body.mark.stands(Lane.VERIFY) is not True:
            await self.body.mark.ensure(Lane.VERIFY)
        self._power = power.seen
        self.body.require_power(command)

    # while it may run

    async def running(self) -> MotorState | None:
        """Ask for the motor's state while the move is under way; None when it cannot be told any more."""
        return await self._state(lambda state: state.runs or self._ended_as_asked(state))

    async def _state(self, plausible: Callable[[MotorState], bool]) -> MotorState | None:
        """Ask for the motor's state: twice where it is not plausible, or while the line garbles frames."""
        half: MotorState | None
        self._half = None
        while (state := await self._answered(self._read)) is not None:
            half, self._half = self._half, state
            if half is not None and self._agree(state, half):
                break
            if plausible(state) and not self.body.line.errs():
                break
        if state is not None:
            self._half = None
            await self._watch_its_way(state)
        return state

    async def _answered(self, question: Callable[[], Awaitable[T]]) -> T | None:
        """Repeat a question until it is answered; None when there was silence for too long."""
        loop, body = asyncio.get_running_loop(), self.body
        while not self._silence.too_long:
            try:
                answer = await question()
            except GatewayError as error:
                self._silence.unanswered(loop.time(), silent=body.line.shows_silence(error))
                await asyncio.sleep(body.poll_interval_s)
            else:
                self._silence.answered(loop.time())
                return answer
        return None

    async def _read(self) -> MotorState:
        """Ask what the motor does: behind clients while it runs, before them when that decides the move."""
        body = self.body
        if self._half is None and not body.motion.end_due.is_set():
            reading = asyncio.create_task(self._ask(background_of(body.line)), name=f"poll {body.address}")
            due = asyncio.create_task(body.motion.end_due.wait(), name=f"end of {body.address}")
            try:
                await asyncio.wait(
                    {reading, due}, timeout=self._patience_s, return_when=asyncio.FIRST_COMPLETED
                )
                if reading.done():
                    with suppress(QueueFull):
                        return reading.result()
            finally:
                reading.cancel()
                due.cancel()
                await asyncio.gather(reading, due, return_exceptions=True)
        began_at = asyncio.get_running_loop().time()
        try:
            return await self._ask_urgently()
        finally:
            took_s = asyncio.get_running_loop().time() - began_at
            self._patience_s = max(OVERDUE_S, SHARE_OF_OVERDUE * took_s)

    async def _ask_urgently(self) -> MotorState:
        """Ask in the urgent lane, anew when that is another one by now: its stop is over."""
        while (lane := self._urgent_lane) is Lane.BACKGROUND:
            with suppress(TimeoutError):
                async with asyncio.timeout(STOPPING_S):
                    return await self._ask(lane)
        return await self._ask(lane)

    @property
    def _urgent_lane(self) -> Lane:
        """Before clients; where many are stopped, their standstill is proved first."""
        behind = self.body.life.being_stopped and not is_prompt(self.body.line)
        return Lane.BACKGROUND if behind else Lane.VERIFY

    async def _ask(self, lane: Lane) -> MotorState:
        if lane is not Lane.VERIFY and is_crowded(self.body.line):
            status, _ = await self.body.ask(STATUS, lane=lane)
            seen = MotorState(status.bits or 0, self.move.position or 0)
            if seen.runs:
                return seen
            lane = self._urgent_lane
        state = await self.body.poll(lane)
        if state.runs:
            return state
        cause, _ = await self.body.ask(_END_CAUSE, lane=self._urgent_lane)
        return state._replace(cause=cause.bits)

    def _agree(self, one: MotorState, other: MotorState) -> bool:
        """True if both may be true: a motor at rest stays where it is."""
        if one.runs or other.runs:
            return one.runs and other.runs
        same_place = abs(one.position - other.position) <= self.tolerance
        return same_place and (one.bits, one.cause) == (other.bits, other.cause)

    def _ended_as_asked(self, state: MotorState) -> bool:
        """True if an announced end, the end cause and the position all tell of success."""
        near = self.move.target_position is None or self._is_target(state.position)
        return self.body.motion.announced.is_set() and not state.cause and near

    def _is_target(self, position: int | None) -> bool:
        target = self.move.target_position
        return target is not None and position is not None and abs(position - target) <= self.tolerance

    async def _watch_its_way(self, state: MotorState) -> None:
        """A motor that is elsewhere than between start and target has begun elsewhere.

        Seen twice, that is a sign of a loss of power, whatever the mark tells.
        """
        if state.runs and self._is_off_its_way(state):
            again = await self._answered(lambda: self._ask(Lane.VERIFY))
            self._strayed |= again is not None and again.runs and self._is_off_its_way(again)

    def _is_off_its_way(self, state: MotorState) -> bool:
        start, target = self.move.start_position, self.move.target_position
        if start is None or target is None or self.move.kind == "interpolated":
            return False
        sways = 0 if self.body.counted_in == "pulses" else ENCODER_SWAYS
        slack = max(self.tolerance, self.body.configured.position_tolerance, sways)
        return not min(start, target) - slack <= state.position <= max(start, target) + slack

    # the verdict

    async def contradicted(self, refusal: ControllerRefused) -> NoReply | None:
        """See whether a refusal hides that the command was executed: what then counts in its place.

        A motor that stood still is in motion when a line that has doubled the command had it set going by the
        first copy, whose reply was lost.
        """
        before = self.before
        if refusal.error_code not in IN_MOTION or self.move.status is not MoveStatus.SENT or before is None:
            return None
        state = await self._state(lambda _: False)
        if state is not None and not state.runs and state.position == before.position:
            return None
        self._note(
            f"It refused {self.move.command} as in motion ({refusal.error_code}), and had stood still: the "
            "line has doubled the command, or something else moves the motor."
        )
        self._doubled = refused_in_motion(self.body.address, self.move.command)
        return self._doubled

    async def without_reply(self, error: NoReply) -> Verdict | None:
        """Let the motor tell whether the command was executed, as no reply did; None if the move runs on."""
        state = await self._state(lambda _: False)
        if state is None:
            return self.given_up(error)
        self.move.position = state.position
        if state.runs:
            if self._doubled is None:
                self._note(f"The motor runs, and had stood still{self._executed}{self._of_reply(error)}")
            return None
        kept = False if await self._fell_back(state) else await self._mark_tells()
        if kept is False:
            self.body.stands()
            return self._judged(AtRest(power=Power.LOST, begun=Begun.IN_DOUBT))
        if self._tells_its_end(state):
            self._note(f"The motor has moved, and has come to rest{self._of_reply(error)}")
            return await self.at_rest(state)
        if kept or not self.body.life.was_silent:
            if self._travelled_to_target(state):
                self._note(f"The motor stands at the target{self._of_reply(error)}")
                return None
            if self._untouched(state) and (kept or await self._still_counts(state)):
                self.body.stands()
                stays = self.move.start_position == self.move.target_position
                place = Place.TARGET_AS_BEFORE if stays else Place.START
                return self._judged(AtRest(begun=Begun.IN_DOUBT, place=place))
        return await self._of_unproved(state, kept, error)

    async def _of_unproved(self, state: MotorState, kept: bool | None, error: NoReply) -> Verdict:
        self.body.stands()
        if kept is None and state.position == POWER_ON_POSITION and self.move.kind != "home":
            self._not_known(f"it stands at {POWER_ON_POSITION}, and no mark stands")
        elif kept:
            await self._note_missed(state)
        power = Power.KEPT if kept else Power.UNPROVED
        return self._judged(AtRest(power=power, begun=Begun.IN_DOUBT, place=Place.UNKNOWN), error)

    @property
    def _executed(self) -> str:
        """The conclusion from a motor that runs: in another life something else may have set it going."""
        return "" if self.resumed else ": the command was executed"

    def _of_reply(self, error: NoReply) -> str:
        """The fate of the reply, as the end of a sentence."""
        if self._doubled is not None:
            return "."
        if self.move.acknowledged_at is not None:
            return f"; the command was acknowledged before {self.resumed}."
        if self.resumed:
            return f"; nobody knows whether a reply came before {self.resumed}."
        usable = "usable " if isinstance(error, GarbledReply) else ""
        return f", although no {usable}reply came."

    def _travelled_to_target(self, state: MotorState) -> bool:
        started_there = self.before is not None and self._is_target(self.before.position)
        return self._is_target(state.position) and not started_there

    def _untouched(self, state: MotorState) -> bool:
        """True if the motor shows that a move of some length was never begun."""
        before = self.before
        leads_back = self.move.kind == "interpolated" and self.move.target_position in (
            None,
            self.move.start_position,
        )
        straight = self.move.kind == "interpolated" or self.move.kind in STRAIGHT
        if before is None or not straight or leads_back:
            return False
        ended_at_once = state.bits & ~before.bits & MOTION_ERRORS
        return state.position == before.position and not ended_at_once

    async def _still_counts(self, state: MotorState) -> bool:
        """True if it has kept its power: a controller that was switched off and on stands at 0, too."""
        return state.position != POWER_ON_POSITION or await self._remembers_homing()

    def _has_moved(self, state: MotorState) -> bool:
        """True if it stands elsewhere than before: then the cause of the last end is that of this move."""
        return self.before is not None and state.position != self.before.position

    def _tells_its_end(self, state: MotorState) -> bool:
        """True if the controller, or a stop, tells how a move without a reply ended: it was executed.

        In another life something else may have moved the motor since.
        """
        told = bool(state.cause) or self._was_stopped_at(state)
        return told and not self.resumed and self._has_moved(state)

    def _was_stopped_at(self, state: MotorState) -> bool:
        """True if a stop was confirmed there since the command was sent."""
        return self.body.motion.stopped_at is not None and state.position == self.body.motion.stopped_at

    async def at_rest(self, state: MotorState) -> Verdict:
        """How the move ended that came to rest."""
        causes = names_of(state.cause, END_CAUSE_BITS)
        if causes:
            await self._fell_back(state)
            told = Told.STOP if causes == ["stop_command"] else Told.CAUSE
            ended = " and ".join(CAUSES[cause] for cause in causes)
            return self._judged(AtRest(told), cause="+".join(causes), ended=ended)
        finding = await self._finding(state)
        verdict = self._judged(finding, self._doubled)
        if verdict.status is MoveStatus.FAILED and await self._note_missed(state):
            return self._judged(finding._replace(power=Power.UNPROVED))
        if verdict.status is MoveStatus.SUCCEEDED:
            if self.move.kind == "home":
                await self._homed()
            elif self.body.configured.in_position:
                return await self._without_in_position() or verdict
        return verdict

    async def _finding(self, state: MotorState) -> AtRest:
        """The finding of a move that was executed, and whose end has no cause."""
        kept = False if await self._fell_back(state) else await self._kept_its_power()
        if self.move.target_position is None:
            place = Place.WITHOUT_TARGET
        else:
            place = Place.TARGET if self._is_target(self.move.position) else Place.ELSEWHERE
        return AtRest(
            power=_POWER[kept],
            stop=Stop.CONFIRMED if self._was_stopped_at(state) else Stop.NONE,
            begun=Begun.SEEN if self._doubled is None else Begun.REFUSED_IN_MOTION,
            place=place,
        )

    async def _without_in_position(self) -> Verdict | None:
        """Wait for the servo drive to arrive (INP): how the move ends if it does not, else None."""
        body = self.body
        if await self._answered(body.know_mode) != "servo":
            return None
        until = asyncio.get_running_loop().time() + IN_POSITION_S
        while not (sensor := await self._answered(self._ask_for_in_position)):
            if sensor is None:
                return self.given_up()
            if body.life.being_stopped or body.motion.stopped_at is not None:
                return self._judged(AtRest(Told.STOP))
            if asyncio.get_running_loop().time() > until:
                return self._judged(AtRest(Told.NOT_IN_POSITION), waited_s=IN_POSITION_S)
            body.motion.end_due.clear()
            await happens(body.motion.end_due, body.poll_interval_s)
        self._note("The servo drive reports that it is in position (INP).")
        return None

    async def _ask_for_in_position(self) -> bool:
        sensors, _ = await self.body.ask(GetSensors(bit=IN_POSITION_BIT), lane=Lane.VERIFY)
        return bool(sensors.on)

    async def _homed(self) -> None:
        """An origin search, or the centring of a stall dog, has ended well: ask how far it went (0PD)."""
        if self.move.command != CentreStallDog.code:  # which finds the nearest dog, wherever that is
            self.body.power.found_origin()
        with suppress(GatewayError):
            told, _ = await believed(
                self.body.line, lambda: self.body.ask(GetHomingDistance(), lane=Lane.VERIFY), _same_reply
            )
            self.move.homing_distance = told.pulses

    def given_up(self, error: GatewayError | None = None) -> Verdict:
        """The verdict on a move whose end was not seen; `error` where it is unknown if it was begun."""
        move, stopped_at, half = self.move, self.body.motion.stopped_at, self._half
        heard, place = Heard.NOTHING, move.position
        if stopped_at is not None:
            place = move.position = stopped_at
        elif self.body.motion.announced.is_set():
            heard = Heard.END
        elif half is not None and not half.runs:
            heard, place = Heard.STANDSTILL, half.position
        finding = Unseen(
            Sight.SILENT if self._silence.of_body else Sight.OUT_OF_REACH,
            heard,
            Stop.NONE if stopped_at is None else Stop.CONFIRMED,
            Begun.SEEN if error is None else Begun.IN_DOUBT,
        )
        return self._judged(finding, error, position=place)

    def _judged(self, finding: Finding, error: GatewayError | None = None, **more: Any) -> Verdict:
        body, move = self.body, self.move
        sent = "may have been sent" if move.sent_at is None else "was sent"
        reply = f"before {self.resumed}" if self.resumed else "and no usable reply came"
        words = VerdictWords(
            who=body.address,
            announcer="The link master",
            sending=f"{move.command} {sent} to {body.address} {reply}",
            unheard=self._silence.told,
            lost="has lost" if body.power.certain else "seems to have lost",
            position=move.position,
            where=f"at {move.position}",
            target=move.target_position,
            counted=" encoder counts" if move.counted_in == "encoder_counts" else " pulses",
        )
        return judge(finding, words._replace(**more), error)

    # its power

    async def _kept_its_power(self) -> bool | None:
        """True if it has kept its power since the command was sent; None where nothing proves it."""
        if not self._in_question():
            return True
        told = await self._mark_tells()
        if told:
            return await self._end_agrees()
        if told is False or self._mark_stood():
            return told
        return await self._seems_to_have_kept_it()

    async def _fell_back(self, state: MotorState) -> bool:
        """True if the motor ran, or stands, where only a loss of power leads it, whatever its mark tells."""
        start, target = self.move.start_position, self.move.target_position
        if self._strayed:
            why = f"it ran elsewhere than between {start} and {target}"
        elif state.position == POWER_ON_POSITION and self._is_off_its_way(state):
            why = f"it came to rest at {state.position}, which is not between {start} and {target}"
        else:
            return False
        if await self._mark_tells() is not False:
            self._not_known(why)
        return True

    async def _note_missed(self, state: MotorState) -> bool:
        """True if a motor that rests beside its target, and tells no cause, may have lost its power."""
        doubted = self._has_moved(state) and await self._answered(self.body.know_mode) != "encoder"
        if doubted:
            self._not_known(f"it came to rest at {state.position}, and tells no cause")
        return doubted

    def _not_known(self, why: str) -> None:
        """Forbid motions to places until the body's place is known again."""
        self._note(f"It seems to have lost its power, so its place is not known: {why}.")
        self.body.power.lost(certain=False, why=why)

    async def _end_agrees(self) -> bool | None:
        """True if the end agrees with a mark that stands: a comment may outlast the power.

        A move without a target ends by a cause, or is announced; a homing is remembered.
        """
        move = self.move
        if move.target_position is not None or move.kind == "interpolated" or await self._end_announced():
            return True
        if move.kind == "home" and await self._remembers_homing():
            return True
        self._not_known(f"it came to rest at {move.position}, and neither an end nor a cause was told")
        return None

    def _in_question(self) -> bool:
        """True if the end of the move alone does not prove it.

        After a loss of power a controller announces no end, and stands at 0, or anywhere on its way.
        """
        move = self.move
        missed = move.target_position is not None and not self._is_target(move.position)
        silent_end = move.completion != "frame" and (
            move.target_position is None or move.position == POWER_ON_POSITION
        )
        return self._needs_proof or self.body.life.was_silent or missed or silent_end

    async def _mark_tells(self) -> bool | None:
        """True if its mark proves that it has kept its power; None where there is none, or no answer."""
        if self._mark_stood() and await self._answered(self._ask_for_mark) is None:
            return None
        return self.body.power.kept_since(self._power)

    def _mark_stood(self) -> bool:
        """True if the mark is, as far as is known, the one that stood before the move."""
        return bool(self.body.power.kept_since(self._power))

    async def _ask_for_mark(self) -> bool:
        await self.body.mark.stands(Lane.VERIFY)
        return True

    async def _seems_to_have_kept_it(self) -> bool | None:
        """Tell it without a mark, by position, status and the announcement of the end."""
        move = self.move
        if self._power_was_lost():
            why = f"its move came to rest at {move.position}, as after a loss of power, and no mark stands"
            self._not_known(why)
            return False
        at_power_on = move.position == POWER_ON_POSITION
        if not at_power_on and move.kind == "home" and move.completion != "frame":
            return None
        if not at_power_on or await self._end_announced():
            if self._needs_proof:
                self._note(
                    "No mark proves that it has kept its power: only position, status and settings tell."
                )
            return True
        self._note(
            f"The motor stands at {POWER_ON_POSITION}, as after a loss of power, and no end was announced."
        )
        if await self._remembers_homing():
            return True
        self._not_known(f"it stands at {POWER_ON_POSITION}, and no end was announced")
        return None

    def _power_was_lost(self) -> bool:
        """True if a body that calls its end normal may have been switched off in the middle of the move."""
        at_power_on = self.move.position == POWER_ON_POSITION
        arrived = self._is_target(self.move.position)
        if arrived and not at_power_on:
            return False
        fell_back = at_power_on and self.move.kind in STRAIGHT
        return self.body.life.was_silent or (fell_back and not arrived)

    async def _end_announced(self) -> bool:
        if self.move.completion == "frame":
            return True
        if not await happens(self.body.motion.announced, MISSING_END_FRAME_S):
            return False
        self.move.completion = "frame"
        return True

    async def _remembers_homing(self) -> bool:
        try:
            remembers = await self.body.remembers_homing(Lane.VERIFY)
        except GatewayError:
            return False
        if remembers:
            self._note("The controller remembers its last homing, so it has kept its power.")
        return remembers

    def _note(self, sentence: str) -> None:
        self.move.evidence.append(sentence)
