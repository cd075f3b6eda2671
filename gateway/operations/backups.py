"""Backups: all that controllers keep, read as text, compared with one, brought back."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Final, NamedTuple

from gateway.core.addresses import there_are
from gateway.core.backup_record import Backup, BackupComparison
from gateway.core.backups import Source
from gateway.core.errors import InvalidRequest
from gateway.core.restore_record import Restore, RestorePlan, Units
from gateway.core.restores import Controller, Restores
from gateway.core.rights import Right
from gateway.fics import backup as robot_backup
from gateway.fics.backup import RobotContents, RobotSource
from gateway.fics.backup_restore import NO_FLASH, RobotRestore
from gateway.fics.family import Fics
from gateway.operations.caller import for_caller, needs, require
from gateway.operations.records import Records
from gateway.plant import Plant
from gateway.rorze import backup, backup_scale
from gateway.rorze.backup import BodySource, Contents
from gateway.rorze.backup_restore import BodyRestore
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze

OfBodies = Mapping[int, Contents]
"""What a backup has of each body, by its number."""


class Reading(NamedTuple):
    """Controllers that are to be read."""

    target: str
    """The path of what is asked for."""
    preamble: str
    sources: Sequence[Source]


class Wanted(NamedTuple):
    """Controllers, and what they are to hold."""

    target: str
    """The path of what was asked for."""
    restores: Restores[Any]
    controllers: Sequence[Controller]
    has_flash: bool = True


def check_bodies(text: str) -> OfBodies:
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


@for_caller
async def read(plant: Plant, reading: Reading, wait_s: float) -> Backup:
    """Begin to read a backup, and give its record after `wait_s` at most.

    :raises BodyBusy: one is being read, or restored, or a program is uploaded.
    :raises GatewayError: a controller does not answer.
    """
    require(plant, Right.VIEW, reading.target)
    begun = await plant.backups.start(*reading)
    await plant.backups.wait(begun, wait_s)
    return begun


@for_caller
async def text(plant: Plant, reading: Reading) -> str:
    """Read a backup to its end; errors as of `read`, and where something was not read.

    A caller that gives up ends it.
    """
    require(plant, Right.VIEW, reading.target)
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
    plant: Plant, body_id: str, found: OfBodies, from_body: str | None, units: Units | None = None
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
    found: OfBodies,
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
    plant: Plant, sources: Mapping[Body, int], found: OfBodies, units: Units | None
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


@needs(Right.VIEW)
async def for_robot(plant: Plant, robot_id: str, found: RobotContents) -> Wanted:
    """Let a robot hold what a backup has of it.

    :raises NotFound: there is no such robot.
    """
    fics = plant.family(Fics)
    robot = fics.robot(robot_id)
    return Wanted(f"/robots/{robot.id}", fics.restores, [RobotRestore(robot, found)], has_flash=False)


@for_caller
async def plan(plant: Plant, wanted: Wanted) -> RestorePlan:
    """Tell what a restore would write, and what differs; nothing is written but the mark of the gateway.

    :raises BodyBusy: a controller is being restored.
    :raises GatewayError: one was not read.
    """
    require(plant, Right.SETUP, wanted.target, leased=False)
    plant.admission.require()
    return await wanted.restores.plan(wanted.target, wanted.controllers)


@for_caller
async def start(plant: Plant, wanted: Wanted, flash: bool, power_cycle: bool, wait_s: float) -> Restore:
    """Begin to bring controllers back to a backup, and give the record after `wait_s` at most.

    :raises InvalidRequest: it cannot be kept without power, and is to be verified after a power cycle.
    :raises GatewayError: errors as of `Restores.start`.
    """
    require(plant, Right.SETUP, wanted.target)
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


@for_caller
async def compare(plant: Plant, wanted: Wanted, wait_s: float) -> BackupComparison:
    """Begin to tell what a restore would write, and what differs; give the record after `wait_s` at most.

    :raises BodyBusy: a controller is being restored or compared.
    """
    require(plant, Right.SETUP, wanted.target, leased=False)
    plant.admission.require()
    begun = plant.comparisons.start(wanted.target, wanted.restores, wanted.controllers)
    await plant.comparisons.wait(begun, wait_s)
    return begun


def _restores(plant: Plant, path: str) -> tuple[Restores[Any], str]:
    """Who knows the restores of a path, and the path in full."""
    rorze, fics = plant.family(Rorze), plant.family(Fics)
    _, collection, name = path.split("/")
    if collection == "robots":
        return fics.restores, f"/robots/{fics.robot(name).id}"
    if collection == "bodies":
        return rorze.restores, f"/bodies/{rorze.body(name).address}"
    _bodies_of(plant, name)
    return rorze.restores, path


BACKUPS: Final = Records(lambda plant, path: (plant.backups, _restores(plant, path)[1]), Right.VIEW)
COMPARISONS: Final = Records(
    lambda plant, path: (plant.comparisons, _restores(plant, path)[1]), Right.SETUP, leased=False
)
RESTORES: Final = Records(_restores, Right.SETUP, leased=False)


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
