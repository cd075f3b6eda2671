"""Scans of lines for bodies."""

from typing import Final

from gateway.core.operation import Rows, Wait
from gateway.core.rights import Right
from gateway.door.names import LineId
from gateway.plant import Plant
from gateway.rorze.family import Rorze
from gateway.rorze.scans import Scan

SCANS: Final = Rows("lines", later=True)


@SCANS.post("/lines/{line_id}/scans", Right.SETUP, leased=False, over="The scan is over.")
async def start_scan(plant: Plant, line_id: LineId, *, wait: Wait = None) -> Scan:
    """Ask all 120 body numbers of the line, between its other work, whether a body is there.

    A line with a robot has none.
    """
    plant.target(f"/lines/{line_id}")  # a line that leads to a robot says so
    rorze = plant.family(Rorze)
    scan = rorze.scans.start(rorze.lines[line_id])
    return await rorze.scans.get(line_id, scan.id, wait or 0.0)


@SCANS.get("/lines/{line_id}/scans/{scan_id}")
async def get_scan(plant: Plant, line_id: LineId, scan_id: str, *, wait: Wait = None) -> Scan:
    """Get a scan, at once or when it is over."""
    plant.target(f"/lines/{line_id}")
    return await plant.family(Rorze).scans.get(line_id, scan_id, wait or 0.0)
