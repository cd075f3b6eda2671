"""The client of a broker: what waits for an answer ends when it is cancelled."""

import asyncio

from bridges.mqtt.broker import TellingClient
from tests.plants import in_virtual_time


@in_virtual_time
async def test_work_that_is_cancelled_as_its_answer_comes_ends() -> None:
    """Else a connection that a refusal should end would go on for ever, and the bridge would not end."""
    client, answered, over = TellingClient("127.0.0.1", 1), asyncio.Event(), asyncio.Event()

    async def work() -> None:
        while not over.is_set():
            await client._wait_for(answered.wait(), None)
            await asyncio.sleep(0)

    working = asyncio.create_task(work())
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    answered.set()
    await asyncio.sleep(0)
    working.cancel()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    was_ended = working.done()
    over.set()
    await asyncio.wait([working])
    assert was_ended
