"""Software stops: sent ahead of everything, repeated, believed only when the controller stands still."""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from math import inf
from typing import Any, Final, NamedTuple

from pydantic import Field

from gateway.core.errors import ControllerRefused, GatewayError, NoReply, NotSent, StoppedFirst
from gateway.core.events import EventHub
from gateway.core.exchange import Lane
from gateway.core.records import request_id_field
from gateway.core.stops import (
    CONFIRM_WITHIN_S,
    RECORD_WITHIN_S,
    REPEAT_S,
    BilingualReport,
    Stopping,
    StopPlan,
    StopState,
    StopsUnderWay,
    is_under_way,
    standstill_unknown,
)
from gateway.core.stops import StopMode as StopMode
from gateway.core.supervisor import do_each
from gateway.core.times import happens
from gateway.rorze.bodies import Body, Group, R
from gateway.rorze.body_states import BodyNews
from gateway.rorze.knowledge import PROGRAM_RUNS
from gateway.rorze.line import Line
from gateway.rorze.plans import longest_ramp_s
from gateway.rorze.probes import (
    SilentLines,
    Sweep,
    is_heard,
    is_prompt,
    is_quiet,
    is_silent,
    proofs_s,
    wire_s,
)
from gateway.rorze.session import Answered, Outcome
from gateway.texts import Text, text
from protocols.rorze.position import GetPosition
from protocols.rorze.profile import ProfileError
from protocols.rorze.programs import EndProgram, GetProgramStatus
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import GetControllerStatus
from protocols.rorze.stops import StopDecelerating, StopImmediately

ATTEMPT_FRAMES = 2
"""An attempt to stop a body that does not answer: the stop, and the end of the program."""
STOP_BYTES = 8
"""Bytes of a stop, or of the end of a program; replies go the other way meanwhile."""
GOES_FIRST = 2
"""A silent body is asked behind the proofs of others for this many times as long as these may take."""
LAST_LOOK_S = 2 * REPEAT_S
"""A motor that ran so shortly before it was to stand counts as running."""
UNKNOWN_CODE = "0x49"
"""A controller without user programs refuses the question for them so, or without a code."""
NOT_AT_REST: Final = text("stops.motor-not-at-rest")
PROGRAM_GOES_ON: Final = text("stops.program-goes-on")


class StopReport(BilingualReport):
    """The state of the stop of one body, and its evidence."""

    body_id: str
    state: StopState = Field(
        "requested", description="Only confirmed means that the controller itself reports standstill."
    )
    position: int | None = Field(None, description="Position in pulses, at standstill.")
    detail: str | None = Field(None, description="Why it is not confirmed.")
    request_id: str | None = request_id_field("the request that asked for it first")


