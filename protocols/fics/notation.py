"""How C-HOST arguments and answers are written, and the field types made of them (C-HOST manual 1-5, 2)."""

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    PlainSerializer,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
)
from pydantic_core import CoreSchema, PydanticCustomError

from protocols.table import RangeFault, Wire

MOST_AXES = 8
"""Axes of one unit. An assumption: the manual only shows that there can be five (C-HOST manual 2)."""
LAST_UNIT = 9
"""Units are numbered from 1; ERD prints the number as one character (C-HOST manual 2-13)."""
LAST_CHANNEL = 99
"""Channels of eight inputs or outputs are numbered from 1. An assumption: the manual gives no last one."""
DECIMALS = 3
"""Decimals of coordinates and speeds we send. An assumption: the figures of C-HOST manual 1-5 are lost."""
LARGEST = 99_999_999
"""Coordinates and amounts lie within plus and minus this, as does a variable. An assumption, as above."""
PERCENT_WIDTH = 5
"""Characters of a speed percentage, the point included (C-HOST manual 2-15)."""

AXES = "One value per axis in the order of the unit's axes; null leaves an axis as it is."
PLACES = f"In mm, pulse or degree as each axis is set up. {AXES}"


class Quantity(StrEnum):
    """The quantity that a number measures; its unit depends on the axis system."""

    POSITION = "position"
    SPEED = "speed"


class AxisSystem(StrEnum):
    """The coordinate system an axis is set up for (C-HOST manual 1-5)."""

    MILLIMETRE = "mm"
    PULSE = "pulse"
    DEGREE = "degree"

    def unit(self, quantity: Quantity) -> str:
        """The unit of a number: mm and mm/s, pulse and kpps, or degree and rpm."""
        return self.value if quantity is Quantity.POSITION else _SPEED_UNITS[self]

    def can_hold(self, quantity: Quantity, value: float) -> bool:
        """Say whether the controller can take the number: pulses are whole."""
        whole = self is AxisSystem.PULSE and quantity is Quantity.POSITION
        return not whole or float(value).is_integer()


_SPEED_UNITS = {AxisSystem.MILLIMETRE: "mm/s", AxisSystem.PULSE: "kpps", AxisSystem.DEGREE: "rpm"}


@dataclass(frozen=True)
class FicsWhole(Wire):
    """A whole number of at most `width` digits; zeros in front and a plus may be left out, and are by us."""

    width: int = 10
    pattern = r"[+-]?[0-9]+"

    def decode(self, text: str) -> int:
        """Read sign and digits.

        :raises RangeFault: there are more.
        """
        if len(text.lstrip("+-")) > self.width:
            raise RangeFault(f"{text!r} has more than {self.width} digits")
        return int(text)


@dataclass(frozen=True)
class Decimal(Wire):
    """A decimal number in its shortest form, but with `least` decimals; no longer than `width`.

    A number that begins with the point is a fraction.
    """

    least: int = 0
    width: int = 20
    signed: bool = False
    """True if a plus is written too."""

    pattern = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)"

    def encode(self, value: Any) -> str:
        """Write the shortest form."""
        digits, _, decimals = f"{abs(value):.6f}".partition(".")
        decimals = decimals.rstrip("0").ljust(self.least, "0")
        sign = "-" if value < 0 else "+" if self.signed else ""
        return sign + digits + ("." + decimals if decimals else "")

    def decode(self, text: str) -> float:
        """Read the number.

        :raises RangeFault: it is longer.
        """
        if len(text) > self.width:
            raise RangeFault(f"{text!r} has more than {self.width} characters")
        return float(text)


@dataclass(frozen=True)
class FicsDigits(Wire):
    """A number of fixed width, zero filled."""

    width: int

    @property
    def pattern(self) -> str:  # type: ignore[override]  # depends on the width
        """Exactly `width` digits."""
        return rf"[0-9]{{{self.width}}}"

    def encode(self, value: Any) -> str:
        """Fill with zeros."""
        return f"{value:0{self.width}d}"

    def decode(self, text: str) -> int:
        """Read the digits."""
        return int(text)


