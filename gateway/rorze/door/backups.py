"""Backups of bodies, one or all of a line."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Annotated, Final

from pydantic import Field

from gateway.core.addresses import there_are
from gateway.core.aside import aside
from gateway.core.backup_record import Backup, BackupComparison, Restore, RestorePlan, Units
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.operation import PlainText, Rows, Wait
from gateway.core.records import example
from gateway.core.restores import Restores
from gateway.door.backups import (
    AS_TEXT,
    LAST,
    WITHOUT,
    ComparisonOrder,
    ComparisonRequest,
    ReadingOrder,
    RestoreRequest,
    begin,
    compare,
    list_work,
    read,
    text,
    text_of,
    text_of_night,
)
from gateway.door.names import LineId
from gateway.plant import Plant
from gateway.rorze import backup
from gateway.rorze.backup import BodySource, Contents
from gateway.rorze.backup_places import Section
from gateway.rorze.backup_restore import BodyRestore
from gateway.rorze.bodies import Body
from gateway.rorze.family import BodyId, Rorze
from protocols.rorze.inputs_outputs import SetOutputs
from protocols.rorze.status import SetUserComment
from protocols.rorze.user_program.assembler import Assembled

ROWS: Final = Rows("backups")
TEXTS: Final = Rows("backups")
"""Rows of backups as text alone, read while the request waits."""
SMALL = "[body 3F]\n[settings]\n0SS10 ; origin offset, pulses\n"
Bodies = Annotated[str | None, Field(description="These only, joined by commas: 00,3F. Left out: all.")]

Held = Mapping[int, Contents]
"""Content of the backup for each body, by its number."""


def check_bodies(text: str) -> Held:
    """Read a backup of bodies; nothing is sent.

    :raises InvalidText: it has faults, each with its line and column.
    """
    return backup.parse(text)


def of_body(plant: Plant, body_id: str) -> ReadingOrder:
    """All that a body keeps.

    :raises NotFound: there is no such body.
    """
    body = plant.family(Rorze).body(body_id)
    return _of_bodies(plant, f"/bodies/{body.address}", [body])


def of_line(plant: Plant, line_id: str, chosen: Sequence[str] | None = None) -> ReadingOrder:
    """All that the bodies of a line keep, or those that are chosen.

    :raises NotFound: there is no such line or body.
    :raises InvalidRequest: it is no line of bodies.
    """
    bodies = _bodies_of(plant, line_id) if chosen is None else _chosen(plant, line_id, chosen)
    return _of_bodies(plant, f"/lines/{line_id}", bodies)


def _of_bodies(plant: Plant, target: str, bodies: Sequence[Body]) -> ReadingOrder:
    rorze = plant.family(Rorze)

    def require_free(body: Body) -> None:
        rorze.restores.require_none(body.address)
        rorze.uploads.require_none(body)

    sources = [BodySource(body, partial(require_free, body), plant.names.of(body.address)) for body in bodies]
    return ReadingOrder(target, backup.PREAMBLE, sources)


def for_body(
    plant: Plant, body_id: str, found: Held, from_body: str | None, units: Units | None = None
) -> ComparisonOrder:
    """Let a body hold what a backup has of it, or of the body `from_body`.

    :raises NotFound: there is no such body.
    :raises InvalidRequest: the backup has nothing of it, or is of another scale, and `units` does not help.
    """
    body = plant.family(Rorze).body(body_id)
    source = body.number if from_body is None else _number(from_body)
    return ComparisonOrder(f"/bodies/{body.address}", *_controllers(plant, {body: source}, found, units))


def for_line(
    plant: Plant,
    line_id: str,
    found: Held,
    chosen: Sequence[str] | None,
    units: Units | None = None,
) -> ComparisonOrder:
    """Let the bodies of a line, or those that are chosen, hold what a backup has of them.

    :raises NotFound: there is no such line or body.
    :raises InvalidRequest: it is no line of bodies, or the backup has nothing of one that was chosen, or is
        of another scale than a body, and `units` does not help.
    """
    if chosen is None:
        sources = {body: body.number for body in _bodies_of(plant, line_id) if body.number in found}
        unknown = [f"{number:02X}" for number in found.keys() - set(sources.values())]
        if unknown:
            raise InvalidRequest(
                f"The line {line_id} has no body {', '.join(sorted(unknown))}; nothing was sent.",
                "Choose its bodies by `bodies`.",
            )
    else:
        sources = {body: body.number for body in _chosen(plant, line_id, chosen)}
    return ComparisonOrder(f"/lines/{line_id}", *_controllers(plant, sources, found, units))


def _controllers(
    plant: Plant, sources: Mapping[Body, int], found: Held, units: Units | None
) -> tuple[Restores[BodyRestore], list[BodyRestore]]:
    rorze = plant.family(Rorze)
    for source in sources.values():
        if source not in found:
            raise InvalidRequest(
                f"The backup has nothing of body {source:02X}; "
                f"{there_are([f'{number:02X}' for number in found])}; nothing was sent.",
                "Name the body of the backup by `from_body`.",
            )
    held = {body: backup.for_body(found[source], body, units) for body, source in sources.items()}
    return rorze.restores, [
        BodyRestore(body, wanted, rorze.uploads, scale) for body, (wanted, scale) in held.items()
    ]


def _number(body: str) -> int:
    number = backup.body_number(body)
    if number is None:
        raise InvalidRequest(f"from_body: {body!r} is no body number; nothing was sent.")
    return number


def _chosen(plant: Plant, line_id: str, chosen: Sequence[str]) -> list[Body]:
    bodies, rorze = _bodies_of(plant, line_id), plant.family(Rorze)
    named = [rorze.body(name if "." in name else f"{line_id}.{name}") for name in dict.fromkeys(chosen)]
    if not all(body in bodies for body in named):
        raise InvalidRequest(f"bodies: not all are on the line {line_id}; nothing was sent.")
    return named


def _bodies_of(plant: Plant, line_id: str) -> list[Body]:
    plant.port(line_id)
    rorze = plant.family(Rorze)
    if line_id not in rorze.lines:
        raise InvalidRequest(f"{line_id} is the line of a robot; nothing was sent.", "Back up its robot.")
    return rorze.bodies_of(rorze.lines[line_id])


class OfBodies(ComparisonRequest):
    """A backup of bodies, which have scales."""

    without: list[Section] | None = Field(None, description=WITHOUT)
    units: Units | None = Field(
        None,
        description=(
            "Conversion of a backup made at another scale (`[scale]`), which is refused else. keep_pulses: "
            "the same pulses, which are other lengths; convert: the same lengths, speeds and accelerations, "
            "to the nearest pulse."
        ),
    )


class BodyComparisonRequest(OfBodies, json_schema_extra=example(backup=SMALL)):
    """A backup that a body is to be compared with."""

    from_body: str | None = Field(
        None, description="Take what the backup has of another body: two hex digits. Else of the same number."
    )


class LineComparisonRequest(OfBodies, json_schema_extra=example(backup=SMALL)):
    """A backup that bodies of a line are to be compared with."""

    bodies: list[str] | None = Field(
        None, description="These only: addresses such as 3F. Else all that the backup has."
    )


class BodyRestoreRequest(
    RestoreRequest, BodyComparisonRequest, json_schema_extra=example(backup=SMALL, dry_run=True)
):
    """A backup to be restored to one body."""


class LineRestoreRequest(
    RestoreRequest, LineComparisonRequest, json_schema_extra=example(backup=SMALL, dry_run=True)
):
    """A backup to be restored to bodies of a line."""


@TEXTS.get("/bodies/{body_id}/backup", **AS_TEXT)
async def get_body_backup(plant: Plant, body_id: BodyId) -> PlainText:
    """Read all that a body keeps: settings, speeds, patterns, positions, memories, user program.

    It takes two minutes at 9600 baud; others are served meanwhile. `POST .../backups` answers at once.
    """
    return PlainText(await text(of_body(plant, body_id)))


@TEXTS.get("/lines/{line_id}/backup", **AS_TEXT)
async def get_line_backup(plant: Plant, line_id: LineId, *, bodies: Bodies = None) -> PlainText:
    """Read all that the bodies of a line keep, as one text. It takes two minutes a body at 9600 baud.

    All of them have to answer; `bodies` leaves out who does not. `POST .../backups` answers at once.
    """
    return PlainText(await text(of_line(plant, line_id, chosen_of(bodies))))


async def start_body_backup(plant: Plant, body_id: BodyId, *, wait: Wait = None) -> Backup:
    """Begin to read all that a body keeps; the record at `Location` has the text in the end."""
    return await read(plant, of_body(plant, body_id), wait or 0.0)


async def restore_body(
    plant: Plant, body_id: BodyId, wanted: BodyRestoreRequest, *, wait: Wait = None
) -> Restore | RestorePlan:
    """Bring a body back to a backup: write what differs, read it back, and tell what differs still.

    Refused while the motor moves or a program runs. A stop ends it.
    """
    return await _begin(plant, await _for_body(plant, body_id, wanted), wanted, wait or 0.0)


async def compare_body(
    plant: Plant, body_id: BodyId, wanted: BodyComparisonRequest, *, wait: Wait = None
) -> BackupComparison:
    """Begin to tell what a restore would write and what differs; the record at `Location` has it in the end.

    Nothing is written but the gateway's own mark. `POST .../restores` with `dry_run` is the same in one
    request, which takes two minutes at 9600 baud.
    """
    return await compare(plant, await _for_body(plant, body_id, wanted), wait or 0.0)


async def start_line_backup(
    plant: Plant, line_id: LineId, *, bodies: Bodies = None, wait: Wait = None
) -> Backup:
    """Begin to read all that the bodies of a line keep, one after the other, as one text.

    All of them have to answer; `bodies` leaves out who does not. The record has the text in the end.
    """
    return await read(plant, of_line(plant, line_id, chosen_of(bodies)), wait or 0.0)


async def restore_line(
    plant: Plant, line_id: LineId, wanted: LineRestoreRequest, *, wait: Wait = None
) -> Restore | RestorePlan:
    """Bring the bodies of a line, or chosen ones, back to a backup, one after the other."""
    return await _begin(plant, await _for_line(plant, line_id, wanted), wanted, wait or 0.0)


async def compare_line(
    plant: Plant, line_id: LineId, wanted: LineComparisonRequest, *, wait: Wait = None
) -> BackupComparison:
    """Begin to tell what a restore of a line's bodies would write and what differs, one after the other."""
    return await compare(plant, await _for_line(plant, line_id, wanted), wait or 0.0)


