"""How RC-420 parameters and reply values are written, and the field types made of them (RC-420 manual 19)."""

import re
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from protocols.table import Reply, Spoken, Wire

BILLION = 1_000_000_000


class Number(Wire):
    """A command's number: decimal, or hexadecimal after H; written by us in decimal."""

    pattern = r"[+-]?\d{1,12}|H[0-9A-F]{1,8}"

    def decode(self, text: str) -> int:
        """Read either notation."""
        return int(text[1:], 16) if text.startswith("H") else int(text)


class Whole(Wire):
    """A whole number in decimal."""

    def decode(self, text: str) -> int:
        """Read sign and digits."""
        return int(text)


@dataclass(frozen=True)
class Digits(Whole):
    """A reply's unsigned number of fixed width, zero filled."""

    width: int

    @property
    def pattern(self) -> str:  # type: ignore[override]  # depends on the width
        """Exactly `width` digits."""
        return rf"\d{{{self.width}}}"

    def encode(self, value: Any) -> str:
        """Fill with zeros."""
        return f"{value:0{self.width}d}"


class Signed(Whole):
    """A reply's signed number: sign and nine digits, always."""

    pattern = r"[+-]\d{9}"

    def encode(self, value: Any) -> str:
        """Write sign and nine digits."""
        return f"{value:+010d}"


@dataclass(frozen=True)
class Hex(Wire):
    """A set of bits as H and `width` hexadecimal digits; commands may have fewer, down to `least`."""

    width: int
    least: int | None = None

    @property
    def pattern(self) -> str:  # type: ignore[override]  # depends on the width
        """H and the digits."""
        return rf"H[0-9A-F]{{{self.least or self.width},{self.width}}}"

    def encode(self, value: Any) -> str:
        """Write all digits in upper case."""
        return f"H{value:0{self.width}X}"

    def decode(self, text: str) -> int:
        """Read the digits after H."""
        return int(text[1:], 16)


class Word(Wire):
    """One of a few words, each with its own sign on the wire: `Word(endless="Z")`."""

    def __init__(self, **signs: str) -> None:
        self._signs = signs
        self._words = {sign: word for word, sign in signs.items()}
        self.pattern = "|".join(re.escape(sign) for sign in signs.values())

    def encode(self, value: Any) -> str:
        """Write the sign of the word."""
        return self._signs[value]

    def decode(self, text: str) -> str:
        """Read the word of the sign."""
        return self._words[text]


class Printable(Wire):
    """Printable characters up to the end of the parameter list."""

    def __init__(self, pattern: str) -> None:
        self.pattern = pattern


class PositionReference(BaseModel):
    """An entry of the position table: by its number, or where the position index points."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    position: Annotated[int, Field(ge=0, le=2047)] | Literal["next", "previous"] = Field(
        description="Position number 0-2047; `next` and `previous` use the position index, then step it."
    )


class PositionWire(Wire):
    """`P[25]`, `P[+]` or `P[-]`."""

    pattern = r"P\[(?:\d{1,4}|[+-])\]"
    _steps: ClassVar = {"+": "next", "-": "previous"}
    _signs: ClassVar = {"next": "+", "previous": "-"}

    def encode(self, value: Any) -> str:
        """Write the reference."""
        return f"P[{self._signs.get(value.position, value.position)}]"

    def decode(self, text: str) -> object:
        """Read the reference; its range is checked by the model."""
        inner = text[2:-1]
        return PositionReference.model_validate({"position": self._steps.get(inner) or int(inner)})


def two_decimals(value: float) -> float:
    """Refuse what the controller could not hold."""
    if round(value, 2) != value:
        raise ValueError("at most two decimals")
    return value


class Hundredths(Wire):
    """A number with two decimals in replies; one or two in commands, after a point that has to be there."""

    pattern = r"\d{1,9}\.\d{1,2}"

    def encode(self, value: Any) -> str:
        """Write two decimals."""
        return f"{value:.2f}"

    def decode(self, text: str) -> float:
        """Read the number."""
        return float(text)


PositionRef = Annotated[PositionReference, PositionWire()]
Slot = Annotated[int, Field(ge=0, le=29), Number()]
"""The number of a speed parameter set S[n] or of an acceleration pattern A[n]: 0-29; left out, number 30."""
Pulses = Annotated[int, Field(gt=-BILLION, lt=BILLION), Number()]
"""A position or amount, strictly between -1,000,000,000 and +1,000,000,000."""
Amount = Annotated[int, Field(ge=0, lt=BILLION), Number()]
Flag = Annotated[int, Field(ge=0, le=1), Number()]
SignedValue = Annotated[int, Field(gt=-BILLION, lt=BILLION), Signed()]
FlagValue = Annotated[int, Field(ge=0, le=1), Digits(1)]
TwoDecimals = Annotated[float, AfterValidator(two_decimals), Hundredths()]


@dataclass(frozen=True)
class UpTo(Whole):
    """A reply's number of at most `width` digits, not filled, where the manual states no width."""

    width: int

    @property
    def pattern(self) -> str:  # type: ignore[override]  # depends on the width
        """One to `width` digits."""
        return rf"\d{{1,{self.width}}}"


@dataclass(frozen=True)
class PaddedHundredths(Hundredths):
    """A reply's number with two decimals and a fixed width, zero filled: `00200.00` has width 8."""

    width: int

    @property
    def pattern(self) -> str:  # type: ignore[override]  # depends on the width
        """Digits, the point and two decimals."""
        return rf"\d{{{self.width - 3}}}\.\d\d"

    def encode(self, value: Any) -> str:
        """Fill with zeros."""
        return f"{value:0{self.width}.2f}"


class Interval(Spoken):
    """A stretch of positions from lower to upper, in pulses; both or neither are given."""

    lower: Pulses | None = Field(
        None, description="First position, below `upper`; encoder counts in encoder mode."
    )
    upper: Pulses | None = Field(None, description="Last position, in pulses or encoder counts.")

    @model_validator(mode="after")
    def _is_not_empty(self) -> Self:
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise ValueError("lower must be less than upper")
        return self


class Bounds(Reply, args="{lower},{upper}"):
    """The stretch of positions that is set, in pulses; -999,999,999 to +999,999,999 where none is."""

    lower: SignedValue
    upper: SignedValue


class Plain(Whole):
    """A signed number in decimal only, not filled, where the manual states no width."""

    pattern = r"[+-]?\d{1,12}"


Speed = Annotated[int, Field(ge=1, le=1_000_000), Number()]
"""A speed in pps."""