@dataclass(frozen=True)
class FicsHex(Wire):
    """A hexadecimal number of fixed width."""

    width: int

    @property
    def pattern(self) -> str:  # type: ignore[override]  # depends on the width
        """Exactly `width` digits in upper case."""
        return rf"[0-9A-F]{{{self.width}}}"

    def encode(self, value: Any) -> str:
        """Fill with zeros."""
        return f"{value:0{self.width}X}"

    def decode(self, text: str) -> int:
        """Read the digits."""
        return int(text, 16)


def driver_error_text(code: int) -> str:
    """A driver's error as drivers' manuals print it (C-HOST manual 2-13): 0x31 is `31h`."""
    return f"{code:02X}h"


def _driver_error(value: Any) -> Any:
    return int(value.removesuffix("h"), 16) if isinstance(value, str) else value


DriverError = Annotated[
    int,
    BeforeValidator(_driver_error),
    Field(ge=0, le=0xFF),
    FicsHex(2),
    PlainSerializer(driver_error_text, return_type=str, when_used="json"),
    WithJsonSchema({"type": "string", "pattern": "^[0-9A-F]{2}h$"}),
]
"""An error code of a driver: a number here, and text with its base in JSON."""


@dataclass(frozen=True)
class Token(Wire):
    """Text that stands for itself."""

    pattern: str


class Switch(Wire):
    """`+` for on, `-` for off."""

    pattern = "[+-]"

    def encode(self, value: Any) -> str:
        """Write the sign."""
        return "+" if value else "-"

    def decode(self, text: str) -> bool:
        """Read the sign."""
        return text == "+"


@dataclass(frozen=True)
class PerAxis(Wire):
    """Values joined by commas, one for each axis; `hole` stands for an axis without one."""

    item: Wire
    hole: str | None = ""
    most: int = MOST_AXES

    @property
    def pattern(self) -> str:  # type: ignore[override]  # depends on the items
        """Not only commas, and no more than there can be axes."""
        hole = "" if self.hole is None else f"|{re.escape(self.hole)}"
        one = f"(?:{self.item.pattern}{hole})"
        return rf"(?=,*[^,]){one}(?:,{one}){{0,{self.most - 1}}}"

    def encode(self, value: Any) -> str:
        """Join the values."""
        return ",".join(str(self.hole) if item is None else self.item.encode(item) for item in value)

    def decode(self, text: str) -> list[object]:
        """Split at the commas."""
        return [None if piece == self.hole else self.item.decode(piece) for piece in text.split(",")]


UNKNOWN = "#####"
"""Text of a position that is not known (C-HOST manual 2-9)."""


def expected(what: str) -> WrapValidator:
    """Say the whole of what a field can hold, whichever part of it is not kept to."""

    def parse(value: Any, parse_further: ValidatorFunctionWrapHandler) -> Any:
        try:
            return parse_further(value)
        except ValidationError:
            raise PydanticCustomError("not_possible", "must be {what}", {"what": what}) from None

    return WrapValidator(parse)


