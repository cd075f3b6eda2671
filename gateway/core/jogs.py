"""Jogs of all families: a motor moves only while a heartbeat comes twice a second.

A family brings how its motor is stopped, and how it is seen to stand still.
`python -m gateway.core.jogs > docs/jogs.md` draws the table.
"""

import asyncio
import secrets
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Any, ClassVar, Final, Generic, Literal, NamedTuple, TypeVar

from pydantic import Field, PrivateAttr

from gateway.core.drawn import states
from gateway.core.errors import GatewayError, NotFound
from gateway.core.line import LineDriver
from gateway.core.origin import Origin, acting, working
from gateway.core.records import Record
from gateway.core.supervisor import do_each, insist, supervise
from protocols.wording import as_given

HEARTBEAT_S: Final = 0.5
"""The longest time between two heartbeats; after it the motor is stopped."""
START_WITHIN_S: Final = 2.0
KEPT: Final = 100
"""Ended sessions that are remembered, to tell why they have ended."""

JogEnd = Literal["ended", "lost", "stopped"]
JogState = Literal["jogging", "stopping", JogEnd]
_ENDS: Final[tuple[JogEnd, ...]] = "ended", "lost", "stopped"
_WHAT: Final = "the end of a jog"


class Jog(Record):
    """A motor that jogs, or has jogged."""

    id: str = Field(default_factory=lambda: secrets.token_hex(8))
    state: JogState = Field(
        "jogging",
        description="`stopping`: it is told to stop, and may still move. `ended`, `lost` and `stopped`: it "
        "was seen to stand still. `ended`: by request, or by itself as at its limit; `lost`: "
        "for want of a heartbeat; `stopped`: with all that moves there, or at the end of the "
        "gateway.",
    )
    ends_as: JogEnd | None = Field(
        default=None, description="State that follows at standstill; null while it jogs."
    )
    heartbeat_within_ms: int = Field(
        default=int(HEARTBEAT_S * 1000), description="Seconds within which the next heartbeat has to come."
    )
    _why_ended: str | None = PrivateAttr(None)

    @property
    def why_ended(self) -> str | None:
        """Cause of an end without a request: a sentence without subject and full stop; None if unknown."""
        return self._why_ended

    def note_end(self, why: str) -> None:
        """Note that the motor stands still without a stop."""
        self._why_ended = why


class JogOutOfReach(GatewayError):
    """A heartbeat came for a part out of reach: it may move, and cannot be stopped."""

    kind = "jog-out-of-reach"
    moved = "unknown"
    retryable = True

    def __init__(self, who: str, what: str) -> None:
        super().__init__(
            f"{who} is out of reach: {what} may go on moving, and no software can stop it until it answers "
            "again.",
            "Use the hardware stop.",
        )


class JogOver(GatewayError):
    """The JOG session goes on no more: its motor is being stopped, or stands still."""

    kind = "jog-over"
    moved = "yes"

    def __init__(self, what: str, jog: Jog) -> None:
        if jog.state == "stopping":
            super().__init__(
                f"The JOG of {what} is being stopped ({jog.ends_as}); the axis may still move.",
                "Wait until it stands still; start a new JOG then if it is still wanted.",
            )
        else:
            why = "" if jog.why_ended is None else f": it {jog.why_ended}"
            super().__init__(
                f"The JOG of {what} is over ({jog.state}){why}; the axis stands still.",
                "Start a new JOG if it is still wanted.",
            )


class JogNews(Enum):
    """An event for a jog."""

    HEARTBEAT = "heartbeat"
    MISSED = "no heartbeat in time"
    END = "its end is asked for"
    REST = "its motor comes to rest without a stop"
    STOP = "its motor is stopped by another"
    CLOSING = "the gateway ends"
    REFUSED = "it never moved: its controller has refused it"
    STILL = "its motor is seen to stand still"


class JogAction(Enum):
    """The reaction to it."""

    WAIT = "wait for the next heartbeat"
    STOP = "stop its motor, see that it stands still, tell"
    SEE = "see that it stands still, tell"
    TELL = "tell"
    REFUSE = "refuse"


class JogStep(NamedTuple):
    """One cell of the table."""

    state: JogState | None
    """State that follows; None for the end with which it began to stop."""
    action: JogAction
    ends_as: JogEnd | None = None
    """End of the jog, where it is known only now; the first end that comes counts."""


