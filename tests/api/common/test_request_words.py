"""Faults of requests in this project's words, which name the value that was meant or those there are."""

import json
import re
from functools import cache
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from api.app import create_app
from api.common.faults import faults_of
from gateway.config import Config
from gateway.plant import Plant
from tests.api.stand import Stand, on_stand

THEIR_WORDS = re.compile(
    "Input should|Extra inputs|Value error|value_error|Field required|Unable to|Assertion failed|pydantic"
    "|valid (?:integer|number|string|dictionary|list|boolean)|is not what is expected here"
)
LINE = {"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}
JUNK = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**30), 10**30)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=50)
    | st.sampled_from(["relativ", "hihg", "pulze", "ccww"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=20), inner, max_size=3),
    max_leaves=6,
)
"""Values of any type, in the place of another."""


@cache
def bodies_of_requests() -> list[tuple[Any, list[Any]]]:
    """The body that each route takes, with the examples that its document shows."""
    app = create_app(Plant(Config.model_validate({"lines": [LINE]})))
    paths = app.openapi()["paths"]
    found = []
    for row in app.rows.routes:
        body, operation = row.call.body, row.operation
        if body is not None and body.name and operation.documented and operation.media is None:
            content = paths[row.path][operation.verb.lower()]["requestBody"]["content"]["application/json"]
            found.append((body, [it["value"] for it in content["examples"].values()] or [{}]))
    return found


@st.composite
def spoilt(draw: st.DrawFn) -> tuple[Any, object]:
    """A request's body, and an example of it of which one part is missing, misspelt or something else."""
    field, examples = draw(st.sampled_from(bodies_of_requests()))
    value = json.loads(json.dumps(draw(st.sampled_from(examples))))
    around: Any = value
    inside: list[tuple[Any, Any]] = []
    while isinstance(around, dict | list) and around and (not inside or draw(st.booleans())):
        key = draw(st.sampled_from(sorted(around) if isinstance(around, dict) else range(len(around))))
        inside.append((around, key))
        around = around[key]
    if not inside:
        return field, draw(JUNK)
    parent, key = inside[-1]
    match draw(st.sampled_from(["other", "missing", "misspelt", "more"])):
        case "missing" if isinstance(parent, dict):
            del parent[key]
        case "misspelt" if isinstance(parent, dict):
            parent[key[:-1] + "x"] = parent.pop(key)
        case "more" if isinstance(parent, dict):
            parent[draw(st.text(max_size=30))] = draw(JUNK)
        case _:
            parent[key] = draw(JUNK)
    return field, value


@settings(max_examples=600, deadline=None)
@given(spoilt())
def test_no_request_is_refused_in_the_words_of_the_validation_library(request: tuple[Any, object]) -> None:
    field, value = request
    errors: list[Any] = []
    field.read(value, errors)
    if not errors:
        return
    faults = faults_of(errors, value, field.annotation)
    assert faults
    for place, said in faults.items():
        assert not THEIR_WORDS.search(said), (place, said)
        assert place.isprintable(), place
        assert said.isprintable(), said


def test_every_route_with_a_body_is_tried() -> None:
    assert len(bodies_of_requests()) > 300


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("/bodies/3E/position", "There is no body 3E; there are arm.00, arm.01, arm.3F; nothing was sent."),
        ("/bodies/leg.3F", "There is no body leg.3F; there are arm.00, arm.01, arm.3F; nothing was sent."),
        ("/groups/80", "There is no group 80; there are none; nothing was sent."),
        ("/lines/leg", "There is no line leg; there is arm; nothing was sent."),
        ("/robots/r9", "There is no robot r9; there are none; nothing was sent."),
        ("/scaras/wafer", "There is no SCARA robot wafer; there are none; nothing was sent."),
        ("/events?bodies=3E", "bodies: there is no 3E; there are 00, 01, 3F, arm.00, arm.01, arm.3F."),
    ],
)
def test_who_asks_for_what_is_not_there_is_told_what_is_and_where_it_is_listed(path: str, said: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.get(path)
        assert answer.json()["detail"] == said
        assert answer.json()["remedy"].startswith("GET /")

    story()


def test_a_length_must_be_a_number() -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        move = {"kind": "absolute", "position": {"value": "5000", "unit": "pulse"}}
        answer = await stand.post("/bodies/3F/moves", move)
        assert answer.json()["detail"] == "position.value: must be a number, not '5000'; nothing was sent."

    story()


@pytest.mark.parametrize("path", ["/bodies/3F/positions?first=9&last=2", "/bodies/3F/program/uploads/7"])
def test_every_refusal_tells_what_to_do_next(path: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        assert (await stand.get(path)).json()["remedy"]

    story()


@pytest.mark.parametrize(
    ("path", "meant"),
    [
        ("/bodies/3F/commands/get-positon", " (did you mean get-position?)"),
        ("/groups/80/commands/mov-to", " (did you mean move-to?)"),
        ("/robots/r1/units/1/commands/get-axis-stats", " (did you mean get-axis-status?)"),
        ("/bodies/3F/commands/sing", ""),
        ("/nobodies/3F/commands/get-position", ""),
        ("/bodys/3F/moves", " (did you mean bodies?)"),
        ("/bodies/3F/move", " (did you mean moves?)"),
        ("/robots/r1/units/1/move", " (did you mean moves?)"),
        ("/bodies/3F/moves/1/2/3", ""),
        ("/sing", ""),
        (
            "/moves/5",
            " (did you mean /bodies/{body_id}/moves/{move_id} or /scaras/{scara_id}/moves/{move_id} or "
            "/robots/{robot_id}/units/{unit}/moves/{move_id}?)",
        ),
        (
            "/power-cycle/acknowledge",
            " (did you mean /bodies/{body_id}/power-cycle/acknowledge or "
            "/robots/{robot_id}/power-cycle/acknowledge?)",
        ),
        ("/moves/", ""),
    ],
)
def test_a_misspelt_path_or_command_is_answered_by_the_one_that_was_meant(path: str, meant: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        before = stand.frames()
        answer = await stand.post(path, {})
        assert (answer.status_code, answer.json()["detail"]) == (
            404,
            f"There is nothing at {path}{meant}; nothing was sent.",
        )
        assert stand.frames() == before

    story()


@on_stand()
async def test_a_body_that_comes_in_several_types_is_told_its_members(stand: Stand) -> None:
    answer = await stand.client.put("/bodies/3F/program", json={"sorce": "END"})
    assert answer.json()["detail"] == "sorce: is not known here (did you mean source?); nothing was sent."


@on_stand()
async def test_what_is_hardly_like_a_name_was_not_meant_by_it(stand: Stand) -> None:
    answer = await stand.post("/stop", {"bodies": ["3F"]})
    assert answer.json()["detail"].startswith(
        "bodies: is not known here (known are mode); nothing was sent. Nothing was stopped"
    )
