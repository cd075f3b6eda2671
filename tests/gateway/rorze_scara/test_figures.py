"""Counters of the moves of SCARA robots."""

from tests.gateway.rorze_scara.cell import cell, deg
from tests.plants import in_virtual_time


@in_virtual_time
async def test_a_move_of_a_scara_robot_counts_for_the_line_of_its_bodies() -> None:
    async with cell() as robot:
        await robot.finished("finger", angle=deg(60))
        assert {line for line, _ in robot.rig.plant.history.figures.moves} == {"line1"}
