"""Jogs of bodies: a bounded move that is stopped as soon as heartbeats stay away."""

import asyncio
from collections.abc import Callable
from typing import Final, NamedTuple

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.jogs import START_WITHIN_S, Jogging, JogNews, JogOutOfReach, Jogs
from gateway.core.move_record import Move, MoveStatus
from gateway.core.stops import CONFIRM_WITHIN_S, RECORD_WITHIN_S
from gateway.rorze.bodies import Body
from gateway.rorze.move_proof import CAUSES
from gateway.rorze.move_requests import BodyJog, BodyJogRequest, relative_command
from gateway.rorze.moves import Moves
from gateway.rorze.plans import amount_of, at_own_speed, top_speed_of
from gateway.rorze.stops import Stops
from protocols.rorze.modes import GetSoftLimits
from protocols.rorze.notation import BILLION

LONGEST_S: Final = 10.0
"""No jog goes further than the motor comes in this time at its top speed: nothing stops it where the gateway
has died."""

_Session = Jogging[BodyJog, Body]


class BodyJogs(Jogs[BodyJog, Body]):
    """The jogs of all bodies of a plant."""

    still_within_s = CONFIRM_WITHIN_S + RECORD_WITHIN_S

    def __init__(self, moves: Moves, stops: Stops, tell: Callable[[str, Body, BodyJog], object]) -> None:
        super().__init__(lambda news, session: tell(news, session.of, session.jog))
        self._moves, self._stops = moves, stops

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
                """The motor may move from now on, answered or not."""
                jog = BodyJog(
                    id=move.id,
                    body_id=body.address,
                    direction=ready.turn,
                    speed=ready.speed,
                    distance=distance,
                )
                jog._bound = bound  # noqa: SLF001  # no client sees it
                self._begin(Jogging(jog, body.address, line, body))

            try:
                [move] = await self._moves.start(body, command, within_s, on_sent=begun, kind="jog")
                return self._sessions[move.id].jog
            except GatewayError:
                raise
            except Exception:  # it may move, and nobody awaits its heartbeat
                self._stops.stop([body], "decelerate")
                raise

    def body_stops(self, body: Body) -> None:
        """A stop of a body begins: its jog goes on no more."""
        for session in self._sessions.values():
            if session.of is body:
                self._take(session, JogNews.STOP)

    def _require_in_reach(self, session: _Session) -> None:
        if not session.of.online:
            raise JogOutOfReach(session.of.address, "its motor")

    def _stop(self, session: _Session) -> None:
        self._stops.stop([session.of], "decelerate")

    async def _rests(self, session: _Session) -> None:
        session.jog.note_end(_why_ended(await self._ended(session), session.jog._bound))  # noqa: SLF001

    async def _see_still(self, session: _Session) -> bool:
        """Wait until its move has ended, or else a stop is confirmed."""
        while (await self._ended(session)).status in (MoveStatus.LOST, MoveStatus.UNKNOWN):
            [report] = await self._stops.stop([session.of], "decelerate")
            if report.state == "confirmed":
                break
        return True

    async def _ended(self, session: _Session) -> Move:
        """Give its move when that is over."""
        move = self._moves.get(session.jog.id)
        if not move.status.final:
            await session.of.motion.free.wait()
        return move


def _why_ended(move: Move, bound: str) -> str:
    """Say how a jog ended without a stop, as a sentence without its subject."""
    if move.status is MoveStatus.SUCCEEDED:
        return f"came to {bound}"
    told = [CAUSES[cause] for cause in (move.end_cause or "").split("+") if cause in CAUSES]
    return " and ".join(told) or f"ended as its move did ({move.status})"


class _Reach(NamedTuple):
    distance: int
    bound: str
    """Name of the limit at which the jog ends."""


async def _reach(body: Body, request: BodyJogRequest) -> _Reach:
    """Calculate the longest way of a jog, in the unit of the operating mode, and the limit that bounds it.

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
