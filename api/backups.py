"""Backups over HTTP: read as text, compared, brought back; a restore is a record, followed to its end."""

from typing import Annotated, Final

from fastapi import Query, Request, Response
from pydantic import Field

from api.common.documentation import begins
from api.common.problems import DECLARED
from api.common.records import RecordRoutes
from api.common.requests import begun_response, json_response, new_router, origin, plant_of, wait_s
from api.common.strict_json import StrictRequest, StrictRoute
from gateway.core.aside import aside
from gateway.core.backup_record import Backup, BackupComparison
from gateway.core.operation import Wait
from gateway.core.records import RequestModel, example
from gateway.core.restore_record import Restore, RestorePlan, Units
from gateway.core.rights import Right
from gateway.door.names import BodyId, LineId, RobotId
from gateway.operations import backups
from gateway.operations.backups import Reading, Wanted

MAX_BACKUP_BYTES = 2_097_152
"""A line of 120 bodies, each with a table of 200 positions."""
TEXT = "text/plain"
SMALL = "[body 3F]\n[settings]\n0SS10 ; origin offset, pulses\n"

OF_ROBOT = "[robot r1]\n[variables]\nV01 12.5\n"


class LongRequest(StrictRequest):
    """A request with a backup in it."""

    most = MAX_BACKUP_BYTES


class LongRoute(StrictRoute):
    """A route that takes a backup."""

    request_class = LongRequest


router = new_router("backups", LongRoute)


class ComparisonRequest(RequestModel, json_schema_extra=example(backup=SMALL)):
    """A backup to be compared with. A section that it does not have is not looked at."""

    backup: str = Field(description="The text of a backup; comments after `;` mean nothing.")


class OfBodies(ComparisonRequest):
    """A backup of bodies, which have scales."""

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


Bodies = Annotated[str | None, Query(description="These only, joined by commas: 00,3F. Left out: all.")]
BACKUP = {**DECLARED, 200: {"content": {TEXT: {"schema": {"type": "string"}}}, "description": "The backup."}}
BEGINS_BACKUP = begins(Backup, "It is over.")
BEGINS_COMPARISON = begins(BackupComparison, "It is over.")
BEGINS_RESTORE = begins(Restore, "With `dry_run` the plan; else the restore is over.", RestorePlan | Restore)

NO_MORE: Final = "Read no more."
BACKUPS: Final = RecordRoutes("a backup", Backup, backups.BACKUPS, NO_MORE)
COMPARISONS: Final = RecordRoutes("a comparison", BackupComparison, backups.COMPARISONS, NO_MORE)
RESTORES: Final = RecordRoutes(
    "a restore",
    Restore,
    backups.RESTORES,
    "Write no more; what differs is still read and told, unless it is cancelled once more.",
)


# bodies


@router.get("/bodies/{body_id}/backup", Right.VIEW, response_class=Response, responses=BACKUP)
async def get_body_backup(request: Request, body_id: BodyId) -> Response:
    """Read all that a body keeps: settings, speeds, patterns, positions, memories, user program.

    It takes two minutes at 9600 baud; others are served meanwhile. `POST .../backups` answers at once.
    """
    return await _text(request, backups.of_body(plant_of(request), body_id))


@router.post("/bodies/{body_id}/backups", Right.VIEW, **BEGINS_BACKUP)
async def start_body_backup(request: Request, body_id: BodyId, wait: Wait = None) -> Response:
    """Begin to read all that a body keeps; the record at `Location` has the text in the end."""
    return await _reading(request, backups.of_body(plant_of(request), body_id), wait)


BACKUPS.add_to(
    router, "/bodies/{body_id}/backups", "get_body_backup_record", "cancel_body_backup", body_id=BodyId
)


@router.post("/bodies/{body_id}/restores", Right.SETUP, **BEGINS_RESTORE)
async def restore_body(
    request: Request, body_id: BodyId, wanted: BodyRestoreRequest, wait: Wait = None
) -> Response:
    """Bring a body back to a backup: write what differs, read it back, and tell what differs still.

    Refused while the motor moves or a program runs. A stop ends it.
    """
    target = await _for_body(request, body_id, wanted)
    return await _begun(request, target, wanted, wait)


RESTORES.add_to(
    router, "/bodies/{body_id}/restores", "get_body_restore", "cancel_body_restore", body_id=BodyId
)


@router.post("/bodies/{body_id}/comparisons", Right.SETUP, **BEGINS_COMPARISON)
async def compare_body(
    request: Request, body_id: BodyId, wanted: BodyComparisonRequest, wait: Wait = None
) -> Response:
    """Begin to tell what a restore would write and what differs; the record at `Location` has it in the end.

    Nothing is written but the gateway's own mark. `POST .../restores` with `dry_run` is the same in one
    request, which takes two minutes at 9600 baud.
    """
    return await _comparing(request, await _for_body(request, body_id, wanted), wait)


COMPARISONS.add_to(
    router, "/bodies/{body_id}/comparisons", "get_body_comparison", "cancel_body_comparison", body_id=BodyId
)


# lines


@router.get("/lines/{line_id}/backup", Right.VIEW, response_class=Response, responses=BACKUP)
async def get_line_backup(request: Request, line_id: LineId, bodies: Bodies = None) -> Response:
    """Read all that the bodies of a line keep, as one text. It takes two minutes a body at 9600 baud.

    All of them have to answer; `bodies` leaves out who does not. `POST .../backups` answers at once.
    """
    return await _text(request, backups.of_line(plant_of(request), line_id, _chosen(bodies)))


