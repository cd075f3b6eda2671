"""What the records that the gateway gives to its clients, and takes from them, have in common."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, JsonValue, TypeAdapter

from gateway.core.origin import current


def _all_required(schema: dict[str, Any]) -> None:
    schema["required"] = list(schema["properties"])


def example(**members: object) -> dict[str, JsonValue]:
    """What a class of requests takes as `json_schema_extra`, to show one that works on the demo."""
    return {"examples": [TypeAdapter(JsonValue).validate_python(members)]}


def request_id_field(which: str = "the request that asked for it") -> Any:
    """The field of a record with the id of the request that it comes from."""
    return Field(default_factory=lambda: current().request_id, description=f"The X-Request-Id of {which}.")


class Record(BaseModel):
    """Something the gateway tells: every member is always there, be it null."""

    model_config = ConfigDict(extra="forbid", json_schema_extra=_all_required)


class RequestModel(BaseModel):
    """What a client asks for: nothing is converted, and nothing unknown is passed over."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False)
