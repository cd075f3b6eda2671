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
                "x-later": True,
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
            "Stopped": {
                "properties": {
                    "confirmed": {"default": False},
                    "counts": {
                        "title": "Counts",
                        "description": "How often.",
                        "$ref": "#/components/schemas/Counts",
                        "x-detail": True,
                    },
                }
            },
            "Counts": {"type": "object", "additionalProperties": {"type": "integer"}},
            "Ack": {},
            "EventList": {"properties": {"events": {"type": "array"}}},
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
    assert set(resources["components"]["schemas"]) == {"Stop", "Stopped", "Counts", "EventList"}


def test_the_core_leaves_out_the_sections_that_are_not_needed_first() -> None:
    core = core_of(DOCUMENT)
    assert set(core["paths"]) == {"/stop", "/lines"}
    assert set(core["paths"]["/lines"]) == {"get"}
    assert [section["name"] for section in core["tags"]] == ["stops", "lines"]


def test_a_parameter_refers_to_the_choices_that_have_a_name() -> None:
    document = deepcopy(DOCUMENT)
    document["components"]["schemas"]["Turn"] = {"enum": ["cw", "ccw"], "type": "string"}
    written_out = {"enum": ["cw", "ccw"], "type": "string", "default": "cw"}
    document["paths"]["/lines"]["get"]["parameters"] = [
        {"name": "turn", "in": "query", "schema": written_out}
    ]
    complete(document)
    (parameter,) = document["paths"]["/lines"]["get"]["parameters"]
    assert parameter["schema"] == {"$ref": "#/components/schemas/Turn", "default": "cw"}


def test_the_core_leaves_out_what_is_for_later_and_leaves_details_open() -> None:
    core = core_of(DOCUMENT)
    assert "/events" not in core["paths"]
    assert set(core["components"]["schemas"]) == {"Stop", "Stopped"}
    assert core["components"]["schemas"]["Stopped"]["properties"] == {
        "confirmed": {"default": False},
        "counts": {"title": "Counts", "description": "How often. Its form is in resources.json."},
    }
    assert "Counts" in DOCUMENT["components"]["schemas"]
