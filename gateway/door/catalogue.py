"""The command tables as data: every row with its parameters, reply, rules and errors."""

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, Field

from gateway.core import numbers
from gateway.core.operation import Rows
from gateway.core.rights import RIGHT_OF, Right
from gateway.texts import catalogue
from protocols.fics.commands import ROWS as FICS_ROWS
from protocols.fics.commands import of_the_robot
from protocols.fics.row import Block, FicsCommand, WhenAnswered
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.errors import lookup
from protocols.rorze.row import MODE_NAMES, LinkMasterCommand, ModeName, RorzeCommand
from protocols.table import Effect, Retry

ROWS: Final = Rows("commands")
Family = Literal["rorze", "fics"]


class CommandError(BaseModel):
    """An error with which a controller may refuse a command (RC-420 manual 21)."""

    code: str
    ja: str
    en: str


class _CommandInfo(BaseModel):
    code: str = Field(description="Its three characters; empty where a macro's name takes their place.")
    name: str = Field(description="The last part of its route, .../commands/NAME.")
    title_ja: str
    title_en: str
    parameters: dict[str, Any] = Field(description="JSON Schema of the request body.")
    reply: dict[str, Any] = Field(description="JSON Schema of the reply.")
    usage: list[str] = Field(description="How the parameters are written on the line.")
    starts_motion: bool
    effect: Effect = Field(description="What it does, by which the right follows.")
    right: Right = Field(description="What sending it takes.")
    retry: Retry = Field(
        description="What repeating it without a reply would do. The gateway repeats only "
        "`read` and software stops. `setting`: read back, and repeat what differs; `conditional`: look "
        "first, for it may hide an alarm, wear the flash memory or move; `never`: it is done twice."
    )
    example: list[str] = Field(description="Commands and replies in turn, as the manual prints them.")


class CommandInfo(_CommandInfo):
    """A row of the RC-420 command table (RC-420 manual 14 and 19)."""

    family: Literal["rorze"]
    addressed_to: Literal["body", "line"]
    modes: list[ModeName] = Field(description="Operating modes in which it is allowed.")
    while_moving: bool = Field(description="Whether it is allowed while the motor moves.")
    in_programs: bool = Field(description="Whether it is allowed in user programs.")
    errors: list[CommandError]


class FicsCommandInfo(_CommandInfo):
    """A row of the C-HOST command table (C-HOST manual 1-7 and 4-1)."""

    family: Literal["fics"]
    addressed_to: Literal["robot", "unit"]
    answered: WhenAnswered = Field(description="When it is answered; Ver.2 answers only `always`.")
    blocked_by: list[Block] = Field(description="What makes the robot refuse it; the manual's letters.")
    during_upload: bool = Field(description="Whether it is allowed between POF 1 and POF 2.")


class CommandList(BaseModel):
    """The whole tables of both families, in the manuals' order."""

    commands: list[Annotated[CommandInfo | FicsCommandInfo, Field(discriminator="family")]]


class Translations(BaseModel):
    """What the gateway says in English only, in other languages: hints of parameters, reasons, notes."""

    ja: dict[str, str] = Field(description="Japanese by the English sentence.")


class Numbers(BaseModel):
    """Numbers that never change, in later versions neither; each type and cause has one of its own."""

    events: dict[str, int] = Field(description="By the type of an event, from 1.")
    alarms: dict[str, int] = Field(description="By the cause of an alarm, from 1.")


FamilyName = Annotated[Family | None, Field(description="Only the commands of one family.")]


@ROWS.get("/commands", any_scope=True, by_hand="the tables are written once, and answered with their tag")
async def list_commands(*, family: FamilyName = None) -> CommandList:
    """List every command that controllers and robots know."""
    return tables_of(*(_COMMANDS if family is None else (family,)))


@ROWS.get("/translations", any_scope=True)
async def list_translations() -> Translations:
    """Give in other languages what the gateway says in English only: hints of parameters, reasons, notes."""
    return Translations(ja=dict(catalogue("sentences.ja")))


@ROWS.get("/numbers", any_scope=True)
async def list_numbers() -> Numbers:
    """Give the numbers of event types and of causes of alarms, for systems that know things by numbers."""
    return Numbers(events=dict(numbers.EVENTS), alarms=dict(numbers.ALARMS))


def tables_of(*families: Family) -> CommandList:
    """The tables of some families."""
    return CommandList(commands=[command for family in families for command in _COMMANDS[family]()])


def _shared(row: type[RorzeCommand[Any]] | type[FicsCommand[Any]]) -> dict[str, Any]:
    japanese, english = row.titles()
    return {
        "code": row.code,
        "name": row.name(),
        "title_ja": japanese,
        "title_en": english,
        "parameters": row.model_json_schema(),
        "reply": row.reply_type().model_json_schema(),
        "usage": row.usage(),
        "starts_motion": row.starts_motion(),
        "effect": row.effect,
        "right": RIGHT_OF[row.effect],
        "retry": row.retry,
        "example": list(row.example),
    }


@cache
def _rorze_info(row: Row) -> CommandInfo:
    return CommandInfo(
        **_shared(row),
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


@cache
def _fics_info(row: type[FicsCommand[Any]]) -> FicsCommandInfo:
    return FicsCommandInfo(
        **_shared(row),
        family="fics",
        addressed_to="robot" if of_the_robot(row) else "unit",
        answered=row.answered,
        blocked_by=sorted(row.blocked),
        during_upload=row.during_upload,
    )


_COMMANDS: Final[Mapping[Family, Callable[[], Iterable[CommandInfo | FicsCommandInfo]]]] = {
    "rorze": lambda: map(_rorze_info, COMMANDS.values()),
    "fics": lambda: map(_fics_info, FICS_ROWS),
}
