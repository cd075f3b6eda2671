"""Numbers of axes: by name and with their units for clients, in a row for the robot."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import BeforeValidator, Field, ValidationError
from pydantic_core import PydanticCustomError
from typing_extensions import TypeAliasType

from gateway.core.errors import InvalidRequest
from gateway.core.records import AnswerModel, RequestModel
from gateway.fics.axes import UnitAxes
from protocols.fics.notation import AxisName, Number, Quantity, SpeedNumber
from protocols.fics.row import FicsCommand
from protocols.wording import sentence

V = TypeVar("V")


class Measured(RequestModel):
    """A number with its unit."""

    quantity: ClassVar[Quantity]
    value: float
    unit: str


AmountUnit = TypeAliasType("AmountUnit", Literal["mm", "pulse", "degree"])


class Amount(Measured):
    """A coordinate, or an amount to move by, in the unit its axis is set up for."""

    quantity = Quantity.POSITION
    value: Number
    unit: AmountUnit


class AxisSpeed(Measured):
    """A speed in the unit its axis is set up for."""

    quantity = Quantity.SPEED
    value: SpeedNumber
    unit: Literal["mm/s", "kpps", "rpm"]


def _each_axis_once(given: object) -> object:
    """Refuse an axis named in lower and in upper case."""
    names = [name.upper() for name in given if isinstance(name, str)] if isinstance(given, dict) else []
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise PydanticCustomError("axis_twice", "must name axis {axis} once only", {"axis": twice})
    return given


ByAxis = Annotated[dict[AxisName, V], BeforeValidator(_each_axis_once)]
Amounts = ByAxis[Amount]
AxisAmounts = TypeAliasType("AxisAmounts", Annotated[Amounts, Field(min_length=1)])
AxisSpeeds = ByAxis[AxisSpeed]


class AxisValue(AnswerModel):
    """A coordinate or a speed of an axis, with its unit."""

    value: float
    unit: str = Field(description="mm, pulse or degree; mm/s, kpps or rpm.")


def in_order(field: str, unit: UnitAxes, names: Sequence[str], given: Mapping[str, V]) -> list[V | None]:
    """Put values given by name into the order of the axes; null stands for an axis that is not named.

    :raises InvalidRequest: there is no such axis.
    """
    for name in given:
        if name not in names:
            raise InvalidRequest(
                f"{field}.{name}: {unit.address} has the axes {', '.join(names)}; nothing was sent."
            )
    return [given.get(name) for name in names]


def numbers(
    field: str, unit: UnitAxes, names: Sequence[str], given: Mapping[str, Measured]
) -> list[float | None]:
    """The bare numbers in the order of the axes.

    :raises InvalidRequest: there is no such axis, or it is set up for another unit.
    """
    for name, measured in given.items():
        if name in names:
            _require_unit(f"{field}.{name}", unit, name, measured)
    bare = {name: measured.value for name, measured in given.items()}
    return in_order(field, unit, names, bare)


def _require_unit(field: str, unit: UnitAxes, axis: str, measured: Measured) -> None:
    system = unit.systems[axis]
    expected = system.unit(measured.quantity)
    if measured.unit != expected:
        raise InvalidRequest(
            f"{field}.unit: axis {axis} of {unit.address} is set up for {expected}, not for "
            f"{measured.unit}; nothing was sent."
        )
    unit.require_value(axis, measured.quantity, measured.value, f"{field}.value")


def build(field: str, row: type[FicsCommand[Any]], **parameters: object) -> FicsCommand[Any]:
    """Make a command of what a request says in a field.

    :raises InvalidRequest: the command cannot be written with these parameters.
    """
    try:
        return row(**parameters)
    except ValidationError as error:
        raise InvalidRequest(f"{field}: {sentence(error.errors()[0])}; nothing was sent.") from None
