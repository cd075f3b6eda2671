"""Writes the generated part of the Python client: `python clients/python/generate.py`, or `make clients`.

From `openapi/resources.json` it writes a TypedDict for each schema and a method for each operation. The
client for asyncio is written by hand; the one without is made from it, so that there is only one to read.
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
DOCUMENT = HERE.parent.parent / "openapi" / "resources.json"
PACKAGE = HERE / "motion_gateway_client"

Schema = dict[str, Any]

PLAN = "validate_only"
"""The member of a request that makes it a question; methods of their own ask it."""
SCALARS = {"string": "str", "integer": "int", "number": "float", "boolean": "bool", "null": "None"}
WITHOUT_ASYNC = {
    r"\basync (def|with|for)\b": r"\1",
    r"\bawait ": "",
    r"\bAsync(Gateway|Operations|Heart|Client|Iterator|Generator|HTTPTransport)\b": r"\1",
    r"\basynccontextmanager\b": "contextmanager",
    r"\basync_(operations|heart)\b": r"\1",
    r"\baclosing\b": "closing",
    r"\baclose\b": "close",
    r"\baiter_text\b": "iter_text",
    r"\baread\b": "read",
    r"\b__a(enter|exit)__\b": r"__\1__",
    r"\basyncio\b": "time",
    r"  # noqa: ASYNC\d+.*": "",
    r" For asyncio\.": "",
}


def files(document: Schema) -> dict[str, str]:
    """Write every generated file, by its name."""
    operations = _operations(document)
    by_hand = (PACKAGE / "async_gateway.py").read_text("utf-8")
    return {
        "types.py": _formatted(_types(document)),
        "async_operations.py": _formatted(operations),
        "operations.py": _formatted(_without_async(operations)),
        "gateway.py": _formatted(_without_async(by_hand)),
    }


def _without_async(text: str) -> str:
    for pattern, replacement in WITHOUT_ASYNC.items():
        text = re.sub(pattern, replacement, text)
    return text


def _formatted(text: str) -> str:
    for tidy in (("check", "--quiet", "--fix", "--select", "F401,I"), ("format",)):
        command = [sys.executable, "-m", "ruff", *tidy, "--stdin-filename", str(PACKAGE / "_.py"), "-"]
        done = subprocess.run(command, input=text, capture_output=True, text=True, check=True)  # noqa: S603
        text = done.stdout
    return text


# types


def _types(document: Schema) -> str:
    """A class for each schema with members, and an alias for each other."""
    schemas = document["components"]["schemas"]
    texts = [_class(name, schema) for name, schema in schemas.items() if schema.get("type") == "object"]
    texts += [
        f"{name}: TypeAlias = {type_of(schema)}\n"
        for name, schema in schemas.items()
        if schema.get("type") != "object"
    ]
    event = schemas["EventList"]["properties"]["events"]["items"]
    texts.append(f"Event: TypeAlias = {type_of(event)}\n")
    return (
        '"""What the gateway takes and gives; generated from openapi/resources.json."""\n\n'
        "from __future__ import annotations\n\n"
        "from typing import Any, Literal, NotRequired, TypeAlias, TypedDict\n\n" + "\n\n".join(texts)
    )


def _class(name: str, schema: Schema) -> str:
    lines = [f"class {name}(TypedDict):", f"    {_doc(schema.get('description', name))}"]
    required = schema.get("required", ())
    members = {member: its for member, its in schema.get("properties", {}).items() if member != PLAN}
    for member, its in members.items():
        kind = type_of(its) if member in required else f"NotRequired[{type_of(its)}]"
        lines.append(f"    {member}: {kind}")
        if told := its.get("description"):
            lines.append(f"    {_doc(told)}")
    return "\n".join(lines) + "\n"


def _doc(text: str) -> str:
    text = text.replace("\\", "\\\\")
    return f'"""{text}\n"""' if "\n" in text else f'"""{text}"""'


def type_of(schema: Schema) -> str:
    """Name the type of a schema, as an annotation does."""
    if reference := schema.get("$ref"):
        return str(reference).rpartition("/")[2]
    if "const" in schema:
        return f"Literal[{schema['const']!r}]"
    if "enum" in schema:
        return f"Literal[{', '.join(map(repr, schema['enum']))}]"
    if kinds := schema.get("oneOf") or schema.get("anyOf"):
        return " | ".join(dict.fromkeys(map(type_of, kinds)))
    return _container(schema)


def _container(schema: Schema) -> str:
    kind = schema.get("type")
    if kind == "array":
        return f"list[{type_of(schema.get('items', {}))}]"
    if kind == "object":
        of = schema.get("additionalProperties")
        return f"dict[str, {type_of(of) if isinstance(of, dict) else 'Any'}]"
    return SCALARS.get(str(kind), "Any")


# operations


def _operations(document: Schema) -> str:
    methods = [
        text
        for path, item in document["paths"].items()
        for method, operation in item.items()
        for text in _methods(document, path, method, operation)
    ]
    words = set(re.findall(r"\w+", "".join(methods)))
    used = sorted(words & set(document["components"]["schemas"]))
    return (
        '"""Every operation of the gateway as a method; generated from openapi/resources.json."""\n\n'
        "from __future__ import annotations\n\n"
        "from typing import Any, Literal, Protocol\n\n"
        f"from motion_gateway_client.generated.types import ({', '.join(used)})\n"
        "from motion_gateway_client.paths import filled\n\n\n"
        "class AsyncOperations(Protocol):\n"
        '    """What a gateway can be asked; how it is asked is up to `call`."""\n\n'
        "    async def call(self, method: str, path: str, *, query: dict[str, Any] | None = None, "
        "body: Any = None, idempotency_key: str | None = None) -> Any:\n"
        '        """Send a request, and give the answer\'s content."""\n\n' + "\n".join(methods)
    )


