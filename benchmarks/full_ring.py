"""The gateway after a day, its event ring full: `python -m benchmarks.full_ring PORT CONFIG`."""

import asyncio
import sys
from pathlib import Path
from unittest.mock import patch

import uvloop

from app.server import serve
from gateway.config import load
from gateway.core.events import RETAINED_EVENTS, EventHub

BATCH = 500
PAUSE_S = 0.002


class FullHub(EventHub):
    """An event hub that fills itself as soon as the gateway runs."""

    def __init__(self) -> None:
        super().__init__()
        self._filling = asyncio.get_running_loop().create_task(self._fill())

    async def _fill(self) -> None:
        await asyncio.sleep(1.0)  # what the gateway has made by then is frozen, and events never are
        while self.last < RETAINED_EVENTS:
            for number in range(BATCH):
                self.publish("body.move.succeeded", f"/bodies/line.{number % 120:02X}", a_move(number))
            await asyncio.sleep(PAUSE_S)


def a_move(number: int) -> dict[str, object]:
    """The data of a move's event, as large as that of a true one."""
    place = {"value": number, "unit": "pulse"}
    times = dict.fromkeys(("queued_at", "sent_at", "started_at", "ended_at"), "2026-01-01T00:00:00.000000Z")
    evidence = [{"kind": "status", "bits": number}, {"kind": "position", "pulses": number}]
    return {"id": f"{number:032x}", "frame": "&3F1+M500\\r", "position": place, "evidence": evidence, **times}


def main(config: Path, hub: type[FullHub] = FullHub) -> None:
    """Serve until the process is ended."""
    with patch("gateway.plant.EventHub", hub):
        uvloop.run(serve(load(config), config.with_suffix(".data")))


if __name__ == "__main__":
    main(Path(sys.argv[2]))
