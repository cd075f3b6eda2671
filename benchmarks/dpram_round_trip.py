"""The time of a message and its answer through a dual-port RAM, and the cost of an idle one, beside TCP."""

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from benchmarks.figures import Figure, Target
from benchmarks.processes import announced
from transports import TransportLost, create

ROUNDS = 5
MESSAGE = b"APS -123.456,78.9,0.0,#####\r"
SETTLING_S = 0.05
"""Seconds for which a port stays awake after it was opened."""


class Answers:
    """A receiver whose next message can be waited for."""

    def __init__(self) -> None:
        self.next: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()

    def data_received(self, data: bytes) -> None:
        """Give the message to the one who waits."""
        self.next.set_result(data)

    def connection_lost(self, error: TransportLost) -> None:
        """Measure no further."""
        self.next.set_exception(error)


async def run(seconds: float) -> list[Figure]:
    """Measure round trips and idle time, dual-port RAM and TCP in turn, each for a part of the seconds."""
    share = seconds / ROUNDS / 4
    trips: list[list[float]] = []
    idle: list[list[float]] = []
    async with AsyncExitStack() as stack:
        path = Path(stack.enter_context(TemporaryDirectory())) / "ram"
        echo = ("-m", "benchmarks.fics_echo")
        dpram = await stack.enter_async_context(announced(*echo, "dpram", str(path)))
        tcp = await stack.enter_async_context(announced(*echo, "tcp"))
        for _ in range(ROUNDS):
            trips.append([await _p50_us(address, share) for address in (dpram, tcp)])
            idle.append([await _idle_percent(address, share) for address in (dpram, tcp)])
    return [
        _figure("DPRAM round trip: p50", "us", trips, Target("figure", "<=", 300)),
        _figure("DPRAM idle", "% of a core", idle, Target("figure", "<=", 2)),
    ]


def _figure(name: str, unit: str, rounds: list[list[float]], target: Target) -> Figure:
    measured, yardstick = zip(*rounds, strict=True)
    return Figure(name, unit, measured, yardstick, target)


async def _p50_us(address: str, seconds: float) -> float:
    port, answers = create(address), Answers()
    taken: list[float] = []
    await port.open(answers)
    ends_at = perf_counter() + seconds
    while not taken or perf_counter() < ends_at:
        answers.next = asyncio.get_running_loop().create_future()
        begun_at = perf_counter()
        port.write(MESSAGE)
        assert await answers.next == MESSAGE
        taken.append(perf_counter() - begun_at)
    await port.close()
    return 1e6 * median(taken)


async def _idle_percent(address: str, seconds: float) -> float:
    """Processor time that this process uses while its port is open and nothing comes."""
    port = create(address)
    await port.open(Answers())
    await asyncio.sleep(SETTLING_S)
    begun_at, used = perf_counter(), process_time()
    await asyncio.sleep(seconds)
    percent = 100 * (process_time() - used) / (perf_counter() - begun_at)
    await port.close()
    return percent
