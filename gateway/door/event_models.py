"""The events as models, one for each type: what a client can tell apart by `type`."""

import re
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, create_model
from pydantic_core import CoreSchema

from gateway.core.event_types import EventType
from gateway.core.events import CloudEvent, Telemetry
from gateway.core.numbers import EVENTS as NUMBERS
from gateway.event_types import EVENT_TYPES

__all__ = ["EVENT_TYPES", "NUMBERS", "CloudEvent", "EventList", "EventType", "Telemetry", "name_of"]


def name_of(row: EventType) -> str:
    """The type's name as a class has it: BodyMoveStarted."""
    return "".join(word.capitalize() for word in re.split(r"[._]", row.name))


def _model_of(row: EventType) -> type[BaseModel]:
    types: dict[str, Any] = {"type": Literal[row.name], "data": row.data}
    doc = f"{row.when[0].upper()}{row.when[1:]}; about `{row.subject}`."
    base = Telemetry if row.live else CloudEvent
    return create_model(f"{name_of(row)}Event", __base__=base, __doc__=doc, **types)


class _OfTheTable:
    """Any event of the table of types; their 200 models are made when their schema is first asked for."""

    @staticmethod
    def __get_pydantic_core_schema__(_source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        models: Any = Union[tuple(map(_model_of, EVENT_TYPES.values()))]  # noqa: UP007  # of as many as there are
        return handler.generate_schema(Annotated[models, Field(discriminator="type")])


class EventList(BaseModel):
    """Some events in their order, and where the list goes on."""

    model_config = ConfigDict(defer_build=True)

    events: list[Annotated[Any, _OfTheTable]]
    cursor: str
