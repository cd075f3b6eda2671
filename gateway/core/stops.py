"""A stop that is under way: repeated until standstill is proved, however long that takes."""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from functools import partial
from typing import Any, ClassVar, Final, Generic, Literal, Protocol, Self, TypeVar

from pydantic import PrivateAttr
from typing_extensions import TypeAliasType

from gateway.core.drawn import Transition
from gateway.core.errors import GatewayError, NotSent
from gateway.core.origin import working
from gateway.core.records import Record
from gateway.core.supervisor import do_each, insist, supervise
from gateway.core.times import happens
from gateway.texts import Text, text

StopMode = TypeAliasType("StopMode", Literal["decelerate", "immediate"])
StopState = TypeAliasType(
    "StopState", Literal["requested", "sent", "acknowledged", "refused", "confirmed", "not_sent"]
)

REPEAT_S = 0.1
"""A stop is repeated this often until standstill is proved."""
HURRY_S = 60.0
"""Seconds after which a stop is repeated only every `REPEAT_SLOWLY_S`, which leaves others their time."""
REPEAT_SLOWLY_S = 1.0
CONFIRM_WITHIN_S = 2.0
"""Seconds without standstill until an event calls for the hardware stop; the stop is still repeated."""
PROVED_WITHIN_S = 1.0
"""A motor that tells that it runs has this time from when its ramp can be over, if that is later."""
RAMP_ASKED_AFTER_S = 1.5
"""Seconds after a decelerating stop until a motor that still runs is asked how long its ramp may take."""
RECORD_WITHIN_S = 1.0
"""A move that was stopped is recorded within this; if not, the next one does not wait any longer."""
CLOCK_S = 0.001
"""Seconds by which a timer may be early."""


class StopNews(Enum):
    """News of a stop."""

    WRITTEN = "it is on the wire"
    NOT_SENT = "it cannot be put on the wire"
    TAKEN = "its controller takes it"
    REFUSED = "its controller refuses it"
    NOT_REFUSED = "its controller has refused nothing"
    PROVED = "standstill is proved"


class StopAction(Enum):
    """Reaction to news of a stop."""

    NONE = ""
    RAMP = "its ramp begins"
    TELL = "write the reason into its report"


StopStep = Transition[StopState, StopAction]


def _row(state: StopState, **steps: StopStep) -> Mapping[StopNews, StopStep]:
    """The row of a stop that is under way: only a standstill that was proved ends it."""
    return {
        StopNews.WRITTEN: StopStep(state, StopAction.NONE),
        StopNews.NOT_SENT: StopStep(state, StopAction.NONE),  # what was sent before stays sent
        StopNews.TAKEN: StopStep("acknowledged", StopAction.RAMP),
        StopNews.REFUSED: StopStep("refused", StopAction.NONE),
        StopNews.NOT_REFUSED: StopStep(state, StopAction.NONE),
        StopNews.PROVED: StopStep("confirmed", StopAction.TELL),
        **{StopNews[name]: steps[name] for name in steps},
    }


_NOT_SENT: Final[Mapping[str, StopStep]] = {
    "WRITTEN": StopStep("sent", StopAction.NONE),
    "NOT_SENT": StopStep("not_sent", StopAction.TELL),
}
TABLE: Final[Mapping[StopState, Mapping[StopNews, StopStep]]] = {
    "requested": _row("requested", **_NOT_SENT),
    "not_sent": _row("not_sent", **_NOT_SENT),
    "sent": _row("sent"),
    "acknowledged": _row("acknowledged", TAKEN=StopStep("acknowledged", StopAction.NONE)),
    "refused": _row("refused", NOT_REFUSED=StopStep("sent", StopAction.NONE)),
    "confirmed": dict.fromkeys(StopNews, StopStep("confirmed", StopAction.NONE)),
}


class HardwareCall(Enum):
    """State of the call for the hardware stop."""

    NOT_YET = "not called for"
    AMID_PROOF = "called for, amid a proof"
    CALLED = "called for"
    DISPROVED = "called for, and the motor stood already"


class CallNews(Enum):
    """News of the call for the hardware stop."""

    LATE = "no standstill in time"
    UNPROVED = "the proof under way fails"
    PROVED = "standstill is proved"


