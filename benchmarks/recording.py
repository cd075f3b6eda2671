"""The time to record ten minutes of eight lines, and the longest hold of the event loop by it."""

import asyncio
import sys
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from time import perf_counter, process_time, time_ns

from benchmarks.figures import Figure, Target
from gateway.access.principal import EVERYBODY, asking
from gateway.config import Config
from gateway.core.aside import SWITCH_S
from gateway.plant import Plant
from transports.recorder import Recorder
from transports.trace import TraceKind

LINES, RECORDS_A_S, MINUTES = 8, 100, 10
TAKES_S = 5.0
BEAT_S = 0.001
LONGEST_MS = 5.0
STEP_NS = 1_000_000_000 // RECORDS_A_S


async def run(_seconds: float) -> list[Figure]:
    """Fill the memory of eight lines; take it; the yardstick is the loop at rest for as long."""
    sys.setswitchinterval(SWITCH_S)
    tables = [
        {"id": f"line{number}", "address": f"tcp://127.0.0.1:{number}", "bodies": [{"id": "3F"}]}
        for number in range(1, LINES + 1)
    ]
    plant = Plant(Config.model_validate({"access": {"mode": "open"}, "lines": tables}))
    for recorder in plant.history.recorders.values():
        fill(recorder)
    with TemporaryDirectory() as folder, asking(EVERYBODY):
        plant.works.recordings.keep_in(Path(folder))
        at, used = perf_counter(), process_time()
        taking = asyncio.create_task(_taken(plant))
        held_ms = await _holds_ms(taking)
        took_s, cost_s = perf_counter() - at, process_time() - used
        rest_ms = await _holds_ms(asyncio.create_task(asyncio.sleep(took_s)))
    await plant.close()
    return [
        Figure("ten minutes of 8 lines", "s", [took_s], [cost_s], Target("figure", "<=", TAKES_S)),
        Figure("the loop meanwhile, p99", "ms", [held_ms], [rest_ms], Target("figure", "<=", LONGEST_MS)),
    ]


async def _taken(plant: Plant) -> None:
    record = plant.works.recordings.start(None, MINUTES * 60, 0)
    await plant.works.recordings.wait(record, 600)
    assert record.status == "finished", record.error
    assert record.bytes is not None


async def _holds_ms(work: "asyncio.Task[None]") -> float:
    """Delay of a timer while work is done, in ms: the worst but one in a hundred."""
    late: list[float] = []
    while not work.done():
        at = perf_counter()
        await asyncio.sleep(BEAT_S)
        late.append(1000 * (perf_counter() - at - BEAT_S))
    await work
    return sorted(late)[-1 - len(late) // 100]


def fill(recorder: Recorder) -> None:
    """Give a recorder ten minutes of questions and answers, half of them with a request."""
    dice = Random(1)
    count = MINUTES * 60 * RECORDS_A_S
    now_ns = time_ns()
    _, mono_ns = recorder.clocks()
    for number in range(count):
        ago = (count - number) * STEP_NS
        recorder.clocks = lambda ago=ago: (now_ns - ago, mono_ns - ago)  # type: ignore[misc]
        kind: TraceKind = "rx" if number % 2 else "tx"
        data = b">&3F6PD+%09d\r" % dice.randrange(10**9) if number % 2 else b"&3F6PD\r"
        asked = number % 4 == 0
        request = ("http 10.0.0.7", dice.randbytes(16).hex())
        recorder.sender = request if asked else ("gateway: poll", None)
        recorder.record(kind, data)
