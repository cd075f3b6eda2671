"""Scans of the ports of the gateway's machine and network for controllers that no line serves."""

import asyncio
from collections.abc import Sequence

from gateway.core.errors import NotFound
from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.port_scans import GATEWAY, Port, PortScan
from gateway.security import entries


@needs(Right.ADMIN, whole_plant=True)
async def list_ports(plant: Plant) -> list[Port]:
    """The serial ports of the machine, with the lines that have them."""
    return await asyncio.to_thread(plant.port_scans.ports)


@needs(Right.ADMIN, whole_plant=True)
async def start(plant: Plant, ports: Sequence[str], wait_s: float) -> PortScan:
    """Begin to ask who is at ports, and give the scan after `wait_s` at most; errors as of `start`."""
    plant.admission.require()
    scan = plant.port_scans.start(ports)
    plant.security.note(entries.PORT_SCAN, ", ".join(ports), scan=scan.id)
    await plant.port_scans.wait(scan, wait_s)
    return scan


@needs(Right.ADMIN, whole_plant=True)
async def get(plant: Plant, scan_id: str, wait_s: float) -> PortScan:
    """Give a scan when it is over, or as it is when the time is up; errors as of `Works.get`."""
    return await plant.port_scans.get(GATEWAY, scan_id, wait_s)


@needs(Right.ADMIN, whole_plant=True)
async def break_off(plant: Plant) -> PortScan:
    """Ask nobody more, and give the scan with what was found.

    :raises NotFound: none is running.
    """
    for scan in plant.port_scans.under_way():
        plant.port_scans.break_off(scan)
        await plant.port_scans.wait(scan, float("inf"))
        return scan
    raise NotFound("No scan of ports is running.")
