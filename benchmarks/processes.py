"""The programs that a benchmark measures: each in a process of its own, ended with its block."""

import asyncio
import os
import socket
import sys
import time
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from pathlib import Path
from random import SystemRandom

START_S = 100.0
"""A program that has not started by then on a busy machine never will."""
END_S = 60.0
PORTS = range(20_000, 32_000)
"""Ports from which the system gives none by itself: a program that restarts finds its own one free."""

_SCHEDULED = 2
"""The kind of clock, in its number, that counts what the scheduler gave a process (Linux)."""

MOTION_GATEWAY = ("-c", "from app.cli import main; main()")
"""The command line as the installed script runs it, also where it is not installed."""


@contextmanager
def set_apart() -> Iterator[set[int]]:
    """Keep a processor free of this process and of those it starts; give it, for what is measured.

    Where controllers and clients are other machines they do not take turns with the server on its processor
    either. With a single processor there is nothing to set apart.
    """
    everything = os.sched_getaffinity(0)
    apart = {max(everything)}
    os.sched_setaffinity(0, everything - apart or apart)
    try:
        yield apart
    finally:
        os.sched_setaffinity(0, everything)


@asynccontextmanager
async def simulated_line(bodies: list[int], *place: str) -> AsyncIterator[None]:
    """Run a simulated RC-400; `place` are the options that say where, such as `--pty PATH --baud 9600`."""
    numbers = ",".join(f"{body:02X}" for body in bodies)
    async with announced(*MOTION_GATEWAY, "simulate", "rc400", "--bodies", numbers, *place):
        yield


@asynccontextmanager
async def announced(*program: str) -> AsyncIterator[str]:
    """Run a program that says a line when it has started; give that line."""
    async with running(sys.executable, *program) as process:
        assert process.stdout is not None
        async with asyncio.timeout(START_S):
            said = await process.stdout.readline()
        if not said:
            raise RuntimeError(f"{' '.join(program)} did not start; its error stands above.")
        yield said.decode().rstrip()


@asynccontextmanager
async def gateway(config: Path, port: int, processors: set[int]) -> AsyncIterator[Process]:
    """Run the gateway, which accepts connections at `port`, on some processors."""
    data = str(config.with_suffix(".data"))
    program = [*MOTION_GATEWAY, "serve", "--config", str(config), "--data", data]
    async with serving(program, port, processors) as process:
        yield process


@asynccontextmanager
async def module(
    name: str, port: int, *arguments: str, processors: set[int] | None = None
) -> AsyncIterator[Process]:
    """Run a module that accepts connections at `port`, on some processors if they are given."""
    async with serving(["-m", name, str(port), *arguments], port, processors) as process:
        yield process


@asynccontextmanager
async def serving(program: list[str], port: int, processors: set[int] | None) -> AsyncIterator[Process]:
    """Run a program that accepts connections at `port`, on some processors if they are given."""
    async with running(sys.executable, *program) as process:
        if processors:
            os.sched_setaffinity(process.pid, processors)
        async with asyncio.timeout(START_S):
            while not await accepts(port):
                if process.returncode is not None:
                    raise RuntimeError(f"{program[-1]} did not start; its error stands above.")
                await asyncio.sleep(0.05)
        yield process


@asynccontextmanager
async def running(*program: str, nice: int = 0) -> AsyncIterator[Process]:
    """Run a program, as nice as told, and end it with the block."""
    process = await asyncio.create_subprocess_exec(*program, stdout=PIPE)
    if nice:
        os.setpriority(os.PRIO_PROCESS, process.pid, nice)
    try:
        yield process
    finally:
        if process.returncode is None:
            process.terminate()
        try:
            async with asyncio.timeout(END_S):
                await process.wait()
        except TimeoutError:
            process.kill()
            await process.wait()


async def accepts(port: int) -> bool:
    """Say whether a program listens at a port of this machine."""
    try:
        _, writer = await asyncio.open_connection("127.0.0.1", port)
    except OSError:
        return False
    writer.close()
    return True


def cpu_s(process: Process) -> float:
    """Processor time that a program has taken until now, with all its threads."""
    return time.clock_gettime((~process.pid << 3) | _SCHEDULED)


def resident_mib(process: int) -> float:
    """Memory that a process has now."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def free_port() -> int:
    """Find a TCP port that no program uses now, nor soon."""
    while True:
        port = SystemRandom().choice(PORTS)
        with socket.socket() as listener, suppress(OSError):
            listener.bind(("127.0.0.1", port))
            return port
