"""The parts of the OpenAPI document that generators of clients need, and FastAPI does not write."""

from collections.abc import Callable, Iterable, Iterator, Mapping
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
    schemas = document["components"]["schemas"]
    choices = {tuple(schema["enum"]): name for name, schema in schemas.items() if "enum" in schema}
    for path, item in document["paths"].items():
        for method, operation in item.items():
            _complete_parameters(operation, choices)
            if takes_key(method.upper(), path, operation.get("x-right")):
                operation.setdefault("parameters", []).append(_KEY)
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


def _complete_parameters(operation: Schema, choices: Mapping[tuple[str, ...], str]) -> None:
    for parameter in operation.get("parameters", ()):
        if parameter["in"] == "path" and (examples := parameter["schema"].get("examples")):
            parameter["example"] = examples[0]  # Swagger UI fills in no other
        schema = parameter["schema"]
        if name := choices.get(tuple(schema.get("enum", ()))):  # FastAPI writes out what has a name
            told = {word: value for word, value in schema.items() if word not in ("enum", "type")}
            parameter["schema"] = {"$ref": _REFERENCE + name, **told}


def core_of(document: Schema) -> Schema:
    """The document of what is needed first: a light one to generate a client from.

    Sections and operations say what that is; members that are details have no form there.
    """
    core = deepcopy(_part(document, _is_needed_first))
    for schema in core["components"]["schemas"].values():
        members = schema.get("properties", {})
        members |= {name: _open(member) for name, member in members.items() if member.get("x-detail")}
    core = _part(core, lambda *_: True)
    return {**core, "info": {**core["info"], "description": core["info"]["description"] + _MORE}}


def _is_needed_first(path: str, operation: Schema) -> bool:
    return COMMAND not in path and CORE.keys() >= {*operation["tags"]} and not operation.get("x-later")


def _open(member: Schema) -> Schema:
    """Leave the form of a member open, but for its words."""
    told = f"{member.get('description', '')} Its form is in resources.json.".strip()
    return {"title": member.get("title", ""), "description": told}


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
