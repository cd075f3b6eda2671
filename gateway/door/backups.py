"""Backups: all that controllers keep, read as text, compared with one, brought back."""

import asyncio
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from gateway.core.addresses import there_are
from gateway.core.aside import aside
from gateway.core.backup_record import Backup, BackupComparison
from gateway.core.backups import Source
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.operation import Rows, Run, Text, Wait
from gateway.core.records import RequestModel, example
from gateway.core.restore_record import Restore, RestorePlan, Units
from gateway.core.restores import Controller, Restores
from gateway.core.rights import Right
from gateway.core.works import Works
from gateway.door.names import BodyId, LineId, RobotId
from gateway.door.records import Find, list_records
from gateway.fics import backup as robot_backup
from gateway.fics.backup import RobotContents, RobotSource
from gateway.fics.backup_restore import NO_FLASH, RobotRestore
from gateway.fics.family import Fics
from gateway.plant import Plant
from gateway.rorze import backup, backup_scale
from gateway.rorze.backup import BodySource, Contents
from gateway.rorze.backup_places import Section
from gateway.rorze.backup_restore import BodyRestore
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from protocols.rorze.user_program.assembler import Assembled

ROWS: Final = Rows("backups")
MAX_BACKUP_BYTES: Final = 2_097_152
"""A line of 120 bodies, each with a table of 200 positions."""
OVER: Final = "With `dry_run` the plan; else the restore is over."
TEXTS: Final = Rows("backups")
"""As text alone, read while the request waits."""
TEXT: Final = "text/plain"
AS_TEXT: Final[Mapping[str, Any]] = {"media": TEXT, "answered": "The backup."}
ENDING: Final = ".backup"
LAST: Final = "last"
Night = Annotated[
    str, Field(pattern=r"^\d{4}-\d\d-\d\d$", description="As YYYY-MM-DD.", examples=["2026-11-28"])
]
WITHOUT: Final = "Sections of the backup that are left as they are, such as positions."
NO_MORE: Final = "Read no more."
WRITE_NO_MORE: Final = "Write no more; what differs is still read and told, unless it is cancelled once more."
SMALL = "[body 3F]\n[settings]\n0SS10 ; origin offset, pulses\n"
OF_ROBOT = "[robot r1]\n[variables]\nV01 12.5\n"
Bodies = Annotated[str | None, Field(description="These only, joined by commas: 00,3F. Left out: all.")]

Held = Mapping[int, Contents]
"""What a backup has of each body, by its number."""


class Reading(NamedTuple):
    """Controllers that are to be read."""

    target: str
    """The path of what is asked for."""
    preamble: str
    sources: Sequence[Source]


def folder_of_nights(plant: Plant) -> Path:
    """Where the backups lie that are read by night, by their targets.

    :raises NotFound: none are.
    """
    if plant.nightly_backups is None:
        raise NotFound("No backups are kept by night here; nothing was sent.", "Set [backups] nightly_at.")
    return plant.nightly_backups


async def text_of_night(plant: Plant, target: str, night: str, ending: str = ENDING) -> str:
    """Give the backup of a line or a robot that was read in a night, or in the last one.

    :raises NotFound: there is none.
    """
    own = folder_of_nights(plant) / target
    try:
        return await asyncio.to_thread(_read_night, own, night, ending)
    except FileNotFoundError:
        raise NotFound(f"There is no {target}/{night}{ending}; nothing was sent.") from None


def _read_night(own: Path, night: str, ending: str) -> str:
    files = sorted(own.glob(f"*{ending}")) if night == LAST else [own / f"{night}{ending}"]
    if not files:
        raise FileNotFoundError(own)
    return files[-1].read_text("utf-8")


class Wanted(NamedTuple):
    """Controllers, and what they are to hold."""

    target: str
    """The path of what was asked for."""
    restores: Restores[Any]
    controllers: Sequence[Controller]
    has_flash: bool = True


def check_bodies(text: str) -> Held:
    """Read a backup of bodies; nothing is sent.

    :raises InvalidText: it has faults, each with its line and column.
    """
    return backup.parse(text)


def of_body(plant: Plant, body_id: str) -> Reading:
    """All that a body keeps.

    :raises NotFound: there is no such body.
    """
    body = plant.family(Rorze).body(body_id)
    return _of_bodies(plant, f"/bodies/{body.address}", [body])


