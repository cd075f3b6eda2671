"""A fixed script of requests puts the same bytes on the wire, in the same order, as when it was recorded.

`python -m tests.recordings.test_recordings` records anew; the difference shows what changes on the wire.
"""

import asyncio
import re
from collections.abc import Callable, Coroutine, Sequence
from pathlib import Path
from typing import Any

import httpx2
import pytest
from httpx2 import ASGITransport, AsyncClient

from api.app import create_app
from gateway.plant import Plant
from simulator.faults import Direction, Fault, Switch
from tests.api.stand import HOST
from tests.fics_plants import fics_rig
from tests.plants import rig
from tests.recordings.scripts import BODIES, ROBOT, Step
from tests.simulated_line import SimulatedCable
from tests.virtual_time import run_virtual

FOLDER = Path(__file__).parent
SEED = 11

FAULTS = (
    Switch(Fault.LOST, Direction.REPLIES, 0.02),
    Switch(Fault.LOST, Direction.REQUESTS, 0.01),
    Switch(Fault.LATE, Direction.REPLIES, 0.02, delay_s=0.3),
    Switch(Fault.DOUBLED, Direction.REPLIES, 0.02, delay_s=0.05),
)

MARK = re.compile("GW-[0-9a-f]{8}")
"""The text that tells whether a body has kept its power: it is made up anew each time."""

Recording = list[str]


async def record_bodies(faults: Sequence[Switch] = ()) -> Recording:
    """Play the script for bodies on a line at 9600 baud."""
    async with rig(baud=9600, groups={}, seed=SEED) as running:
        for fault in faults:
            running.machine.faults.set(fault)
        return await _play(running.plant, running.wire, BODIES)


async def record_robot(mode: int, faults: Sequence[Switch] = ()) -> Recording:
    """Play the script for a robot of two units at 19200 baud."""
    unseen = "move_samples_per_s = 0"
    async with fics_rig(units=2, mode=mode, baud=19200, seed=SEED, options=unseen) as running:
        for fault in faults:
            running.machine.faults.set(fault)
        return await _play(running.plant, running.cable, ROBOT)


async def _play(plant: Plant, cable: SimulatedCable, script: Sequence[Step]) -> Recording:
    """Send the requests on time; give each with its status, between the frames it lies between."""
    recording: Recording = []
    written = 0

    def note_frames() -> None:
        nonlocal written
        recording.extend(
            MARK.sub("GW-........", ascii(frame.decode("ascii"))[1:-1]) for frame in cable.written[written:]
        )
        written = len(cable.written)

    app = create_app(plant)
    transport = ASGITransport(app, raise_app_exceptions=False)
    async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
        requests: list[tuple[Step, asyncio.Task[httpx2.Response]]] = []
        for step in script:
            note_frames()
            recording.append(f"-- {step.method} {step.path}")
            asked = asyncio.create_task(client.request(step.method, step.path, json=step.content))
            requests.append((step, asked))
            await asyncio.sleep(step.then_s)
        await asyncio.wait([asked for _, asked in requests], timeout=60)
        note_frames()
        recording.append("-- answers")
        recording += [f"{asked.result().status_code} {step.method} {step.path}" for step, asked in requests]
    return recording


RECORDINGS: dict[str, Callable[[], Coroutine[Any, Any, Recording]]] = {
    "bodies": record_bodies,
    "bodies-on-a-bad-wire": lambda: record_bodies(FAULTS),
    "robot-in-ver-3": lambda: record_robot(3),
    "robot-in-ver-3-on-a-bad-wire": lambda: record_robot(3, FAULTS),
    "robot-in-ver-2": lambda: record_robot(2),
    "robot-in-ver-2-on-a-bad-wire": lambda: record_robot(2, FAULTS),
}


@pytest.mark.parametrize("name", RECORDINGS)
def test_the_wire_carries_what_was_recorded(name: str) -> None:
    played = run_virtual(RECORDINGS[name]())

    assert played == _file(name).read_text("ascii").splitlines()


@pytest.mark.parametrize("name", ["bodies", "robot-in-ver-3", "robot-in-ver-2"])
def test_on_a_good_wire_the_script_shows_every_kind_of_answer(name: str) -> None:
    answers = _file(name).read_text("ascii").partition("-- answers\n")[2].splitlines()

    statuses = {answer[:3] for answer in answers}

    assert {"200", "202", "409"} <= statuses
    assert not any(status.startswith("5") for status in statuses)


def _file(name: str) -> Path:
    return FOLDER / f"{name}.txt"


def _record() -> None:
    for name, play in RECORDINGS.items():
        _file(name).write_text("\n".join([*run_virtual(play()), ""]), "ascii")


if __name__ == "__main__":
    _record()
