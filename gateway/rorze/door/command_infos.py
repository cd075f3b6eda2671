"""The command table as data: every row with its parameters, reply, rules and errors."""

from collections.abc import Iterator
from functools import cache
from typing import Literal

from pydantic import Field

from gateway.core.records import AnswerModel
from gateway.door.command_info import CommandInfoBase, shared
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.errors import lookup
from protocols.rorze.row import MODE_NAMES, LinkMasterCommand, ModeName


class CommandError(AnswerModel):
    """An error with which a controller may refuse a command (RC-420 manual 21)."""

    code: str
    ja: str
    en: str


class CommandInfo(CommandInfoBase):
    """A row of the RC-420 command table (RC-420 manual 14 and 19)."""

    family: Literal["rorze"]
    addressed_to: Literal["body", "line"]
    modes: list[ModeName] = Field(description="Operating modes in which it is allowed.")
    while_moving: bool = Field(description="True if it is allowed while the motor moves.")
    in_programs: bool = Field(description="True if it is allowed in user programs.")
    errors: list[CommandError]


INFO = CommandInfo


def infos() -> Iterator[CommandInfo]:
    """All rows, in the manual's order."""
    return map(_info, COMMANDS.values())


@cache
def _info(row: Row) -> CommandInfo:
    return CommandInfo(
        **shared(row),
        family="rorze",
        addressed_to="line" if issubclass(row, LinkMasterCommand) else "body",
        modes=[MODE_NAMES[mode] for mode in row.modes],
        while_moving=row.moving,
        in_programs=row.program,
        errors=[
            CommandError(code=f"0x{code:02X}", ja=error.ja, en=error.en)
            for code, error in ((code, lookup(code, row.code)) for code in sorted(row.errors))
        ],
    )