def _methods(document: Schema, path: str, method: str, operation: Schema) -> Iterator[str]:
    """Write an operation; one that only plans if it is asked to is two, each with its own answer."""
    name = snake(operation["operationId"])
    told = operation.get("description") or operation["summary"]
    answers = {status: list(_answers(response)) for status, response in operation["responses"].items()}
    if not _can_plan(document, operation):
        answer = " | ".join(dict.fromkeys(chain.from_iterable(answers.values())))
        yield _method(name, told, path, method, operation, answer, "body")
        return
    (started,) = answers["202"]
    (planned,) = (kind for kind in " | ".join(answers["200"]).split(" | ") if kind != started)
    plan_name = name.replace("start", "plan")
    yield _method(name, f"{told} `{plan_name}` does that.", path, method, operation, started, "body")
    told = f"Say what `{name}` would send, and how long it would take; nothing moves."
    as_plan = f'{{**body, "{PLAN}": True}}'
    yield _method(plan_name, told, path, method, operation, planned, as_plan)


def _can_plan(document: Schema, operation: Schema) -> bool:
    schema = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema", {})
    kinds = [document["components"]["schemas"][type_of(it)] for it in schema.get("oneOf", ())]
    return any(PLAN in kind["properties"] for kind in kinds)


def _method(name: str, told: str, path: str, method: str, operation: Schema, answer: str, body: str) -> str:
    """Write a method: path parameters and body by position, the others by name."""
    parameters = operation.get("parameters", [])
    in_path = [it for it in parameters if it["in"] == "path"]
    in_query = [it for it in parameters if it["in"] == "query"]
    positional = [f"{it['name']}: {type_of(it['schema'])}" for it in in_path]
    named = [f"{it['name']}: {_or_none(type_of(it['schema']))} = None" for it in in_query]
    path_values = "".join(f", {it['name']}={it['name']}" for it in in_path)
    sent = [f'"{method.upper()}"', f'filled("{path}"{path_values})']
    if in_query:
        sent.append("query={" + ", ".join(f'"{it["name"]}": {it["name"]}' for it in in_query) + "}")
    if taken := operation.get("requestBody"):
        kind = type_of(taken["content"]["application/json"]["schema"])
        positional.append(f"body: {kind}" if taken.get("required") else f"body: {kind} | None = None")
        positional.append("/")
        sent.append(f"body={body}")
    if method != "get" and operation["x-right"] != "stop":
        named.append("idempotency_key: str | None = None")
        sent.append("idempotency_key=idempotency_key")
    signature = ", ".join(["self", *positional, *(["*", *named] if named else [])])
    return (
        f"    async def {name}({signature}) -> {answer}:\n"
        f"        {_doc(told)}\n"
        f"        answer: {answer} = await self.call({', '.join(sent)})\n"
        f"        return answer\n"
    )


def _or_none(kind: str) -> str:
    return kind if kind.endswith("None") else f"{kind} | None"


def _answers(response: Schema) -> Iterator[str]:
    """Name the types of an answer that is no problem."""
    for media_type, content in response.get("content", {}).items():
        if media_type != "application/problem+json":
            yield "str" if media_type == "text/csv" else type_of(content["schema"])


def snake(name: str) -> str:
    """Name an operation as Python does: start_move."""
    return re.sub(r"(?=[A-Z])", "_", name).lower()


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else PACKAGE / "generated"
    for name, text in files(json.loads(DOCUMENT.read_text("utf-8"))).items():
        (target / name).write_text(text, "utf-8")
