"""The parts of the OpenAPI document that generators of clients need, and FastAPI does not write."""

from collections.abc import Callable, Iterable, Iterator
from copy import deepcopy
from typing import Any, Final

from api.common.documentation import CORE, SECTIONS
from api.common.idempotency import LONGEST_KEY, takes_key

Schema = dict[str, Any]

_REFERENCE = "#/components/schemas/"
_JSON = "application/json"
COMMAND = "/commands/"
"""The part of a path that only single rows of the command tables have."""


_KEY: Final[Schema] = {
    "name": "Idempotency-Key",
    "in": "header",
    "required": False,
    "description": "With it the request is carried out once, however often it is sent; a repetition has the "
    "first answer.",
    "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_KEY, "pattern": "^[!-~]+$"},
}


_MORE: Final = """\

This is what is needed first. [All](docs/all) has the routes of single commands, too: `.../commands/NAME`."""


def complete(document: Schema) -> None:
    """Describe sections, name the Idempotency-Key, show examples, and put defaults into descriptions.

    Strict TypeScript demands a member that has a default, for a reader always finds it; but here
    a client writes it.
    """
    for path, item in document["paths"].items():
        for method, operation in item.items():
            _complete_parameters(operation, keyed=takes_key(method.upper(), path, operation.get("x-right")))
    document["tags"] = list(_sections(document["paths"]))
    for operation in _operations(document):
        for content in _contents(operation.get("requestBody", {})):
            content.setdefault("examples", _examples(document, content["schema"]))
            for member in content["schema"].get("properties", {}).values():
                _describe_default(member)
    for schema in _reached(
        document, [op["requestBody"] for op in _operations(document) if "requestBody" in op]
    ):
        for member in schema.get("properties", {}).values():
            _describe_default(member)


def _complete_parameters(operation: Schema, *, keyed: bool) -> None:
    for parameter in operation.get("parameters", ()):
        if parameter["in"] == "path" and (examples := parameter["schema"].get("examples")):
            parameter["example"] = examples[0]  # Swagger UI fills in no other
    if keyed:
        operation.setdefault("parameters", []).append(_KEY)


def core_of(document: Schema) -> Schema:
    """The document of what is needed first, as the sections say: a light one to generate a client from.

    An event is any event there, since asyncapi.yaml has their types; and each choice has a name.
    """
    core = deepcopy(_part(resources_of(document), lambda _, operation: CORE.keys() >= {*operation["tags"]}))
    schemas = core["components"]["schemas"]
    schemas["EventList"]["properties"]["events"]["items"] = {"$ref": f"{_REFERENCE}Event"}
    schemas["Event"] = _any_event(schemas["StreamGapEvent"])
    _name_choices(schemas)
    core = _part(core, lambda *_: True)
    return {**core, "info": {**core["info"], "description": core["info"]["description"] + _MORE}}


def _any_event(one: Schema) -> Schema:
    """Describe what all events have, after one of them."""
    any_text, any_object = {"type": "string"}, {"type": "object", "additionalProperties": True}
    said = {"type": {**any_text, "title": "Type"}, "data": {**any_object, "title": "Data"}}
    told = "What has happened; the types of events, and the data of each, are in asyncapi.yaml."
    return {**one, "title": "Event", "description": told, "properties": {**one["properties"], **said}}


def _name_choices(schemas: dict[str, Schema]) -> None:
    """Move what may be left out (null) and has no name yet into a schema of its own."""
    for owner, schema in [*schemas.items()]:
        for member in schema.get("properties", {}).values():
            options = member.get("anyOf", [])
            for number, option in enumerate(options):
                if "enum" in option or option.get("type") == "object":
                    name = _free_name(schemas, owner, member["title"].replace(" ", ""), option)
                    schemas[name] = {**option, "title": name}
                    options[number] = {"$ref": _REFERENCE + name}


def _free_name(schemas: dict[str, Schema], owner: str, own: str, option: Schema) -> str:
    """Name a choice after its member, and another of that name after its owner, too."""
    is_enum_of_that_name = "enum" in option and own not in schemas
    return own if is_enum_of_that_name or schemas.get(own) == {**option, "title": own} else owner + own


def resources_of(document: Schema) -> Schema:
    """The document without the routes of single commands, which stay few and have the better names."""
    return _part(document, lambda path, _: COMMAND not in path)


def _part(document: Schema, has: Callable[[str, Schema], bool]) -> Schema:
    """Some operations of the document, with the schemas that they refer to."""
    operations = {
        path: {method: operation for method, operation in item.items() if has(path, operation)}
        for path, item in document["paths"].items()
    }
    paths = {path: item for path, item in operations.items() if item}
    kept = {id(schema) for schema in _reached(document, [paths])}
    schemas = document["components"]["schemas"]
    components = {name: schema for name, schema in schemas.items() if id(schema) in kept}
    return {
        **document,
        "tags": list(_sections(paths)),
        "paths": paths,
        "components": {**document["components"], "schemas": components},
    }


def _sections(paths: Schema) -> Iterator[Schema]:
    """Describe the sections that some paths have."""
    used = {
        tag for path in paths.values() for operation in path.values() for tag in operation.get("tags", ())
    }
    for name, description in SECTIONS.items():
        if name in used:
            yield {"name": name, "description": description}


def _operations(document: Schema) -> Iterator[Schema]:
    for path in document["paths"].values():
        yield from path.values()


def _contents(body: Schema) -> Iterator[Schema]:
    if content := body.get("content", {}).get(_JSON):
        yield content


def _examples(document: Schema, schema: Schema) -> Schema:
    """Collect the examples of a body's schema, or of each of its kinds."""
    schemas = [_resolved(document, option) for option in schema.get("oneOf", [schema])]
    found = [value for option in schemas for value in option.get("examples", ())]
    return {value.get("kind") or value.get("mode") or "example": {"value": value} for value in found}


def _describe_default(member: Schema) -> None:
    default = member.pop("default", None)
    if default is not None:
        said = f"Left out: {str(default).lower() or 'empty'}."
        member["description"] = f"{member.get('description', '')} {said}".strip()


def _resolved(document: Schema, schema: Schema) -> Schema:
    name = schema.get("$ref", "").removeprefix(_REFERENCE)
    resolved: Schema = document["components"]["schemas"][name] if name else schema
    return resolved


def _reached(document: Schema, parts: Iterable[Any]) -> list[Schema]:
    """Give the named schemas to which some parts of the document lead, each once."""
    schemas = document["components"]["schemas"]
    reached: dict[str, Schema] = {}
    waiting = list(parts)
    while waiting:
        for name in _names(waiting.pop()):
            if name not in reached:
                reached[name] = schemas[name]
                waiting.append(schemas[name])
    return list(reached.values())


def _names(part: Any) -> Iterator[str]:
    """Give the names of the schemas that a part of the document refers to."""
    if isinstance(part, dict):
        if isinstance(reference := part.get("$ref"), str):
            yield reference.removeprefix(_REFERENCE)
        part = part.values()
    elif not isinstance(part, list):
        return
    for item in part:
        yield from _names(item)