def of_line(plant: Plant, line_id: str, chosen: Sequence[str] | None = None) -> Reading:
    """All that the bodies of a line keep, or those that are chosen.

    :raises NotFound: there is no such line or body.
    :raises InvalidRequest: it is no line of bodies.
    """
    bodies = _bodies_of(plant, line_id) if chosen is None else _chosen(plant, line_id, chosen)
    return _of_bodies(plant, f"/lines/{line_id}", bodies)


def _of_bodies(plant: Plant, target: str, bodies: Sequence[Body]) -> Reading:
    rorze = plant.family(Rorze)

    def require_free(body: Body) -> None:
        rorze.restores.require_none(body.address)
        rorze.uploads.require_none(body)

    sources = [BodySource(it, partial(require_free, it), plant.names.of(it.address)) for it in bodies]
    return Reading(target, backup.PREAMBLE, sources)


def of_robot(plant: Plant, robot_id: str) -> Reading:
    """All that a robot tells of what it keeps.

    :raises NotFound: there is no such robot.
    """
    fics = plant.family(Fics)
    robot = fics.robot(robot_id)
    source = RobotSource(robot, partial(fics.restores.require_none, robot.id))
    return Reading(f"/robots/{robot.id}", robot_backup.PREAMBLE, [source])


async def read(plant: Plant, reading: Reading, wait_s: float) -> Backup:
    """Begin to read a backup, and give its record after `wait_s` at most.

    :raises BodyBusy: one is being read, or restored, or a program is uploaded.
    :raises GatewayError: a controller does not answer.
    """
    begun = await plant.backups.start(*reading)
    await plant.backups.wait(begun, wait_s)
    return begun


async def text(reading: Reading) -> str:
    """Read a backup to its end; errors as of `read`, and where something was not read.

    A caller that gives up ends it.
    """
    for source in reading.sources:
        await source.require_ready()
    return reading.preamble + "".join([await source.read(_Nobody()) for source in reading.sources])


class _Nobody:
    """Nobody is told how far a reading has come."""

    def expect(self, _: int | None) -> None:
        """Say nothing."""

    def has_read(self) -> None:
        """Say nothing."""


def for_body(
    plant: Plant, body_id: str, found: Held, from_body: str | None, units: Units | None = None
) -> Wanted:
    """Let a body hold what a backup has of it, or of the body `from_body`.

    :raises NotFound: there is no such body.
    :raises InvalidRequest: the backup has nothing of it, or is of another scale, and `units` does not help.
    """
    body = plant.family(Rorze).body(body_id)
    source = body.number if from_body is None else _number(from_body)
    return Wanted(f"/bodies/{body.address}", *_controllers(plant, {body: source}, found, units))


def for_line(
    plant: Plant,
    line_id: str,
    found: Held,
    chosen: Sequence[str] | None,
    units: Units | None = None,
) -> Wanted:
    """Let the bodies of a line, or those that are chosen, hold what a backup has of them.

    :raises NotFound: there is no such line or body.
    :raises InvalidRequest: it is no line of bodies, or the backup has nothing of one that was chosen, or is
        of another scale than a body, and `units` does not help.
    """
    if chosen is None:
        sources = {body: body.number for body in _bodies_of(plant, line_id) if body.number in found}
        unknown = [f"{it:02X}" for it in found.keys() - set(sources.values())]
        if unknown:
            raise InvalidRequest(
                f"The line {line_id} has no body {', '.join(sorted(unknown))}; nothing was sent.",
                "Choose its bodies by `bodies`.",
            )
    else:
        sources = {body: body.number for body in _chosen(plant, line_id, chosen)}
    return Wanted(f"/lines/{line_id}", *_controllers(plant, sources, found, units))


def _controllers(
    plant: Plant, sources: Mapping[Body, int], found: Held, units: Units | None
) -> tuple[Restores[BodyRestore], list[BodyRestore]]:
    rorze = plant.family(Rorze)
    for source in sources.values():
        if source not in found:
            raise InvalidRequest(
                f"The backup has nothing of body {source:02X}; "
                f"{there_are([f'{it:02X}' for it in found])}; nothing was sent.",
                "Name the body of the backup by `from_body`.",
            )
    held = {body: backup_scale.for_body(found[source], body, units) for body, source in sources.items()}
    return rorze.restores, [
        BodyRestore(body, wanted, rorze.uploads, scale) for body, (wanted, scale) in held.items()
    ]


