"""Asks one line for the values that clients watch, in a share of its time that is free."""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from math import inf
from typing import ClassVar, Self

from gateway.core.errors import GatewayError
from gateway.core.family import AnyLine
from gateway.core.live import Live
from gateway.core.origin import LIVE, ORIGIN
from gateway.core.times import happens

REST_S = 1.0
"""Seconds until an unanswered question is asked again."""
IO_HZ = 2.0
"""Inputs and outputs are asked for no more often a second: positions are not to wait for them."""
CLOCK_S = 0.001
"""Seconds by which a timer may be early."""


class LiveSource(ABC):
    """One kind of values of one target."""

    type: ClassVar[str]
    most_hz: ClassVar[float] = inf
    """Highest rate at which it is asked, in Hz, however often clients want it."""
    subject: str

    @abstractmethod
    async def read(self, due: Sequence["LiveSource"]) -> Sequence["LiveSource"]:
        """Ask for it and put the answer; give the answers to all that is `due`.

        :raises GatewayError: it was not told.
        """

    @property
    def own_hz(self) -> float:
        """Rate in Hz at which it is asked without a watcher, for work that is under way."""
        return 0.0

    def among(self, due: Sequence["LiveSource"]) -> list[Self]:
        """The due sources of this kind."""
        return [source for source in due if isinstance(source, type(self))]


class Sampler:
    """Asks for what is due first, one question after the other, and for nothing without a watcher."""

    def __init__(self, line: AnyLine, live: Live, sources: Iterable[LiveSource], share: float) -> None:
        self._line, self._live, self._share = line, live, share
        self._sources = list(sources)
        self._due: dict[LiveSource, float] = {}
        """Time at which each watched source is to be asked."""
        self._free_at = 0.0
        """Time before which more than its share of the line would be taken."""

    async def run(self) -> None:
        """Ask until cancelled."""
        ORIGIN.set(LIVE)  # of this task alone
        while True:
            demand = self._live.demand
            now = _now()
            self._due = {source: self._due.get(source, now) for source in self._sources if self._hz(source)}
            while not demand.is_set():
                await self._next(demand)

    async def _next(self, demand: asyncio.Event) -> None:
        if not self._due:
            await demand.wait()
            return
        source, now = min(self._due, key=self._due.__getitem__), _now()
        wait_s = max(self._due[source], self._free_at) - now
        if wait_s > CLOCK_S:
            await happens(demand, wait_s)
            return
        before_s = self._line.load.busy_s[LIVE.work]
        told = await self._read(source, [source for source, at in self._due.items() if at <= now + CLOCK_S])
        for answered in told:
            if hz := self._hz(answered):
                self._due[answered] = max(self._due[answered] + 1 / hz, now)
            else:  # nobody wants it any more, and nobody has said so
                self._due.pop(answered, None)
        if source not in told:
            self._due[source] = _now() + REST_S
        took_s = self._line.load.busy_s[LIVE.work] - before_s
        self._free_at = _now() + took_s * (1 / self._share - 1)

    async def _read(self, source: LiveSource, due: list[LiveSource]) -> Sequence[LiveSource]:
        try:
            return await source.read(due)
        except GatewayError:
            return ()

    def _hz(self, source: LiveSource) -> float:
        rate = self._live.rate(source.type, source.subject)
        return max(min(rate, source.most_hz), source.own_hz)


def _now() -> float:
    return asyncio.get_running_loop().time()
