"""The OpenAPI document: the file is what the app says, and generators can work with it."""

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest

from api import openapi
from gateway.event_types import EVENT_TYPES
from protocols.fics.commands import COMMANDS as FICS_COMMANDS
from protocols.rorze.commands import COMMANDS

TEXT, RESOURCES, CORE = (
    (openapi.FOLDER / name).read_text("utf-8") for name in ("openapi.json", "resources.json", "core.json")
)
NEEDED_FIRST = {
    *("startMove", "getMove", "listMoves", "startGroupMove", "startRobotMove", "getRobotMove", "runMacro"),
    *("stopAll", "stopBody", "stopGroup", "stopRobot", "stopUnit"),
    *("getPosition", "getStatus", "getPositions", "getStatuses", "getUnitPosition", "getUnitStatus"),
    *("listLines", "getLine", "listBodies", "getBody", "listGroups", "listRobots", "getRobot", "readyz"),
    *("listAlarms", "resetAlarm", "listRobotErrors", "resetRobotErrors", "getIdentity"),
    *("acknowledgePowerCycle", "acknowledgeBodyPowerCycle", "listBodyPositions", "storeBodyPositions"),
}
DOCUMENT: dict[str, Any] = json.loads(TEXT)


def operations() -> list[dict[str, Any]]:
    return [operation for path in DOCUMENT["paths"].values() for operation in path.values()]


def test_the_files_are_what_the_app_says() -> None:
    for name, text in openapi.documents().items():
        assert (openapi.FOLDER / name).read_text("utf-8") == text, "write it anew: python -m api.openapi"


def test_the_resources_have_no_route_of_a_single_command() -> None:
    paths = json.loads(RESOURCES)["paths"]
    assert {path for path in DOCUMENT["paths"] if "/commands/" not in path} == set(paths)


def test_the_core_has_all_that_a_newcomer_does_first() -> None:
    names = {it["operationId"] for path in json.loads(CORE)["paths"].values() for it in path.values()}
    assert names >= NEEDED_FIRST
    assert "listEvents" not in names, "events are described in asyncapi.yaml"


def test_a_client_generated_from_the_core_is_light() -> None:
    """A generator writes a file for each operation and each schema, and makes up names for what has none."""
    core = json.loads(CORE)
    schemas = core["components"]["schemas"]
    assert len(schemas) <= 120
    assert len(schemas) + sum(map(len, core["paths"].values())) + len(core["tags"]) <= 142
    named = list(schemas.values())
    nameless = [part for part in parts_of([core["paths"], *named]) if "enum" in part and part not in named]
    assert nameless == []


def parts_of(part: Any) -> Iterator[dict[str, Any]]:
    if isinstance(part, dict):
        yield part
        part = list(part.values())
    for inner in part if isinstance(part, list) else ():
        yield from parts_of(inner)


@pytest.mark.parametrize("part", [RESOURCES, CORE])
def test_a_part_has_only_schemas_that_it_refers_to(part: str) -> None:
    named = set(re.findall(r'"#/components/schemas/([^"]+)"', part))
    assert named == set(json.loads(part)["components"]["schemas"])


def bodies() -> Iterator[tuple[str, dict[str, Any]]]:
    for operation in operations():
        if body := operation.get("requestBody"):
            yield operation["operationId"], body["content"]["application/json"]


NEVER_ALONE = {
    "sendSetCommunicationMode",
    "sendBeginPositionUpload",
    "sendEndPositionUpload",
    "sendUploadPosition",
}
"""Commands that are always refused when sent alone: they show no example."""


def test_every_request_with_members_shows_an_example() -> None:
    schemas = DOCUMENT["components"]["schemas"]
    for name, content in bodies():
        reference = content["schema"].get("$ref", "").rpartition("/")[2]
        if (not reference or schemas[reference]["properties"]) and name not in NEVER_ALONE:
            assert content["examples"], name


def test_no_request_has_a_default_for_strict_typescript_demands_the_member_then() -> None:
    schemas = DOCUMENT["components"]["schemas"]
    seen: set[str] = set()
    waiting = [content["schema"] for _, content in bodies()]
    while waiting:
        text = json.dumps(waiting.pop())
        assert '"default": ' not in text
        new = set(re.findall(r'"#/components/schemas/([^"]+)"', text)) - seen
        waiting += [schemas[name] for name in new]
        seen |= new
    assert "Left out: high." in schemas["RelativeMoveRequest"]["properties"]["speed"]["description"]


def test_every_section_is_described_in_every_document() -> None:
    for document in (DOCUMENT, json.loads(RESOURCES), json.loads(CORE)):
        used = {
            tag
            for path in document["paths"].values()
            for operation in path.values()
            for tag in operation["tags"]
        }
        assert used == {section["name"] for section in document["tags"]}
        assert all(section["description"].endswith(".") for section in document["tags"])


def test_the_core_leads_to_the_whole_and_takes_the_same_key() -> None:
    core = json.loads(CORE)
    assert "(docs/all)" in core["info"]["description"]
    assert core["components"]["securitySchemes"] == DOCUMENT["components"]["securitySchemes"]


def test_events_are_a_union_by_type() -> None:
    items = DOCUMENT["components"]["schemas"]["EventList"]["properties"]["events"]["items"]
    assert items["discriminator"]["propertyName"] == "type"
    assert set(items["discriminator"]["mapping"]) == set(EVENT_TYPES)