async def _for_body(plant: Plant, body_id: str, wanted: BodyComparisonRequest) -> ComparisonOrder:
    body = plant.family(Rorze).body(body_id)
    found = await _held(plant, body.line.id, wanted)
    return for_body(plant, body_id, found, wanted.from_body, wanted.units)


async def _held(plant: Plant, line_id: str, wanted: OfBodies) -> Held:
    """Read the bodies of a backup; errors as of `check_bodies` and `text_of_night`."""
    found = await aside(check_bodies, await text_of(plant, line_id, wanted))
    left = {number: contents.without(wanted.without or ()) for number, contents in found.items()}
    if not any(contents.sections for contents in left.values()):
        raise InvalidRequest("without: nothing of the backup is left; nothing was sent.", "Name fewer.")
    return left


def _require_ends(plant: Plant, target: ComparisonOrder) -> None:
    """Refuse programs with a move that only a stop ends; errors as of `EndlessPrograms.forbid`."""
    endless = plant.family(Rorze).endless
    for controller in target.controllers:
        if isinstance(controller, BodyRestore) and isinstance(
            program := controller.wanted.program, Assembled
        ):
            endless.forbid(program.instructions, program.lines, "Nothing was sent", "backup")


async def _for_line(plant: Plant, line_id: str, wanted: LineComparisonRequest) -> ComparisonOrder:
    found = await _held(plant, line_id, wanted)
    return for_line(plant, line_id, found, wanted.bodies, wanted.units)


