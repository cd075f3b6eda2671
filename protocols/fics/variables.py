"""Variables of the system (C-HOST manual 2-35)."""

from typing import Annotated

from pydantic import Field

from protocols.fics.notation import Decimal, Finite, Number, Within
from protocols.fics.row import Query, RobotAction
from protocols.table import RangeFault, Reply, Retry, Wire

LAST_VARIABLE = 99
NUMBER = f"Number of the variable, 0-{LAST_VARIABLE}."


class VariableNumber(Wire):
    """Two digits; a zero in front may be left out."""

    pattern = r"[0-9]+"

    def encode(self, value: int) -> str:
        """Write two digits."""
        return f"{value:02d}"

    def decode(self, text: str) -> int:
        """Read the digits.

        :raises RangeFault: there are more than two.
        """
        if len(text) > 2:
            raise RangeFault(f"{text!r} has more than two digits")
        return int(text)


Variable = Annotated[int, Within(0, LAST_VARIABLE), VariableNumber()]


class VariableValue(Reply, args="V{number}={value}"):
    """A variable and what it holds."""

    number: Variable = Field(description=NUMBER)
    value: Annotated[Finite, Decimal(signed=True)]


class GetVariable(
    Query[VariableValue],
    code="VAR",
    args="V{number}",
    blocked="a",
    echo=("number",),
    example=("VAR V99", "VAR V99=+12.5", "VAR V05", "VAR V05=-3"),
):
    """変数の問い合わせ: get a variable."""

    number: Variable = Field(description=NUMBER)


class SetVariable(
    RobotAction,
    code="VAR",
    args="V{number}={value}",
    blocked="a",
    retry=Retry.SETTING,
    example=("VAR V99=12.5", "VAR", "VAR V05=-3", "VAR"),
):
    """変数の設定: set a variable."""

    number: Variable = Field(description=NUMBER)
    value: Annotated[Number, Decimal()]
