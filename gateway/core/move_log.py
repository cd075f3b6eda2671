"""The moves that are remembered, under way or over, and where motors were seen in the newest of them."""

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from itertools import islice
from typing import Any, Generic, TypeVar

from gateway.core.errors import NotFound
from gateway.core.move_record import MoveRecord
from gateway.core.times import happens
from protocols.wording import as_given

HISTORY = 1000
"""Finished moves that are kept, for all bodies or all robots together."""


M = TypeVar("M", bound=MoveRecord)


class MoveLog(Generic[M]):
    """Moves by their ids, and who waits for their ends."""

    def __init__(self) -> None:
        self._moves: OrderedDict[str, M | tuple[str, bytes]] = OrderedDict()
        """Moves by id.

        A move that is over is the address of what moved and the record as text: the garbage collector has
        nothing to look through in it.
        """
        self._kind: type[M]
        """Type of the records."""
        self._over: dict[str, asyncio.Event] = {}
        """Events that are set at the end of a move, for those under way alone."""
        self.on_change: Callable[[M], object] = lambda _: None
        """Called with a move that is new or has another status."""

    def remember(self, moves: Iterable[M]) -> None:
        """Take over the moves of an earlier life, in their order."""
        for move in moves:
            self.add(move)
            if move.status.final:
                self.end(move)

    def add(self, move: M) -> None:
        """Remember a new move; the oldest that are over may be forgotten for it."""
        self._moves[move.id], self._kind = move, type(move)
        self._over[move.id] = asyncio.Event()
        # Only what still runs stands before the oldest that is over.
        over = (
            move_id for move_id, move in self._moves.items() if isinstance(move, tuple) or move.status.final
        )
        for move_id in list(islice(over, max(0, len(self._moves) - HISTORY))):
            del self._moves[move_id]
            self._over.pop(move_id, None)

    def end(self, move: M) -> None:
        """The move is over and its record complete: tell who waits."""
        if move.id in self._moves:
            self._moves[move.id] = (move.body_id, move.model_dump_json().encode())
        if over := self._over.pop(move.id, None):
            over.set()

    def let_go(self) -> None:
        """Release all waiters: the gateway ends, and the moves may go on."""
        for over in self._over.values():
            over.set()

    def __contains__(self, move_id: str) -> bool:
        return move_id in self._moves

    def get(self, move_id: str) -> M:
        """Find a move by its id.

        :raises NotFound: there is none, or it is no longer kept.
        """
        move = self._moves.get(move_id)
        if move is None:
            raise NotFound(
                f"There is no move {as_given(move_id)}; "
                f"finished moves are kept until {HISTORY} newer ones exist.",
                "The list of moves of the same body or unit has those that are kept.",
            )
        return self._record(move)

    def under_way(self) -> list[M]:
        """The moves that are not over."""
        return [
            move for move in self._moves.values() if not isinstance(move, tuple) and not move.status.final
        ]

    def of(self, address: str, limit: int | None = None) -> list[M]:
        """The moves of a body or a unit, newest first; no more than a limit."""
        own = (move for move in reversed(self._moves.values()) if _body_of(move) == address)
        return [self._record(move) for move in islice(own, limit)]

    def _record(self, kept: M | tuple[str, bytes]) -> M:
        if isinstance(kept, tuple):
            return self._kind.model_validate_json(kept[1])
        return kept

    async def wait(self, move_id: str, timeout_s: float) -> M:
        """Give the move when it is over, or as it is when the time is up."""
        move = self.get(move_id)
        if not move.status.final and timeout_s > 0:
            await happens(self._over[move_id], timeout_s)
        return move


def _body_of(kept: MoveRecord | tuple[str, bytes]) -> str:
    return kept[0] if isinstance(kept, tuple) else kept.body_id


PLACES = 512
"""Places kept of one move; of more every second one is left out, all along the way."""
WAYS = 200
"""Moves whose trajectories are kept, of all bodies or all robots together."""

P = TypeVar("P")


class Trajectory(Generic[P]):
    """Where a motor was seen during one move, in the order of time."""

    def __init__(self, began_at: datetime, at: float, place: P) -> None:
        self.began_at = began_at
        """Time at which the command was written."""
        self._began_at = at
        self._kept: list[tuple[float, P]] = [(0.0, place)]
        self._last: tuple[float, P] | None = None
        self._apart_s = 0.0
        """Seconds that two kept places lie apart at least."""

    def add(self, at: float, place: P) -> None:
        """Note where it was seen at a time of the event loop; what was read before the move is not of it."""
        seconds = at - self._began_at
        if seconds <= self._newest_s:
            return
        self._last = (seconds, place)
        if seconds - self._kept[-1][0] >= self._apart_s:
            self._kept.append(self._last)
        if len(self._kept) >= PLACES:
            del self._kept[1::2]
            self._apart_s = 2 * seconds / PLACES

    @property
    def places(self) -> list[tuple[float, P]]:
        """Seconds since the command was written, and the place: always with the first and the newest."""
        newest = [] if self._last is None or self._last is self._kept[-1] else [self._last]
        return self._kept + newest

    def time_of(self, seconds: float) -> datetime:
        """The wall time `seconds` after the beginning."""
        return self.began_at + timedelta(seconds=seconds)

    @property
    def _newest_s(self) -> float:
        return (self._last or self._kept[-1])[0]


W = TypeVar("W", bound=Trajectory[Any])


class Trajectories(Generic[W]):
    """The trajectories of the newest moves, by the ids of the moves."""

    def __init__(self) -> None:
        self._ways: OrderedDict[str, W] = OrderedDict()

    def begin(self, move_id: str, trajectory: W) -> None:
        """A move begins; the trajectory of the oldest one may be forgotten for it."""
        self._ways[move_id] = trajectory
        if len(self._ways) > WAYS:
            self._ways.popitem(last=False)

    @property
    def all(self) -> list[W]:
        """Kept trajectories, the oldest first."""
        return list(self._ways.values())

    def of(self, move_id: str) -> W:
        """Find the trajectory of a move.

        :raises NotFound: its command was not written, or newer ones have taken its place.
        """
        if move_id not in self._ways:
            raise NotFound(
                f"No samples of the move {move_id} are kept: it was not sent since the gateway's start, or "
                f"there are {WAYS} newer ones."
            )
        return self._ways[move_id]
