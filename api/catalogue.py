"""The command table as data: every row with its parameters, reply, rules and errors."""

from functools import cache
from typing import Any, Literal

from fastapi import Response
from pydantic import BaseModel, Field

from api.problems import DECLARED
from api.requests import new_router
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.errors import lookup
from protocols.rorze.row import LinkMasterCommand
from protocols.table import Retry

router = new_router("commands")


class CommandError(BaseModel):
    """An error with which a controller may refuse a command (RC-420 manual 21)."""

    code: str
    ja: str
    en: str


class CommandInfo(BaseModel):
    """A row of the command table (RC-420 manual 14 and 19)."""

    family: Literal["rorze"]
    code: str
    name: str = Field(description="As in /bodies/{body_id}/commands/NAME.")
    addressed_to: Literal["body", "line"]
    title_ja: str
    title_en: str
    parameters: dict[str, Any] = Field(description="JSON Schema of the request body.")
    reply: dict[str, Any] = Field(description="JSON Schema of the reply.")
    usage: list[str] = Field(description="How the parameters are written on the line.")
    modes: list[Literal["stepping", "encoder", "servo"]] = Field(
        description="Operating modes in which it is allowed."
    )
    while_moving: bool = Field(description="Whether it is allowed while the motor moves.")
    in_programs: bool = Field(description="Whether it is allowed in user programs.")
    starts_motion: bool
    retry: Retry = Field(description="What may be repeated by itself when no reply came.")
    errors: list[CommandError]
    example: list[str] = Field(description="Commands and replies in turn, as the manual prints them.")


class CommandList(BaseModel):
    """The whole table, in the manual's order."""

    commands: list[CommandInfo]


@router.get("/commands", name="list_commands", response_model=CommandList, responses=DECLARED)
async def list_commands() -> Response:
    """List every command the controllers know."""
    return Response(_table(), media_type="application/json")


@cache
def _table() -> str:
    return CommandList(commands=[_info(row) for row in COMMANDS.values()]).model_dump_json()


def _info(row: Row) -> CommandInfo:
    japanese, english = row.titles()
    names: tuple[Literal["stepping", "encoder", "servo"], ...] = ("stepping", "encoder", "servo")
    return CommandInfo(
        family="rorze",
        code=row.code,
        name=row.name(),
        addressed_to="line" if issubclass(row, LinkMasterCommand) else "body",
        title_ja=japanese,
        title_en=english,
        parameters=row.model_json_schema(),
        reply=row.reply_type().model_json_schema(),
        usage=row.usage(),
        modes=[names[int(mode)] for mode in row.modes],
        while_moving=row.moving,
        in_programs=row.program,
        starts_motion=row.starts_motion(),
        retry=row.retry,
        errors=[
            CommandError(code=f"0x{code:02X}", ja=lookup(code).ja, en=lookup(code).en)
            for code in sorted(row.errors)
        ],
        example=list(row.example),
    )
