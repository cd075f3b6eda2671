"""How much of a serial line's time the gateway uses: eight bodies read flat out over a paced pty.

Beside it stands a bare program on the same line, which knows nothing but to write a frame when the last
reply is there: what it misses of the wire's time is the machine's doing and the simulator's.
"""

import asyncio
import gc
import os
import tty
from itertools import cycle
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from benchmarks.figures import Figure, Target
from benchmarks.processes import simulated_line
from gateway.bodies import answer_or_raise
from gateway.exchange import Lane
from gateway.line import Line
from protocols.rorze.link import CR, encode
from protocols.rorze.position import GetPosition, SignedPulses
from transports import create
from transports.recorder import Recorded, Recorder
from transports.serial_port import BITS_PER_BYTE

BODIES = list(range(8))
READ = GetPosition()
SPEEDS = {9600: 0.97, 38400: 0.97, 115200: 0.95}
"""Baud, and the share of the wire's time that should be used."""
WINDOWS = 9
"""Stretches measured; their median does not mind that the machine had other work in one of them."""
WARM_UP = 20
"""Exchanges before the clock counts."""


async def run(seconds: float) -> list[Figure]:
    """Measure each speed for so many seconds, half of them with the bare program."""
    gc.freeze()  # as the gateway does
    return [figure for baud, share in SPEEDS.items() for figure in await _line_use(baud, share, seconds / 2)]


async def _line_use(baud: int, share: float, seconds: float) -> list[Figure]:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "line"
        async with simulated_line(BODIES, "--pty", str(path), "--baud", str(baud)):
            ours = _rates(await _read_flat_out(f"serial://{path}?baud={baud}", seconds))
            bare = _rates(await asyncio.to_thread(_read_barely, path, seconds))
    wire_allows = [baud / BITS_PER_BYTE / _exchange_bytes()] * WINDOWS
    name, target = f"line use at {baud} baud", Target("ratio", ">=", share)
    return [
        Figure(f"{name}: of the wire's time", "reads/s", ours, wire_allows, target),
        Figure(f"{name}: of a bare program's", "reads/s", ours, bare, target),
    ]


def _exchange_bytes() -> int:
    """Bytes of a command and its reply; the yardstick is their bit times and nothing else."""
    command = encode(BODIES[0], READ)
    reply = b">" + command.removesuffix(CR) + SignedPulses(pulses=0).written().encode() + CR
    return len(command) + len(reply)


def _rates(arrivals: list[float]) -> list[float]:
    """Exchanges per second, window by window: from the arrival of one reply to that of another."""
    size = max((len(arrivals) - WARM_UP - 1) // WINDOWS, 1)
    starts = range(WARM_UP, WARM_UP + size * WINDOWS, size)
    return [size / (arrivals[start + size] - arrivals[start]) for start in starts]


def _read_barely(path: Path, seconds: float) -> list[float]:
    """Read one body after the other, each as soon as the last has answered; when replies arrived."""
    frames = cycle([encode(body, READ) for body in BODIES])
    port = os.open(path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(port)
    arrivals: list[float] = []
    ends_at = monotonic() + seconds
    while not _enough(arrivals, ends_at):
        os.write(port, next(frames))
        while not os.read(port, 1024).endswith(CR):
            continue
        arrivals.append(monotonic())
    os.close(port)
    return arrivals


def _enough(arrivals: list[float], ends_at: float) -> bool:
    return len(arrivals) > WARM_UP + WINDOWS and arrivals[-1] >= ends_at


async def _read_flat_out(address: str, seconds: float) -> list[float]:
    """Read with one reader a body, so that a read waits whenever the line is free; when replies arrived."""
    line = Line("line", Recorded(create(address), Recorder()), BODIES)
    up = asyncio.Event()
    line.on_change = lambda _what, _facts: up.set()
    line.start()
    await up.wait()
    arrivals: list[float] = []
    ends_at = asyncio.get_running_loop().time() + seconds
    await asyncio.gather(*(_read(line, body, ends_at, arrivals) for body in BODIES))
    await line.close()
    return arrivals


async def _read(line: Line, body: int, ends_at: float, arrivals: list[float]) -> None:
    while not _enough(arrivals, ends_at):
        answered = answer_or_raise(f"{body:02X}", READ, await line.submit(body, READ, Lane.READ))
        arrivals.append(answered.at)
