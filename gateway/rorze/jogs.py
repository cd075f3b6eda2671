"""Jogs of bodies: a bounded move that is stopped as soon as heartbeats stay away."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final, Literal, NamedTuple, cast

from pydantic import Field, model_validator

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.jogs import (
    HEARTBEAT_S,
    KEPT,
    START_WITHIN_S,
    Jog,
    JogEnd,
    JogOutOfReach,
    JogOver,
    no_such_jog,
)
from gateway.core.move_record import Move, MoveStatus
from gateway.core.origin import Origin, acting, working
from gateway.core.own_faults import all_of, carry_on, insist
from gateway.core.records import RequestModel, example
from gateway.core.stops import CONFIRM_WITHIN_S, RECORD_WITHIN_S
from gateway.rorze.bodies import Body
from gateway.rorze.limited_speed import MaxSpeed, at_own_speed, require_one_speed
from gateway.rorze.move_proof import CAUSES
from gateway.rorze.move_requests import Pattern, Speed, relative_command
from gateway.rorze.moves import Moves
from gateway.rorze.plans import amount_of, top_speed_of
from gateway.rorze.stops import StopReport, Stops
from gateway.rorze.units import Length
from protocols.rorze.modes import GetSoftLimits
from protocols.rorze.notation import BILLION

LONGEST_S: Final = 10.0
"""No jog goes further than the motor comes in this time at its top speed: nothing stops it where the gateway
has died."""
STILL_WITHIN_S: Final = CONFIRM_WITHIN_S + RECORD_WITHIN_S

Turn = Literal["cw", "ccw"]
_TURNS: Final[dict[str, Turn]] = {"+": "cw", "-": "ccw", "cw": "cw", "ccw": "ccw"}


class BodyJogRequest(RequestModel, json_schema_extra=example(direction="cw")):
    """Which way to jog, how fast, and how far at most."""

    direction: Literal["cw", "ccw", "+", "-"] = Field(description="+ is cw, - is ccw.")
    speed: Speed = Field(default="low", description="`low` runs at the start speed, without ramps.")
    pattern: Pattern = None
    max_speed: MaxSpeed = None
    at_most: Length | None = Field(
        default=None,
        description="The jog ends after this distance; never further than 10 s take at its top speed, nor "
        "beyond the soft limits.",
    )

    _one_speed = model_validator(mode="after")(require_one_speed)

    @property
    def turn(self) -> Turn:
        """The direction in the words of moves."""
        return _TURNS[self.direction]


class BodyJog(Jog):
    """A body that jogs, or has jogged."""

    id: str = Field(description="Of the jog, and of the move it makes.")
    body_id: str
    direction: Turn
    speed: Speed
    distance: int = Field(description="So far it goes at most, in pulses; encoder counts in encoder mode.")


@dataclass(eq=False)
class _Session:
    jog: BodyJog
    body: Body
    move: Move
    bound: str
    """Where it ends if it comes as far as it may."""
    until: float = 0.0
    """Deadline of the next heartbeat, on the event loop's clock."""
    alarm: asyncio.TimerHandle | None = None
    """Stops it, unless the next heartbeat comes first."""
    over: "asyncio.Task[None]" = field(init=False)
    """Ends when the motor was seen to stand still. A session is kept only with it."""
    stopping: "asyncio.Task[list[StopReport]] | None" = None


