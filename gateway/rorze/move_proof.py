"""The proof of a move by the controller's own state: that it was begun, is over, and how it ended."""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Final

from gateway.core.errors import (
    BodyBusy,
    ControllerRefused,
    GarbledReply,
    GatewayError,
    NoReply,
    NotSent,
    QueueFull,
)
from gateway.core.exchange import Lane
from gateway.core.move_log import Trajectory
from gateway.core.move_record import Move, MoveStatus
from gateway.core.move_runs import Found, MoveRun, MoveRuns, found
from gateway.core.next_calls import NextCall
from gateway.core.preparation import prepare
from gateway.core.supervisor import Deed
from gateway.core.times import happens
from gateway.core.verdicts import AtRest, Begun, Heard, Place, Power, Stop, Told, VerdictWords, row_of
from gateway.rorze.alarms import calls_for_body
from gateway.rorze.asked_body import believed
from gateway.rorze.bodies import ENCODER_SWAYS, STATUS, Body, R
from gateway.rorze.errors import IN_MOTION
from gateway.rorze.knowledge import MotorState
from gateway.rorze.plans import crossed_limit, target_of
from gateway.rorze.power import POWER_ON_POSITION, PowerSeen
from gateway.rorze.probes import background_of, follow_s, is_crowded, is_prompt, poll_s
from gateway.rorze.starts import SharedWay, Start, StartQuestion, entry_in, needs_of, spoils
from protocols.rorze.inputs_outputs import GetSensors
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.origin import CentreStallDog, GetHomingDistance
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import END_CAUSE_BITS, SENSOR_BITS, GetEndCause, names_of

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
OUT_OF_RANGE: Final = "0x5D"
"""The controller's error; it does not say which range is meant."""
WATCHED_S = 2.0
"""A body that is watched is asked alone this often."""
_END_CAUSE: Final = GetEndCause()

_POWER: Final = {True: Power.KEPT, None: Power.UNPROVED, False: Power.LOST}


