"""Scans of the ports of the gateway's machine and network over HTTP: who is there that no line serves."""

from typing import Annotated

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.common.documentation import begins
from api.common.requests import (
    begun_response,
    json_response,
    new_router,
    origin,
    plant_of,
    wait_headers,
    wait_s,
)
from gateway.core.operation import Wait
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.operations import port_scans
from gateway.port_scans import Port, PortScan

router = new_router("configuration")

PORTS_AT_ONCE = 16


class PortList(BaseModel):
    """The serial ports of the gateway's machine."""

    ports: list[Port]


class PortScanRequest(RequestModel, json_schema_extra=example(ports=["/dev/ttyUSB1"])):
    """Where to ask."""

    ports: list[Annotated[str, Field(min_length=1, max_length=300)]] = Field(
        min_length=1,
        max_length=PORTS_AT_ONCE,
        description="Devices and addresses: /dev/ttyUSB1, tcp://HOST:PORT, dpram:///dev/uio0. A serial port "
        "is tried at every baud rate, unless its address has `?baud=`.",
    )


@router.get("/system/ports", Right.ADMIN, response_model=PortList)
async def list_ports(request: Request) -> Response:
    """List the serial ports of the gateway's machine, and which line has each; nothing is sent."""
    ports = await port_scans.list_ports(plant_of(request), origin())
    return json_response(PortList(ports=ports))


@router.post("/system/scans", Right.ADMIN, **begins(PortScan, "The scan is over."))
async def start_port_scan(request: Request, wanted: PortScanRequest, wait: Wait = None) -> Response:
    """Ask who is at ports that no line has: an RC-400 with which bodies, or a Fics robot.

    Only questions are sent; whatever else is at a port hears bytes that it does not know. `POST /lines` adds
    the `line` of what is found, with its `comment`.
    """
    plant, waited_s = plant_of(request), wait_s(request, wait)
    scan = await port_scans.start(plant, origin(), wanted.ports, waited_s)
    return begun_response(scan, "/system/scans", waited_s)


@router.get("/system/scans/{scan_id}", Right.ADMIN, response_model=PortScan)
async def get_port_scan(request: Request, scan_id: str, wait: Wait = None) -> Response:
    """Get a scan of ports, at once or when it is over; `current` is the one under way, or the last."""
    waited_s = wait_s(request, wait)
    scan = await port_scans.get(plant_of(request), origin(), scan_id, waited_s)
    return json_response(scan, headers=wait_headers(waited_s))


@router.delete("/system/scans/current", Right.ADMIN, response_model=PortScan)
async def break_off_port_scan(request: Request) -> Response:
    """Ask nobody more; what was found until then is in the record."""
    return json_response(await port_scans.break_off(plant_of(request), origin()))
