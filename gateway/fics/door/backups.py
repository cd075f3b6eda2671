"""Backups of robots."""

from functools import partial
from typing import Final

from pydantic import Field

from gateway.core.aside import aside
from gateway.core.backup_record import Backup, BackupComparison, Restore, RestorePlan
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
from gateway.fics import backup
from gateway.fics.axes import RobotId
from gateway.fics.backup import RobotContents, RobotSource
from gateway.fics.backup_restore import NO_FLASH, RobotRestore
from gateway.fics.robot import Robots
from gateway.plant import Plant

ROWS: Final = Rows("backups")
TEXTS: Final = Rows("backups")
"""Rows that answer with text alone, which is read while the request waits."""
OF_ROBOT = "[robot r1]\n[variables]\nV01 12.5\n"


def of_robot(plant: Plant, robot_id: str) -> ReadingOrder:
    """All that a robot tells of what it keeps.

    :raises NotFound: there is no such robot.
    """
    fics = plant.family(Robots)
    robot = fics.robot(robot_id)
    source = RobotSource(robot, partial(fics.restores.require_none, robot.id))
    return ReadingOrder(f"/robots/{robot.id}", backup.PREAMBLE, [source])


def check_robot(plant: Plant, robot_id: str, text: str) -> RobotContents:
    """Read a backup of a robot, whose axes it has to name; nothing is sent.

    :raises NotFound: there is no such robot.
    :raises InvalidText: it has faults, each with its line and column.
    """
    return backup.parse(plant.family(Robots).robot(robot_id), text)


def for_robot(plant: Plant, robot_id: str, found: RobotContents) -> ComparisonOrder:
    """Let a robot hold what a backup has of it.

    :raises NotFound: there is no such robot.
    """
    fics = plant.family(Robots)
    robot = fics.robot(robot_id)
    return ComparisonOrder(f"/robots/{robot.id}", fics.restores, [RobotRestore(robot, found)], NO_FLASH)


class RobotComparisonRequest(ComparisonRequest, json_schema_extra=example(backup=OF_ROBOT)):
    """A backup that a robot is to be compared with."""

    without: list[backup.Kind] | None = Field(None, description=WITHOUT)


class RobotRestoreRequest(
    RestoreRequest, RobotComparisonRequest, json_schema_extra=example(backup=OF_ROBOT, dry_run=True)
):
    """A backup to be restored to a robot."""


@TEXTS.get("/robots/{robot_id}/backup", **AS_TEXT)
async def get_robot_backup(plant: Plant, robot_id: RobotId) -> PlainText:
    """Read what a robot tells of what it keeps: variables, and of each unit settings and positions."""
    return PlainText(await text(of_robot(plant, robot_id)))


async def start_robot_backup(plant: Plant, robot_id: RobotId, *, wait: Wait = None) -> Backup:
    """Begin to read what a robot tells of what it keeps; the record at `Location` has the text in the end."""
    return await read(plant, of_robot(plant, robot_id), wait or 0.0)


async def restore_robot(
    plant: Plant, robot_id: RobotId, wanted: RobotRestoreRequest, *, wait: Wait = None
) -> Restore | RestorePlan:
    """Bring a robot back to a backup: write what differs, read it back, and tell what differs still.

    Refused while it moves. A stop ends it. There is no `flash`: C-HOST has no command for it.
    """
    return await begin(plant, await _for_robot(plant, robot_id, wanted), wanted, wait or 0.0)


async def compare_robot(
    plant: Plant, robot_id: RobotId, wanted: RobotComparisonRequest, *, wait: Wait = None
) -> BackupComparison:
    """Begin to tell what a restore of a robot would write and what differs."""
    return await compare(plant, await _for_robot(plant, robot_id, wanted), wait or 0.0)


async def _for_robot(plant: Plant, robot_id: str, wanted: RobotComparisonRequest) -> ComparisonOrder:
    robot = plant.family(Robots).robot(robot_id)
    found = await aside(check_robot, plant, robot.id, await text_of(plant, robot.id, wanted))
    return for_robot(plant, robot.id, found.without(wanted.without or ()))


def readings(plant: Plant) -> dict[str, ReadingOrder]:
    """Each robot."""
    return {robot.id: of_robot(plant, robot.id) for robot in plant.family(Robots).robots()}


OF_ANOTHER: Final = ""
"""No difference tells that it is another controller."""
SPEEDS: Final = ("speed_percent", "motor_speed_percent")
"""Settings that each loss of power sets to 100 %."""


async def signs(plant: Plant, address: str) -> ComparisonOrder:
    """Give a robot's settings and positions of the last night, but for the speeds in percent."""
    night = await text_of_night(plant, address, LAST)
    found = (await aside(check_robot, plant, address, night)).without(["variables"])
    for unit in found.units.values():
        unit.settings = {
            name: setting for name, setting in (unit.settings or {}).items() if name not in SPEEDS
        }
    return for_robot(plant, address, found)


def _of_a_robot(plant: Plant, robot_id: str) -> tuple[Restores[RobotRestore], str]:
    fics = plant.family(Robots)
    return fics.restores, f"/robots/{fics.robot(robot_id).id}"


list_work(
    ROWS, "/robots/{robot_id}", "robot", (start_robot_backup, restore_robot, compare_robot), _of_a_robot
)
