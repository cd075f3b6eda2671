"""Where motors were seen during their moves: some hundred places of each of the newest moves."""

from collections import OrderedDict
from datetime import datetime, timedelta
from typing import Any, Generic, TypeVar

from gateway.core.errors import NotFound

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
