"""The command tables as data: every row with its parameters, reply, rules and errors."""

from typing import Annotated, Any, Final, Literal, Union

from pydantic import Field

from gateway.core import numbers
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel
from gateway.door.doors import doors
from gateway.families import FAMILIES
from gateway.texts import catalogue

ROWS: Final = Rows("commands")
_TABLES: Final = {
    name: module for name, family in FAMILIES.items() for module in doors("command_infos", family)
}
Family: Any = Literal[tuple(_TABLES)]
_INFO: Any = Union[tuple(table.INFO for table in _TABLES.values())]  # noqa: UP007


class CommandList(AnswerModel):
    """The whole tables of both families, in the manuals' order."""

    commands: list[Annotated[_INFO, Field(discriminator="family")]]


class Translations(AnswerModel):
    """Translations of texts that the gateway has in English only: hints of parameters, reasons, notes."""

    ja: dict[str, str] = Field(description="The Japanese sentence for each English one.")


class Numbers(AnswerModel):
    """Numbers that never change, in later versions neither; each type and cause has one of its own."""

    events: dict[str, int] = Field(description="Number of each type of event, from 1.")
    alarms: dict[str, int] = Field(description="Number of each cause of an alarm, from 1.")


FamilyName = Annotated[Family | None, Field(description="Only the commands of one family.")]


@ROWS.get("/commands", any_scope=True, by_hand="the tables are written once, and answered with their tag")
async def list_commands(*, family: FamilyName = None) -> CommandList:
    """List every command that controllers and robots know."""
    return tables_of(*(_TABLES if family is None else (family,)))


@ROWS.get("/translations", any_scope=True)
async def list_translations() -> Translations:
    """Give translations of texts that the gateway has in English only: hints, reasons, notes."""
    return Translations(ja=dict(catalogue("sentences.ja")))


@ROWS.get("/numbers", any_scope=True)
async def list_numbers() -> Numbers:
    """Give the numbers of event types and of causes of alarms, for systems that know things by numbers."""
    return Numbers(events=dict(numbers.EVENTS), alarms=dict(numbers.ALARMS))


def tables_of(*families: Family) -> CommandList:
    """The tables of some families."""
    return CommandList(commands=[command for family in families for command in _TABLES[family].infos()])
