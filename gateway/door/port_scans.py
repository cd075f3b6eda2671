"""Scans of the ports of the gateway's machine and network: controllers that no line serves."""

import asyncio
from typing import Annotated, Final

from pydantic import Field

from gateway.core.errors import NotFound
from gateway.core.operation import Rows, Wait
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.families import FAMILIES
from gateway.plant import Plant
from gateway.port_scans import GATEWAY, Port, PortScan
from gateway.security import entries

ROWS: Final = Rows("configuration")

PORTS_AT_ONCE = 16


class PortList(AnswerModel):
    """The serial ports of the gateway's machine."""

    ports: list[Port]


class PortScanRequest(RequestModel, json_schema_extra=example(ports=["/dev/ttyUSB1"])):
    """The ports to ask."""

    ports: list[Annotated[str, Field(min_length=1, max_length=300)]] = Field(
        min_length=1,
        max_length=PORTS_AT_ONCE,
        description="Devices and addresses: /dev/ttyUSB1, tcp://HOST:PORT, dpram:///dev/uio0. A serial port "
        "is tried at every baud rate, unless its address has `?baud=`.",
    )


_MAY_BE: Final = ", or ".join(family.told_of_ports for family in FAMILIES.values() if family.told_of_ports)


@ROWS.get("/system/ports", Right.ADMIN)
async def list_ports(plant: Plant) -> PortList:
    """List the serial ports of the gateway's machine, and which line has each; nothing is sent."""
    return PortList(ports=await asyncio.to_thread(plant.works.port_scans.ports))


@ROWS.post(
    "/system/scans",
    Right.ADMIN,
    over="The scan is over.",
    description=f"""Ask who is at ports that no line has: {_MAY_BE}.

No motor moves, and no setting changes. Each unit of a robot that stands is selected in turn, to count its
axes, and then the first one again. Whatever else is at a port hears bytes that it does not know. `POST
/lines` adds the `line` of what is found, with its `comment`.""",
)
async def start_port_scan(plant: Plant, wanted: PortScanRequest, *, wait: Wait = None) -> PortScan:
    """Begin a scan of ports."""
    plant.admission.require()
    scan = plant.works.port_scans.start(wanted.ports)
    plant.access.security.note(entries.PORT_SCAN, ", ".join(wanted.ports), scan=scan.id)
    await plant.works.port_scans.wait(scan, wait or 0.0)
    return scan


@ROWS.get("/system/scans/{scan_id}", Right.ADMIN, whole_plant=True)
async def get_port_scan(plant: Plant, scan_id: str, *, wait: Wait = None) -> PortScan:
    """Get a scan of ports, at once or when it is over; `current` is the one under way, or the last."""
    return await plant.works.port_scans.get(GATEWAY, scan_id, wait or 0.0)


@ROWS.delete("/system/scans/current", Right.ADMIN)
async def break_off_port_scan(plant: Plant) -> PortScan:
    """End the running scan of ports; its record keeps the controllers found until then."""
    for scan in plant.works.port_scans.under_way():
        plant.works.port_scans.break_off(scan)
        await plant.works.port_scans.wait(scan, float("inf"))
        return scan
    raise NotFound("No scan of ports is running.")
