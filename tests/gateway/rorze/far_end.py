"""A port whose other end is a script: what comes back, when, and what was written, to the byte."""

import asyncio
import functools
import random
import re
from collections import defaultdict, deque
from collections.abc import AsyncIterator, Callable, Coroutine, Iterable
from contextlib import asynccontextmanager
from typing import Any, ParamSpec

from gateway.rorze.line import Line, LineState
from protocols.rorze.link import POISON
from protocols.rorze.row import LINK_MASTER
from tests.virtual_time import run_virtual
from transports.base import Receiver, Transport, TransportLost, TransportUnavailable

P = ParamSpec("P")

Said = str | bytes
"""A frame of the far end; CR is added to text."""
LATENCY_S = 0.010
"""Seconds from the end of a frame to its reply, where the script says nothing else."""
_FENCE = re.compile(r"&(\w\w)3NDP\[(\d+)\]")
_QUERIES = {"6PD": "+000000000", "9CD": "H00", "9MD": "H00", "0BD": "2", "XID": "02,03"}


class FarEnd(Transport):
    """Answers every command at once and well, unless it was told otherwise; first in, first out."""

    def __init__(self, baud: int | None = None) -> None:
        super().__init__("scripted://")
        self.written: list[tuple[float, str]] = []
        """Frames without CR, with the times at which they were written."""
        self.silent: set[int] = set()
        """Bodies that say nothing."""
        self.plugged_in = True
        self.stuck = False
        """True while the port holds back what is written to it."""
        self.openings: list[float] = []
        """Times of attempts to open the port."""
        self.byte_time_s = 10 / baud if baud else 0.0
        self._scripts: dict[str, deque[tuple[tuple[float, Said], ...]]] = defaultdict(deque)
        self._receiver: Receiver | None = None
        self._last_reply_at = 0.0
        self._held_back = 0

    # what a test says

    def once(self, frame: str, *replies: tuple[float, Said]) -> None:
        """Answer the next such frame (`fence 02` for the next fence) with these, each after its seconds."""
        self._scripts[frame].append(replies)

    def say(self, said: Said, after_s: float = 0.0) -> None:
        """Say something unasked, out of turn."""
        self._deliver_at(asyncio.get_running_loop().time() + after_s, said)

    def unplug(self) -> None:
        """Pull the cable."""
        self.plugged_in = False
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            receiver.connection_lost(TransportLost("the cable was pulled"))

    # what a test sees

    @property
    def frames(self) -> list[str]:
        """The frames in order, fences without their number."""
        return [self._named(frame) for _, frame in self.written]

    def times_of(self, frame: str) -> list[float]:
        """When such a frame was written."""
        return [at for at, written in self.written if self._named(written) == frame]

    # Transport

    async def open(self, receiver: Receiver) -> None:
        self.openings.append(asyncio.get_running_loop().time())
        if not self.plugged_in:
            raise TransportUnavailable("the cable is not plugged in")
        self._receiver = receiver

    def write(self, data: bytes) -> None:
        if self._receiver is None:
            raise TransportLost("the cable is not plugged in")
        now = asyncio.get_running_loop().time()
        frame = data.removesuffix(b"\r").decode("ascii")
        self.written.append((now, frame))
        if self.stuck:
            self._held_back += len(data)
            return
        heard_at = now + len(data) * self.byte_time_s
        for delay_s, said in self._replies(frame):
            # Equal times would leave the order to the loop's heap.
            self._last_reply_at = max(heard_at + delay_s, self._last_reply_at + 1e-6)
            self._deliver_at(self._last_reply_at, said)

    def unsent(self) -> int:
        return self._held_back if self.stuck else 0

    async def close(self) -> None:
        self._receiver = None
        self._held_back = 0

    def _named(self, frame: str) -> str:
        fence = _FENCE.fullmatch(frame)
        return f"fence {fence[1]}" if fence else frame

    def _replies(self, frame: str) -> Iterable[tuple[float, Said]]:
        if frame.encode() + b"\r" == POISON or int(frame[1:3], 16) in self.silent:
            return ()
        script = self._scripts[self._named(frame)]
        return script.popleft() if script else ((LATENCY_S, healthy(frame)),)

    def _deliver_at(self, at: float, said: Said) -> None:
        data = said if isinstance(said, bytes) else said.encode("ascii") + b"\r"
        receiver = self._receiver

        def deliver() -> None:
            if receiver is not None and receiver is self._receiver:
                receiver.data_received(data)

        asyncio.get_running_loop().call_at(at + len(data) * self.byte_time_s, deliver)


def healthy(frame: str) -> str:
    """The reply of a controller without a fault."""
    fence = _FENCE.fullmatch(frame)
    if fence:
        return f">&{fence[1]}3NDP[{int(fence[2]):04d}],+000000000"
    return f">{frame[:6]}{_QUERIES.get(frame[3:6], '')}"


@asynccontextmanager
async def running_line(
    far_end: FarEnd,
    bodies: Iterable[int] = (2, 3),
    groups: dict[int, list[int]] | None = None,
    **options: Any,
) -> AsyncIterator[Line]:
    """A line that is set up and ready; the far end's notes begin after that."""
    line = Line("line1", far_end, bodies, groups, rng=random.Random(1), **options)
    line.start()
    await until(lambda: line.state is LineState.READY)
    far_end.written.clear()
    line.counters.clear()
    yield line
    await line.close()


async def until(condition: Callable[[], object], within_s: float = 60.0) -> None:
    """Let virtual time pass until something is so."""
    async with asyncio.timeout(within_s):
        while not condition():  # noqa: ASYNC110  # a condition has no event, and virtual time costs nothing
            await asyncio.sleep(0.001)


def virtual(story: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Make a test of a coroutine, run in virtual time."""

    @functools.wraps(story)
    def test(*args: P.args, **kwargs: P.kwargs) -> None:
        run_virtual(story(*args, **kwargs))

    return test


def addressed_to(frames: Iterable[str], body: int) -> list[str]:
    """The frames for one body, or for the link master."""
    return [frame for frame in frames if frame[1:3] == f"{body:02X}"]


SET_UP_FRAMES = (POISON[:-1].decode(), f"&{LINK_MASTER:02X}XID", f"&{LINK_MASTER:02X}XRSM1")
