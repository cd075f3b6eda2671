"""Commands as plain text: those of the table as their rows, others as they were written."""

import types
from functools import lru_cache
from typing import Annotated, Any

from gateway.core.errors import InvalidRequest
from protocols.rorze.commands import COMMANDS
from protocols.rorze.notation import Printable
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply, Retry, WireFault

CODE_LENGTH = 3


class VerbatimReply(Reply, args="{text}"):
    """A reply of which nothing is known."""

    text: Annotated[str, Printable("[ -~]*")]


class Verbatim(
    RorzeCommand[VerbatimReply],
    args="{text}",
    errors=frozenset({0x23, 0x49, 0x4A, 0x5D}),
    retry=Retry.NEVER,
    starts=False,
):
    """A command that is not in the table: it is sent as it was written, once."""

    text: Annotated[str, Printable("[ -%'-~]*")]


def read(text: str) -> RorzeCommand[Any]:
    """Recognise a command of the table, so that the table's rules hold for it; others stay text.

    :raises InvalidRequest: it is not in the table's form.
    """
    code, parameters = text[:CODE_LENGTH], text[CODE_LENGTH:]
    row = COMMANDS.get(code)
    if row is None:
        return _verbatim(code)(text=parameters)
    try:
        return row.read(parameters)
    except WireFault as error:
        raise InvalidRequest(f"{code}: {error}; nothing was sent.", "Write it as the manual does.") from None


@lru_cache(maxsize=64)
def _verbatim(code: str) -> type[Verbatim]:
    row: type[Verbatim] = types.new_class(
        "Verbatim",
        (Verbatim,),
        {"code": code, "args": "{text}"},
        lambda body: body.update(__module__=__name__),
    )
    return row
