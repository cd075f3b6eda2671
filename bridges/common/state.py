"""How a bridge is: what it is connected to, and what it has done, for people and for Prometheus."""

import asyncio
import logging
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from typing import Final, Literal

from prometheus_client import CollectorRegistry, Counter, Gauge, disable_created_metrics

log = logging.getLogger(__name__)

Outcome = Literal["done", "replayed", "refused", "unknown"]
OUTCOMES: Final[tuple[Outcome, ...]] = ("done", "replayed", "refused", "unknown")
"""Ends of a command. Unknown: the gateway was asked, and its answer was lost."""
PREFIX: Final = "motion_gateway_bridge"


class Figures:
    """Counts since the bridge's start, as `/metrics` tells them."""

    def __init__(self) -> None:
        disable_created_metrics()  # type: ignore[no-untyped-call]
        self.registry = CollectorRegistry()
        counted = f"{PREFIX}_commands"
        self._commands = Counter(counted, "Commands, by how they ended.", ["outcome"], registry=self.registry)
        for outcome in OUTCOMES:
            self._commands.labels(outcome)
        self.events = self.counter("events", "Events that the other side has taken, repeated ones too.")
        self.gaps = self.counter("gaps", "Gaps in the gateway's events; a snapshot followed each.")
        self.documents = self.counter("documents", "States that were told.")
        self._connected = Gauge(f"{PREFIX}_connected", "1 while connected.", ["to"], registry=self.registry)

    def counter(self, name: str, told: str) -> Counter:
        """Make a counter of one protocol's own."""
        return Counter(f"{PREFIX}_{name}", told, registry=self.registry)

    def command(self, outcome: Outcome) -> None:
        """Count a command."""
        self._commands.labels(outcome).inc()

    def connected(self, side: str, connected: bool) -> None:
        """Tell of a side whether it is connected."""
        self._connected.labels(side).set(connected)


class State:
    """Keeps for each side if it is connected, and why it is not."""

    def __init__(self, sides: Iterable[str], figures: Figures) -> None:
        self._figures = figures
        self._down: dict[str, str] = {}
        self._to_do: dict[str, None] = {}
        """Sentences: why it is not online though its sides are connected."""
        self._news = asyncio.Event()
        self.since = datetime.now(UTC)
        """Time of the last change of the state."""
        self.on_change: Callable[[], object] = lambda: None
        for side in sides:
            self._down[side] = f"not connected to the {side} yet"
            figures.connected(side, False)

    @property
    def online(self) -> bool:
        """True if all sides are connected and nothing is left to do: all published values are up to date."""
        return not self._down and not self._to_do

    @property
    def reason(self) -> str | None:
        """Why it is not online."""
        return "; ".join((*self._down.values(), *self._to_do)) or None

    def is_up(self, side: str) -> bool:
        """Tell if a side is connected."""
        return side not in self._down

    async def wait_for(self, side: str, *, connected: bool = True) -> None:
        """Wait until a side is connected, or is not."""
        while (side in self._down) is connected:
            await self._news.wait()

    def up(self, side: str) -> None:
        """A side is connected."""
        if self._down.pop(side, None) is not None:
            log.info("connected to the %s", side)
            self._changed(side, True)

    def down(self, side: str, why: str) -> None:
        """A side is not, and why: one sentence."""
        before = self._down.get(side)
        self._down[side] = why
        if before != why:
            log.warning("not connected to the %s: %s", side, why)
            self._changed(side, False)

    def begin(self, what: str) -> None:
        """Something has to be done before it is online: a sentence."""
        if what not in self._to_do:
            self._to_do[what] = None
            self._tell()

    def done(self, what: str) -> None:
        """It is done."""
        if what in self._to_do:
            del self._to_do[what]
            self._tell()

    def _changed(self, side: str, connected: bool) -> None:
        self._figures.connected(side, connected)
        self._tell()

    def _tell(self) -> None:
        self.since = datetime.now(UTC)
        news, self._news = self._news, asyncio.Event()
        news.set()
        self.on_change()
