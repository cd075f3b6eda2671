"""What callers may ask of robots that takes the plant."""

from typing import Final

from gateway.fics.door import backups, jogs, moves, positions, robots, stops, text_commands

ROWS: Final = (
    robots.ROWS,
    stops.ROWS,
    moves.ROWS,
    moves.SAMPLES,
    moves.SAMPLES_AS_CSV,
    jogs.ROWS,
    positions.ROWS,
    positions.TABLES,
    backups.ROWS,
    backups.TEXTS,
    text_commands.ROWS,
)