class CallAction(Enum):
    """Reaction to news of the call."""

    NONE = ""
    CALL = "tell stop.unconfirmed"


CallStep = Transition[HardwareCall, CallAction]


def _call(unproved: HardwareCall, proved: HardwareCall) -> Mapping[CallNews, CallStep]:
    """The row of a stop that is under way; a call that meets a fault of the gateway is made again."""
    return {
        CallNews.LATE: CallStep(HardwareCall.AMID_PROOF, CallAction.CALL),
        CallNews.UNPROVED: CallStep(unproved, CallAction.NONE),
        CallNews.PROVED: CallStep(proved, CallAction.NONE),
    }


CALLS: Final[Mapping[HardwareCall, Mapping[CallNews, CallStep]]] = {
    HardwareCall.NOT_YET: _call(HardwareCall.NOT_YET, HardwareCall.NOT_YET),
    HardwareCall.AMID_PROOF: _call(HardwareCall.CALLED, HardwareCall.DISPROVED),
    HardwareCall.CALLED: _call(HardwareCall.CALLED, HardwareCall.CALLED),
    HardwareCall.DISPROVED: dict.fromkeys(CallNews, CallStep(HardwareCall.DISPROVED, CallAction.NONE)),
}


def standstill_unknown(what: Text, error: GatewayError) -> Text:
    """Say that it is unknown whether something stands still, and why it has not told.

    That nothing was sent is true of the question, but people would take it for the stop.
    """
    if isinstance(error, NotSent):
        why = text("stops.cannot-be-asked")
    else:
        why = Text(error.detail, error.detail_ja or f"（{error.detail}）")
    return text("stops.standstill-unknown", what=what, why=why)


class Report(Protocol):
    """Progress of a stop, as people are told."""

    state: StopState
    detail: str | None

    def note_japanese(self, detail: str | None) -> None:
        """Take `detail` in Japanese, too."""

    def in_japanese(self) -> Self:
        """Give the report for people who read Japanese."""


class BilingualReport(Record):
    """A report whose `detail` there is in Japanese, too."""

    _detail_ja: str | None = PrivateAttr(None)

    def note_japanese(self, detail: str | None) -> None:
        """Take it."""
        self._detail_ja = detail

    def in_japanese(self) -> Self:
        """Give the report for people who read Japanese."""
        return self.model_copy(update={"detail": self._detail_ja})


