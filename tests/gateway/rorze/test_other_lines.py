"""Lines that do otherwise than is assumed, where the manual leaves it open: they are served all the same."""

import asyncio

import pytest

from gateway.core.errors import BodyOffline, ControllerRefused, PowerCycled
from gateway.core.move_record import MoveStatus
from protocols.rorze.moves import MoveClockwise, MoveTo
from simulator.rorze.rc400 import LinkSettings
from tests.gateway.rorze.test_body_power import BROWN_OUT_S, brown_out
from tests.plants import finished, in_virtual_time, rig, start

PRESENT = (0x00, 0x3F)
OTHERS = {
    "refusals have no code": LinkSettings(error_codes=False),
    "lines end with CR LF": LinkSettings(line_end="\r\n"),
    "excess line ends are ignored": LinkSettings(excess_line_ends="ignored"),
    "replies take their time": LinkSettings(reply_delay_s=0.05),
    "commands before a reply are lost": LinkSettings(reply_delay_s=0.05, interjection="drop"),
    "all at once": LinkSettings(
        reply_delay_s=0.05,
        error_codes=False,
        interjection="drop",
        line_end="\r\n",
        excess_line_ends="ignored",
    ),
}


@pytest.mark.parametrize("other", OTHERS)
@in_virtual_time
async def test_it_moves_stops_and_goes_nowhere_after_a_loss_of_power(other: str) -> None:
    async with rig(present=PRESENT, baud=9600, settings=OTHERS[other], groups={}) as it:
        assert (await finished(it, MoveClockwise(distance=500))).status is MoveStatus.SUCCEEDED
        with pytest.raises(ControllerRefused):
            await start(it, MoveClockwise(distance=500, pattern=7))
        with pytest.raises(BodyOffline):
            await start(it, MoveClockwise(distance=500), "01")
        long = await start(it, MoveClockwise(distance=500_000))
        await asyncio.sleep(1)
        [report] = await it.plant.stops.stop([it.body()], "decelerate")
        assert report.state == "confirmed"
        assert it.plant.moves.get(long.id).status is MoveStatus.STOPPED
        brown_out(it)
        await asyncio.sleep(BROWN_OUT_S + 1)
        with pytest.raises(PowerCycled):
            await start(it, MoveTo(position=700))
