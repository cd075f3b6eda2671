"""The time from the client's socket to the first byte on an idle line."""

import asyncio
import os
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from itertools import cycle
from pathlib import Path
from socket import socket
from statistics import median
from tempfile import TemporaryDirectory
from time import monotonic

from benchmarks.figures import Figure, Target
from benchmarks.gateways import write_config
from benchmarks.http_client import ask, connect, get, post
from benchmarks.processes import free_port, gateway, module, set_apart
from protocols.rorze.row import LAST_BODY
from simulator.ports import Machine, serve_tcp
from simulator.rorze.line import build_line

BODIES = list(range(LAST_BODY + 1))
ROUNDS = 5
PAUSE_S = 0.001
"""Seconds between two requests, so that the line is idle."""
READS_BETWEEN = 20
"""Reads between two commands.

When the turn of a body comes again, no copy of its last reply can come any more, so no fence goes first; and
the computer has not fallen asleep.
"""
SYNCS = 21
PAGE_BYTES = 4096
TARGET = Target("figure", "<=", 1.0)
READS = [get(f"/bodies/{body:02X}/position") for body in BODIES]
_COMMANDS = [post(f"/bodies/{body:02X}/commands/set-homing-retries", {"retries": 1}) for body in BODIES]
COMMANDS = [request for command in _COMMANDS for request in (*READS[:READS_BETWEEN], command)]


class Overheard:
    """A machine that notes when a frame of one kind begins to arrive, on the clock the client uses."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self.heard: dict[bytes, float] = {}

    def receive(self, data: bytes, now: float) -> None:
        """Note the time, and let the machine work."""
        self.heard[data[3:6]] = monotonic()
        self._machine.receive(data, now)

    def take_output(self, now: float) -> bytes:
        """The machine's."""
        return self._machine.take_output(now)

    def wake_at(self) -> float | None:
        """The machine's."""
        return self._machine.wake_at()


class Echo:
    """A machine that says what it hears: the far end of the bare application."""

    def __init__(self) -> None:
        self._said = b""

    def receive(self, data: bytes, _now: float) -> None:
        """Take bytes."""
        self._said += data

    def take_output(self, _now: float) -> bytes:
        """Give them back."""
        said, self._said = self._said, b""
        return said

    def wake_at(self) -> float | None:
        """Nothing happens without a request."""
        return None


async def run(seconds: float) -> list[Figure]:
    """Measure reads and commands, gateway and yardstick in turn, each for a part of the seconds."""
    share = seconds / ROUNDS / 4
    reads: list[list[float]] = []
    commands: list[list[float]] = []
    syncs: list[float] = []
    async with _stands() as stands:
        turns = [(measure, cycle(READS), cycle(COMMANDS)) for measure in stands]
        for measure, read, _ in turns:
            await measure(read, b"GET", b"6PD", share)  # not counted: caches fill
        for _ in range(ROUNDS):
            reads.append([await measure(read, b"GET", b"6PD", share) for measure, read, _ in turns])
            commands.append([await measure(command, b"POST", b"0RS", share) for measure, _, command in turns])
            syncs.append(await asyncio.to_thread(_sync_ms))
    beyond = [ours - sync for (ours, _), sync in zip(commands, syncs, strict=True)]
    return [
        _figure("GET to first byte: p50", reads),
        _figure("POST to first byte: p50", commands),
        Figure("POST to first byte, beyond a bare fsync: p50", "ms", beyond, syncs, TARGET),
    ]


def _sync_ms() -> float:
    """Median time of the disk, in ms, to write and sync as much as an intent, with no other writer."""
    taken: list[float] = []
    with TemporaryDirectory() as folder, Path(folder, "bare").open("wb", buffering=0) as file:
        for _ in range(SYNCS):
            begun_at = monotonic()
            file.write(bytes(PAGE_BYTES))
            os.fsync(file.fileno())
            taken.append(monotonic() - begun_at)
    return 1000 * median(taken)


def _figure(name: str, rounds: list[list[float]]) -> Figure:
    measured, yardstick = zip(*rounds, strict=True)
    return Figure(name, "ms", measured, yardstick, TARGET)


Measure = Callable[[Iterator[bytes], bytes, bytes, float], Coroutine[None, None, float]]
"""Median milliseconds to the first byte of frames with a code, for requests of some seconds; those with a
method count."""


@asynccontextmanager
async def _stands() -> AsyncIterator[tuple[Measure, Measure]]:
    """Run the gateway and the bare application, both with far ends in this process."""
    line = Overheard(build_line(BODIES, monotonic()))
    echo = Overheard(Echo())
    web, bare = free_port(), free_port()
    async with AsyncExitStack() as stack:
        line_port, echo_port = [await _listen(stack, machine) for machine in (line, echo)]
        folder = Path(stack.enter_context(TemporaryDirectory()))
        apart = stack.enter_context(set_apart())
        start = stack.enter_async_context
        await start(gateway(write_config(folder, web, line_port, BODIES), web, apart))
        await start(module("benchmarks.bare_app", bare, str(echo_port), processors=apart))
        yield partial(_p50_ms, web, line), partial(_p50_ms, bare, echo)


async def _listen(stack: AsyncExitStack, machine: Machine) -> int:
    port = await serve_tcp(machine, "127.0.0.1", 0)
    stack.push_async_callback(port.aclose)
    return int(port.address.rpartition(":")[2])


async def _p50_ms(
    port: int, far_end: Overheard, requests: Iterator[bytes], method: bytes, code: bytes, seconds: float
) -> float:
    taken: list[float] = []
    with connect(port) as sock:
        ends_at = monotonic() + seconds
        for request in requests:
            await asyncio.sleep(PAUSE_S)
            sent_at = await asyncio.to_thread(_ask, sock, request)
            if request.startswith(method):
                taken.append(far_end.heard[code] - sent_at)
            if taken and monotonic() >= ends_at:
                break
    return 1000 * median(taken)


def _ask(sock: socket, request: bytes) -> float:
    """Ask, and tell when the request was about to be written."""
    sent_at = monotonic()
    ask(sock, request)
    return sent_at