class BodyRun(MoveRun[Move, MotorState]):
    """A move of a body, and the evidence of how it ends."""

    controller = "the body"

    def __init__(
        self,
        moves: MoveRuns[Move],
        body: Body,
        move: Move,
        *,
        before: MotorState | None = None,
        tolerance: int = 0,
        resumed: str = "",
    ) -> None:
        super().__init__(moves, move, body, body.line, body.address, body.poll_interval_s)
        self.body, self.before = body, before
        """`before` is the motor's state just before the command was sent."""
        self._tolerance = tolerance
        """Pulses by which the motor may miss the target."""
        self._resumed = resumed
        """Why another life of the gateway, or another gateway, has begun it, which may have had the reply."""
        self._command: RorzeCommand[Any] | None = None
        self._needs_proof = False
        self._power = PowerSeen(None, 0)
        """The state of the body's power just before the command was sent."""
        self._strayed = False
        """True if the motor was seen where its way does not lead."""
        self._half: MotorState | None = None
        """A reading that counts when the next one agrees; no cut of the line undoes it."""
        self._doubled: NoReply | None = None
        """The error that counts in place of a refusal as in motion, although the motor had stood still."""
        self._patience_s = OVERDUE_S
        self._asked_at = 0.0
        self._set_ups = body.line.set_ups
        """The line's count of set-ups when the motor was last seen to run, or when the move began."""

    # the body

    def _calls(self, error: GatewayError, /) -> Sequence[NextCall]:
        return calls_for_body(error, self.who)

    def _free(self) -> tuple[Deed, ...]:
        return *super()._free(), partial(self._moves.on_trajectory, self.body)

    def _lose(self, _why: str, /) -> None:
        self.body.may_move()  # what is not written yet never is: no move stands for it

    def advance(self, status: MoveStatus, error: GatewayError | None = None) -> None:
        """Change the status of the move, and note what its positions are counted in."""
        self.move.counted_in = self.body.counted_in or self.move.counted_in
        super().advance(status, error)

    def set_going(self, command: RorzeCommand[Any]) -> None:
        """Its command is on the wire."""
        self.body.was_set_going(command)
        self.advance(MoveStatus.SENT)

    def trace(self, trajectory: Trajectory[int]) -> None:
        """Keep where the motor is seen from now on."""
        self.body.motion.trace(trajectory)
        self._moves.trajectories.begin(self.move.id, trajectory)
        self._moves.on_trajectory(self.body)

    def _words(self) -> VerdictWords:
        body, move = self.body, self.move
        sent = "may have been sent" if move.sent_at is None else "was sent"
        reply = f"before {self._resumed}" if self._resumed else "and no usable reply came"
        return VerdictWords(
            who=self.who,
            announcer="The link master",
            sending=f"{move.command} {sent} to {self.who} {reply}",
            lost="has lost" if body.power.certain else "seems to have lost",
            position=move.position,
            where=f"at {move.position}",
            target=move.target_position,
            counted=" encoder counts" if move.counted_in == "encoder_counts" else " pulses",
        )

    # before it is sent

    async def know_the_start(self, command: RorzeCommand[Any], stretch: SharedWay | None) -> None:
        """Prove that the motor rests, its place, and its target: the evidence if no reply comes.

        The plan of a move, if there is one, knows the target by its `stretch`. Errors as of its needs.

        :raises NotSent: it did not tell.
        :raises ControllerRefused: it did not tell where an entry of its position table leads to.
        """
        body, move, self._command = self.body, self.move, command
        self._needs_proof = spoils(body.power, command)
        start = Start(
            body.address,
            command,
            body.told,
            body.prepared,
            body.power,
            self._needs_proof,
            body.configured.position_tolerance,
            stretch,
            body.known_at_rest(),
        )
        try:
            await prepare(None, needs_of(start), partial(self._answer, start))
        except NoReply as error:
            raise NotSent(
                f"{body.address} did not tell its state before the move; the move was not sent.", error.remedy
            ) from None
        except BodyBusy:
            body.may_move()
            raise
        finally:
            self._take_start(start)
        self._moves.log.on_change(move)  # before its intent: it is what the next life judges by

    def _take_start(self, start: Start) -> None:
        """Take what is known of the start, whatever keeps the motion from being sent."""
        self.before, self._power = start.rest, start.power.seen
        if start.rest is not None:
            self.move.start_position = self.move.position = start.rest.position
            self.move.target_position, self._tolerance = start.way

    async def _answer(self, start: Start, question: StartQuestion) -> None:
        """Ask a question, as often as the line makes it necessary, and take the answer.

        :raises GatewayError: it did not tell.
        """
        body, entry = self.body, entry_in(start.command)
        if question is StartQuestion.REST:
            start.rest, start.in_program = await body.where_it_rests(), body.life.in_program
        elif question is StartQuestion.TARGET and entry is not None:
            start.entry = (await self._believed(GetPositionEntry(entry=entry))).pulses
        elif question is StartQuestion.MODE:
            start.mode = (await self._believed(GetOperatingMode())).mode
        elif question is StartQuestion.SPEEDS:
            await body.know_pattern(start.command)
        elif question is StartQuestion.POWER:
            start.stands = await body.mark.stands(Lane.VERIFY)
        elif question in (StartQuestion.MARK, StartQuestion.NEW_MARK):
            await body.mark.ensure(Lane.VERIFY)
        if question is StartQuestion.MARK:  # what was seen before proves nothing
            body.told.rest_in_doubt()
            start.rest = None

    async def _believed(self, question: RorzeCommand[R]) -> R:
        """Ask once, or twice while the line errs."""

        async def ask() -> R:
            return (await self.body.ask(question, lane=Lane.VERIFY))[0]

        return await believed(self.body.line, ask)

    # while it may run

    async def follow(self, doubt: NoReply | None = None) -> None:
        """Look until the motor rests; a command that was acknowledged has some time first."""
        if doubt is None:
            await happens(self.body.motion.end_due, poll_s(self.body.line))
        await super().follow(doubt)
        if self.move.completion == "polling" and self.move.status is not MoveStatus.LOST:
            await self._expect_end_frame()

    async def _look(self) -> MotorState | None:
        """Ask for the motor's state; earlier signs of an end are of another move, if it runs."""
        motion, line = self.body.motion, self.body.line
        announced, due, set_ups = motion.announced.is_set(), motion.end_due.is_set(), line.set_ups
        self._asked_at = asyncio.get_running_loop().time()
        state = await self._state(lambda state: state.runs or self._ended_as_asked(state))
        if state is not None:
            self.move.position = state.position
        if state is not None and state.runs:
            self._set_ups = set_ups
            motion.forget_signs(announced=announced, due=due)
        return state

    async def _pause(self) -> None:
        body = self.body
        took_s = asyncio.get_running_loop().time() - self._asked_at
        pause_s = WATCHED_S if body.motion.watched else self._every_s
        await happens(body.motion.end_due, max(pause_s, follow_s(body.line) - took_s))

    async def _expect_end_frame(self) -> None:
        """Wait for the announcement of an end, if the line has answered since the motor ran."""
        body = self.body
        if self._set_ups != body.line.set_ups:
            return
        if not await happens(body.motion.announced, MISSING_END_FRAME_S) and body.move is None:
            body.line.missed_an_end(body.number)

    async def _state(self, plausible: Callable[[MotorState], bool]) -> MotorState | None:
        """Ask for the motor's state: twice where it is not plausible, or while the line garbles frames."""
        half: MotorState | None
        self._half = None
        while (state := await self._answer_to(self._read)) is not None:
            half, self._half = self._half, state
            if half is not None and self._agree(state, half):
                break
            if plausible(state) and not self.body.line.errs():
                break
        if state is not None:
            self._half = None
            await self._watch_its_way(state)
        return state

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
        same_place = abs(one.position - other.position) <= self._tolerance
        return same_place and (one.bits, one.cause) == (other.bits, other.cause)

    def _ended_as_asked(self, state: MotorState) -> bool:
        """True if an announced end, the end cause and the position all tell of success."""
        near = self.move.target_position is None or self._is_target(state.position)
        return self.body.motion.announced.is_set() and not state.cause and near

    def _is_target(self, position: int | None) -> bool:
        target = self.move.target_position
        return target is not None and position is not None and abs(position - target) <= self._tolerance

    async def _watch_its_way(self, state: MotorState) -> None:
        """A motor that is elsewhere than between start and target has begun elsewhere.

        Seen twice, that is a sign of a loss of power, whatever the mark tells.
        """
        if state.runs and self._is_off_its_way(state):
            again = await self._answer_to(lambda: self._ask(Lane.VERIFY))
            self._strayed |= again is not None and again.runs and self._is_off_its_way(again)

    def _is_off_its_way(self, state: MotorState) -> bool:
        start, target = self.move.start_position, self.move.target_position
        if start is None or target is None or self.move.kind == "interpolated":
            return False
        sways = 0 if self.body.counted_in == "pulses" else ENCODER_SWAYS
        slack = max(self._tolerance, self.body.configured.position_tolerance, sways)
        return not min(start, target) - slack <= state.position <= max(start, target) + slack

    # the verdict

    def _was_refused(self, error: GatewayError, /) -> bool:
        return isinstance(error, ControllerRefused) and error.address in (self.who, self.move.group_id)

    async def look_into(self, refusal: ControllerRefused) -> GatewayError:
        """See whether a refusal hides that the command was executed, and name the limits it is about.

        A motor that stood still is in motion when a line that has doubled the command had it set going by the
        first copy, whose reply was lost.
        """
        if await self._contradicts(refusal):
            self._doubled = self._executed_after_all(refusal.error_code, "motor")
            return self._doubled
        if self._command is not None:
            await _name_limits(self.body, self._command, refusal)
        if self.move.status is MoveStatus.SENT:
            self.body.was_refused()
        return refusal

    async def _contradicts(self, refusal: ControllerRefused) -> bool:
        before = self.before
        if refusal.error_code not in IN_MOTION or self.move.status is not MoveStatus.SENT or before is None:
            return False
        state = await self._state(lambda _: False)
        return state is None or state.runs or state.position != before.position

    async def _resolve(self, doubt: NoReply, /) -> Found | None:
        """Let the motor tell whether the command was executed, as no reply did; None if the move runs on."""
        state = await self._state(lambda _: False)
        if state is None:
            return self._unseen()
        self.move.position = state.position
        if state.runs:
            self._doubt = None
            if self._doubled is None:
                self._note(f"The motor runs, and had stood still{self._executed}{self._of_reply(doubt)}")
            return None
        kept = False if await self._fell_back(state) else await self._mark_tells()
        if kept is False:
            self.body.stands()
            return found(AtRest(power=Power.LOST, begun=Begun.IN_DOUBT))
        if self._tells_its_end(state):
            self._doubt = None
            self._note(f"The motor has moved, and has come to rest{self._of_reply(doubt)}")
            return await self._at_rest(state)
        if kept or not self.body.life.was_silent:
            if self._travelled_to_target(state):
                self._doubt = None
                self._note(f"The motor stands at the target{self._of_reply(doubt)}")
                return None
            if self._untouched(state) and (kept or await self._still_counts(state)):
                self.body.stands()
                stays = self.move.start_position == self.move.target_position
                place = Place.TARGET_AS_BEFORE if stays else Place.START
                return found(AtRest(begun=Begun.IN_DOUBT, place=place))
        return await self._of_unproved(state, kept, doubt)

    async def _of_unproved(self, state: MotorState, kept: bool | None, doubt: NoReply) -> Found:
        self.body.stands()
        if kept is None and state.position == POWER_ON_POSITION and self.move.kind != "home":
            self._not_known(f"it stands at {POWER_ON_POSITION}, and no mark stands")
        elif kept:
            await self._note_missed(state)
        power = Power.KEPT if kept else Power.UNPROVED
        return found(AtRest(power=power, begun=Begun.IN_DOUBT, place=Place.UNKNOWN), doubt)

    @property
    def _executed(self) -> str:
        """The conclusion from a motor that runs: in another life something else may have set it going."""
        return "" if self._resumed else ": the command was executed"

    def _of_reply(self, error: NoReply) -> str:
        """The fate of the reply, as the end of a sentence."""
        if self._doubled is not None:
            return "."
        if self.move.acknowledged_at is not None:
            return f"; the command was acknowledged before {self._resumed}."
        if self._resumed:
            return f"; nobody knows whether a reply came before {self._resumed}."
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
        return told and not self._resumed and self._has_moved(state)

    def _was_stopped_at(self, state: MotorState) -> bool:
        """True if a stop was confirmed there since the command was sent."""
        return self.body.motion.stopped_at is not None and state.position == self.body.motion.stopped_at

    async def _finding(self, seen: MotorState, /) -> Found:
        self.move.completion = "frame" if self.body.motion.announced.is_set() else "polling"
        self.body.stands()
        return await self._at_rest(seen)

    async def _at_rest(self, state: MotorState) -> Found:
        causes = names_of(state.cause, END_CAUSE_BITS)
        if causes:
            await self._fell_back(state)
            told = Told.STOP if causes == ["stop_command"] else Told.CAUSE
            ended = " and ".join(CAUSES[cause] for cause in causes)
            return found(AtRest(told), cause="+".join(causes), ended=ended)
        finding = await self._without_cause(state)
        status = row_of(finding).status
        if status is MoveStatus.FAILED and await self._note_missed(state):
            return found(finding._replace(power=Power.UNPROVED))
        if status is MoveStatus.SUCCEEDED and self.move.kind == "home":
            await self._homed()
        elif status is MoveStatus.SUCCEEDED and self.body.configured.in_position:
            return await self._without_in_position() or found(finding)
        return found(finding, self._doubled)

    async def _without_cause(self, state: MotorState) -> AtRest:
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

    async def _without_in_position(self) -> Found | None:
        """Wait for the servo drive to arrive (INP): how the move ends if it does not, else None."""
        body = self.body
        if await self._answer_to(body.know_mode) != "servo":
            return None
        until = asyncio.get_running_loop().time() + IN_POSITION_S
        while not (sensor := await self._answer_to(self._ask_for_in_position)):
            if sensor is None:
                return self._unseen()
            if body.life.being_stopped or body.motion.stopped_at is not None:
                return found(AtRest(Told.STOP))
            if asyncio.get_running_loop().time() > until:
                return found(AtRest(Told.NOT_IN_POSITION), waited_s=IN_POSITION_S)
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
            self.move.homing_distance = (await self._believed(GetHomingDistance())).pulses

    def _unseen(self) -> Found:
        """The finding about a motor out of sight, by the last sign of it."""
        stopped_at, half = self.body.motion.stopped_at, self._half
        if stopped_at is not None:
            self.move.position = stopped_at
            return self._out_of_sight(stop=Stop.CONFIRMED)
        if self.body.motion.announced.is_set():
            return self._out_of_sight(Heard.END)
        if half is not None and not half.runs:
            return self._out_of_sight(Heard.STANDSTILL, position=half.position)
        return self._out_of_sight()

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
        doubted = self._has_moved(state) and await self._answer_to(self.body.know_mode) != "encoder"
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
        if self._mark_stood() and await self._answer_to(self._ask_for_mark) is None:
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


async def _name_limits(body: Body, command: RorzeCommand[Any], refusal: ControllerRefused) -> None:
    """Name the target and the limit, where a refused move leads beyond one; only reads are sent."""
    if refusal.error_code != OUT_OF_RANGE:
        return
    try:
        here, _ = await body.ask(GetPosition())
        target = await target_of(body, command, here.pulses)
        crossed = None if target is None else await crossed_limit(body, target)
    except GatewayError:
        return  # the refusal stands, with the controller's own words
    if crossed is None:
        return
    refusal.reword("body.beyond-limits", body=body.address, code=refusal.command_code, beyond=crossed.said)