class Stopping(ABC):
    """The stop of a body or a robot. Only standstill ends it."""

    silent_after_s = REPEAT_S
    """Seconds since the last reply on the line after which no answer is to be expected."""
    one_at_a_time: ClassVar[bool] = False
    """True if a repetition is left out while the last one waits for its turn or its reply."""
    report: Any
    """The `Report` of this stop, a model."""

    def __init__(
        self, mode: StopMode, report: Report, line: Any, tell: Callable[[str, dict[str, Any]], object]
    ) -> None:
        """`tell` publishes news of the stop, such as `stop.confirmed`, with its data."""
        self.mode = mode
        self.report, self._line, self._tell = report, line, tell
        self._reasons: Sequence[Text] = ()
        """Objections to standstill, from the last look at the controller."""
        self._began_at = asyncio.get_running_loop().time()
        self._held_before_s: float = line.admission.held_s(self._began_at)
        self._stop: asyncio.Future[Any] | None = None
        """Outcome of the last repetition."""
        self._taken_s = 0.0
        """Age of the stop when its controller took it, in seconds."""
        self._ramp_s: float | None = None
        """Seconds that its ramp may take by the controller's settings; None if unknown."""
        self._repeated_at = self._began_at
        self._call = HardwareCall.NOT_YET
        self._trouble: Text | None = None
        """Why it was not sent."""
        self._at_once = asyncio.Event()

    # what a body or a robot adds

    @abstractmethod
    def _send_stop(self) -> "asyncio.Future[Any]":
        """Queue the stop, with `note_written`; the future gives its outcome, and never raises.

        :raises GatewayError: it cannot be put on the wire.
        """

    def _note(self, outcome: Any, /) -> None:
        """Take the outcome of a stop that was queued."""
        if isinstance(outcome, NotSent):
            self.note_not_sent(outcome)
        elif not isinstance(outcome, GatewayError):
            self.note_acknowledged()

    @abstractmethod
    async def _see(self) -> Sequence[Text]:
        """Ask the controller for objections to standstill; a program that could move it again is one, too.

        Nothing is given where all stands still.
        """

    def why_not(self) -> Sequence[Text]:
        """Tell what keeps it from being confirmed."""
        return self._reasons

    def tells_of_motion(self) -> bool:
        """Say whether the controller has taken the stop, and said when last asked that the motor runs."""
        return False

    def asks_for_s(self) -> float:
        """Seconds that its controller may take to tell the length of the ramp; 0 if it is not asked now."""
        return 0.0

    # time

    @property
    def waited_s(self) -> float:
        """Seconds for which it has been under way, without the time for which the gateway was held up."""
        now = asyncio.get_running_loop().time()
        held: float = self._line.admission.held_s(now)
        return now - self._began_at - (held - self._held_before_s)

    def is_late(self) -> bool:
        """Say whether the motor should stand by now."""
        return self.waited_s >= self.due_s - CLOCK_S

    @property
    def due_s(self) -> float:
        """Age in seconds at which its motor is to stand: silence is no ramp."""
        if not self.tells_of_motion():
            return CONFIRM_WITHIN_S
        if self._ramp_s is None:
            return CONFIRM_WITHIN_S + self.asks_for_s()
        return max(CONFIRM_WITHIN_S, self._taken_s + self._ramp_s + PROVED_WITHIN_S)

    def asks_for_ramp(self) -> bool:
        """Say whether the stop has lasted so long that the motor's ramp has to be known."""
        decelerates = self.mode == "decelerate" and self._ramp_s is None
        return decelerates and self.waited_s >= RAMP_ASKED_AFTER_S and self.tells_of_motion()

    def note_ramp(self, seconds: float) -> None:
        """Note the seconds that its ramp may take."""
        self._ramp_s = seconds

    @property
    def disproves_its_alarm(self) -> bool:
        """True if the proof of standstill was under way already when the hardware stop was called for."""
        return self._call is HardwareCall.DISPROVED

    # repeating

    def submit(self) -> None:
        """Send the stop, and note its outcome when that is known."""
        if self.one_at_a_time and is_under_way(self._stop):
            return
        try:
            self._stop = stop = self._send_stop()
        except GatewayError as error:
            self.note_not_sent(error)
        else:
            stop.add_done_callback(lambda future: self._note(future.result()))

    async def see_through(self) -> None:
        """Repeat the stop until standstill is proved, if it is not yet. To cancel this gives it up."""
        loop = asyncio.get_running_loop()
        self._warn_in(CONFIRM_WITHIN_S)
        try:
            began_at = loop.time()
            while self.report.state != "confirmed" and not await self._is_proved():
                await self._pause(self.pause_s(loop.time() - began_at))
                began_at = loop.time()
                self._take_call(CallNews.UNPROVED)
                self._repeat()
        finally:
            self._warning.cancel()
        self._take_call(CallNews.PROVED)
        self._take(StopNews.PROVED)
        self.tell()

    def repeat_at_once(self) -> None:
        """Send the next repetition now: it will arrive."""
        self._at_once.set()

    async def _pause(self, pause_s: float) -> None:
        await happens(self._at_once, pause_s)
        self._at_once.clear()

    async def _is_proved(self) -> bool:
        """Ask for proof; while no controller on the line answers there is none, and the stop is repeated."""
        async with asyncio.TaskGroup() as group:
            proof = group.create_task(self._stands_still(), name="proof of a stop")
            while not proof.done():
                replies = self._line.counters["replies"]
                await asyncio.wait({proof}, timeout=max(self.pause_s(), self.silent_after_s))
                if not proof.done() and self._line.counters["replies"] == replies:
                    self._repeat()
        return proof.result()

    async def _stands_still(self) -> bool:
        self._reasons = await self._see()
        self.tell()
        return not self._reasons

    def pause_s(self, took_s: float = 0.0) -> float:
        """Seconds to wait after an attempt; in the long run at least as long as the attempt has taken."""
        hurries = asyncio.get_running_loop().time() - self._began_at < HURRY_S
        return REPEAT_S if hurries else max(REPEAT_SLOWLY_S - took_s, took_s)

    def _repeat(self) -> None:
        """Send it once more; a motor that decelerates has its time, and is told now and then after that."""
        now = asyncio.get_running_loop().time()
        decelerates = self.mode == "decelerate" and self.report.state == "acknowledged"
        is_long = self.waited_s >= CONFIRM_WITHIN_S and now - self._repeated_at >= REPEAT_SLOWLY_S
        if self._is_overdue or is_long or not decelerates:
            self._repeated_at = now
            self.submit()

    def has_had_no_turn(self) -> bool:
        """Say whether the line was so busy with other stops that nothing speaks against this one yet."""
        return False

    def may_still_be_asked(self) -> bool:
        """Say whether it is too early to report on the stop; a long ramp is not waited for."""
        return not self._is_overdue and not self._takes_long() and self.has_had_no_turn()

    def _takes_long(self) -> bool:
        """Say whether its motor may still be on its ramp when people get the report."""
        return self.due_s > CONFIRM_WITHIN_S

    def _warn_in(self, seconds: float) -> None:
        loop, what = asyncio.get_running_loop(), "the call for the hardware stop"
        self._warning = loop.call_later(seconds, insist, what, self._warn)

    def _warn(self) -> None:
        if self.report.state == "confirmed":
            return
        if not self.is_late():
            self._warn_in(min(self.due_s - self.waited_s, REPEAT_S))
            return
        if self.has_had_no_turn():
            self._warn_in(REPEAT_S)
            return
        if self._take_call(CallNews.LATE) is CallAction.CALL:
            self.tell()
            self.publish("unconfirmed")

    # telling

    def _take(self, news: StopNews) -> StopAction:
        """Go on to the next state of the report, and give what is to be done."""
        self.report.state, action = TABLE[self.report.state][news]
        return action

    def _take_call(self, news: CallNews) -> CallAction:
        self._call, action = CALLS[self._call][news]
        return action

    @property
    def _is_overdue(self) -> bool:
        return self._call is not HardwareCall.NOT_YET

    def note_written(self, _: float) -> None:
        """Note that the stop is on the wire."""
        self._trouble = None
        self._take(StopNews.WRITTEN)

    def note_acknowledged(self) -> None:
        """Its controller has taken it."""
        if self._take(StopNews.TAKEN) is StopAction.RAMP:
            self._taken_s = self.waited_s

    def note_not_sent(self, error: GatewayError) -> None:
        """It could not be put on the wire; what was sent before stays sent."""
        if self._take(StopNews.NOT_SENT) is StopAction.TELL:
            ja = error.detail_ja or text("stops.not-sent", why=error.detail).ja
            self._trouble = Text(error.detail, ja)
            self.tell()

    def publish(self, what: str, **more: str) -> None:
        """Tell everybody how far it has come: its report, and `more`."""
        self._tell(f"stop.{what}", {**self.report.model_dump(), **more})

    def calls_for_hardware(self) -> bool:
        """Say whether the software stop may not be enough."""
        return self._is_overdue

    def tell(self) -> None:
        """Write into the report why it is not confirmed; nothing where it is."""
        if self.report.state == "confirmed":
            self._explain(())
            return
        reasons = [self._trouble] if self._trouble else [*self.why_not()]
        if self._ramp_s is not None and self._takes_long() and not self._is_overdue:
            reasons.append(text("stops.ramp-takes", seconds=f"{self._ramp_s:.1f}"))
        if self.calls_for_hardware():
            reasons.append(text("stops.unconfirmed"))
        self._explain(reasons)

    def _explain(self, reasons: Sequence[Text]) -> None:
        self.report.detail = " ".join(reason.en for reason in reasons) or None
        self.report.note_japanese("".join(reason.ja for reason in reasons) or None)


