"""Whose turn it is on a line: a pure decision over what waits, without clock or I/O.

Stops go first, then the questions a motor waits for, then commands, then reads. Within a lane the bodies take
turns, so that one busy body starves nobody; within a body the order of arrival holds. Equal reads that wait
share one exchange, and so do equal stops.
"""

from collections import OrderedDict, deque
from collections.abc import Callable, Iterator
from itertools import chain

from gateway.core.errors import QueueFull
from gateway.core.lanes import QUEUE_LIMIT, STOPS, Lane
from gateway.rorze.exchange import Exchange


class _Turns(OrderedDict[int, deque[Exchange]]):
    """One lane: the queue of each body that waits, in the order of their turns."""

    def exchanges(self) -> Iterator[Exchange]:
        return chain.from_iterable(self.values())

    def add(self, exchange: Exchange) -> None:
        self.setdefault(exchange.body, deque()).append(exchange)

    def add_first(self, exchange: Exchange) -> None:
        self.setdefault(exchange.body, deque()).appendleft(exchange)
        self.move_to_end(exchange.body, last=False)

    def take(self, may_go: Callable[[Exchange], bool] | None) -> Exchange | None:
        """The first exchange of the first body whose turn it can be; the body then goes to the end."""
        for body, queue in self.items():
            if may_go is None or may_go(queue[0]):
                exchange = queue.popleft()
                if queue:
                    self.move_to_end(body)
                else:
                    del self[body]
                return exchange
        return None

    def remove(self, unwanted: Callable[[Exchange], bool]) -> list[Exchange]:
        removed = [exchange for exchange in self.exchanges() if unwanted(exchange)]
        for exchange in removed:
            queue = self[exchange.body]
            queue.remove(exchange)
            if not queue:
                del self[exchange.body]
        return removed


class Scheduler:
    """What waits on one line, and which of it goes next."""

    def __init__(self) -> None:
        self._lanes = [_Turns() for _ in Lane]

    def __bool__(self) -> bool:
        return any(self._lanes)

    def has_stops(self) -> bool:
        """Whether any stop waits."""
        return any(self._lanes[lane] for lane in STOPS)

    def has(self, lane: Lane) -> bool:
        """Whether anything waits in a lane."""
        return bool(self._lanes[lane])

    def waiting(self, lane: Lane) -> int:
        """How many exchanges wait in a lane."""
        return sum(map(len, self._lanes[lane].values()))

    def submit(self, exchange: Exchange) -> Exchange:
        """Queue an exchange; an equal one that already waits takes over its waiters and is returned instead.

        :raises QueueFull: too many wait for this body already.
        """
        queue = self._lanes[exchange.lane].get(exchange.body, ())
        for other in queue:
            if other.shares(exchange):
                other.take_over(exchange)
                return other
        if exchange.lane not in STOPS and len(queue) >= QUEUE_LIMIT:
            raise QueueFull(
                f"{QUEUE_LIMIT} requests wait for this body already; nothing was sent.", "Try again later."
            )
        self._lanes[exchange.lane].add(exchange)
        return exchange

    def put_back(self, exchange: Exchange) -> None:
        """Queue an exchange again before everything else of its lane: it has had its turn already."""
        self._lanes[exchange.lane].add_first(exchange)

    def next(
        self, lanes: tuple[Lane, ...], may_go: Callable[[Exchange], bool] | None = None
    ) -> Exchange | None:
        """Take out the exchange whose turn it is among the lanes that may send now."""
        for lane in lanes:
            turns = self._lanes[lane]
            if turns and (exchange := turns.take(may_go)) is not None:
                return exchange
        return None

    def remove(self, unwanted: Callable[[Exchange], bool]) -> list[Exchange]:
        """Take out everything unwanted, in whatever lane it waits."""
        return [exchange for turns in self._lanes for exchange in turns.remove(unwanted)]

    def expire(self, now: float) -> float | None:
        """Tell those for whom it is too late, and give the time at which to look again, if any."""
        self.remove(lambda it: it.expire(now))
        waiting = chain.from_iterable(turns.exchanges() for turns in self._lanes)
        deadlines = chain.from_iterable(exchange.waiters.values() for exchange in waiting)
        return min((it for it in deadlines if it is not None), default=None)