def test_groups_answer_in_one_shape() -> None:
    shapes = [name for name in DOCUMENT["components"]["schemas"] if name.startswith(("GroupReply", "Member"))]
    assert shapes == ["GroupReply", "MemberReply"]


def test_every_reference_leads_somewhere() -> None:
    schemas = DOCUMENT["components"]["schemas"]
    named = set(re.findall(r'"#/components/schemas/([^"]+)"', TEXT))
    assert named <= set(schemas)
    assert not [name for name in schemas if "__" in name], "two models share a name"


def test_every_operation_has_a_name_of_its_own_and_tells_its_problems() -> None:
    names = [operation["operationId"] for operation in operations()]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch("[a-z]+([A-Z0-9][a-z0-9]*)*", name) for name in names)
    problem = {"schema": {"$ref": "#/components/schemas/Problem"}}
    for operation in operations():
        if operation["operationId"] not in ("livez", "readyz"):
            assert operation["responses"]["4XX"]["content"] == {"application/problem+json": problem}


def test_no_path_parameter_has_a_name_that_breaks_clients() -> None:
    for operation in operations():
        for parameter in operation.get("parameters", ()):
            assert parameter["name"] not in ("body", "client", "self")


def test_no_list_or_choice_has_the_name_of_its_schema_for_clients_make_variables_of_both() -> None:
    for name, schema in DOCUMENT["components"]["schemas"].items():
        own = re.sub("(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
        member = schema.get("properties", {}).get(own, {})
        assert member.get("type") != "array", name
        assert "enum" not in member, name


def test_discriminators_have_no_default() -> None:
    for name, schema in DOCUMENT["components"]["schemas"].items():
        for field, described in schema.get("properties", {}).items():
            if field in ("kind", "mode") and "const" in described:
                assert field in schema["required"], name


def test_every_command_carries_its_code() -> None:
    sent = [operation for operation in operations() if operation["operationId"].startswith("send")]
    codes = {operation["x-code"] for operation in sent if "x-code" in operation}
    assert codes == {*COMMANDS, *FICS_COMMANDS}


def test_what_can_move_a_motor_is_marked() -> None:
    paths = DOCUMENT["paths"]
    marked = {path for path, its in paths.items() if its.get("post", {}).get("x-effect") == "motion"}
    begin = ("/moves", "/jogs", "/program/runs", "/macros/{name}/runs", "/commands/home", "/commands/move-to")
    assert {path for path, its in paths.items() if "post" in its and path.endswith(begin)} <= marked
    assert all(paths[path]["post"]["x-right"] == "operate" for path in marked)


def test_the_key_that_makes_repetitions_harmless_stands_at_all_that_does_something_but_stops() -> None:
    def keyed(operation: dict[str, Any]) -> bool:
        return any(it["name"] == "Idempotency-Key" for it in operation.get("parameters", ()))

    paths = DOCUMENT["paths"]
    assert keyed(paths["/bodies/{body_id}/moves"]["post"])
    assert keyed(paths["/robots/{robot_id}/errors/reset"]["post"])
    assert keyed(paths["/bodies/{body_id}/program"]["put"])
    for path in (
        "/stop",
        "/bodies/{body_id}/stop",
        "/bodies/{body_id}/commands/stop-immediately",
        "/bodies/{body_id}/raw",
    ):
        assert not keyed(paths[path]["post"]), path
    assert not any(keyed(item["get"]) for item in paths.values() if "get" in item)


UNIT_IN_NAME = re.compile(r"(^|_)(baud|s|ms|us|ns|hz|pps|pps_s|percent|um|pulses|seconds|bytes)$")
UNIT_IN_WORDS = re.compile(
    r"pulse|percent|second|_unit|counted_in|counts|`units?`|micrometres|degree|%|number", re.IGNORECASE
)
NUMBERS_OF_THINGS = re.compile(
    r"(^|_)(number|numbers|axis|axes|set|path|index|unit|units|channel|input|output|point|line|column|token|address"
    r"|mode|status|cause|code|error|labels|comment|factor|retries|filters|records|counters|waiting|per_turn"
    r"|unknown|label|[CMSIO])$"
)
COUNTS = {"points", "asked", "read", "expected", "written", "verified", "commands", "instructions", "steps"}


def test_every_value_has_its_unit_in_its_name_beside_it_or_in_its_description() -> None:
    schemas: dict[str, Any] = json.loads(RESOURCES)["components"]["schemas"]
    bare = [
        f"{name}.{member}"
        for name, schema in schemas.items()
        if not {"unit", "units", "counted_in"} & schema.get("properties", {}).keys()
        for member, described in schema.get("properties", {}).items()
        if is_number(described) and member not in COUNTS
        if not (UNIT_IN_NAME.search(member) or NUMBERS_OF_THINGS.search(member))
        if not UNIT_IN_WORDS.search(f"{schema.get('description')} {described.get('description')}")
    ]
    known = ["VariableSetting.value", "VariableValue.value"]
    assert bare == known, "programs know"


def is_number(schema: dict[str, Any]) -> bool:
    """Say whether a schema is of numbers, or of lists or tables of them."""
    inner = [schema.get("items"), schema.get("additionalProperties"), *schema.get("anyOf", ())]
    return schema.get("type") in ("number", "integer") or any(
        is_number(it) for it in inner if isinstance(it, dict)
    )