class Stops(StopsUnderWay[tuple[Body, StopMode], "_BodyStop"]):
    """The stops under way. A second stop of the same kind joins the first."""

    def __init__(
        self,
        events: EventHub,
        groups_of: Callable[[Body], list[Group]],
        sweep_of: Callable[[Line], Sweep],
    ) -> None:
        super().__init__()
        self._events = events
        self._sweep_of = sweep_of
        self._groups_of = groups_of
        self.on_begin: Callable[[Body], None] = lambda _: None
        """Called with each body whose stop begins."""
        self._silent_lines = SilentLines(events, self._unconfirmed_on)

    def stop(self, bodies: Iterable[Body], mode: StopMode) -> "asyncio.Task[list[StopReport]]":
        """Stop bodies; every stop frame is queued before this returns, first those that reach whole groups.

        A stop of the same mode that is under way repeats itself: it gets no further frame from here.
        The result comes when all stand still, or after two seconds with what is known then. A fault of the
        gateway itself at one body keeps no other from its stop.
        """
        running = self._begun(self._plan(list(bodies), mode))
        return asyncio.create_task(self._report(running), name="stop report")

    def _plan(self, bodies: Sequence[Body], mode: StopMode) -> StopPlan[tuple[Body, StopMode]]:
        partners = partial(self._with_interpolation_partners, bodies)
        wanted = do_each("a stop", partners).first(otherwise=list(bodies))
        new = [body for body in wanted if (body, mode) not in self._running]
        deeds = [
            *(partial(self._forbid_what_waits, body) for body in wanted),
            partial(self._stop_groups, wanted, new, mode),
            *(partial(self._begin_new, body, mode) for body in new),
        ]
        return deeds, [(body, mode) for body in wanted]

    def _stop_groups(self, wanted: list[Body], new: list[Body], mode: StopMode) -> None:
        for group in self._groups_within(wanted):
            if not set(new).isdisjoint(group.members):
                self._stop_group(group, mode)

    def _stop_group(self, group: Group, mode: StopMode) -> None:
        """One frame for all members; the single frames behind it do not depend on it."""
        with suppress(GatewayError):
            stop = group.line.submit(group.number, _stop_of(mode), Lane.STOP)
            stop.add_done_callback(partial(self._note_group, group))

    def _note_group(self, group: Group, stop: "asyncio.Future[Outcome]") -> None:
        """One that did not answer its stop is not asked for proofs, either."""
        line = group.line
        if isinstance(stop.result(), NoReply) and line.state == "ready" and not is_prompt(line):
            self._sweep_of(line).distrust(group)

    def under_way(self, body: Body) -> bool:
        """True if a stop of the body is not confirmed yet."""
        return any(stop.body is body for stop in self._tasks)

    def on_line(self, line: Line) -> bool:
        """True if a stop of any body of a line is not confirmed yet."""
        return any(stop.body.line is line for stop in self._tasks)

    def others_prove(self, line: Line, body: int) -> bool:
        """True if others on a line, who answer, have yet to tell whether they stand, and how a move ended."""
        stops = (stop for stop in self._tasks if stop.body.line is line and stop.body.number != body)
        return any(stop.goes_first() for stop in stops)

    def _unconfirmed_on(self, line: Line) -> "list[_BodyStop]":
        return [stop for stop in self._running.values() if stop.body.line is line]

    async def close(self) -> None:
        """Give up repeating: the gateway ends."""
        await self._silent_lines.close()
        await super().close()

    def in_reach_again(self, body: Body) -> None:
        """A body that was silent answers again, or its line is up again: the next stop will arrive."""
        for stop in self._tasks:
            if stop.body is body:
                stop.repeat_at_once()

    def unconfirmed(self, body: Body) -> StopReport | None:
        """The report of a stop of the body that is not confirmed yet."""
        report: StopReport | None = self.unconfirmed_among(stop for stop in self._tasks if stop.body is body)
        return report

    def _with_interpolation_partners(self, bodies: Iterable[Body]) -> list[Body]:
        """An axis of an interpolated move takes the others of its group with it."""
        wanted = dict.fromkeys(bodies)
        for body in list(wanted):
            if body.move is not None and body.move.kind == "interpolated":
                for group in self._groups_of(body):
                    if group.address == body.move.group_id:
                        wanted |= dict.fromkeys(group.members)
        return list(wanted)

    def _groups_within(self, bodies: list[Body]) -> list[Group]:
        groups = dict.fromkeys(group for body in bodies for group in self._groups_of(body))
        return [group for group in groups if set(group.members) <= set(bodies)]

    def _forbid_what_waits(self, body: Body) -> None:
        """Nothing admitted before the stop, for the body or a group it is in, can be written after it."""
        body.line.forbid({body.number, *(group.number for group in self._groups_of(body))})

    def _begin_new(self, body: Body, mode: StopMode) -> None:

        def tell(news: str, data: dict[str, Any]) -> None:
            self._events.publish(f"body.{news}", f"/bodies/{body.address}", data)

        sweep = self._sweep_of(body.line)
        stop = _BodyStop(body, mode, tell, sweep, self._company_of, self._silent_lines)
        self._begin((body, mode), stop, f"the stop of {body.address}", partial(self.on_begin, body))

    def _count(self, stop: "_BodyStop") -> None:
        stop.body.life.hear(BodyNews.STOP if self.under_way(stop.body) else BodyNews.NO_STOP)

    def _company_of(self, body: Body) -> list[Body]:
        """The bodies of its line with stops that are not confirmed yet."""
        return [stop.body for stop in self._unconfirmed_on(body.line)]

    def _over(self, stop: "_BodyStop") -> None:
        super()._over(stop)
        stop.end_asking()

    async def _report(self, stops: "list[_BodyStop]") -> list[StopReport]:
        wait_s, running = CONFIRM_WITHIN_S, [self._tasks[stop] for stop in stops if stop in self._tasks]
        while running:
            _, running_on = await asyncio.wait(running, timeout=wait_s)
            early = (stop for stop in stops if stop in self._tasks and stop.may_still_be_asked())
            running = list(running_on) if any(early) else []
            wait_s = REPEAT_S
        return [stop.report for stop in stops]

    def _at_standstill(self, stop: "_BodyStop") -> Sequence[Callable[[], object]]:
        body = stop.body
        body.motion.stop_is_confirmed(disproves_its_alarm=stop.disproves_its_alarm)
        if not any(other is not stop and other.body is body for other in self._tasks):
            body.life.hear(BodyNews.NO_STOP)
        return stop.withdraw, partial(body.was_stopped, stop.report.position)

    async def _record(self, stop: "_BodyStop") -> None:
        await _move_recorded(stop.body)


