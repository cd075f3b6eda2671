"""A setting that steps the position index is done once, and no caller is told to repeat it."""

import asyncio

import pytest

from gateway.core.errors import NoReply
from protocols.rorze.position_table import SetPositionEntry
from simulator.faults import Direction
from tests.plants import in_virtual_time, lose, rig


@pytest.mark.parametrize(
    ("parameters", "remedy"),
    [("P[+],50", "position index"), ("P[-],50", "position index"), ("P[7],50", "Read back")],
)
@in_virtual_time
async def test_without_a_reply_the_remedy_says_what_to_read(parameters: str, remedy: str) -> None:
    async with rig() as it:
        body, command = it.body(), SetPositionEntry.read(parameters)
        asking = asyncio.create_task(body.ask(command))
        await it.wire.begun(body.line.frame_of(body.number, command).removesuffix("\\r"))
        lose(it, Direction.REPLIES)
        with pytest.raises(NoReply) as caught:
            await asking
        assert remedy in caught.value.remedy
        assert (caught.value.moved, caught.value.retryable) == ("no", False)
        assert len(it.executed("3PS")) == 1