def is_under_way(sent: "asyncio.Future[Any] | None") -> bool:
    """Say whether what was sent still waits for its turn or its outcome."""
    return sent is not None and not sent.done()


K = TypeVar("K")
"""Key of a stop, by its subject and kind: a second stop with the same key joins the first."""
S = TypeVar("S", bound=Stopping)


StopPlan = tuple[Sequence[Callable[[], object]], Sequence[K]]
"""The deeds that begin stops, and the keys of all that are under way then."""


class StopsUnderWay(Generic[K, S]):
    """Stops of one kind of controllers, until each is confirmed and the moves it has ended are recorded."""

    def __init__(self) -> None:
        self._running: dict[K, S] = {}
        """Stops that are not confirmed yet."""
        self._tasks: dict[S, asyncio.Task[None]] = {}

    # what a family adds

    def _count(self, stop: S, /) -> None:
        """Note that a stop has begun, or is over: `_tasks` has those under way."""

    def _at_standstill(self, _stop: S, /) -> Iterable[Callable[[], object]]:
        """Name what is to be done before it is told that a stop is confirmed, whatever meets a fault."""
        return ()

    async def _record(self, stop: S, /) -> None:
        """Wait until the move that it has ended is recorded; no other may begin before."""

    # their life

    def _begun(self, plan: StopPlan[K]) -> list[S]:
        """Begin the stops of a plan, each deed for itself."""
        deeds, keys = plan
        do_each("a stop", *deeds).or_raise()
        return [self._running[key] for key in keys]

    def _begin(self, key: K, stop: S, what: str, *others: Callable[[], object]) -> None:
        """Begin a stop, and do what `others` are to do with it; its task repeats it."""
        task = supervise(what, partial(self._see_through, stop, what), lambda _: self._over(stop))
        self._running[key], self._tasks[stop] = stop, task
        do_each(what, partial(self._count, stop), stop.submit, partial(stop.publish, "requested"), *others)

    async def _see_through(self, stop: S, what: str) -> None:
        """Repeat it until it is confirmed; from then on another stop is one of its own."""
        with working("stops"):
            await stop.see_through()
        if stop in self._running.values():
            done = self._at_standstill(stop)
            do_each(what, partial(self._forget, stop), *done, partial(stop.publish, "confirmed"))
        await self._record(stop)

    def _over(self, stop: S) -> None:
        """Forget a stop, which a gateway that closes may not even have begun to see through."""
        self._tasks.pop(stop, None)
        self._forget(stop)
        self._count(stop)

    def _forget(self, stop: S) -> None:
        for key in [key for key, running in self._running.items() if running is stop]:
            del self._running[key]

    def unconfirmed_among(self, stops: Iterable[S]) -> Any:
        """The report of one of these that is not confirmed yet; None without one."""
        reports = (stop.report for stop in stops)
        return next((report for report in reports if report.state != "confirmed"), None)

    @property
    def is_unconfirmed(self) -> bool:
        """Say whether a stop is under way that is not confirmed yet."""
        return bool(self._running)

    async def confirmed(self) -> None:
        """Wait until every stop is confirmed, and its move recorded."""
        if self._tasks:
            await asyncio.wait(self._tasks.values())

    async def close(self) -> None:
        """Give up repeating, at the end of the gateway."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class StopsOfOne(StopsUnderWay[StopMode, S]):
    """The stops of one controller, which stops all its motors together."""

    def __init__(self, who: str, new: Callable[[StopMode], S]) -> None:
        super().__init__()
        self._who, self._new = who, new

    def _before(self) -> Iterable[Callable[[], object]]:
        """Name what is to be done before a stop is queued, whatever meets a fault."""
        return ()

    def stop(self, mode: StopMode) -> "asyncio.Task[Any]":
        """Stop it; a stop is queued before this returns, and nothing older is sent after it.

        The report comes when it stands still, or after two seconds with what is known then.
        """
        [stop] = self._begun(self._plan(mode))
        return asyncio.create_task(self._report(stop, self._tasks[stop]), name="stop report")

    def _plan(self, mode: StopMode) -> StopPlan[StopMode]:
        running = self._running.get(mode)
        send = partial(self._begin_new, mode) if running is None else running.submit
        return (*self._before(), send), (mode,)

    def _begin_new(self, mode: StopMode) -> None:
        self._begin(mode, self._new(mode), f"the stop of {self._who}")

    @staticmethod
    async def _report(stop: S, task: "asyncio.Task[None]") -> Any:
        await asyncio.wait({task}, timeout=CONFIRM_WITHIN_S)
        return stop.report