def chosen_of(bodies: str | None) -> list[str] | None:
    """The bodies of a list with commas; None: all."""
    return None if bodies is None else bodies.split(",")


async def _begin(
    plant: Plant, target: ComparisonOrder, wanted: RestoreRequest, wait_s: float
) -> Restore | RestorePlan:
    _require_ends(plant, target)
    return await begin(plant, target, wanted, wait_s)


def readings(plant: Plant) -> dict[str, ReadingOrder]:
    """Each line of bodies."""
    return {line_id: of_line(plant, line_id) for line_id in plant.family(Rorze).lines}


OF_ANOTHER: Final = SetUserComment.code
"""A difference that begins so tells that it is another controller."""


async def signs(plant: Plant, address: str) -> ComparisonOrder:
    """Give a body's settings of the last night, but for the states of its outputs."""
    body = plant.family(Rorze).body(address)
    held = await aside(check_bodies, await text_of_night(plant, body.line.id, LAST))
    if body.number not in held:
        raise NotFound(f"The backup has nothing of {address}.")
    settings = held[body.number].places.get("settings", {})
    kept = {key: command for key, command in settings.items() if not isinstance(command, SetOutputs)}
    return for_body(plant, address, {body.number: Contents({"settings": kept})}, None)


def _of_a_body(plant: Plant, body_id: str) -> tuple[Restores[BodyRestore], str]:
    rorze = plant.family(Rorze)
    return rorze.restores, f"/bodies/{rorze.body(body_id).address}"


def _of_a_line(plant: Plant, line_id: str) -> tuple[Restores[BodyRestore], str]:
    _bodies_of(plant, line_id)
    return plant.family(Rorze).restores, f"/lines/{line_id}"


list_work(ROWS, "/bodies/{body_id}", "body", (start_body_backup, restore_body, compare_body), _of_a_body)
list_work(ROWS, "/lines/{line_id}", "line", (start_line_backup, restore_line, compare_line), _of_a_line)
