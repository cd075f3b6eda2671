"""Macros of the system, called by their own names (C-HOST manual 1-7, 3)."""

from typing import Annotated, Final

from pydantic import AfterValidator, Field

from protocols.fics.notation import Cut, Decimal, Number, PerAxis, Token, expected
from protocols.fics.row import RobotAction
from protocols.table import Effect, Retry

MOST_ARGUMENTS = 4

_STANDARD = """
    MOD UNT JOG JTE ORG LMI LMA AES ASS DRT VAO POM POF POS PCL IOT SCV HMT HMO HMV HMB VSB VSO VST VSS
    SLP SLM VAR VER APS ACD ASD ERR ERD POR IDI IDO
"""
_OF_MOTOR_AXES = "MMI MMA MPS MAO MSO MST MSS MSP MSM"
_END_OF_POSITIONS = "POE"
RESERVED: Final = frozenset(f"{_STANDARD} {_OF_MOTOR_AXES} {_END_OF_POSITIONS}".split())
"""Names that no macro can have: those of commands, and the end of a download of positions."""


def not_a_command(name: str) -> str:
    """Refuse a name that would be taken for a command."""
    if name in RESERVED:
        raise ValueError(f"{name} is a command, so no macro can have this name")
    return name


MacroName = Annotated[
    str,
    Field(pattern="^[A-Z0-9]{3}$"),
    expected("three capital letters or digits"),
    AfterValidator(not_a_command),
    Token("[A-Z0-9]{3}"),
]
Arguments = Annotated[
    list[Number | None],
    Field(min_length=1, max_length=MOST_ARGUMENTS),
    Cut,
    PerAxis(Decimal(), most=MOST_ARGUMENTS),
]


class RunMacro(
    RobotAction,
    args="{macro}< {arguments}>",
    blocked="abc",
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    example=("PCK 150,140,-5", "PCK", "PCK", "PCK"),
):
    """マクロ実行: run a macro, whose name is the command's."""

    macro: MacroName = Field(description="Three capital letters or digits.")
    arguments: Arguments | None = Field(default=None, description="Up to four numbers; null leaves one out.")

    def wire_name(self) -> str:
        """The name of the macro."""
        return self.macro