def check_robot(plant: Plant, robot_id: str, text: str) -> RobotContents:
    """Read a backup of a robot, whose axes it has to name; nothing is sent.

    :raises NotFound: there is no such robot.
    :raises InvalidText: it has faults, each with its line and column.
    """
    return robot_backup.parse(plant.family(Fics).robot(robot_id), text)


def for_robot(plant: Plant, robot_id: str, found: RobotContents) -> Wanted:
    """Let a robot hold what a backup has of it.

    :raises NotFound: there is no such robot.
    """
    fics = plant.family(Fics)
    robot = fics.robot(robot_id)
    return Wanted(f"/robots/{robot.id}", fics.restores, [RobotRestore(robot, found)], has_flash=False)


async def plan(plant: Plant, wanted: Wanted) -> RestorePlan:
    """Tell what a restore would write, and what differs; nothing is written but the mark of the gateway.

    :raises BodyBusy: a controller is being restored.
    :raises GatewayError: one was not read.
    """
    plant.admission.require()
    return await wanted.restores.plan(wanted.target, wanted.controllers)


async def start(plant: Plant, wanted: Wanted, flash: bool, power_cycle: bool, wait_s: float) -> Restore:
    """Begin to bring controllers back to a backup, and give the record after `wait_s` at most.

    :raises InvalidRequest: it cannot be kept without power, and is to be verified after a power cycle.
    :raises GatewayError: errors as of `Restores.start`.
    """
    plant.admission.require()
    if flash and not wanted.has_flash:
        raise InvalidRequest(f"flash: {NO_FLASH}", "Leave it out.")
    if power_cycle and not flash:
        raise InvalidRequest(
            "power_cycle: what is not written to flash memory is lost with the power; nothing was sent.",
            "Ask for flash, too.",
        )
    restores = wanted.restores
    begun = await restores.start(wanted.target, wanted.controllers, flash=flash, power_cycle=power_cycle)
    await restores.wait(begun, wait_s)
    return begun


async def compare(plant: Plant, wanted: Wanted, wait_s: float) -> BackupComparison:
    """Begin to tell what a restore would write, and what differs; give the record after `wait_s` at most.

    :raises BodyBusy: a controller is being restored or compared.
    """
    plant.admission.require()
    begun = plant.comparisons.start(wanted.target, wanted.restores, wanted.controllers)
    await plant.comparisons.wait(begun, wait_s)
    return begun


def _restores(plant: Plant, **named: str) -> tuple[Restores[Any], str]:
    """Who knows the restores of what a path names, and the path in full."""
    rorze, fics = plant.family(Rorze), plant.family(Fics)
    [(kind, name)] = named.items()
    if kind == "robot_id":
        return fics.restores, f"/robots/{fics.robot(name).id}"
    if kind == "body_id":
        return rorze.restores, f"/bodies/{rorze.body(name).address}"
    _bodies_of(plant, name)
    return rorze.restores, f"/lines/{name}"


def _backups(plant: Plant, **named: str) -> tuple[Works[Any], str]:
    return plant.backups, _restores(plant, **named)[1]


def _comparisons(plant: Plant, **named: str) -> tuple[Works[Any], str]:
    return plant.comparisons, _restores(plant, **named)[1]


def _number(body: str) -> int:
    number = backup.body_number(body)
    if number is None:
        raise InvalidRequest(f"from_body: {body!r} is no body number; nothing was sent.")
    return number


def _chosen(plant: Plant, line_id: str, chosen: Sequence[str]) -> list[Body]:
    bodies, rorze = _bodies_of(plant, line_id), plant.family(Rorze)
    named = [rorze.body(it if "." in it else f"{line_id}.{it}") for it in dict.fromkeys(chosen)]
    if not all(body in bodies for body in named):
        raise InvalidRequest(f"bodies: not all are on the line {line_id}; nothing was sent.")
    return named


def _bodies_of(plant: Plant, line_id: str) -> list[Body]:
    plant.port(line_id)
    rorze = plant.family(Rorze)
    if line_id not in rorze.lines:
        raise InvalidRequest(f"{line_id} is the line of a robot; nothing was sent.", "Back up its robot.")
    return rorze.bodies_of(rorze.lines[line_id])


