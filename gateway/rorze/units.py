"""Lengths and angles to pulses and back: one factor for each body, set in the configuration."""

from fractions import Fraction
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, WithJsonSchema, model_validator
from typing_extensions import TypeAliasType

from gateway.core.errors import InvalidRequest
from gateway.core.records import AnswerModel, RequestModel, example
from protocols.wording import plain_number

Per = Literal["", "/s", "/s2"]
LengthUnit = TypeAliasType("LengthUnit", Literal["pulse", "mm", "um", "deg", "mdeg"])
_IN_BASE: dict[str, tuple[str, float]] = {
    "mm": ("mm", 1.0),
    "um": ("mm", 0.001),
    "deg": ("deg", 1.0),
    "mdeg": ("deg", 0.001),
}


class Scale(AnswerModel):
    """The number of pulses in one unit, for a body."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    unit: Literal["mm", "um", "deg", "mdeg"]
    pulses_per_unit: Annotated[float, Field(gt=0, le=1_000_000_000, allow_inf_nan=False)]

    def pulses(self, value: float, unit: LengthUnit) -> int:
        """The nearest whole number of pulses.

        :raises InvalidRequest: a length was given for an angle, or an angle for a length.
        """
        return round(value * self._factor(unit))

    def value(self, pulses: float) -> float:
        """The length or angle of `pulses`, in the scale's own unit."""
        return pulses / self.pulses_per_unit

    @property
    def words(self) -> str:
        """As people say it: 100 pulses/mm."""
        return f"{plain_number(self.pulses_per_unit, 9)} pulses/{self.unit}"

    def written(self, pulses: int) -> str:
        """Pulses as a length or angle: -9999999.99 mm."""
        return f"{plain_number(self.value(pulses), 6)} {self.unit}"

    def per(self, other: "Scale") -> Fraction | None:
        """Pulses of this scale for one of another; None where one is of lengths and the other of angles."""
        (dimension, size), (others, other_size) = _IN_BASE[self.unit], _IN_BASE[other.unit]
        if dimension != others:
            return None
        own = Fraction(str(self.pulses_per_unit)) / Fraction(str(size))
        return own * Fraction(str(other_size)) / Fraction(str(other.pulses_per_unit))

    def _factor(self, unit: LengthUnit) -> float:
        if unit == "pulse":
            return 1.0
        dimension, size = _IN_BASE[unit]
        own_dimension, own_size = _IN_BASE[self.unit]
        if dimension != own_dimension:
            raise InvalidRequest(
                f"This body moves in {self.unit}, not in {unit}; nothing was sent.", "Use its unit."
            )
        return self.pulses_per_unit * size / own_size


class Scaled(AnswerModel):
    """A number of pulses, or of pulses per second, in the body's unit."""

    value: float
    unit: str = Field(description="Unit such as mm, mm/s or mm/s2.")

    @classmethod
    def of(cls, pulses: float | None, scale: Scale | None, per: Per = "") -> Self | None:
        """Convert pulses; None without a number, or without a scale."""
        if pulses is None or scale is None:
            return None
        return cls(value=scale.value(pulses), unit=f"{scale.unit}{per}")


def to_pulses(value: float, unit: LengthUnit, scale: Scale | None) -> int:
    """Convert a distance or position to whole pulses.

    :raises InvalidRequest: pulses are not whole, or the body has no scale, or another dimension.
    """
    if unit == "pulse":
        if value != int(value):
            raise InvalidRequest(f"{value} is not a whole number of pulses; nothing was sent.", "Round it.")
        return int(value)
    if scale is None:
        raise InvalidRequest(
            f"This body has no pulses_per_unit, so {unit} means nothing to it; nothing was sent.",
            "Give pulses, or configure the body's scale.",
        )
    return scale.pulses(value, unit)


def require_whole(value: float | None, unit: LengthUnit | None) -> None:
    """Refuse a part of a pulse.

    :raises ValueError: it is one.
    """
    if unit == "pulse" and isinstance(value, float):
        raise ValueError(f"pulses must be a whole number, not {value}")


class Length(RequestModel, json_schema_extra=example(value=0, unit="pulse")):
    """A distance or a position with its unit."""

    value: Annotated[int | float, WithJsonSchema({"type": "number"})] = Field(
        gt=-1e9, lt=1e9, description="Pulses are whole numbers."
    )
    unit: LengthUnit = Field(description="mm, um, deg and mdeg need the body's scale in the configuration.")

    def pulses(self, scale: Scale | None) -> int:
        """The length in pulses.

        :raises InvalidRequest: the body has no scale for this unit.
        """
        return to_pulses(self.value, self.unit, scale)

    @model_validator(mode="after")
    def _whole_pulses(self) -> Self:
        require_whole(self.value, self.unit)
        return self
