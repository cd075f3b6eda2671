"""The table of all operations: those that families list beside what they do."""

from collections.abc import Iterator
from functools import cache
from typing import Final

from gateway.core.operation import Operation, Rows
from gateway.door import (
    access_keys,
    alarms,
    audit,
    backups,
    bodies,
    body_jogs,
    body_positions,
    catalogue,
    configuration,
    events,
    groups,
    health,
    leases,
    lines,
    moves,
    of_http,
    port_scans,
    programs,
    robot_jogs,
    robot_moves,
    robot_positions,
    robots,
    scara_moves,
    scaras,
    security_log,
    sessions,
    stops,
    system,
    text_commands,
    traces,
)
from gateway.door.commands import rows_of
from gateway.families import FAMILIES

SECTIONS: Final = (
    bodies.ROWS,
    moves.ROWS,
    moves.SAMPLES,
    groups.ROWS,
    body_jogs.ROWS,
    body_positions.ROWS,
    programs.ROWS,
    scaras.ROWS,
    stops.OF_SCARAS,
    scaras.PATHS,
    scara_moves.ROWS,
    robots.ROWS,
    stops.OF_ROBOTS,
    robot_moves.ROWS,
    robot_moves.SAMPLES,
    robot_jogs.ROWS,
    robot_positions.ROWS,
    stops.ROWS,
    alarms.ROWS,
    audit.ROWS,
    leases.ROWS,
    configuration.ROWS,
    port_scans.ROWS,
    security_log.ROWS,
    access_keys.ROWS,
    sessions.ROWS,
    system.ROWS,
    lines.ROWS,
    backups.ROWS,
    events.ROWS,
    traces.ROWS,
    catalogue.ROWS,
    text_commands.ROWS,
    health.ROWS,
    of_http.ROWS,
)
"""What takes more than one thing of a family: the plant with its names, leases, alarms and logs."""


@cache
def operations() -> tuple[Operation, ...]:
    """All of them, section by section."""
    return tuple(_listed())


def _listed() -> Iterator[Operation]:
    for rows in _sections():
        yield from rows
    for family in FAMILIES.values():
        yield from rows_of(family)


def _sections() -> Iterator[Rows]:
    yield from SECTIONS
    for family in FAMILIES.values():
        yield from family.rows