class ComparisonRequest(RequestModel, json_schema_extra=example(backup=SMALL)):
    """A backup to be compared with, as text or of a night. A section that it lacks is not looked at."""

    backup: str | None = Field(None, description="The text of a backup; comments after `;` mean nothing.")
    nightly: Literal["last"] | Night | None = Field(
        None, description="Instead of `backup` the one that was read by night: the last, or that of a date."
    )

    @model_validator(mode="after")
    def _one_backup(self) -> Self:
        if (self.backup is None) == (self.nightly is None):
            raise ValueError("give backup or nightly")
        return self


class OfBodies(ComparisonRequest):
    """A backup of bodies, which have scales."""

    without: list[Section] | None = Field(None, description=WITHOUT)
    units: Units | None = Field(
        None,
        description="For a backup made at another scale (`[scale]`), which is refused else. keep_pulses: the "
        "same pulses, which are other lengths; convert: the same lengths, speeds and accelerations, to the "
        "nearest pulse.",
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


class RobotComparisonRequest(ComparisonRequest, json_schema_extra=example(backup=OF_ROBOT)):
    """A backup that a robot is to be compared with."""

    without: list[robot_backup.Kind] | None = Field(None, description=WITHOUT)


class RestoreRequest(ComparisonRequest, json_schema_extra=example(backup=SMALL, dry_run=True)):
    """A backup to be restored. A section that it does not have is left as it is."""

    dry_run: bool = Field(
        False, description="Tell what would be written and what differs, and write nothing."
    )
    flash: bool = Field(False, description="Write it to flash memory, too, once it was read back.")
    power_cycle: bool = Field(
        False, description="With `flash`: wait until the power was off and on, and compare once more."
    )


class BodyRestoreRequest(
    RestoreRequest, BodyComparisonRequest, json_schema_extra=example(backup=SMALL, dry_run=True)
):
    """A backup to be restored to one body."""


class LineRestoreRequest(
    RestoreRequest, LineComparisonRequest, json_schema_extra=example(backup=SMALL, dry_run=True)
):
    """A backup to be restored to bodies of a line."""


class RobotRestoreRequest(
    RestoreRequest, RobotComparisonRequest, json_schema_extra=example(backup=OF_ROBOT, dry_run=True)
):
    """A backup to be restored to a robot."""


@TEXTS.get("/bodies/{body_id}/backup", **AS_TEXT)
async def get_body_backup(plant: Plant, body_id: BodyId) -> Text:
    """Read all that a body keeps: settings, speeds, patterns, positions, memories, user program.

    It takes two minutes at 9600 baud; others are served meanwhile. `POST .../backups` answers at once.
    """
    return Text(await text(of_body(plant, body_id)))


@TEXTS.get("/lines/{line_id}/backup", **AS_TEXT)
async def get_line_backup(plant: Plant, line_id: LineId, *, bodies: Bodies = None) -> Text:
    """Read all that the bodies of a line keep, as one text. It takes two minutes a body at 9600 baud.

    All of them have to answer; `bodies` leaves out who does not. `POST .../backups` answers at once.
    """
    return Text(await text(of_line(plant, line_id, chosen_of(bodies))))


@TEXTS.get("/robots/{robot_id}/backup", **AS_TEXT)
async def get_robot_backup(plant: Plant, robot_id: RobotId) -> Text:
    """Read what a robot tells of what it keeps: variables, and of each unit settings and positions."""
    return Text(await text(of_robot(plant, robot_id)))


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


async def start_robot_backup(plant: Plant, robot_id: RobotId, *, wait: Wait = None) -> Backup:
    """Begin to read what a robot tells of what it keeps; the record at `Location` has the text in the end."""
    return await read(plant, of_robot(plant, robot_id), wait or 0.0)


async def restore_robot(
    plant: Plant, robot_id: RobotId, wanted: RobotRestoreRequest, *, wait: Wait = None
) -> Restore | RestorePlan:
    """Bring a robot back to a backup: write what differs, read it back, and tell what differs still.

    Refused while it moves. A stop ends it. There is no `flash`: C-HOST has no command for it.
    """
    return await _begin(plant, await _for_robot(plant, robot_id, wanted), wanted, wait or 0.0)


async def compare_robot(
    plant: Plant, robot_id: RobotId, wanted: RobotComparisonRequest, *, wait: Wait = None
) -> BackupComparison:
    """Begin to tell what a restore of a robot would write and what differs."""
    return await compare(plant, await _for_robot(plant, robot_id, wanted), wait or 0.0)


async def _for_body(plant: Plant, body_id: str, wanted: BodyComparisonRequest) -> Wanted:
    body = plant.family(Rorze).body(body_id)
    found = await _held(plant, body.line.id, wanted)
    return for_body(plant, body_id, found, wanted.from_body, wanted.units)


async def _held(plant: Plant, line_id: str, wanted: OfBodies) -> Held:
    """What a backup has of bodies; errors as of `check_bodies` and `text_of_night`."""
    found = await aside(check_bodies, await _text_of(plant, line_id, wanted))
    left = {number: it.without(wanted.without or ()) for number, it in found.items()}
    if not any(it.sections for it in left.values()):
        raise InvalidRequest("without: nothing of the backup is left; nothing was sent.", "Name fewer.")
    return left


async def _text_of(plant: Plant, target: str, wanted: ComparisonRequest) -> str:
    if wanted.backup is not None:
        return wanted.backup
    return await text_of_night(plant, target, wanted.nightly or LAST)


def _require_ends(plant: Plant, target: Wanted) -> None:
    """Refuse programs with a move that only a stop ends; errors as of `EndlessPrograms.forbid`."""
    endless = plant.family(Rorze).endless
    for it in target.controllers:
        if isinstance(it, BodyRestore) and isinstance(program := it.wanted.program, Assembled):
            endless.forbid(program.instructions, program.lines, "Nothing was sent", "backup")


async def _for_line(plant: Plant, line_id: str, wanted: LineComparisonRequest) -> Wanted:
    found = await _held(plant, line_id, wanted)
    return for_line(plant, line_id, found, wanted.bodies, wanted.units)


async def _for_robot(plant: Plant, robot_id: str, wanted: RobotComparisonRequest) -> Wanted:
    robot = plant.family(Fics).robot(robot_id)
    found = await aside(check_robot, plant, robot.id, await _text_of(plant, robot.id, wanted))
    return for_robot(plant, robot.id, found.without(wanted.without or ()))


def chosen_of(bodies: str | None) -> list[str] | None:
    """The bodies of a list with commas; None: all."""
    return None if bodies is None else bodies.split(",")


async def _begin(
    plant: Plant, target: Wanted, wanted: RestoreRequest, wait_s: float
) -> Restore | RestorePlan:
    _require_ends(plant, target)
    if wanted.dry_run:
        return await plan(plant, target)
    return await start(plant, target, wanted.flash, wanted.power_cycle, wait_s)


class _Kind(NamedTuple):
    """Long work with backups: what begins it, and how its records are found and cancelled."""

    noun: str
    record: Any
    find: Find
    right: Right
    cancelled: str
    told: Mapping[str, Any]


_KINDS: Final = (
    _Kind("backup", Backup, _backups, Right.VIEW, NO_MORE, {"over": "It is over."}),
    _Kind(
        *("restore", Restore, _restores, Right.SETUP, WRITE_NO_MORE),
        {"over": OVER, "result": Restore, "planned": RestorePlan, "most_bytes": MAX_BACKUP_BYTES},
    ),
    _Kind(
        *("comparison", BackupComparison, _comparisons, Right.SETUP, NO_MORE),
        {"over": "It is over.", "leased": False, "most_bytes": MAX_BACKUP_BYTES},
    ),
)
_BEGUN_BY: Final[Mapping[str, tuple[str, Sequence[Run]]]] = {
    "body": ("/bodies/{body_id}", (start_body_backup, restore_body, compare_body)),
    "line": ("/lines/{line_id}", (start_line_backup, restore_line, compare_line)),
    "robot": ("/robots/{robot_id}", (start_robot_backup, restore_robot, compare_robot)),
}

for what, (place, beginnings) in _BEGUN_BY.items():
    for kind, begin in zip(_KINDS, beginnings, strict=True):
        ROWS.add("POST", f"{place}/{kind.noun}s", kind.right, begin, **kind.told)
        found_by = "_record" if kind.noun == "backup" else ""
        list_records(
            ROWS,
            f"{place}/{kind.noun}s",
            kind.record,
            kind.find,
            one=f"a {kind.noun}",
            names=(f"get_{what}_{kind.noun}{found_by}", f"cancel_{what}_{kind.noun}"),
            cancelled=kind.cancelled,
            right=kind.right,
            leased=False,
        )
