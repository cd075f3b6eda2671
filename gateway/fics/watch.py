"""The watch over a robot: power that was lost, errors, motion that the gateway did not start."""

from collections.abc import Mapping
from contextlib import suppress

from gateway.core.errors import ControllerRefused, Expired, GatewayError, PowerCycled
from gateway.core.line_state import LineState
from gateway.core.times import happens
from gateway.fics.axes import at_rest, in_trouble
from gateway.fics.errors import IN_MOTION, RobotBusy
from gateway.fics.exchange import UNIT
from gateway.fics.robot import Robot
from gateway.fics.units import RobotUnit
from protocols.fics.speeds import GetSpeedPercent
from protocols.fics.status import AxisSensors, AxisStatus
from protocols.fics.system import HostMode

HEALTH_POLL_S = 5.0
"""A robot that does nothing for us is asked for its mode, errors and status this often."""


async def watch(robot: Robot) -> None:
    """Look again and again, and publish what is found."""
    motion = robot.known.motion
    while True:
        motion.poll_due.clear()
        if robot.line.state is LineState.READY and motion.command is None and not motion.stopping:
            try:
                await _look(robot)
            except (PowerCycled, RobotBusy, Expired):
                pass  # it has been told, or moves for us by now, or is wanted by others
            except GatewayError as error:
                robot.publish("robot.unreadable", {"detail": error.detail})
        await happens(motion.poll_due, HEALTH_POLL_S)


async def _look(robot: Robot) -> None:
    await robot.conversation.see_power()
    await robot.conversation.poll_error()
    moves = await _moves(robot)
    if robot.known.motion.command is not None:
        return
    robot.known.motion.note_foreign(moves=moves)
    if moves:
        robot.line.note_forbidden(IN_MOTION)
    with suppress(ControllerRefused):  # the terminal is at work; before the next motion it is done
        await robot.conversation.restore_speeds()
        await robot.conversation.see_units()


async def _moves(robot: Robot) -> bool | None:
    """True if the unit moves that the robot acts on; None while the terminal keeps it from telling.

    Another unit is not selected just to be looked at: the terminal would show it (C-HOST manual 2-1). Only
    where the robot acts on one that is not configured the first that is becomes the present one.
    """
    try:
        unit = await _present_unit(robot)
        statuses = await unit.status()
        if robot.line.mode == HostMode.VER_2:
            await _see_signs(robot, unit, still=at_rest(statuses.values()))
        if at_rest(statuses.values()):
            await _know_ramps(robot, unit)
        with suppress(GatewayError):  # its sensors and places are asked for again
            await _compare_bits(robot, unit, statuses, await unit.sensors())
    except ControllerRefused as refused:
        return True if refused.error_code == IN_MOTION else None
    return not at_rest(statuses.values())


async def _know_ramps(robot: Robot, unit: RobotUnit) -> None:
    """Ask once how long its axes may take to come to rest: in motion, when it counts, it does not tell."""
    for question in robot.known.motion.ramps.unknown_of(unit):
        await unit.read(question)


async def _see_signs(robot: Robot, unit: RobotUnit, *, still: bool) -> None:
    """See that the power was kept: another unit is selected only to be sure of that.

    Where nothing tells, a loss has taken nothing that is known of: so speeds are learnt while none is feared.
    """
    power, absences = robot.known.power, robot.line.absences
    in_doubt = power.in_doubt
    beside = power.witnesses_beside(unit) if still else []
    if await robot.conversation.see_power(unit, speeds=in_doubt) or not still:
        return
    for witness in beside:
        if await robot.conversation.see_power(witness, speeds=in_doubt):
            return
    if in_doubt:
        power.settle_doubt(absences)
    elif not power.knows_speeds(unit):
        await unit.read(GetSpeedPercent())


async def _compare_bits(
    robot: Robot, unit: RobotUnit, axes: Mapping[str, AxisStatus], sensors: Mapping[str, AxisSensors]
) -> None:
    """Once it stands still and is homed: see that its bits mean what the configuration says."""
    standing = at_rest(axes.values()) and not any(map(in_trouble, axes.values()))
    free = robot.known.motion.command is None and robot.latched_error is None
    if not (standing and free and robot.known.bits.is_due(unit.number)):
        return
    homed = None not in (await unit.position("motor")).values()
    robot.known.bits.was_looked_at(unit.number)
    if homed and (told := robot.known.bits.compare(unit.number, axes, sensors)):
        robot.publish("robot.bits.mismatch", {"unit": unit.number, "detail": told})


async def _present_unit(robot: Robot) -> RobotUnit:
    if len(robot.units) == 1:
        return robot.units[0]
    known = robot.known.unit.number
    number = known or (await robot.read(UNIT)).host_unit
    return next((unit for unit in robot.units if unit.number == number), robot.units[0])
