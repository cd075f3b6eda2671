"""The share of a serial line's time that the gateway uses: eight bodies read flat out over a paced pty.

Its yardstick is the wire's time. At a speed at which machine and simulator take a share of that themselves
it is a bare program on the same line, which only writes a frame when the last reply is there.
"""

import asyncio
import gc
import logging
import os
import tty
from itertools import cycle
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from benchmarks.figures import Figure, Target
from benchmarks.processes import simulated_line
from gateway.core.exchange import Lane
from gateway.rorze.bodies import answer_or_raise
from gateway.rorze.line import Line
from protocols.rorze.link import CR, encode
from protocols.rorze.position import GetPosition, SignedPulses
from transports import create
from transports.recorder import Recorded, Recorder
from transports.serial_port import BITS_PER_BYTE

BODIES = list(range(8))
READ = GetPosition()
SPEEDS = (9600, 38400, 115200)
BARE_FROM = 115200
"""Baud rate from which on the bare program is the yardstick: it reaches 0.90 to 0.96 of the wire."""
TARGET = Target("ratio", ">=", 0.97)
ROUNDS = 5
"""Turns of gateway and yardstick; their median does not mind that the machine had other work in one."""
WARM_UP = 10
"""Exchanges before the clock counts."""


async def run(seconds: float) -> list[Figure]:
    """Measure each speed for `seconds`, half of them with the yardstick."""
    gc.freeze()  # as the gateway does
    logging.getLogger("gateway").setLevel(logging.ERROR)  # a line that a turn has closed is no news
    return [await _line_use(baud, seconds / ROUNDS / 2) for baud in SPEEDS]


async def _line_use(baud: int, turn_s: float) -> Figure:
    whose, yardstick = ("a bare program's", _bare) if baud >= BARE_FROM else ("the wire's time", _wire)
    ours, theirs = [], []
    with TemporaryDirectory() as folder:
        path = Path(folder) / "line"
        async with simulated_line(BODIES, "--pty", str(path), "--baud", str(baud)):
            for _ in range(ROUNDS):
                ours.append(_rate(await _read_flat_out(f"serial://{path}?baud={baud}", turn_s)))
                theirs.append(await yardstick(path, baud, turn_s))
    return Figure(f"line use at {baud} baud: of {whose}", "reads/s", ours, theirs, TARGET)


async def _wire(_path: Path, baud: int, _seconds: float) -> float:
    return baud / BITS_PER_BYTE / exchange_bytes()


async def _bare(path: Path, _baud: int, seconds: float) -> float:
    return _rate(await asyncio.to_thread(_read_barely, path, seconds))


def exchange_bytes() -> int:
    """Bytes of a command and its reply; the yardstick is their bit times and nothing else."""
    command = encode(BODIES[0], READ)
    reply = b">" + command.removesuffix(CR) + SignedPulses(pulses=0).written().encode() + CR
    return len(command) + len(reply)


def _rate(arrivals: list[float]) -> float:
    """Exchanges per second, from the arrival of one reply to that of another."""
    return (len(arrivals) - WARM_UP - 1) / (arrivals[-1] - arrivals[WARM_UP])


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
    return len(arrivals) > WARM_UP + 1 and arrivals[-1] >= ends_at


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
