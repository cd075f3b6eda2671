"""The share of a serial line's time that is used by long work: programs, position tables, backups.

Its yardsticks are the wire itself and a bare program on the same line, which writes the same frames, each
when the last reply is there. In the plant is one body at 9600 baud, behind a paced pty, and a journal on the
disk.
"""

import asyncio
import gc
import logging
import os
import select
import tty
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic_ns

from benchmarks.figures import Figure, Target
from benchmarks.processes import simulated_line
from gateway.config import parse
from gateway.core.journal.opening import open_journal
from gateway.plant import Plant
from gateway.rorze import backup, positions
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from protocols.rorze.link import CR
from protocols.rorze.user_program.assembler import Assembled, assemble
from transports.serial_port import BITS_PER_BYTE
from transports.trace import Record

BAUD = 9600
BODY = "00"
ROUNDS = 3
INSTRUCTIONS = 2000
TARGET = Target("ratio", ">=", 0.95)
WIRE_PERCENT = 100.0
LEAST_S = 0.5
"""Seconds that each turn lasts at least, so that some frames are sent."""
QUIET_S = 0.3
"""A line that says nothing for this time has no reply of an earlier program under way."""
NO_REPLY_S = 5.0
LINE = f"""
[[lines]]
id = "line"
address = "serial://{{path}}?baud={BAUD}"
trace_entries = 100_000
bodies = [{{{{id = "{BODY}"}}}}]
"""


async def run(seconds: float) -> list[Figure]:
    """Measure for `seconds`, half of them with the yardstick; 3600 let each transfer end."""
    gc.freeze()  # as the gateway does
    logging.getLogger("gateway").setLevel(logging.ERROR)
    works: dict[str, Callable[[Plant, Body], Awaitable[object]]] = {
        f"upload of {INSTRUCTIONS} instructions": _upload,
        "download of 2048 positions": lambda _, body: positions.read(body, 0, positions.LAST_POSITION),
        "backup of a body": lambda _, body: backup.text_of(body),
    }
    with TemporaryDirectory() as folder:
        path = Path(folder) / "line"
        async with simulated_line([int(BODY, 16)], "--pty", str(path), "--baud", str(BAUD)):
            turn_s = max(seconds / len(works) / ROUNDS / 2, LEAST_S)
            return [
                figure for name, work in works.items() for figure in await _figures(name, path, work, turn_s)
            ]


async def _upload(plant: Plant, body: Body) -> None:
    program = assemble("0SS10\n" * INSTRUCTIONS)
    assert isinstance(program, Assembled)
    uploads = plant.family(Rorze).uploads
    upload = await uploads.start(body, program)
    await uploads.wait(upload, 3600.0)


async def _figures(
    name: str, path: Path, work: Callable[[Plant, Body], Awaitable[object]], turn_s: float
) -> list[Figure]:
    ours, theirs = [], []
    for _ in range(ROUNDS):
        records = exchanges(await _worked(path, work, turn_s))
        frames = [record[3] for record in records if record[2] == "tx"]
        ours.append(_percent(records))
        theirs.append(_percent(await asyncio.to_thread(_bare, path, frames)))
    return [
        Figure(f"{name}: of the wire's time", "%", ours, [WIRE_PERCENT] * ROUNDS, TARGET),
        Figure(f"{name}: of a bare program's", "%", ours, theirs, TARGET),
    ]


async def _worked(
    path: Path, work: Callable[[Plant, Body], Awaitable[object]], turn_s: float
) -> list[Record]:
    """Work for this time at most; give what went over the line meanwhile."""
    async with _plant(path) as plant:
        body, recorder = plant.family(Rorze).body(BODY), plant.history.recorders["line"]
        before = recorder.recorded
        with suppress(TimeoutError):
            await asyncio.wait_for(work(plant, body), turn_s)
        _, records = recorder.after(before)
    return records


@asynccontextmanager
async def _plant(path: Path) -> AsyncIterator[Plant]:
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        plant = Plant(parse(LINE.format(path=path), "a benchmark"), journal=open_journal(folder))
        stack.push_async_callback(plant.close)
        up = asyncio.Event()
        plant.events.listeners.append(lambda event: up.set() if event.type == "line.up" else None)
        await plant.start()
        await up.wait()
        yield plant


def exchanges(records: list[Record]) -> list[Record]:
    """Leave out a reply at the beginning and a request at the end: their other halves were not recorded."""
    written = [number for number, record in enumerate(records) if record[2] == "tx"]
    read = [number for number, record in enumerate(records) if record[2] == "rx"]
    return records[written[0] : read[-1] + 1]


def _bare(path: Path, frames: list[bytes]) -> list[Record]:
    """Write frames, each as soon as the last was answered."""
    records: list[Record] = []
    port = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(port)
        while _read(port, QUIET_S):
            pass  # a late reply to the gateway would be taken for that to the first frame, and so on
        for frame in frames:
            records.append((0, monotonic_ns(), "tx", frame, None, None))
            os.write(port, frame)
            reply = b""
            while not reply.endswith(CR):
                part = _read(port, NO_REPLY_S)
                if not part:
                    raise RuntimeError(f"{frame!r} was not answered within {NO_REPLY_S:g} s.")
                reply += part
            records.append((0, monotonic_ns(), "rx", reply, None, None))
    finally:
        os.close(port)
    return records


def _read(port: int, within_s: float) -> bytes:
    readable, _, _ = select.select([port], [], [], within_s)
    return os.read(port, 1024) if readable else b""


def _percent(records: list[Record]) -> float:
    """The share of the time from the first frame to the last reply in which bytes went over the line."""
    took_s = (records[-1][1] - records[0][1]) / 1e9
    return 100 * sum(len(record[3]) for record in records) * BITS_PER_BYTE / BAUD / took_s
