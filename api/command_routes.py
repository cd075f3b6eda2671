"""One route for each row of the command tables, with its own types, for whatever the row is addressed to."""

from functools import cache
from inspect import getdoc
from typing import Annotated, Any

from fastapi import Body, Request, Response

from api.common.documentation import WORDS, begins_moves, words_of
from api.common.parameters import Endpoint, names_of, taking
from api.common.problems import DECLARED
from api.common.requests import new_router, origin, plant_of, wait_s
from api.common.results import AGE_HEADER, GroupReply, render
from api.common.routes import Router
from api.resources import resource_router
from gateway.core.family import Family, Place, Row
from gateway.core.operation import Wait
from gateway.core.rights import RIGHT_OF
from gateway.door.names import NAMES
from gateway.door.results import GroupMove, StopResult
from gateway.operations.commands import do

AXES_OF_THE_DEMO = 3
"""The manual's robot has more."""


@cache
def routers(family: type[Family]) -> list[Router]:
    """Make the routes of the whole table of a family."""
    made: dict[str, Router] = {}
    for place, row in family.commands:
        tag = words_of(place.path).tag
        _add(made.setdefault(tag, new_router(tag)), family, place, row)
    own = {place.path: place for place, _ in family.commands if place.path not in WORDS}
    return [*made.values(), *map(resource_router, own.values())]


def _add(router: Router, family: type[Family], place: Place, row: Row) -> None:
    """Register a row's route."""
    router.add(
        "POST",
        f"{place.path}/commands/{row.name()}",
        RIGHT_OF[row.effect],
        _endpoint(family, place, row),
        name=f"send_{row.name().replace('-', '_')}{place.suffix}",
        summary=row.titles()[1].capitalize(),
        openapi_extra=_shown(family, row),
        description=describe(family, row),
        **_answers(family, place, row),
    )


def _shown(family: type[Family], row: Row) -> dict[str, Any]:
    """The row's code, and the first example of its manual as a request body."""
    code = {"x-code": row.code} if row.code else {}
    if not row.model_fields or not row.example or row in family.never_alone:
        return code
    command = row.read(row.example[0].partition(row.code)[2].lstrip() if row.code else row.example[0])
    shown = {
        name: value[:AXES_OF_THE_DEMO] if isinstance(value, list) else value
        for name, value in command.model_dump(mode="json", exclude_none=True).items()
    }
    content = {"application/json": {"examples": {"of the manual": {"value": shown}}}}
    return {**code, "requestBody": {"content": content}}


def describe(family: type[Family], row: Row) -> str:
    """The row's documentation: what the manual's page says, in few words."""
    japanese, english = row.titles()
    more = (getdoc(row) or "").partition("\n")[2].strip()
    return "\n\n".join(part for part in (f"{japanese}: {english}.", more, *family.facts(row)) if part)


def _answers(family: type[Family], place: Place, row: Row) -> dict[str, Any]:
    """What a row's route declares of its answers."""
    if row in family.sessions:
        return {"status_code": 201, "response_model": family.sessions[row]}
    if row.starts_motion():
        return begins_moves(place.path, GroupMove if place.members else place.move)
    if row in family.stop_modes:
        return {"response_model": StopResult}
    if place.members:
        return {"response_model": GroupReply}
    model = family.answer_model(row)
    if not family.is_dated(row):
        return {"response_model": model}
    age = {"description": "How old the answer is, in milliseconds.", "schema": {"type": "number"}}
    told = {"description": words_of(place.path).replied, "headers": {AGE_HEADER: age}}
    return {"response_model": model, "responses": {**DECLARED, 200: told}}


def _endpoint(family: type[Family], place: Place, row: Row) -> Endpoint:
    """Make what carries a row out; its parameters may be left out altogether where none is required."""

    async def send(request: Request, command: Any, wait: float | None = None, **names: object) -> Response:
        waited_s = wait_s(request, wait) if waits else 0.0
        target = place.path.format(**names)
        result = await do(plant_of(request), origin(), target, command, waited_s)
        return render(request, result, waited_s)

    waits = row.starts_motion() and row not in family.sessions
    required = not row.may_be_empty() or any(field.is_required() for field in row.model_fields.values())
    annotations = {
        **names_of(place.path, NAMES),
        "command": row if required else Annotated[row, Body(default_factory=row)],
        **({"wait": Wait} if waits else {}),
    }
    return taking(send, annotations)