@router.post("/lines/{line_id}/backups", Right.VIEW, **BEGINS_BACKUP)
async def start_line_backup(
    request: Request, line_id: LineId, bodies: Bodies = None, wait: Wait = None
) -> Response:
    """Begin to read all that the bodies of a line keep, one after the other, as one text.

    All of them have to answer; `bodies` leaves out who does not. The record has the text in the end.
    """
    return await _reading(request, backups.of_line(plant_of(request), line_id, _chosen(bodies)), wait)


BACKUPS.add_to(
    router, "/lines/{line_id}/backups", "get_line_backup_record", "cancel_line_backup", line_id=LineId
)


@router.post("/lines/{line_id}/restores", Right.SETUP, **BEGINS_RESTORE)
async def restore_line(
    request: Request, line_id: LineId, wanted: LineRestoreRequest, wait: Wait = None
) -> Response:
    """Bring the bodies of a line, or chosen ones, back to a backup, one after the other."""
    target = await _for_line(request, line_id, wanted)
    return await _begun(request, target, wanted, wait)


RESTORES.add_to(
    router, "/lines/{line_id}/restores", "get_line_restore", "cancel_line_restore", line_id=LineId
)


@router.post("/lines/{line_id}/comparisons", Right.SETUP, **BEGINS_COMPARISON)
async def compare_line(
    request: Request, line_id: LineId, wanted: LineComparisonRequest, wait: Wait = None
) -> Response:
    """Begin to tell what a restore of a line's bodies would write and what differs, one after the other."""
    return await _comparing(request, await _for_line(request, line_id, wanted), wait)


COMPARISONS.add_to(
    router, "/lines/{line_id}/comparisons", "get_line_comparison", "cancel_line_comparison", line_id=LineId
)


# robots


@router.get("/robots/{robot_id}/backup", Right.VIEW, response_class=Response, responses=BACKUP)
async def get_robot_backup(request: Request, robot_id: RobotId) -> Response:
    """Read what a robot tells of what it keeps: variables, and of each unit settings and positions."""
    return await _text(request, backups.of_robot(plant_of(request), robot_id))


@router.post("/robots/{robot_id}/backups", Right.VIEW, **BEGINS_BACKUP)
async def start_robot_backup(request: Request, robot_id: RobotId, wait: Wait = None) -> Response:
    """Begin to read what a robot tells of what it keeps; the record at `Location` has the text in the end."""
    return await _reading(request, backups.of_robot(plant_of(request), robot_id), wait)


BACKUPS.add_to(
    router, "/robots/{robot_id}/backups", "get_robot_backup_record", "cancel_robot_backup", robot_id=RobotId
)


@router.post("/robots/{robot_id}/restores", Right.SETUP, **BEGINS_RESTORE)
async def restore_robot(
    request: Request, robot_id: RobotId, wanted: RobotRestoreRequest, wait: Wait = None
) -> Response:
    """Bring a robot back to a backup: write what differs, read it back, and tell what differs still.

    Refused while it moves. A stop ends it. There is no `flash`: C-HOST has no command for it.
    """
    target = await _for_robot(request, robot_id, wanted)
    return await _begun(request, target, wanted, wait)


RESTORES.add_to(
    router, "/robots/{robot_id}/restores", "get_robot_restore", "cancel_robot_restore", robot_id=RobotId
)


@router.post("/robots/{robot_id}/comparisons", Right.SETUP, **BEGINS_COMPARISON)
async def compare_robot(
    request: Request, robot_id: RobotId, wanted: RobotComparisonRequest, wait: Wait = None
) -> Response:
    """Begin to tell what a restore of a robot would write and what differs."""
    return await _comparing(request, await _for_robot(request, robot_id, wanted), wait)


COMPARISONS.add_to(
    router,
    "/robots/{robot_id}/comparisons",
    "get_robot_comparison",
    "cancel_robot_comparison",
    robot_id=RobotId,
)


async def _for_body(request: Request, body_id: str, wanted: BodyComparisonRequest) -> Wanted:
    found = await aside(backups.check_bodies, wanted.backup)
    return backups.for_body(plant_of(request), body_id, found, wanted.from_body, wanted.units)


async def _for_line(request: Request, line_id: str, wanted: LineComparisonRequest) -> Wanted:
    found = await aside(backups.check_bodies, wanted.backup)
    return backups.for_line(plant_of(request), line_id, found, wanted.bodies, wanted.units)


async def _for_robot(request: Request, robot_id: str, wanted: RobotComparisonRequest) -> Wanted:
    plant = plant_of(request)
    found = await aside(backups.check_robot, plant, robot_id, wanted.backup)
    return await backups.for_robot(plant, origin(), robot_id, found)


def _chosen(bodies: str | None) -> list[str] | None:
    return None if bodies is None else bodies.split(",")


async def _text(request: Request, reading: Reading) -> Response:
    return Response(await backups.text(plant_of(request), origin(), reading), media_type=TEXT)


async def _reading(request: Request, reading: Reading, wait: float | None) -> Response:
    waited_s = wait_s(request, wait)
    begun = await backups.read(plant_of(request), origin(), reading, waited_s)
    return begun_response(begun, f"{begun.target}/backups", waited_s)


async def _comparing(request: Request, target: Wanted, wait: float | None) -> Response:
    waited_s = wait_s(request, wait)
    begun = await backups.compare(plant_of(request), origin(), target, waited_s)
    return begun_response(begun, f"{begun.target}/comparisons", waited_s)


async def _begun(request: Request, target: Wanted, wanted: RestoreRequest, wait: float | None) -> Response:
    plant, waited_s = plant_of(request), wait_s(request, wait)
    if wanted.dry_run:
        return json_response(await backups.plan(plant, origin(), target))
    begun = await backups.start(plant, origin(), target, wanted.flash, wanted.power_cycle, waited_s)
    return begun_response(begun, f"{begun.target}/restores", waited_s)
