"""What happens to a robot without us: power that was lost, errors, motion nobody here asked for."""

import asyncio
from typing import TYPE_CHECKING

from gateway.errors import GatewayError
from gateway.fics.errors import PowerCycled, RobotBusy, RobotRefused
from gateway.fics.units import at_rest
from gateway.port import LineState

if TYPE_CHECKING:
    from gateway.fics.robot import Robot

HEALTH_POLL_S = 5.0
"""A robot that does nothing for us is asked for its mode, errors and status this often."""

BUSY = "E01"
"""The refusal of a selection of units while something moves (C-HOST manual 1-7)."""


async def watch(robot: "Robot") -> None:
    """Look again and again, and publish what is found."""
    while True:
        if robot.line.state is LineState.READY and robot.motion is None and not robot.stopping:
            try:
                await _look(robot)
            except (PowerCycled, RobotBusy):
                pass  # it has been told, or moves for us by now
            except GatewayError as error:
                robot.publish("robot.unreadable", {"detail": error.detail})
        await asyncio.sleep(HEALTH_POLL_S)


async def _look(robot: "Robot") -> None:
    await robot.see_power()
    await robot.look_for_errors()
    await robot.restore_speeds()
    moves = False
    for unit in robot.units:
        try:
            axes = (await unit.status()).values()
        except RobotRefused as refused:
            moves |= refused.fics_error == BUSY
            continue
        moves |= not at_rest(axes)
    if robot.motion is not None:
        return
    if moves and not robot.moves_by_itself:
        robot.publish("robot.motion.foreign", {})
    robot.moves_by_itself = moves
