"""What callers may ask of SCARA robots."""

from typing import Final

from gateway.rorze_scara.door import moves, scaras, stops

ROWS: Final = (scaras.ROWS, stops.ROWS, scaras.PATHS, moves.ROWS)
