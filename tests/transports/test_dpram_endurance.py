"""A dual-port RAM between two processes that both dawdle: a hundred thousand messages."""

import asyncio
import sys
from pathlib import Path
from random import Random

import anyio.lowlevel
import pytest
import uvloop

from tests.transports.dpram_fics import FROM_FICS, TO_FICS, dawdle, message
from transports import Transport, TransportLost, create

pytestmark = pytest.mark.prove

ROOT = Path(__file__).parents[2]
COUNT = 50_000
"""Messages each way."""


class Checker:
    """A receiver that knows what must come next, and is at times slow."""

    def __init__(self) -> None:
        self.heard_all: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._heard = 0
        self._rng = Random(8)

    def data_received(self, data: bytes) -> None:
        if data != message(FROM_FICS, self._heard):
            self._fail(AssertionError(f"message {self._heard} came as {data!r}"))
        self._heard += 1
        if self._heard == COUNT:
            self.heard_all.set_result(None)
        dawdle(self._rng)

    def connection_lost(self, error: TransportLost) -> None:
        self._fail(error)

    def _fail(self, error: Exception) -> None:
        if not self.heard_all.done():
            self.heard_all.set_exception(error)


async def send_all(port: Transport) -> None:
    """Send now one message, now a few at once."""
    rng = Random(9)
    sent = 0
    while sent < COUNT:
        size = min(rng.choice((1, 1, 1, 5)), COUNT - sent)
        port.write(b"".join(message(TO_FICS, sent + number) for number in range(size)))
        sent += size
        dawdle(rng)
        while port.unsent():
            await anyio.lowlevel.checkpoint()


async def converse(path: Path) -> None:
    """Talk with a second process, until both have heard everything."""
    program = [sys.executable, "-m", "tests.transports.dpram_fics", str(path), str(COUNT)]
    port = create(f"dpram://{path}?stuck_ms=30000")  # the second process has to start
    checker = Checker()
    await port.open(checker)
    fics = await asyncio.create_subprocess_exec(*program, cwd=ROOT)
    try:
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(ends_well(fics))
            tasks.create_task(send_all(port))
            await checker.heard_all
    finally:
        if fics.returncode is None:
            fics.kill()
            await fics.wait()
        await port.close()


async def ends_well(fics: asyncio.subprocess.Process) -> None:
    """It has heard everything as it was sent; otherwise its error stands on stderr."""
    assert await fics.wait() == 0


@pytest.mark.timeout(300)
def test_no_message_is_lost_doubled_or_torn_between_two_processes(tmp_path: Path) -> None:
    path = tmp_path / "ram"
    path.write_bytes(bytes(1024))
    uvloop.run(converse(path))