@dataclass(frozen=True)
class Within:
    """The range of whole numbers; it stands before other validators of the field."""

    ge: int
    le: int

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Bound the numbers, and tell both bounds."""
        what = expected(f"a whole number from {self.ge} to {self.le}")
        return handler.generate_schema(Annotated[source, Field(ge=self.ge, le=self.le), what])


def few_decimals(value: float) -> float:
    """Refuse what would be rounded on the way."""
    if round(value, DECIMALS) != value:
        raise ValueError("too many decimals")
    return value + 0.0  # never minus zero


def fits_percent(value: float) -> float:
    """Refuse what the controller has no room for."""
    if len(Decimal().encode(value)) > PERCENT_WIDTH:
        raise ValueError("too many characters")
    return value


def without_trailing_holes(values: list[Any]) -> list[Any]:
    """Cut what is not written anyway, and refuse a list that says nothing."""
    last = max((place for place, value in enumerate(values) if value is not None), default=None)
    if last is None:
        raise ValueError("at least one axis needs a value")
    return values[: last + 1]


ListLength = Field(min_length=1, max_length=MOST_AXES)
Cut = AfterValidator(without_trailing_holes)

Number = Annotated[
    float,
    Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False),
    AfterValidator(few_decimals),
    expected(f"a number from {-LARGEST} to {LARGEST} with at most {DECIMALS} decimals"),
]
SpeedNumber = Annotated[
    float,
    Field(gt=0, le=LARGEST, allow_inf_nan=False),
    AfterValidator(few_decimals),
    expected(f"a number above 0, up to {LARGEST}, with at most {DECIMALS} decimals"),
]
PercentNumber = Annotated[
    float,
    Field(ge=0.1, le=100, allow_inf_nan=False),
    AfterValidator(fits_percent),
    expected(f"a number from 0.1 to 100 of at most {PERCENT_WIDTH} characters, the point included"),
]
Milliseconds = Annotated[int, Within(1, 9999)]
FourDigits = Annotated[int, Within(0, 9999)]

# What a command gives its axes: null leaves an axis as it is.
Coordinates = Annotated[list[Number | None], ListLength, Cut, PerAxis(Decimal()), Quantity.POSITION]
Speeds = Annotated[list[SpeedNumber | None], ListLength, Cut, PerAxis(Decimal()), Quantity.SPEED]
Percents = Annotated[list[PercentNumber | None], ListLength, Cut, PerAxis(Decimal(width=PERCENT_WIDTH))]
Times = Annotated[list[Milliseconds | None], ListLength, Cut, PerAxis(FicsWhole(width=4))]
StartSpeeds = Annotated[list[FourDigits | None], ListLength, Cut, PerAxis(FicsWhole(width=4))]

# What an answer tells of the axes: anything the controller may hold and can write.
WIDEST = 9_999_999_999
Finite = Annotated[float, Field(ge=-WIDEST, le=WIDEST, allow_inf_nan=False)]
KnownCoordinates = Annotated[list[Finite], ListLength, PerAxis(Decimal(), hole=None), Quantity.POSITION]
MaybeCoordinates = Annotated[
    list[Finite | None], ListLength, PerAxis(Decimal(), hole=UNKNOWN), Quantity.POSITION
]
KnownSpeeds = Annotated[list[Finite], ListLength, PerAxis(Decimal(), hole=None), Quantity.SPEED]
KnownPercents = Annotated[list[Finite], ListLength, PerAxis(Decimal(least=1), hole=None)]
StoredCoordinates = Annotated[list[Finite | None], ListLength, Cut, PerAxis(Decimal()), Quantity.POSITION]
KnownNumbers = Annotated[list[FourDigits], ListLength, PerAxis(FicsWhole(), hole=None)]

AxisName = Annotated[
    str,
    Field(pattern="^[A-Za-z@]$"),
    expected("one capital letter, or @ for theta"),
    AfterValidator(str.upper),
    Token("[A-Z@]"),
]
"""X Y Z .. for user axes, A B C .. for motor axes, @ for theta (C-HOST manual 2-2); in lower case, too."""
Unit = Annotated[int, Within(1, LAST_UNIT), FicsWhole()]
Channel = Annotated[int, Within(1, LAST_CHANNEL), FicsWhole()]
Bit = Annotated[int, Within(0, 7), FicsWhole()]
PositionNumber = Annotated[int, Within(1, 1999), FicsWhole()]
Flag = Annotated[int, Within(0, 1), FicsWhole()]
Direction = Annotated[Literal["+", "-"], Token("[+-]")]
