"""A row of a command table as data: what is told of the rows of all families."""

from typing import Any

from pydantic import Field

from gateway.core.records import AnswerModel
from gateway.core.rights import RIGHT_OF, Right
from protocols.table import Command, Effect, Retry


class CommandInfoBase(AnswerModel):
    """The part of a command's description that all families share."""

    code: str = Field(
        description="The three characters of the command; empty where a macro's name takes their place."
    )
    name: str = Field(description="Name of the command, the last part of its route .../commands/NAME.")
    title_ja: str
    title_en: str
    parameters: dict[str, Any] = Field(description="JSON Schema of the request body.")
    reply: dict[str, Any] = Field(description="JSON Schema of the reply.")
    usage: list[str] = Field(description="Forms in which the parameters are written on the line.")
    starts_motion: bool
    effect: Effect = Field(description="The effect of the command, from which the right follows.")
    right: Right = Field(description="The right that a caller needs to send the command.")
    retry: Retry = Field(
        description="The effect of repeating it after a missing reply. The gateway repeats only "
        "`read` and software stops. `setting`: read back, and repeat what differs; `conditional`: look "
        "first, for it may hide an alarm, wear the flash memory or move; `never`: it is done twice."
    )
    example: list[str] = Field(description="Commands and replies in turn, as the manual prints them.")


def shared(row: type[Command[Any]]) -> dict[str, Any]:
    """Describe a row in the words that all families share."""
    japanese, english = row.titles()
    return {
        "code": row.code,
        "name": row.name(),
        "title_ja": japanese,
        "title_en": english,
        "parameters": row.model_json_schema(),
        "reply": row.reply_type().model_json_schema(),
        "usage": row.usage(),
        "starts_motion": row.starts_motion,
        "effect": row.effect,
        "right": RIGHT_OF[row.effect],
        "retry": row.retry,
        "example": list(row.example),
    }
