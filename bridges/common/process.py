"""A bridge's process, from its start to its end: one side is the gateway's, the other a protocol's."""

import asyncio
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Iterable, Iterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from motion_gateway_client import AsyncGateway

from bridges.common.callers import Callers, Doors
from bridges.common.checks import Say
from bridges.common.feed import Feed
from bridges.common.listener import listening
from bridges.common.mirror import Mirror
from bridges.common.position import Position
from bridges.common.settings import BridgeFile, key_in
from bridges.common.state import Figures, State

ENDS_WITHIN_S: Final = 5.0


@dataclass(frozen=True)
class Life:
    """The service manager and the watchdog of the process."""

    tell: Callable[..., object] = lambda *_states: None
    """Tells the service manager: `READY=1`, `STOPPING=1`."""
    worked: Callable[[str], object] = lambda _side: None
    """Is called with a side whenever that works: feeds the watchdog."""


@dataclass(frozen=True)
class Host:
    """The gateway's side, as a protocol uses it."""

    name: str
    """The gateway's name in other systems."""
    gateway: AsyncGateway
    """Connection for reading, with the bridge's own key."""
    callers: Callers
    """The callers that give commands, each with a key of its own."""
    mirror: Mirror
    feed: Feed
    position: Position
    state: State
    figures: Figures
    life: Life
    data: Path
    """Folder of the files that have to survive a restart of the bridge."""

    def status(self) -> dict[str, Any]:
        """Tell how the bridge is, as `/status` does."""
        lines = {
            document["line_id"]: document["state"]
            for path, document in self.mirror.documents.items()
            if "/lines/" in path
        }
        return {
            "state": "online" if self.state.online else "offline",
            "reason": self.state.reason,
            "since": self.state.since.isoformat().replace("+00:00", "Z"),
            "gateway": self.name,
            "version": version("motion-gateway"),
            "cursor": self.position.cursor,
            "lines": lines,
        }


Protocol = Callable[[Host], Awaitable[None]]
"""The work of a protocol for as long as the bridge runs; when cancelled, it says goodbye to its side."""
F = TypeVar("F", bound=BridgeFile)


@dataclass(frozen=True)
class Kind(Generic[F]):
    """A protocol, as the command line knows it."""

    file: type[F]
    """The model of its file."""
    sides: tuple[str, str]
    """Names of both sides in `State` and for the watchdog: the gateway first."""
    protocol: Callable[[F], Protocol]
    check: Callable[[F, Say], Coroutine[Any, Any, list[str]]]
    """Tries the other side; gives what is wrong, a sentence each."""


async def run(file: F, data: Path, name: str, kind: Kind[F], life: Life = Life()) -> None:
    """Run a bridge until SIGINT or SIGTERM; its position in `data` has its name.

    :raises InUse: another bridge of this kind has `data`.
    :raises CannotListen: the address of `/metrics` cannot be had.
    :raises OSError: `data` cannot be written.
    """
    ending = asyncio.Event()
    with _signals(ending), Position(data, name) as position:
        async with _host(file, kind.sides, position, life, data) as host, _listening(file, host):
            life.tell("READY=1")
            await _until(ending, kind.protocol(file)(host), host.mirror.run(), position.keep())
            life.tell("STOPPING=1")


def _listening(file: BridgeFile, host: Host) -> AbstractAsyncContextManager[None]:
    return listening(file.bridge.listen, host.figures, host.status)


@asynccontextmanager
async def _host(
    file: BridgeFile, sides: Iterable[str], position: Position, life: Life, data: Path
) -> AsyncIterator[Host]:
    doors, figures = Doors(file.gateway), Figures()
    callers = Callers(doors, file.callers)
    state = State(sides, figures)
    async with doors.open(key_in(file.gateway.key_file)) as gateway:
        mirror = Mirror(gateway)
        feed = Feed(gateway, position, mirror, state, figures, life.worked)
        try:
            yield Host(
                file.gateway.name, gateway, callers, mirror, feed, position, state, figures, life, data
            )
        finally:
            await callers.aclose()


@contextmanager
def _signals(ending: asyncio.Event) -> Iterator[None]:
    loop = asyncio.get_running_loop()
    numbers = (signal.SIGINT, signal.SIGTERM)
    for number in numbers:
        loop.add_signal_handler(number, ending.set)
    try:
        yield
    finally:
        for number in numbers:
            loop.remove_signal_handler(number)


async def _until(ending: asyncio.Event, *works: Awaitable[None]) -> None:
    """Let all work until it is to end, or one of them fails.

    :raises Exception: what has failed.
    """
    tasks = [asyncio.ensure_future(work) for work in (ending.wait(), *works)]
    done, others = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in others:
        task.cancel()
    # Not gather(), which waits for all: a group of tasks hears one cancellation, and a library may lose it.
    ended, _ = await asyncio.wait(others, timeout=ENDS_WITHIN_S)
    for task in ended:
        if not task.cancelled():
            task.exception()  # it is known here that all is to end
    for task in done:
        task.result()
