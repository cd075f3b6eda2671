"""Errors of the system, and resetting them (C-HOST manual 2-12 to 2-14)."""

from enum import StrEnum
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, field_serializer

from protocols.fics.notation import LAST_UNIT, AxisName, DriverError, FicsDigits, Token
from protocols.fics.row import Query, RobotAction
from protocols.table import Effect, Reply, Retry, Wire

ERROR_PATTERN = r"E[0-9]{2}|[0-9]{3}"


class CurrentError(Reply, args="{error}"):
    """The error that stands, or the last one of communication."""

    error: Annotated[str, Field(pattern="^(E[0-9]{2}|[0-9]{3})$"), Token(ERROR_PATTERN)] = Field(
        description="`E` and two digits: the last command was refused so; three digits: an error of the "
        "system, which stands until it is reset. `E00` and `000`: none."
    )


class TakeCurrentError(
    Query[CurrentError],
    code="ERR",
    during_upload=True,
    retry=Retry.NEVER,
    effect=Effect.READ,
    example=("ERR", "ERR E05", "ERR", "ERR 183", "ERR", "ERR E00"),
):
    """エラー状態の問い合わせ: take the present error.

    Clears an error of communication by telling it; an error of the system stays.
    """


class DriverSignals(BaseModel):
    """Signals of a driver beside its error code."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    emergency: bool = Field(description="True while the driver's stop input is active.")
    plus_overtravel: bool
    minus_overtravel: bool


class SignalsWire(Wire):
    """`E`, `+` and `-`, each at its place or a blank; blanks at the end may be missing."""

    pattern = r"[E ][+ ]?[- ]?"

    def encode(self, value: Any) -> str:
        """Write three characters."""
        signals = (value.emergency, value.plus_overtravel, value.minus_overtravel)
        return "".join(sign if on else " " for sign, on in zip("E+-", signals, strict=True))

    def decode(self, text: str) -> DriverSignals:
        """Read up to three characters."""
        return DriverSignals(emergency="E" in text, plus_overtravel="+" in text, minus_overtravel="-" in text)


class UnitCharacter(Wire):
    """The unit's number, or a blank in a system of a single unit."""

    pattern = rf"[ 1-{LAST_UNIT}]"

    def encode(self, value: Any) -> str:
        """Write one character."""
        return str(value or " ")

    def decode(self, text: str) -> int:
        """Read one character; a blank is 0."""
        return int(text.strip() or 0)


class DetailKind(StrEnum):
    """The lines of the table in C-HOST manual 2-13."""

    NONE = "none"
    EMERGENCY = "emergency"
    DRIVER = "driver"
    CONNECTION = "connection"
    TIMEOUT = "timeout"
    FICS = "fics"
    """A message error (2nn) or any other error of the system."""
    UNREADABLE = "unreadable"
    """Text in none of these layouts."""


_KINDS = tuple(DetailKind)

# The table's columns are damaged: one character per dash is an assumption, so any other text is kept.
_LAYOUTS = (
    "----"
    "|----{signals}"
    "|{unit}{axis}{driver_error}<{signals}>"
    "|{unit}{axis} C"
    "|-- T{program}{step}"
    "|-{error}{program}{step}<{routine_error}>"
    "|{text}"
)


class ErrorDetail(Reply, args=_LAYOUTS):
    """Details of the latest error; its kind decides which fields are given."""

    unit: Annotated[int, Field(ge=0, le=LAST_UNIT), UnitCharacter()] | None = Field(
        None, description="Number of the unit; null in a system of a single unit, too."
    )
    axis: AxisName | None = Field(None, description="The motor axis.")
    driver_error: DriverError | None = Field(
        None, description="The driver's own code, hexadecimal as in `31h`; `FFh`: not ready."
    )
    signals: Annotated[DriverSignals, SignalsWire()] | None = None
    error: Annotated[int, Field(ge=0, le=999), FicsDigits(3)] | None = Field(
        None, description="The error of the system."
    )
    program: Annotated[int, Field(ge=0, le=999), FicsDigits(3)] | None = None
    step: Annotated[int, Field(ge=0, le=9999), FicsDigits(4)] | None = None
    routine_error: Annotated[int, Field(ge=0, le=99), FicsDigits(2)] | None = Field(
        None, description="Error of the coordinate conversion, with error 183."
    )
    text: Annotated[str, Field(pattern="^[ -~]*$"), Token("[ -~]*")] | None = Field(
        None, description="The answer as it came, if it has no known layout."
    )

    @field_serializer("unit")
    def _shown(self, unit: int | None) -> int | None:
        return unit or None

    @property
    def kind(self) -> DetailKind:
        """Kind of the error: its line in the table."""
        return _KINDS[self.form_index]


class GetErrorDetail(
    Query[ErrorDetail],
    code="ERD",
    example=(
        "ERD",
        "ERD ----",
        "ERD",
        "ERD ----E  ",
        "ERD",
        "ERD 1XFFE+-",
        "ERD",
        "ERD 2A C",
        "ERD",
        "ERD -- T0010020",
        "ERD",
        "ERD -2010010020",
        "ERD",
        "ERD -183001002005",
    ),
):
    """エラー状態の詳細問い合わせ: get the details of the latest error; clears nothing."""


class ResetErrors(
    RobotAction, code="DRT", retry=Retry.CONDITIONAL, effect=Effect.CLEARING, example=("DRT", "DRT")
):
    """エラーリセット: reset the errors of the system and the state EMERGENCY."""
