"""Settings that are told and set as they are kept."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from protocols.rorze.row import RorzeCommand
from protocols.table import Reply
from simulator.rorze.actions import acts_out
from simulator.rorze.controller import Rc420

Row = type[RorzeCommand[Any]]


def keeps(getter: Row, setter: Row, setting: str, words: Sequence[str] = ()) -> None:
    """Act out the command that sets a setting by its one parameter, and the one that asks for it.

    One of `words` is kept as its place among them.
    """
    (field,) = setter.model_fields
    reply = getter.reply_type()

    @acts_out(getter)
    def tell(axis: Rc420, _command: RorzeCommand[Any], _now: float) -> Reply:
        kept = getattr(axis.settings, setting)
        return reply.model_validate({field: words[kept] if words else kept})

    @acts_out(setter)
    def change(axis: Rc420, command: RorzeCommand[Any], _now: float) -> None:
        given: Any = getattr(command, field)
        kept: Any = words.index(given) if words else given
        axis.settings = replace(axis.settings, **{setting: kept})
