"""What callers may ask of bodies, groups and their lines that takes the plant."""

from typing import Final

from gateway.rorze.door import (
    backups,
    bodies,
    groups,
    jogs,
    moves,
    positions,
    programs,
    scans,
    stops,
    text_commands,
)

ROWS: Final = (
    bodies.ROWS,
    moves.ROWS,
    moves.SAMPLES,
    moves.SAMPLES_AS_CSV,
    groups.ROWS,
    jogs.ROWS,
    positions.ROWS,
    positions.TABLES,
    programs.ROWS,
    stops.ROWS,
    scans.ROWS,
    backups.ROWS,
    backups.TEXTS,
    text_commands.ROWS,
)
