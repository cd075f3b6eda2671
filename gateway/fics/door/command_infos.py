"""The command table as data: every row with its parameters, reply and rules."""

from collections.abc import Iterator
from functools import cache
from typing import Any, Literal

from pydantic import Field

from gateway.door.command_info import CommandInfoBase, shared
from protocols.fics.commands import ROWS, of_the_robot
from protocols.fics.row import Block, FicsCommand, WhenAnswered


class FicsCommandInfo(CommandInfoBase):
    """A row of the C-HOST command table (C-HOST manual 1-7 and 4-1)."""

    family: Literal["fics"]
    addressed_to: Literal["robot", "unit"]
    answered: WhenAnswered = Field(description="Condition of an answer; Ver.2 answers only `always`.")
    blocked_by: list[Block] = Field(
        description="Conditions in which the robot refuses it, by the manual's letters."
    )
    during_upload: bool = Field(description="True if it is allowed between POF 1 and POF 2.")


INFO = FicsCommandInfo


def infos() -> Iterator[FicsCommandInfo]:
    """All rows, in the manual's order."""
    return map(_info, ROWS)


@cache
def _info(row: type[FicsCommand[Any]]) -> FicsCommandInfo:
    return FicsCommandInfo(
        **shared(row),
        family="fics",
        addressed_to="robot" if of_the_robot(row) else "unit",
        answered=row.answered,
        blocked_by=sorted(row.blocked),
        during_upload=row.during_upload,
    )
