"""Stories of a SCARA robot's move for faults of the gateway itself."""

import asyncio
from contextlib import suppress

from gateway.core.move_record import MoveStatus
from tests.drawn_faults import AGAIN_S, Strike
from tests.gateway.rorze_scara.cell import START, cell, mm


async def a_scara_moves(struck: Strike) -> None:
    async with cell() as robot:
        with struck():
            with suppress(Exception):
                await robot.start("line", x=mm(20), y=mm(130))
            await asyncio.sleep(AGAIN_S)
        assert robot.scara.move is None
        assert all(move.status.final for move in robot.moves.log.of("wafer"))
        assert not any(robot.moving())
        await robot.put(*START)
        assert (await robot.finished("line", x=mm(10), y=mm(120))).status is MoveStatus.SUCCEEDED


STORIES = (a_scara_moves,)