TABLE: Final[Mapping[JogState, Mapping[JogNews, JogStep]]] = {
    "jogging": {
        JogNews.HEARTBEAT: JogStep("jogging", JogAction.WAIT),
        JogNews.MISSED: JogStep("stopping", JogAction.STOP, "lost"),
        JogNews.END: JogStep("stopping", JogAction.STOP, "ended"),
        JogNews.REST: JogStep("stopping", JogAction.SEE, "ended"),
        JogNews.STOP: JogStep("stopping", JogAction.SEE, "stopped"),
        JogNews.CLOSING: JogStep("stopping", JogAction.STOP, "stopped"),
        JogNews.REFUSED: JogStep("ended", JogAction.TELL, "ended"),
    },
    "stopping": {
        JogNews.HEARTBEAT: JogStep("stopping", JogAction.REFUSE),
        JogNews.MISSED: JogStep("stopping", JogAction.STOP),  # a fault has kept the stop from being sent
        JogNews.STILL: JogStep(None, JogAction.TELL),
    },
    **{end: {JogNews.HEARTBEAT: JogStep(end, JogAction.REFUSE)} for end in _ENDS},
}
"""All other news changes nothing. Only a standstill that was seen makes a jog over."""

J = TypeVar("J", bound=Jog)
T = TypeVar("T")
"""Owner of a jog, where several owners keep their jogs together."""


@dataclass(eq=False)
class Jogging(Generic[J, T]):
    """A jog, with what keeps it and what sees to its end."""

    jog: J
    what: str
    """Noun for the moving part, in sentences."""
    line: LineDriver[Any, Any, Any]
    of: T
    alarm: asyncio.TimerHandle | None = None
    """Stops it, unless the next heartbeat comes first; it is kept until a stop is on its way."""
    rest: "asyncio.Task[None] | None" = None
    """Ends when the motor stands still without a stop."""
    end: "asyncio.Task[None] | None" = None
    """Ends when the motor, which is being stopped, stands still."""

    @property
    def jogs(self) -> bool:
        """True while heartbeats keep it jogging."""
        return self.jog.state == "jogging"

    def let_go(self) -> None:
        """Wait for no heartbeat any more, nor for rest."""
        for each in (self.alarm, self.rest):
            if each is not None:
                each.cancel()


