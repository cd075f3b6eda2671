"""Scans of lines: who is there."""

from gateway.core.rights import Right
from gateway.operations.caller import needs, require
from gateway.plant import Plant
from gateway.rorze.family import Rorze
from gateway.rorze.line import Line
from gateway.rorze.scans import Scan


@needs(Right.SETUP, leased=False)
async def start_scan(plant: Plant, line_id: str) -> Scan:
    """Begin to ask who is on a line; errors as of `Scans.start`."""
    return plant.family(Rorze).scans.start(_line(plant, line_id))


async def get_scan(plant: Plant, line_id: str, scan_id: str, wait_s: float) -> Scan:
    """Give a scan when it is over, or as it is when the time is up; errors as of `Works.get`."""
    require(plant, Right.VIEW, line_id)
    return await plant.family(Rorze).scans.get(_line(plant, line_id).id, scan_id, wait_s)


def _line(plant: Plant, line_id: str) -> Line:
    plant.target(f"/lines/{line_id}")  # a line that leads to a robot says so
    return plant.family(Rorze).lines[line_id]
