"""Corrections of the OpenAPI document, at a small one."""

from copy import deepcopy
from typing import Any

from api.common.schemas import complete, core_of, resources_of

STOP = {"properties": {"mode": {"type": "string", "default": "decelerate"}, "note": {"default": ""}}}
REFERENCE = {"$ref": "#/components/schemas/Stop"}
DOCUMENT: dict[str, Any] = {
    "info": {"description": "What it is."},
    "paths": {
        "/stop": {
            "post": {
                "tags": ["stops"],
                "requestBody": {
                    "content": {"application/json": {"schema": {"$ref": "#/components/schemas/Stop"}}}
                },
                "responses": {"200": {"schema": {"$ref": "#/components/schemas/Stopped"}}},
            }
        },
        "/lines": {"get": {"tags": ["lines"]}, "post": {"tags": ["backups"]}},
        "/events": {
            "get": {
                "tags": ["events"],
                "responses": {"200": {"schema": {"$ref": "#/components/schemas/EventList"}}},
            }
        },
        "/bodies/{body_id}/commands/home": {
            "post": {
                "tags": ["commands"],
                "responses": {"200": {"schema": {"$ref": "#/components/schemas/Ack"}}},
            }
        },
    },
    "components": {
        "schemas": {
            "Stop": {**STOP, "examples": [{"mode": "immediate"}]},
            "Stopped": {"properties": {"confirmed": {"default": False}}},
            "Ack": {},
            "EventList": {
                "properties": {
                    "events": {"items": {"oneOf": [{"$ref": "#/components/schemas/StreamGapEvent"}]}},
                    "end": {"title": "Why Over", "anyOf": [{"enum": ["gap", "end"]}, {"type": "null"}]},
                }
            },
            "StreamGapEvent": {
                "properties": {"id": {"type": "string"}, "type": {"const": "stream.gap"}, "data": {}},
                "required": ["id", "type", "data"],
            },
        }
    },
}


def test_examples_of_a_schema_stand_at_the_request_body_too() -> None:
    document = deepcopy(DOCUMENT)
    complete(document)
    content = document["paths"]["/stop"]["post"]["requestBody"]["content"]["application/json"]
    assert content["examples"] == {"immediate": {"value": {"mode": "immediate"}}}


def test_defaults_of_requests_become_words_and_those_of_answers_stay() -> None:
    document = deepcopy(DOCUMENT)
    complete(document)
    schemas = document["components"]["schemas"]
    assert schemas["Stop"]["properties"] == {
        "mode": {"type": "string", "description": "Left out: decelerate."},
        "note": {"description": "Left out: empty."},
    }
    assert schemas["Stopped"] == DOCUMENT["components"]["schemas"]["Stopped"]


def test_the_resources_leave_out_commands_and_what_only_they_refer_to() -> None:
    resources = resources_of(DOCUMENT)
    assert set(resources["paths"]) == {"/stop", "/lines", "/events"}
    assert [section["name"] for section in resources["tags"]] == ["stops", "lines", "events", "backups"]
    assert set(resources["components"]["schemas"]) == {"Stop", "Stopped", "EventList", "StreamGapEvent"}


def test_the_core_leaves_out_the_sections_that_are_not_needed_first() -> None:
    core = core_of(DOCUMENT)
    assert set(core["paths"]) == {"/stop", "/lines", "/events"}
    assert set(core["paths"]["/lines"]) == {"get"}
    assert [section["name"] for section in core["tags"]] == ["stops", "lines", "events"]


def test_the_core_has_one_schema_for_all_events_and_a_name_for_each_choice() -> None:
    schemas = core_of(DOCUMENT)["components"]["schemas"]
    assert set(schemas) == {"Stop", "Stopped", "EventList", "Event", "WhyOver"}
    assert schemas["EventList"]["properties"] == {
        "events": {"items": {"$ref": "#/components/schemas/Event"}},
        "end": {"title": "Why Over", "anyOf": [{"$ref": "#/components/schemas/WhyOver"}, {"type": "null"}]},
    }
    assert schemas["WhyOver"] == {"title": "WhyOver", "enum": ["gap", "end"]}
    assert set(schemas["Event"]["properties"]) == {"id", "type", "data"}
    assert "const" not in schemas["Event"]["properties"]["type"]
    assert "WhyOver" not in DOCUMENT["components"]["schemas"]
