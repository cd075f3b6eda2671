"""The configuration that is served: read again, and more bodies and lines written into it."""

import asyncio
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any, Final

from pydantic import Field, JsonValue

from gateway.access import principal
from gateway.config import Config
from gateway.config_file import Changes, ConfigFile, changed, changes
from gateway.core.errors import InvalidRequest, NotAllowed
from gateway.core.operation import Rows
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.toml_files import ConfigError
from gateway.door.names import LineId
from gateway.plant import Plant
from gateway.port_scans import require_device
from gateway.security import entries

ROWS: Final = Rows("configuration")
NOT_ADDED: Final = "Correct what is to be added; the file is as it was."


class Reloaded(Changes):
    """The differences between the configuration file and what was served."""

    applied: bool = Field(
        description="True if the lines are served as the file says now; false after a dry run."
    )
    busy: list[str] = Field(
        description="Parts that move or work on lines that would be closed: nothing changes while they do."
    )


async def reload(plant: Plant, *, dry_run: bool) -> Reloaded:
    """Read the file again, and serve its lines; a dry run tells only what would change.

    :raises NotAllowed: the gateway was started without a file.
    :raises InvalidRequest: the file is no configuration; nothing was changed.
    :raises GatewayError: as of `Plant.reload`; nothing was changed.
    """
    file = _file_of(plant)
    async with file.turn:
        try:
            wanted = await asyncio.to_thread(file.load)
        except ConfigError as error:
            plant.access.security.note(entries.RELOAD_REFUSED, str(file.path), why=str(error))
            raise _unusable(error) from None
        return await _serve(plant, wanted, dry_run=dry_run)


async def with_line(plant: Plant, table: Mapping[str, Any], *, comment: str = "", dry_run: bool) -> Reloaded:
    """Write one more line, with its bodies or its robot, into the file, and serve it; errors as of `reload`.

    A comment above it says when it was added, and who asked for it.

    :raises NotSent: the file cannot be written; nothing was changed.
    """
    file = _file_of(plant)
    if "trace_file" in table:
        raise InvalidRequest(
            "line.trace_file: which files are written is not for a request to say; nothing was changed.",
            "Leave it out, or write it into the configuration file by hand.",
        )
    async with file.turn:
        try:
            text, wanted = await asyncio.to_thread(file.with_line, table, _signed(comment))
        except ConfigError as error:
            raise _unusable(error, NOT_ADDED) from None
        line = wanted.lines[-1]
        require_device(line.address, wanted.server)
        reloaded = await _write_and_serve(plant, file, text, wanted, dry_run=dry_run)
        if not dry_run:
            await plant.access.security.keep(entries.LINE_ADDED, line.id, address=line.address)
        return reloaded


async def with_bodies(
    plant: Plant, line_id: str, bodies: Sequence[Mapping[str, Any]], *, comment: str = "", dry_run: bool
) -> Reloaded:
    """Write more bodies of a line into the file, and serve them; comment and errors as of `add_line`.

    :raises NotFound: there is no such line.
    """
    file = _file_of(plant)
    async with file.turn:
        plant.port(line_id)
        try:
            text, wanted = await asyncio.to_thread(file.with_bodies, line_id, bodies, _signed(comment))
        except ConfigError as error:
            raise _unusable(error, NOT_ADDED) from None
        reloaded = await _write_and_serve(plant, file, text, wanted, dry_run=dry_run)
        if not dry_run:
            added = [str(body.get("id")) for body in bodies]
            await plant.access.security.keep(entries.BODIES_ADDED, line_id, bodies=added)
        return reloaded


async def with_settings(
    plant: Plant, line_id: str, settings: Mapping[str, Any], *, dry_run: bool
) -> Reloaded:
    """Write other values for keys of a line into the file, and serve it so; errors as of `add_line`."""
    file = _file_of(plant)
    async with file.turn:
        text = await asyncio.to_thread(file.path.read_text, "utf-8-sig")
        try:
            new = changed(text, line_id, settings, str(file.path))
            wanted = file.parsed(new)
        except ConfigError as error:
            raise _unusable(error, "Change it by hand, and reload it.") from None
        return await _write_and_serve(plant, file, new, wanted, dry_run=dry_run)


def _signed(comment: str) -> str:
    return f"Added on {datetime.now(UTC):%Y-%m-%d} by {principal.current().name}.\n{comment}"


async def _write_and_serve(
    plant: Plant, file: ConfigFile, text: str, wanted: Config, *, dry_run: bool
) -> Reloaded:
    if not dry_run:
        plant.require_rest(wanted)
        await asyncio.to_thread(file.write, text)
    return await _serve(plant, wanted, dry_run=dry_run)


async def _serve(plant: Plant, wanted: Config, *, dry_run: bool) -> Reloaded:
    found = changes(plant.config, wanted)
    busy = plant.busy(wanted)
    if not dry_run:
        await plant.reload(wanted)
        lines = [f"{line.line_id} {line.change}" for line in found.lines]
        await plant.access.security.keep(entries.RELOAD, lines=lines, needs_restart=found.needs_restart)
    return Reloaded(**found.model_dump(), applied=not dry_run, busy=busy)


def _file_of(plant: Plant) -> ConfigFile:
    if plant.file is None:
        raise NotAllowed(
            "The gateway was started without a file of its configuration; nothing was changed.",
            "Start it with --config FILE.",
        )
    return plant.file


def _unusable(error: ConfigError, remedy: str = "Mend the file, then reload it.") -> InvalidRequest:
    return InvalidRequest(f"{error}; nothing was changed.", remedy)


class ReloadRequest(RequestModel, json_schema_extra=example(dry_run=True)):
    """Options for reading the configuration again."""

    dry_run: bool = Field(default=False, description="True to be told what would change; nothing is changed.")


class NewTable(ReloadRequest):
    """A table to be served, and written into the configuration file."""

    comment: str = Field(
        default="",
        max_length=1000,
        description="Comment for the file, above the table and behind the time and the caller.",
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


AT_ONCE: Final = ReloadRequest()


@ROWS.post("/system/reload", Right.ADMIN)
async def reload_configuration(plant: Plant, how: ReloadRequest = AT_ONCE) -> Reloaded:
    """Read the configuration file again, and serve the lines in it.

    Lines that did not change go on undisturbed, and so do moves and events. One that did is closed and opened
    anew, which is refused while something moves on it. `needs_restart` names what a restart alone changes.
    """
    return await reload(plant, dry_run=how.dry_run)


@ROWS.post("/lines", Right.ADMIN)
async def add_line(plant: Plant, new: NewLine) -> Reloaded:
    """Write one more line with its bodies or its robot into the configuration file, and serve it.

    A scan of ports gives the line of each controller that it finds. The file keeps its comments.
    """
    return await with_line(plant, new.line, comment=new.comment, dry_run=new.dry_run)


@ROWS.post("/lines/{line_id}/bodies", Right.ADMIN)
async def add_bodies(plant: Plant, line_id: LineId, new: NewBodies) -> Reloaded:
    """Write bodies that a scan has found into the configuration file, and serve them.

    Their line is opened anew, which is refused while something moves on it.
    """
    tables: list[dict[str, Any]] = list(new.bodies)
    return await with_bodies(plant, line_id, tables, comment=new.comment, dry_run=new.dry_run)