class BodyJogs:
    """The jogs of all bodies of a plant."""

    def __init__(self, moves: Moves, stops: Stops, tell: Callable[[str, Body, BodyJog], None]) -> None:
        self._moves, self._stops, self._tell = moves, stops, tell
        self._sessions: dict[str, _Session] = {}

    async def start(self, body: Body, request: BodyJogRequest) -> BodyJog:
        """Start to jog a body (RC-420 manual 13.2).

        :raises InvalidRequest: the length is in another unit, or it stands at its soft limit; nothing was
            sent.
        :raises GatewayError: as of `Moves.start`.
        """
        line, number = body.line, body.number
        line.require_fit()
        loop = asyncio.get_running_loop()
        late_at, epoch = loop.time() + START_WITHIN_S, line.gate.epoch(number)
        async with at_own_speed(body, request) as ready:
            distance, bound = await _reach(body, ready)
            if line.gate.epoch(number) != epoch:
                raise line.gate.overtaken(number)
            command = relative_command(ready.turn, ready.speed, distance, ready.pattern)
            within_s = max(0.0, late_at - loop.time())

            def begun(move: Move) -> None:
                self._begun(body, move, ready, distance, bound)

            try:
                [move] = await self._moves.start(body, command, within_s, on_sent=begun, kind="jog")
                return self._sessions[move.id].jog
            except GatewayError:
                raise
            except Exception:  # it may move, and nobody awaits its heartbeat
                self._stops.stop([body], "decelerate")
                raise

    def _begun(self, body: Body, move: Move, request: BodyJogRequest, distance: int, bound: str) -> None:
        """The motor may move from now on, answered or not."""
        jog = BodyJog(
            id=move.id, body_id=body.address, direction=request.turn, speed=request.speed, distance=distance
        )
        it, what = _Session(jog, body, move, bound), f"the jog of {body.address}"
        it.over = asyncio.create_task(carry_on(what, partial(self._see_over, it)), name=what)
        self._await_heartbeat(it)
        self._sessions[jog.id] = it
        over = [key for key, each in self._sessions.items() if each.over.done()]
        for key in over[: max(0, len(over) - KEPT)]:
            del self._sessions[key]
        self._tell("started", body, jog)

    def _await_heartbeat(self, it: _Session) -> None:
        loop = asyncio.get_running_loop()
        if it.alarm is not None:
            it.alarm.cancel()
        it.until = loop.time() + HEARTBEAT_S
        it.alarm = loop.call_at(it.until, insist, "the end of a jog", partial(self._missed, it))

    def heartbeat(self, body: Body, jog_id: str) -> BodyJog:
        """Let a body jog for another half second.

        :raises NotFound: it had no such jog.
        :raises JogOver: it is being stopped, or stands still.
        :raises JogOutOfReach: nobody can keep it, or stop it; the jog is lost as if none had come.
        """
        body.line.admission.revise()
        it = self._find(body, jog_id)
        if it.jog.state == "jogging" and asyncio.get_running_loop().time() >= it.until:
            self._stop(it, "lost")  # the loop was held: the alarm comes too late
        if it.jog.state != "jogging":
            raise JogOver(body.address, it.jog)
        if not body.online:
            raise JogOutOfReach(body.address, "its motor")
        self._await_heartbeat(it)
        return it.jog

    async def end(self, body: Body, jog_id: str) -> BodyJog:
        """Stop a jog, and give it when the motor stands still.

        Its state is `stopping` where that was not seen in time; the stop is repeated. One that is over
        already is given as it ended.

        :raises NotFound: the body had no such jog.
        """
        it = self._find(body, jog_id)
        if it.jog.state == "jogging":
            self._stop(it, "ended")
        await asyncio.wait({it.over}, timeout=STILL_WITHIN_S)
        return it.jog

    def body_stops(self, body: Body) -> None:
        """A stop of a body begins: its jog goes on no more."""
        for it in self._sessions.values():
            if it.body is body and it.jog.state == "jogging":
                self._leave(it, "stopped")

    def lose_all(self) -> None:
        """Stop every body that jogs: its heartbeats are too old."""
        jogging = [it for it in self._sessions.values() if it.jog.state == "jogging"]
        all_of(partial(self._stop, it, "lost") for it in jogging)

    async def close(self) -> None:
        """Give up looking whether motors stand still."""
        tasks = [it.over for it in self._sessions.values()]
        for it in self._sessions.values():
            self._silence(it)
            it.over.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _find(self, body: Body, jog_id: str) -> _Session:
        it = self._sessions.get(jog_id)
        if it is None or it.body is not body:
            raise no_such_jog(jog_id)
        return it

    @acting(Origin("gateway: missing heartbeat"))
    def _missed(self, it: _Session) -> None:
        if not it.over.done():
            self._stop(it, "lost")

    def _stop(self, it: _Session, ends_as: JogEnd) -> None:
        """Stop the motor, and only then see to what is told of it."""
        it.jog.state, it.jog.ends_as = "stopping", ends_as
        with working("stops"):
            it.stopping = self._stops.stop([it.body], "decelerate")
        self._leave(it, ends_as)

    def _leave(self, it: _Session, ends_as: JogEnd) -> None:
        """Begin the end of a jog: the motor may still move."""
        self._silence(it)
        it.jog.state, it.jog.ends_as = "stopping", ends_as
        self._tell("stopping", it.body, it.jog)

    def _silence(self, it: _Session) -> None:
        if it.alarm is not None:
            it.alarm.cancel()

    async def _see_over(self, it: _Session) -> None:
        """Wait until the motor stands still: its move has ended, or else a stop is confirmed."""
        await it.body.free.wait()
        if it.jog.state == "jogging":
            it.jog.note_end(_why_ended(it.move, it.bound))
            self._leave(it, "ended")
        while it.move.status in (MoveStatus.LOST, MoveStatus.UNKNOWN):
            [report] = await self._stops.stop([it.body], "decelerate")
            if report.state == "confirmed":
                break
        it.jog.state = cast("JogEnd", it.jog.ends_as)
        self._tell(it.jog.state, it.body, it.jog)


def _why_ended(move: Move, bound: str) -> str:
    """Say how a jog ended that nobody has stopped, as a sentence without its subject."""
    if move.status is MoveStatus.SUCCEEDED:
        return f"came to {bound}"
    told = [CAUSES[cause] for cause in (move.end_cause or "").split("+") if cause in CAUSES]
    return " and ".join(told) or f"ended as its move did ({move.status})"


class _Reach(NamedTuple):
    distance: int
    bound: str
    """Where it ends then."""


async def _reach(body: Body, request: BodyJogRequest) -> _Reach:
    """How far a jog may go, in the unit of the operating mode, and what bounds it.

    :raises InvalidRequest: it stands at its soft limit, or the length is in another unit.
    """
    reach = round(LONGEST_S * await top_speed_of(body, request.speed, request.pattern))
    reach, bound = await amount_of(body, reach), f"the furthest that a jog goes, {LONGEST_S:.0f} s"
    if request.at_most is not None and (at_most := request.at_most.pulses(body.scale)) < reach:
        reach, bound = at_most, "the end of its at_most"
    limits, _ = await body.ask(GetSoftLimits())
    here = (await body.where_it_rests()).position
    room = limits.upper - here if request.turn == "cw" else here - limits.lower
    if min(reach, room) < 1:
        raise InvalidRequest(
            f"{body.address} has no room to jog {request.turn}: it stands at {here}, its soft limits are "
            f"{limits.lower} to {limits.upper}; only questions were sent."
            if room < 1
            else "at_most: it comes to less than one pulse; only questions were sent."
        )
    if room <= reach:
        side, limit = ("upper", limits.upper) if request.turn == "cw" else ("lower", limits.lower)
        return _Reach(min(room, BILLION - 1), f"its {side} soft limit at {limit}")
    return _Reach(min(reach, BILLION - 1), bound)
