"""The configuration over HTTP: read again, and written to while the gateway runs."""

from typing import Annotated, Any

from fastapi import Body, Request, Response
from pydantic import Field, JsonValue

from api.common.requests import json_response, new_router, origin, plant_of
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.door.names import LineId
from gateway.operations import configuration
from gateway.operations.configuration import Reloaded

router = new_router("configuration")


class ReloadRequest(RequestModel, json_schema_extra=example(dry_run=True)):
    """How to read the configuration again."""

    dry_run: bool = Field(default=False, description="Tell what would change, and change nothing.")


class NewTable(ReloadRequest):
    """Something to be served, too, and written into the configuration file."""

    comment: str = Field(
        default="",
        max_length=1000,
        description="Stands above it in the file, after when it was added and who asked for it.",
    )


class NewLine(
    NewTable,
    json_schema_extra=example(
        line={"id": "line2", "address": "tcp://192.0.2.7:4001", "bodies": [{"id": "40"}]}, dry_run=True
    ),
):
    """A line to be served, too."""

    line: dict[str, JsonValue] = Field(
        description="A table `[[lines]]` of the configuration, with its `bodies` or its `robot`."
    )


class NewBodies(NewTable, json_schema_extra=example(bodies=[{"id": "40", "name": "grip"}], dry_run=True)):
    """Bodies to be served, too."""

    bodies: list[dict[str, JsonValue]] = Field(
        min_length=1, max_length=120, description="Tables `[[lines.bodies]]` of the configuration."
    )


HowToReload = Annotated[ReloadRequest, Body(default_factory=ReloadRequest)]


@router.post("/system/reload", Right.ADMIN, response_model=Reloaded)
async def reload_configuration(request: Request, how: HowToReload) -> Response:
    """Read the configuration file again, and serve the lines in it.

    Lines that did not change go on undisturbed, and so do moves and events. One that did is closed and opened
    anew, which is refused while something moves on it. `needs_restart` names what a restart alone changes.
    """
    return json_response(await configuration.reload(plant_of(request), origin(), dry_run=how.dry_run))


@router.post("/lines", Right.ADMIN, response_model=Reloaded)
async def add_line(request: Request, new: NewLine) -> Response:
    """Write one more line with its bodies or its robot into the configuration file, and serve it.

    A scan of ports gives the line of who is found there. The file keeps its comments.
    """
    plant, caller = plant_of(request), origin()
    return json_response(
        await configuration.add_line(plant, caller, new.line, comment=new.comment, dry_run=new.dry_run)
    )


@router.post("/lines/{line_id}/bodies", Right.ADMIN, response_model=Reloaded)
async def add_bodies(request: Request, line_id: LineId, new: NewBodies) -> Response:
    """Write bodies that a scan has found into the configuration file, and serve them.

    Their line is opened anew, which is refused while something moves on it.
    """
    plant, caller = plant_of(request), origin()
    tables: list[dict[str, Any]] = list(new.bodies)
    return json_response(
        await configuration.add_bodies(
            plant, caller, line_id, tables, comment=new.comment, dry_run=new.dry_run
        )
    )