class Jogs(ABC, Generic[J, T]):
    """The jogs of a family, or of one of its controllers."""

    still_within_s: ClassVar[float | None] = None
    """Seconds after which its end is given as it is; None where `_see_still` has bounds of its own."""

    def __init__(self, tell: Callable[[str, Jogging[J, T]], object]) -> None:
        self._tell_of = tell
        self._sessions: dict[str, Jogging[J, T]] = {}

    # what a family brings

    @abstractmethod
    def _require_in_reach(self, session: Jogging[J, T], /) -> None:
        """Refuse a heartbeat that cannot keep the jog.

        :raises JogOutOfReach: the motor could not be stopped.
        """

    @abstractmethod
    def _stop(self, session: Jogging[J, T], /) -> None:
        """Stop the motor; the stop is queued before this returns."""

    @abstractmethod
    async def _rests(self, session: Jogging[J, T], /) -> None:
        """Return when the motor stands still without a stop."""

    @abstractmethod
    async def _see_still(self, session: Jogging[J, T], /) -> bool:
        """See that the motor stands still, which is being stopped; False where others see to it."""

    def _settled(self, session: Jogging[J, T], /) -> None:
        """Note that the motor stands still, or was never told to move."""

    # a jog's life

    def _begin(self, session: Jogging[J, T]) -> None:
        """Begin a jog: the motor may move from now on, answered or not."""
        self._await_heartbeat(session)
        self._sessions[session.jog.id] = session
        what = f"the jog of {session.what}"
        with working("followers"):
            session.rest = supervise(
                what, partial(self._rests, session), partial(self._came_to_rest, session)
            )
        over = [key for key, session in self._sessions.items() if session.jog.state == session.jog.ends_as]
        for key in over[: max(0, len(over) - KEPT)]:
            del self._sessions[key]
        self._tell_of("started", session)

    def _came_to_rest(self, session: Jogging[J, T], rest: "asyncio.Task[None]") -> None:
        if not rest.cancelled():
            self._take(session, JogNews.REST)

    def _await_heartbeat(self, session: Jogging[J, T]) -> None:
        loop = asyncio.get_running_loop()
        if session.alarm is not None:
            session.alarm.cancel()
        session.alarm = loop.call_later(HEARTBEAT_S, insist, _WHAT, partial(self._missed, session))

    @acting(Origin("gateway: missing heartbeat"))
    def _missed(self, session: Jogging[J, T]) -> None:
        self._take(session, JogNews.MISSED)

    def _take(self, session: Jogging[J, T], news: JogNews) -> None:
        """Go on to the next stage: the motor first, and only then what is told of it.

        :raises JogOver: the table refuses it.
        """
        jog = session.jog
        step = TABLE[jog.state].get(news)
        if step is None:
            return
        jog.ends_as = jog.ends_as or step.ends_as
        jog.state = step.state or jog.ends_as or "ended"
        if step.action is JogAction.REFUSE:
            raise JogOver(session.what, jog)
        if step.action is JogAction.WAIT:
            self._await_heartbeat(session)
        elif step.action is JogAction.TELL:
            tell = partial(self._tell_of, jog.state, session)
            insist(_WHAT, session.let_go, partial(self._settled, session), tell)
        else:
            stop = [partial(self._stop, session)] if step.action is JogAction.STOP else []
            with working("stops"):
                do_each(_WHAT, *stop, partial(self._see_to, session)).or_raise()
            session.let_go()
            self._tell_of("stopping", session)

    def _see_to(self, session: Jogging[J, T]) -> None:
        """See that the motor stands still; a second stop joins the first."""
        if session.end is None:
            what = f"the end of the jog of {session.what}"
            session.end = supervise(what, partial(self._see_over, session))

    async def _see_over(self, session: Jogging[J, T]) -> None:
        if await self._see_still(session):
            self._take(session, JogNews.STILL)

    # asked for

    def heartbeat(self, jog_id: str, of: T | None = None) -> J:
        """Keep a motor jogging for another half second, and give its jog.

        :raises NotFound: there was no such jog.
        :raises JogOver: the motor is being stopped, or stands still.
        :raises JogOutOfReach: the motor cannot be kept or stopped; the jog is lost as if no heartbeat had
        come.
        """
        session = self._find(jog_id, of)
        session.line.admission.revise()
        now, alarm = asyncio.get_running_loop().time(), session.alarm
        if session.jogs and alarm is not None and now >= alarm.when():
            self._take(session, JogNews.MISSED)  # the loop was held: the alarm comes too late
        if session.jogs:
            self._require_in_reach(session)
        self._take(session, JogNews.HEARTBEAT)
        return session.jog

    async def end(self, jog_id: str, of: T | None = None) -> J:
        """Stop a jog, and give it when the motor stands still.

        Its state is `stopping` where that was not seen in time; it is still being stopped then. One that is
        over already is given as it ended.

        :raises NotFound: there was no such jog.
        """
        session = self._find(jog_id, of)
        self._take(session, JogNews.END)
        if session.end is not None:
            await asyncio.wait({session.end}, timeout=self.still_within_s)
        return session.jog

    def _find(self, jog_id: str, of: T | None = None) -> Jogging[J, T]:
        session = self._sessions.get(jog_id)
        if session is None or session.of is not of:
            raise NotFound(
                f"There is no JOG session {as_given(jog_id)}; nothing was sent.",
                "Read the status: what it moved may stand still.",
            )
        return session

    # all of them

    def end_all(self, news: Literal[JogNews.MISSED, JogNews.CLOSING]) -> None:
        """Stop every motor that jogs: no heartbeat counts any more."""
        self.take_all(news, [session for session in self._sessions.values() if session.jogs])

    def take_all(self, news: JogNews, sessions: Iterable[Jogging[J, T]] | None = None) -> None:
        """Something has happened to all of them, or these; a fault at one keeps no other from it.

        One that was not stopped because of a fault is stopped when its heartbeat is missed.
        """
        some = self._sessions.values() if sessions is None else sessions
        do_each(_WHAT, *(partial(self._take, session, news) for session in some)).or_raise()

    @property
    def is_under_way(self) -> bool:
        """Say whether a jog is not over."""
        return any(session.jog.state in ("jogging", "stopping") for session in self._sessions.values())

    async def settled(self) -> None:
        """Wait until every motor whose jog has ended stands still, or another stop sees to it."""
        ends = [session.end for session in self._sessions.values() if session.end is not None]
        if ends:
            await asyncio.wait(ends)

    async def close(self) -> None:
        """Stop what jogs, and give up looking whether motors stand still."""
        self.end_all(JogNews.CLOSING)
        for session in self._sessions.values():
            if session.end is not None:
                session.end.cancel()
        await self.settled()


def drawing() -> str:
    """The table as a page of the documentation."""
    head = (
        "Jogs",
        "How a jog goes on and ends, by what happens to it. A cell has the next state and *what is done*;",
        "a dash is news that changes nothing. A jog is over only when its motor was seen to stand still.",
    )
    return states(head, JogNews, TABLE)


if __name__ == "__main__":
    print(drawing(), end="")