class _Look(NamedTuple):
    """The last look at a motor that is being stopped."""

    refuted_at: float | None = None
    """The age of the stop at a look that has seen the motor move; endless where it told nothing."""
    runs: bool = False
    """True if the motor has told that it runs."""


class _BodyStop(Stopping):
    """The stop of one body, and of the user program that could start its next move.

    The end of the program follows the reply, for the link may take one frame at a time; where none is to be
    expected it goes at once.
    """

    one_at_a_time = True
    report: StopReport

    def __init__(
        self,
        body: Body,
        mode: StopMode,
        tell: Callable[[str, dict[str, Any]], object],
        sweep: Sweep,
        company_of: Callable[[Body], list[Body]],
        silent_lines: SilentLines,
    ) -> None:
        super().__init__(mode, StopReport(body_id=body.address), body.line, tell)
        self.body = body
        self._sweep, self._company_of, self._silent_lines = sweep, company_of, silent_lines
        self._most = 1
        """The most stops at a time that its line has had beside it, with it."""
        self.silent_after_s = max(REPEAT_S, body.line.reply_timeout_s)
        self._stopped_in = Lane.STOP
        self._end: asyncio.Future[Outcome] | None = None
        """The end of the program."""
        self._answers = True
        """False if the body may be dead: others need not wait for it."""
        self._ramp: asyncio.Task[None] | None = None
        """Asks how long its ramp may take."""
        self._look = _Look()
        self._reasons = self._not_told = (text("stops.motor-has-not-told", body=body.address),)
        self.tell()

    # sending

    def _send_stop(self) -> "asyncio.Future[Outcome]":
        self._stopped_in = self._lane()
        stop = self._send(_stop_of(self.mode), self.note_written)
        if self._stopped_in is Lane.STOP_REPEAT:
            self._end_program()
        return stop

    def _lane(self) -> Lane:
        return Lane.STOP if self._answers else Lane.STOP_REPEAT

    def _send(
        self, command: RorzeCommand[Any], on_written: Callable[[float], None] | None = None
    ) -> "asyncio.Future[Outcome]":
        return self.body.line.submit(self.body.number, command, self._lane(), on_written=on_written)

    def _note(self, outcome: Outcome) -> None:
        if self.report.state == "confirmed":  # the end of a program would end the next move
            return
        self._answers = not isinstance(outcome, NoReply)
        if not self._answers:
            self._reasons = (text("stops.body-silent", body=self.body.address),)
            self.tell()
        if isinstance(outcome, Answered):
            self.note_acknowledged()
        if isinstance(outcome, NotSent):
            self.note_not_sent(outcome)
        elif isinstance(outcome, NoReply) and self._stopped_in is Lane.STOP:
            self.submit()
        elif self._stopped_in is Lane.STOP:
            self._end_program()

    def _end_program(self) -> None:
        """End the user program, too (RC-420 manual 14, UES)."""
        if is_under_way(self._end) or self._is_free_of_programs():
            return
        immediately = self.mode == "immediate"
        with suppress(GatewayError):
            self._end = self._send(
                EndProgram(motor="stop_immediately" if immediately else "stop_decelerating")
            )

    def end_asking(self) -> None:
        """Want to know no more how long its ramp may take."""
        if self._ramp is not None:
            self._ramp.cancel()

    def withdraw(self) -> None:
        """Take back what still waits: it would stop the next move."""
        number = self.body.number
        self.body.line.cancel(
            lambda exchange: exchange.target == number and exchange.lane is Lane.STOP_REPEAT, StoppedFirst()
        )

    def repeat_at_once(self) -> None:
        """Send the next repetition now: it will arrive."""
        self._answers = True
        super().repeat_at_once()

    def pause_s(self, took_s: float = 0.0) -> float:
        """Pause until the next repetition: all stops share half of the line's time; the rest is for proofs.

        Where silence holds up everybody, the silent bodies share that half.
        """
        line = self.body.line
        attempts = len(self._company_of(self.body)) * ATTEMPT_FRAMES
        attempts_s = wire_s(line, attempts * STOP_BYTES, exchanges=0)
        pause_s = max(super().pause_s(took_s), 2 * attempts_s - took_s)
        if self._answers or line.interject_stops:
            return pause_s
        silent = line.offline | line.presence.mute if line.is_asked_later(self.body.number) else line.offline
        return max(pause_s, 2 * len(silent) * ATTEMPT_FRAMES * line.reply_timeout_s - took_s)

    # seeing

    async def _see(self) -> Sequence[Text]:
        """Ask for the status, twice, and whether a program runs that could move the motor again.

        On a line of many, one that was seen at rest and was told nothing since has said so once already.
        """
        self._most = max(self._most, len(self._company_of(self.body)))
        await _over(self._stop)
        await _over(self._end)
        if self.body.line.is_asked_later(self.body.number):
            return self._reasons or self._not_told
        asked_at = self.waited_s
        try:
            why = await self._why_not_still()
        except GatewayError as error:
            why = standstill_unknown(text("stops.the-motor", body=self.body.address), error)
            self._look = _Look(inf if is_heard(self.body.line) else None)
        else:
            self._answers = True
            self._look = _Look(None if why is None else asked_at, why is NOT_AT_REST)
        if self.asks_for_ramp() and (self._ramp is None or self._ramp.done()):
            self._ramp = asyncio.create_task(self._learn_ramp(), name=f"ramp of {self.body.address}")
        return () if why is None else (why,)

    async def _learn_ramp(self) -> None:
        """Ask how long its ramp may take, beside the proofs; what it does not tell is asked again."""
        pattern = None if self.body.move is None else self.body.prepared.pattern_of_move
        try:
            self.note_ramp(await longest_ramp_s(self.body, pattern, Lane.VERIFY) or 0.0)
        except ProfileError:
            self.note_ramp(0.0)  # nothing moves by such settings
        except GatewayError:
            return

    def asks_for_s(self) -> float:
        """As long as the wire needs for the proofs of all, which takes about as many frames."""
        asks = self._ramp is not None and not self._ramp.done()
        return self.body.line.reply_timeout_s + proofs_s(self.body.line, self._most) if asks else 0.0

    def tells_of_motion(self) -> bool:
        """Its motor ran when it was last asked; what has not answered since is silent."""
        told = self._look.runs and self._answers and self.report.state == "acknowledged"
        return told and not is_quiet(self.body.line)

    def has_had_no_turn(self) -> bool:
        """True if nothing speaks against it yet, for as long as the wire needs for the proofs of all.

        Its reply may still stand behind those of others, and what was asked before it was to stand proves
        nothing.
        """
        is_open = is_under_way(self._stop) and self.report.state == "sent" and is_heard(self.body.line)
        may_be = self._answers and (is_open or self.report.state == "acknowledged")
        return may_be and not self._is_refuted() and self._in_time() and not is_silent(self.body.line)

    def _is_refuted(self) -> bool:
        """True if it was to stand when it was last asked, and did not say that it does."""
        refuted_at = self._look.refuted_at
        return refuted_at is not None and refuted_at >= self.due_s - LAST_LOOK_S

    def goes_first(self) -> bool:
        """True if its body answers, and is asked before silent bodies; not for ever, for they may live."""
        answers = self._answers and self.report.state in ("acknowledged", "confirmed")
        return answers and self._in_time(GOES_FIRST)

    def _in_time(self, times: int = 1) -> bool:
        """True if it began no longer ago than the wire needs for the proofs of all, or `times` that time."""
        line = self.body.line
        needed_s = self.due_s + line.reply_timeout_s + proofs_s(line, self._most)
        return self.waited_s < times * needed_s

    @property
    def began_at(self) -> float:
        """When it was asked for, in the event loop's time."""
        return self._began_at

    def is_due(self) -> bool:
        """True if it was to be confirmed by now."""
        return self.is_late() and not self.has_had_no_turn()

    def _warn(self) -> None:
        """Wait where the line may be silent as a whole: that is known in a moment."""
        if self._silent_lines.may_be(self.body.line):
            self._warning = asyncio.get_running_loop().call_later(REPEAT_S, self._warn)
            return
        super()._warn()

    def _is_free_of_programs(self) -> bool:
        """True if no program can run: on a line of few bodies each is asked nevertheless."""
        return self.body.runs_no_program() and not is_prompt(self.body.line)

    async def _ask(self, command: RorzeCommand[R]) -> R:
        """Ask it in one frame with those that are stopped with it."""
        return await self._sweep.ask_one(self.body, self._company_of(self.body), command, Lane.VERIFY)

    async def _why_not_still(self) -> Text | None:
        if await self._runs_pulses():
            return NOT_AT_REST
        if await self._runs_program():
            return PROGRAM_GOES_ON
        if (rest := self.body.told.rest) is not None and not is_prompt(self.body.line):
            self.report.position = rest.position
            return None
        position = await self._position()
        if await self._runs_pulses():
            return NOT_AT_REST
        self.report.position = position
        return None

    async def _position(self) -> int:
        company = [body for body in self._company_of(self.body) if body.told.rest is None]
        return (await self._sweep.ask_one(self.body, company, GetPosition(), Lane.VERIFY)).pulses

    async def _runs_pulses(self) -> bool:
        status = await self._ask(GetControllerStatus(bit=0))
        return bool(status.on)

    async def _runs_program(self) -> bool:
        if self._is_free_of_programs():
            return False
        try:
            program = await self._ask(GetProgramStatus())
        except ControllerRefused as refusal:
            if refusal.error_code not in (None, UNKNOWN_CODE):
                raise
            return False
        return bool(program.status & PROGRAM_RUNS)

    # telling

    def publish(self, what: str, **more: str) -> None:
        """Tell everybody how far it has come; where the whole line is silent, that is told first."""
        if what == "unconfirmed":
            self._silent_lines.note_overdue(self.body.line)
        super().publish(what, **more)


async def _move_recorded(body: Body) -> None:
    """Wait a little until the stopped move is over in the records too: a new one may then follow at once."""
    if body.move is not None:
        await happens(body.motion.free, RECORD_WITHIN_S)


async def _over(future: "asyncio.Future[Outcome] | None") -> None:
    if future is not None:
        await asyncio.wait({future})


def _stop_of(mode: StopMode) -> StopImmediately | StopDecelerating:
    return StopImmediately() if mode == "immediate" else StopDecelerating()
