"""Units, mode, version and variables (C-HOST manual 2-1, 2-35 to 2-37)."""

from protocols.fics.system import (
    CommunicationMode,
    GetCommunicationMode,
    GetSystemVersion,
    GetUnit,
    HostMode,
    SelectUnit,
    SetCommunicationMode,
    SystemVersion,
    UnitNumbers,
)
from protocols.fics.variables import GetVariable, SetVariable, VariableValue
from simulator.fics.actions import Code, Refused, acts_out
from simulator.fics.robot import Robot

VERSION = SystemVersion(
    project_id="DYNAX001",
    version="0310",
    built="041112",
    project_folder="SIMULATE",
    saved="041215",
    revision=1,
    c_host=30,
)


@acts_out(GetUnit)
def _get_unit(robot: Robot, command: GetUnit, now: float) -> UnitNumbers:
    return UnitNumbers(host_unit=robot.host_unit, fics_unit=robot.fics_unit)


@acts_out(SelectUnit)
def _select_unit(robot: Robot, command: SelectUnit, now: float) -> None:
    if command.unit not in robot.units:
        raise Refused(Code.RANGE)
    robot.host_unit = robot.fics_unit = command.unit


@acts_out(GetCommunicationMode)
def _get_mode(robot: Robot, command: GetCommunicationMode, now: float) -> CommunicationMode:
    return CommunicationMode(mode=robot.mode)


@acts_out(SetCommunicationMode)
def _set_mode(robot: Robot, command: SetCommunicationMode, now: float) -> None:
    robot.mode = command.mode


@acts_out(GetSystemVersion)
def _get_version(robot: Robot, command: GetSystemVersion, now: float) -> SystemVersion:
    return VERSION if robot.mode == HostMode.VER_3 else VERSION.model_copy(update={"c_host": None})


@acts_out(GetVariable)
def _get_variable(robot: Robot, command: GetVariable, now: float) -> VariableValue:
    return VariableValue(number=command.number, value=robot.variables[command.number])


@acts_out(SetVariable)
def _set_variable(robot: Robot, command: SetVariable, now: float) -> None:
    value = command.value
    robot.variables[command.number] = float(round(value)) if robot.settings.numbers == "whole" else value
