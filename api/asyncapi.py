"""The events as documents: `python -m api.asyncapi` writes openapi/asyncapi.yaml and docs/events.md anew."""

from pathlib import Path
from typing import Any, Literal

import yaml
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from gateway.door.event_models import EVENT_TYPES, NUMBERS, CloudEvent, EventType, Telemetry, name_of
from gateway.door.system import VERSION

_ROOT = Path(__file__).parent.parent
PATH = _ROOT / "openapi" / "asyncapi.yaml"
PAGE = _ROOT / "docs" / "events.md"

_SCHEMAS = "#/components/schemas/"
_MESSAGES = "#/components/messages/"

INTRODUCTION = """\
# Events

Every type of event that the gateway publishes, with its subject and its data: a CloudEvent 1.0 each, the same
over the WebSocket `/events`, `GET /events/stream` and `GET /events` ([how to read them](api.md#events)). The
same table is `openapi/asyncapi.yaml`, for generators. Numbers are for systems that know things by them: none
ever changes or is given again. `GET /numbers` gives them, and those of causes of alarms.

| Type | No. | Subject | Data | When | Since |
|---|---|---|---|---|---|
"""


def document() -> str:
    """The AsyncAPI 3.0 document of the event streams, the same for every configuration."""
    text: str = yaml.safe_dump(_asyncapi(), sort_keys=False, allow_unicode=True, width=110)
    return text


def page() -> str:
    """The table of events, and the members of their data."""
    rows = "".join(map(_row, EVENT_TYPES.values()))
    schemas = _schemas()
    data = "".join(_section(model, schemas) for model in _models())
    return f"{INTRODUCTION}{rows}\n## Data\n{data}"


def _asyncapi() -> dict[str, Any]:
    messages = {name_of(row): _message(row) for row in EVENT_TYPES.values()}
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "motion-gateway events",
            "version": VERSION,
            "description": "What happens at the plant, one CloudEvent in each text frame.",
        },
        "servers": {"gateway": {"host": "127.0.0.1:8420", "protocol": "ws"}},
        "channels": {
            "events": {
                "address": "/events",
                "description": "All events from now on, or after a cursor.",
                "messages": {name: {"$ref": _MESSAGES + name} for name in messages},
                "bindings": {"ws": {"query": _query()}},
            }
        },
        "operations": {
            "sendEvents": {
                "action": "send",
                "channel": {"$ref": "#/channels/events"},
                "summary": "The gateway sends each event when it happens.",
                "x-right": "view",
            }
        },
        "components": {"messages": messages, "schemas": _schemas()},
    }


def _query() -> dict[str, Any]:
    texts = {
        "after": "Only events after this cursor.",
        "bodies": "Only events of these bodies, groups and robots: addresses joined by commas.",
        "types": "Only events of these types, joined by commas, such as body.move.*,line.down.",
        "sample": "Live values too: so many times a second at most, 0.1 to 50.",
        "snapshot": "true: begin with a stream.snapshot, all that is known now of what is wanted.",
        "ticket": "A ticket of POST /tickets, from clients that can send no header.",
    }
    described = {name: {"type": "string", "description": text} for name, text in texts.items()}
    return {"type": "object", "properties": described}


def _message(row: EventType) -> dict[str, Any]:
    told = {
        "type": {"const": row.name},
        "subject": {"type": "string", "description": row.subject},
        "data": {"$ref": _SCHEMAS + row.data.__name__},
    }
    return {
        "name": row.name,
        "title": row.name,
        "summary": f"{row.when[0].upper()}{row.when[1:]}.",
        "contentType": "application/cloudevents+json",
        "payload": {"allOf": [{"$ref": _SCHEMAS + _base_of(row)}, {"type": "object", "properties": told}]},
        "x-number": NUMBERS[row.name],
        "x-since": row.since,
    }


def _base_of(row: EventType) -> str:
    return (Telemetry if row.live else CloudEvent).__name__


def _models() -> list[type[BaseModel]]:
    return list(dict.fromkeys(row.data for row in EVENT_TYPES.values()))


def _schemas() -> dict[str, Any]:
    models: list[type[BaseModel]] = [CloudEvent, Telemetry, *_models()]
    wanted: list[tuple[type[BaseModel], Literal["serialization"]]] = [
        (model, "serialization") for model in models
    ]
    _, together = models_json_schema(wanted, ref_template=_SCHEMAS + "{model}")
    definitions: dict[str, Any] = together["$defs"]
    return dict(sorted(definitions.items()))


def _row(row: EventType) -> str:
    name = row.data.__name__
    told = f"`{row.name}` | {NUMBERS[row.name]} | `{row.subject}` | [{name}](#{name.lower()})"
    return f"| {told} | {row.when} | {row.since} |\n"


def _section(model: type[BaseModel], schemas: dict[str, Any]) -> str:
    schema = schemas[model.__name__]
    fields = "".join(
        f"- `{name}`: {_shape(field, schemas)}. {field.get('description', '')}".rstrip() + "\n"
        for name, field in schema.get("properties", {}).items()
    )
    told = schema.get("description", "")
    return f"\n### {model.__name__}\n{told}\n\n{fields or '- nothing'}".rstrip() + "\n"


def _shape(field: dict[str, Any], schemas: dict[str, Any]) -> str:
    if "$ref" in field:
        name = str(field["$ref"]).removeprefix(_SCHEMAS)
        return name if "properties" in schemas[name] else _shape(schemas[name], schemas)
    if "anyOf" in field:
        return " or ".join(_shape(option, schemas) for option in field["anyOf"])
    if "enum" in field:
        return "one of " + ", ".join(f"`{value}`" for value in field["enum"])
    if field.get("type") == "array":
        return f"a list of {_shape(field['items'], schemas)}"
    return str(field.get("type", "any value"))


if __name__ == "__main__":
    PATH.write_text(document(), "utf-8")
    PAGE.write_text(page(), "utf-8")
