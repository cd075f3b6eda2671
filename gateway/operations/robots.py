"""What takes several commands to a robot: where units stand, how they are, inputs, outputs, variables."""

from collections.abc import Callable
from typing import Any, NamedTuple

from gateway.core.errors import InvalidRequest
from gateway.core.rights import Right
from gateway.fics.axes import Coordinates, at_rest
from gateway.fics.family import Fics
from gateway.fics.units import UnknownReason
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.security import entries
from protocols.fics.alarms import ResetErrors
from protocols.fics.inputs_outputs import ChannelBits, GetInputChannel, GetOutputChannel, SwitchOutput
from protocols.fics.notation import LAST_CHANNEL
from protocols.fics.row import FicsCommand
from protocols.fics.status import AxisSensors, AxisStatus
from protocols.fics.variables import LAST_VARIABLE, GetVariable, SetVariable, VariableValue


class Places(NamedTuple):
    """Where the axes of a unit stand."""

    axes: dict[str, float | None]
    reasons: dict[str, UnknownReason]
    """Why an axis has no place."""
    at: float


class Condition(NamedTuple):
    """How the motor axes of a unit are."""

    moving: bool
    axes: dict[str, AxisStatus]
    sensors: dict[str, AxisSensors]
    at: float


@needs(Right.VIEW)
async def position(plant: Plant, robot_id: str, unit: int, coordinates: Coordinates) -> Places:
    """Ask where a unit stands, and why axes do not know it.

    :raises GatewayError: it was not read.
    """
    axes = plant.family(Fics).robot(robot_id).unit(unit)
    places, at = await axes.position_at(coordinates)
    return Places(places, await axes.why_unknown(places), at)


@needs(Right.VIEW)
async def status(plant: Plant, robot_id: str, unit: int) -> Condition:
    """Ask how the motor axes of a unit are, and for their sensors.

    :raises GatewayError: it was not read.
    """
    axes = plant.family(Fics).robot(robot_id).unit(unit)
    statuses, at = await axes.status_at()
    sensors = await axes.sensors()
    return Condition(not at_rest(statuses.values()), statuses, sensors, at)


@needs(Right.OPERATE)
async def acknowledge_power_cycle(plant: Plant, robot_id: str) -> None:
    """Allow motion again after a loss of power; errors as of `Power.acknowledge`."""
    plant.family(Fics).robot(robot_id).power.acknowledge()
    plant.security.note(entries.POWER_CYCLE_ACKNOWLEDGED, robot_id)


@needs(Right.SETUP)
async def change_mode(plant: Plant, robot_id: str, mode: int) -> None:
    """Bring a robot into another mode; errors as of `Robot.change_mode`."""
    await plant.family(Fics).robot(robot_id).change_mode(mode)


@needs(Right.OPERATE)
async def reset_errors(plant: Plant, robot_id: str) -> None:
    """Reset the errors that stand, and the state EMERGENCY (DRT); errors as of `Target.ask`."""
    await plant.target(f"/robots/{robot_id}").ask(ResetErrors())


@needs(Right.VIEW)
async def channels(
    plant: Plant, robot_id: str, row: type[GetInputChannel | GetOutputChannel], first: int, count: int
) -> dict[int, ChannelBits]:
    """Ask for inputs (IDI) or outputs (IDO), channel by channel; errors as of `Robot.read`."""
    return await _read(plant, robot_id, row, "channel", _range("channels", first, count, LAST_CHANNEL))


@needs(Right.VIEW)
async def variables(plant: Plant, robot_id: str, first: int, count: int) -> dict[int, VariableValue]:
    """Ask for variables, one by one (VAR); errors as of `Robot.read`."""
    wanted = _range("variables", first, count, LAST_VARIABLE)
    return await _read(plant, robot_id, GetVariable, "number", wanted)


@needs(Right.OPERATE)
async def switch_output(plant: Plant, robot_id: str, command: SwitchOutput) -> ChannelBits:
    """Switch an output, and give what is read back; errors as of `Robot.change`."""
    told: ChannelBits = await plant.family(Fics).robot(robot_id).change(command)
    return told


@needs(Right.OPERATE)
async def set_variable(
    plant: Plant, robot_id: str, command: SetVariable, expects: Callable[[VariableValue], None] | None = None
) -> VariableValue:
    """Set a variable, and give what is read back; `expects` refuses a value that the sender does not know.

    :raises Outdated: it has another value; it was not set.
    :raises GatewayError: as of `Robot.change`.
    """
    robot = plant.family(Fics).robot(robot_id)
    query = GetVariable(number=command.number)
    since = await robot.asking.as_expected(lambda: robot.read(query), expects)
    told: VariableValue = await robot.change(command, since=since)
    return told


async def _read(
    plant: Plant, robot_id: str, row: type[FicsCommand[Any]], field: str, wanted: range
) -> dict[int, Any]:
    robot = plant.family(Fics).robot(robot_id)
    return {number: await robot.read(row(**{field: number})) for number in wanted}


def _range(what: str, first: int, count: int, last: int) -> range:
    if first + count - 1 > last:
        raise InvalidRequest(f"count: {what} are numbered up to {last}; nothing was sent.")
    return range(first, first + count)
