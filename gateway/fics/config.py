"""The configuration of a line with a Fics: the robot, its units and their axes."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PlainValidator, model_validator

from gateway.core import tables
from gateway.core.tables import Array, Fault, Name, Slug, Table, refuse_repeats
from gateway.core.toml_lines import KeyPath
from protocols.fics.link import Terminator
from protocols.fics.macros import RESERVED
from protocols.fics.notation import LAST_UNIT, MOST_AXES, AxisName, AxisSystem
from protocols.fics.status import SENSOR_BITS, STATUS_BITS


def _check_system(given: Any) -> Any:
    """Take one word for all axes, or a list with one for each."""
    if isinstance(given, str):
        return _axis_system(given)
    if not isinstance(given, list | tuple):
        raise Fault(f"must be {_SYSTEMS}, or a list with one of them for each axis")
    return tuple(_axis_system(word, place) for place, word in enumerate(given))


def _axis_system(word: object, *place: int) -> AxisSystem:
    if not isinstance(word, str) or word not in tuple(AxisSystem):
        raise Fault(f"must be {_SYSTEMS}, not {word!r}", *place)
    return AxisSystem(word)


_SYSTEMS = "'mm', 'pulse' or 'degree'"
System = Annotated[AxisSystem | tuple[AxisSystem, ...], PlainValidator(_check_system)]

THETA = "@"


class UnitTable(Table):
    """Axes of a robot that are commanded together (C-HOST manual 1-5, 1-6)."""

    number: int = Field(ge=1, le=LAST_UNIT)
    axes: Array[AxisName]
    """Names of the user axes in the order of coordinates: X, Y, Z .. and @ for theta."""
    system: System | None = None
    """Units of the user axes; left out, theta is counted in degrees and all others in mm."""
    motor_axes: Array[AxisName] = ()
    """Names of the motor axes, where they are not the user axes."""
    motor_system: System | None = None
    """Units of the motor axes; left out, those that are no user axes are counted in degrees."""

    @model_validator(mode="after")
    def _name_each_axis_once(self) -> Self:
        for key, names in ("axes", self.axes), ("motor_axes", self.motor_axes):
            if len(names) > MOST_AXES:
                raise Fault(f"must name at most {MOST_AXES} axes", key)
            refuse_repeats(names, key)
        if not self.axes:
            raise Fault("must name at least one axis", "axes")
        return self

    @model_validator(mode="after")
    def _count_each_axis_in_one_system(self) -> Self:
        _require_one_each(self.axes, "system", self.system)
        if self.motor_system is not None and not self.motor_axes:
            raise Fault("has no meaning without motor_axes", "motor_system")
        _require_one_each(self.motor_axes, "motor_system", self.motor_system)
        users = self._user_systems()
        for axis, system in self._motor_systems().items():
            if users.get(axis, system) is not system:
                raise Fault(
                    f"axis {axis} is one of axes too, and is counted in {users[axis]} there", "motor_system"
                )
        return self

    @property
    def systems(self) -> dict[str, AxisSystem]:
        """The system of units of each axis, user axes and motor axes alike: one that is both has one."""
        return self._motor_systems() | self._user_systems()

    def _user_systems(self) -> dict[str, AxisSystem]:
        if self.system is None:
            return {axis: AxisSystem.DEGREE if axis == THETA else AxisSystem.MILLIMETRE for axis in self.axes}
        return _each(self.axes, self.system)

    def _motor_systems(self) -> dict[str, AxisSystem]:
        if self.motor_system is None:
            users = self._user_systems()
            return {axis: users.get(axis, AxisSystem.DEGREE) for axis in self.motor_axes}
        return _each(self.motor_axes, self.motor_system)


def _each(axes: tuple[str, ...], system: AxisSystem | tuple[AxisSystem, ...]) -> dict[str, AxisSystem]:
    if isinstance(system, AxisSystem):
        return dict.fromkeys(axes, system)
    return dict(zip(axes, system, strict=True))


def _require_one_each(axes: tuple[str, ...], key: str, system: object) -> None:
    if isinstance(system, tuple) and len(system) != len(axes):
        raise Fault(f"must have one entry for each of {', '.join(axes)}, not {len(system)}", key)


class RobotTable(Table):
    """A Fics robot, alone on its line."""

    id: Slug
    name: Name | None = None
    units: Array[UnitTable]
    macros: dict[str, Name] | None = None
    """Titles of the robot's macros, by their names."""
    status_bits: Array[str] = STATUS_BITS
    """Meaning of bits 0 to 3 of the second digit of ACD: an assumption, for the figure is lost (2-10)."""
    sensor_bits: Array[str] = SENSOR_BITS
    """Meaning of bits 0 to 2 of ASD: an assumption, as well (C-HOST manual 2-11)."""

    @model_validator(mode="after")
    def _name_each_bit_once(self) -> Self:
        for key, given, known in (
            ("status_bits", self.status_bits, STATUS_BITS),
            ("sensor_bits", self.sensor_bits, SENSOR_BITS),
        ):
            if sorted(given) != sorted(known):
                raise Fault(f"must name {', '.join(known)}, each of them once", key)
        return self

    @model_validator(mode="after")
    def _name_macros(self) -> Self:
        for name in self.macros or ():
            if not re.fullmatch("[A-Z0-9]{3}", name) or name in RESERVED:
                raise Fault(
                    f"must be three capital letters or digits, and no command, not {name!r}", "macros", name
                )
        return self

    @model_validator(mode="after")
    def _have_units(self) -> Self:
        if not self.units:
            raise Fault("must list at least one unit", "units")
        refuse_repeats([unit.number for unit in self.units], "units", key="number")
        return self


class FicsLineTable(tables.LineTable):
    """A port with a robot."""

    robot: RobotTable
    mode: Literal[2, 3] = 3
    """The robot's communication mode; in 2 most commands are silent (C-HOST manual 1-1-1)."""
    terminator: Terminator = "cr"
    """End of a command to the robot."""
    input_edges_per_s: float = Field(0, ge=0, le=10)
    """Times a second at which inputs are read to tell their changes while no client watches them."""
    move_samples_per_s: float = Field(5, ge=0, le=50)
    """Positions that are read of a unit while it moves, and kept with the move; 0: only those at its ends."""

    @model_validator(mode="before")
    @classmethod
    def _have_a_robot(cls, table: Any) -> Any:
        if "robot" not in table:
            raise Fault("is required on a line of protocol fics", "robot")
        return table

    def unique_ids(self) -> Mapping[KeyPath, str]:
        """The ids on this line that no other line may have, by where they stand."""
        return {("robot", "id"): self.robot.id}

    def served(self) -> str:
        """Its robot, with its units."""
        units = "; ".join(f"unit {unit.number} of {', '.join(unit.axes)}" for unit in self.robot.units)
        return f"Fics: robot {tables.named(self.robot.id, self.robot.name)}, {units}"
