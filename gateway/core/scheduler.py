"""The order of frames on a line: a pure decision over what waits, without clock or I/O.

Stops go first, then the questions a motor waits for, then commands, then reads, then the background. Within a
lane the targets take turns, so that one busy target starves no other; within a target the order of arrival
holds. Equal reads that wait share one exchange, and so do equal stops.
"""

from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from itertools import chain
from math import inf
from operator import methodcaller
from typing import Any, Generic

from gateway.core.exchange import IMPATIENT, QUESTIONS, STOPS, Exchange, Lane, Series, X, require_room

TURN_S = 0.5
"""Commands and reads that others have overtaken for this time have one turn, ahead of all but stops."""
LANES = tuple(Lane)
_IS_DONE = methodcaller("done")


def is_abandoned(exchange: Exchange[Any, Any, Any]) -> bool:
    """Say whether it is a question without waiters, which need not be sent."""
    return exchange.lane in QUESTIONS and all(map(_IS_DONE, exchange.waiters))


def _queue_of(exchange: Exchange[Any, Any, Any]) -> Hashable:
    """Key of the queue that it waits in: its series, or its target."""
    return exchange.target if exchange.series is None else exchange.series


class _Turns(OrderedDict[Hashable, deque[X]], Generic[X]):
    """One lane: the queue of each target, or series, that waits, in the order of their turns."""

    def exchanges(self) -> Iterator[X]:
        return chain.from_iterable(self.values())

    def add(self, exchange: X, name: Hashable) -> None:
        queue = self.setdefault(name, deque())
        if exchange.rank < 0:
            queue.insert(sum(queued.rank <= exchange.rank for queued in queue), exchange)
        else:
            queue.append(exchange)

    def add_first(self, exchange: X) -> None:
        name = _queue_of(exchange)
        self.setdefault(name, deque()).appendleft(exchange)
        self.move_to_end(name, last=False)

    def take(self, name: Hashable) -> X:
        """The first exchange of a queue, which then goes to the end."""
        queue = self[name]
        exchange = queue.popleft()
        if queue:
            self.move_to_end(name)
        else:
            del self[name]
        return exchange

    def remove(self, unwanted: Callable[[X], bool]) -> list[X]:
        removed = [exchange for exchange in self.exchanges() if unwanted(exchange)]
        for exchange in removed:
            name = _queue_of(exchange)
            self[name].remove(exchange)
            if not self[name]:
                del self[name]
        return removed


class Scheduler(Generic[X]):
    """The exchanges that wait on one line, and the next of them."""

    def __init__(self, waits_for: str = "body") -> None:
        self.waits_for = waits_for
        self.lanes: list[_Turns[X]] = [_Turns() for _ in Lane]
        """Exchanges that wait in each lane; a lane in which nothing waits is false."""
        self.stops = [self.lanes[lane] for lane in STOPS]
        """The lanes of stops."""
        self.holders: dict[int, Series | None] = {}
        """The series that the sequence lock of each target is held for, if it has one."""
        self.members: Mapping[int, Iterable[int]] = {}
        """Other targets that a frame for a target reaches."""
        self.first: deque[X] = deque()
        """Exchanges of the set-up, which go before all lanes but stops."""
        self._passed_over: dict[Lane, float] = {}
        """Times since which lanes have had no turn, where callers wait in them or a fence has gone ahead."""

    def exchanges(self, lane: Lane) -> Iterator[X]:
        """Exchanges that wait in a lane."""
        return self.lanes[lane].exchanges()

    def waiting(self, lane: Lane) -> int:
        """Number of exchanges that wait in a lane."""
        turns = self.lanes[lane]
        return sum(map(len, turns.values())) if turns else 0

    def submit(self, exchange: X) -> X:
        """Queue an exchange; an equal one that already waits takes over its waiters and is returned instead.

        :raises QueueFull: too many wait for this target already.
        """
        turns, name = self.lanes[exchange.lane], _queue_of(exchange)
        if queue := turns.get(name):
            for other in queue:
                if other.shares(exchange):
                    other.take_over(exchange)
                    return other
            if exchange.lane not in STOPS:
                require_room(len(queue), self.waits_for)
        turns.add(exchange, name)
        return exchange

    def put_back(self, exchange: X) -> None:
        """Queue an exchange again before everything else of its lane: it has had its turn already."""
        self.lanes[exchange.lane].add_first(exchange)

    def owe_turn(self, lane: Lane) -> None:
        """Let a lane have the next turn: what goes before it meanwhile could ask for another fence."""
        self._passed_over[lane] = -inf

    def reached(self, target: int) -> Iterable[int]:
        """Targets that a frame for this target reaches."""
        return (target, *self.members.get(target, ()))

    def next(self, lanes: tuple[Lane, ...], may_go: Callable[[X], bool] | None = None) -> X | None:
        """Take out the exchange whose turn it is among the lanes that may send now."""
        for lane in lanes:
            turns = self.lanes[lane]
            if turns:
                for name, queue in turns.items():
                    if (may_go is None or may_go(queue[0])) and self._is_admitted(queue[0]):
                        return turns.take(name)
        return None

    def _is_admitted(self, exchange: X) -> bool:
        """Say whether no other series holds the target; exchanges that see to stops are not asked."""
        if not self.holders or exchange.lane not in IMPATIENT:
            return True
        for target in self.reached(exchange.target):
            holder = self.holders.get(target)
            if holder is not None and holder is not exchange.series:
                return False
        return True

    def next_wanted(self, now: float, may_go: Callable[[X], bool] | None = None) -> X | None:
        """Take out the next exchange of all lanes; reads without waiters are dropped."""
        while exchange := self.next(self._in_turn(now) if self._passed_over else LANES, may_go):
            if not is_abandoned(exchange):
                if self._passed_over or exchange.lane is not Lane.READ or self.lanes[Lane.BACKGROUND]:
                    self._note_turn(exchange.lane, now)
                return exchange
        return None

    def _in_turn(self, now: float) -> tuple[Lane, ...]:
        """Lanes by priority now: one that was passed over for long goes once before all but stops."""
        for lane, since in self._passed_over.items():
            if now - since >= TURN_S:
                return (Lane.STOP, lane, *LANES)
        return LANES

    def _note_turn(self, taken: Lane, now: float) -> None:
        since = self._passed_over
        self._passed_over = {
            lane: since.get(lane, now) for lane in IMPATIENT if lane is not taken and self.lanes[lane]
        }

    def remove(self, unwanted: Callable[[X], bool]) -> list[X]:
        """Take out everything unwanted, in whatever lane it waits."""
        return [exchange for turns in self.lanes for exchange in turns.remove(unwanted)]

    def expire(self, now: float) -> float | None:
        """Settle what is too late, and give the time at which to look again, if any."""
        self.remove(lambda exchange: exchange.expire(now))
        waiting = chain.from_iterable(turns.exchanges() for turns in self.lanes)
        deadlines = chain.from_iterable(exchange.waiters.values() for exchange in waiting)
        return min((deadline for deadline in deadlines if deadline is not None), default=None)
