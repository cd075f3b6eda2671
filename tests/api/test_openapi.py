"""The OpenAPI document: the file is what the app says, and generators can work with it."""

import json
import re
from typing import Any

from api import openapi
from protocols.fics.commands import COMMANDS as FICS_COMMANDS
from protocols.rorze.commands import COMMANDS

TEXT = openapi.document()
DOCUMENT: dict[str, Any] = json.loads(TEXT)


def operations() -> list[dict[str, Any]]:
    return [operation for path in DOCUMENT["paths"].values() for operation in path.values()]


def test_the_file_is_what_the_app_says() -> None:
    assert openapi.PATH.read_text("utf-8") == TEXT, "write it anew: python -m api.openapi"


def test_every_reference_leads_somewhere() -> None:
    schemas = DOCUMENT["components"]["schemas"]
    named = set(re.findall(r'"#/components/schemas/([^"]+)"', TEXT))
    assert named <= set(schemas)
    assert not [name for name in schemas if "__" in name], "two models share a name"


def test_every_operation_has_a_name_of_its_own_and_tells_its_problems() -> None:
    names = [operation["operationId"] for operation in operations()]
    assert len(set(names)) == len(names)
    assert all(name.isidentifier() for name in names)
    problem = {"schema": {"$ref": "#/components/schemas/Problem"}}
    for operation in operations():
        if operation["operationId"] not in ("livez", "readyz"):
            assert operation["responses"]["4XX"]["content"] == {"application/problem+json": problem}


def test_no_path_parameter_has_a_name_that_breaks_clients() -> None:
    for operation in operations():
        for parameter in operation.get("parameters", ()):
            assert parameter["name"] not in ("body", "client", "self")


def test_discriminators_have_no_default() -> None:
    for name, schema in DOCUMENT["components"]["schemas"].items():
        for field, described in schema.get("properties", {}).items():
            if field in ("kind", "mode") and "const" in described:
                assert field in schema["required"], name


def test_every_command_carries_its_code() -> None:
    sent = [operation for operation in operations() if operation["operationId"].startswith("send_")]
    codes = {operation["x-code"] for operation in sent if "x-code" in operation}
    assert codes == {*COMMANDS, *FICS_COMMANDS}
