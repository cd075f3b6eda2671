"""A gateway with the SCARA robot of RC-420 manual 13.10.7, and clients in front of it."""

import asyncio
from collections.abc import Callable, Mapping
from typing import Final

from simulator.demo import GEOMETRY
from simulator.demo import SCARA as START
from tests.api.stand import Stand, Story, build_stand
from tests.virtual_time import run_virtual

BODIES: Final = [{"id": "02"}, {"id": "03"}, {"id": "04"}, {"id": "3F"}]
SCARA: Final[Mapping[str, object]] = {
    "id": "wafer",
    "line": "arm",
    "group": "8A",
    "members": ["02", "03", "04"],
    "arm_um": 215_000,
    "finger_um": 330_000,
    "pulses_per_turn": [121_791.045, 60_000.0, 100_000.0],
    "name": "wafers",
}


def on_cell(story: Story) -> Callable[[], None]:
    """Turn a story about the robot into a test that runs it in virtual time."""

    def test() -> None:
        async def run() -> None:
            async with build_stand({"arm": BODIES}, {}, scaras=[SCARA]) as stand:
                await _teach(stand)
                await story(stand)

        run_virtual(run())

    return test


async def _teach(stand: Stand) -> None:
    """Its controllers know its mechanics, its speeds and a path, and stand where the manual has them."""
    now = asyncio.get_running_loop().time()
    for number, position in enumerate(START.values()):
        axis = stand.port.machine.axes[2 + number]
        for text in (f"HCS{number}", *GEOMETRY):
            assert axis.execute(text, now).payload == "", text
        await stand.send(f"0{2 + number}", "set-position", position=position)
