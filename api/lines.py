"""Lines over HTTP: their state, scans of them, and the record of every byte."""

import asyncio
from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Literal

from fastapi import Query, Request, Response
from pydantic import AwareDatetime, BaseModel, Field

from api.common.problems import DECLARED
from api.common.requests import (
    LineId,
    Wait,
    is_seen,
    json_response,
    new_router,
    plant_of,
    wait_headers,
    wait_s,
)
from gateway.core.errors import NotFound
from gateway.core.rights import Right
from gateway.fics.line import FicsLine
from gateway.plant import Plant
from gateway.rorze.line import Line, LineState
from gateway.rorze.scans import Scan

MAX_TRACE_ENTRIES = 10_000

router = new_router("lines")


class _PortInfo(BaseModel):
    line_id: str
    address: str = Field(description="The port.")
    state: LineState
    down_reason: str | None = Field(
        description="Why the line is `down` or `silent`, and what to check; null while it is neither."
    )
    waiting: dict[str, int] = Field(description="Requests waiting in each lane.")
    counters: dict[str, int] = Field(description="What has happened on the line since the start.")


class LineInfo(_PortInfo):
    """A line: one port with an RC-400 and the bodies behind it."""

    protocol: Literal["rorze"]
    controllers: str = Field(description="What the link master answered to XID.")
    stop_mode: Literal["interject", "after_reply"] = Field(
        description="Whether a stop goes out at the next frame boundary, or after the reply under way."
    )
    strict: bool = Field(
        description="A reply came twice here lately: an acknowledgement counts only when a fence before and "
        "one after it have shown that it was no copy."
    )
    bodies: list[str]
    offline: list[str] = Field(description="Bodies that do not answer.")
    groups: list[str]


class RobotLineInfo(_PortInfo):
    """A line: one port with a robot."""

    protocol: Literal["fics"]
    robot_id: str
    mode: int = Field(description="The robot's communication mode, 3 or 2 (C-HOST manual 1-1-1).")
    online: bool = Field(description="Whether the robot can be asked now, as far as is known.")


AnyLineInfo = Annotated[LineInfo | RobotLineInfo, Field(discriminator="protocol")]


class LineList(BaseModel):
    """All lines of the configuration."""

    lines: list[AnyLineInfo]


class TraceRecord(BaseModel):
    """What happened on the port at one moment."""

    at: datetime = Field(description="UTC wall time, which jumps when the clock is set.")
    monotonic_ns: int = Field(description="A clock that never jumps.")
    kind: Literal["rx", "tx", "opened", "lost", "closed"]
    data: str = Field(description="The bytes; unprintable ones as \\r, \\n, \\t or \\x00.")
    caller: str | None = Field(
        default=None, description="Who had it sent: an interface and a client's address, or `gateway: fence`."
    )
    request_id: str | None = Field(default=None, description="The X-Request-Id of the request behind it.")


class Trace(BaseModel):
    """The newest records of a line, oldest first."""

    line_id: str
    entries: list[TraceRecord]


@router.get("/lines", Right.VIEW, any_scope=True, response_model=LineList)
async def list_lines(request: Request) -> Response:
    """List all lines."""
    plant = plant_of(request)
    seen = [port for port in plant.ports().values() if is_seen(request, port.id)]
    return json_response(LineList(lines=[_info(plant, port) for port in seen]))


@router.get("/lines/{line_id}", Right.VIEW, response_model=AnyLineInfo)
async def get_line(request: Request, line_id: LineId) -> Response:
    """Tell the state of a line; nothing is sent."""
    plant = plant_of(request)
    return json_response(_info(plant, plant.port(line_id)))


@router.post(
    "/lines/{line_id}/scans",
    Right.SETUP,
    status_code=202,
    response_model=Scan,
    responses={**DECLARED, 200: {"model": Scan, "description": "The scan is over."}},
)
async def start_scan(request: Request, line_id: LineId, wait: Wait = None) -> Response:
    """Ask all 120 body numbers of the line, between its other work, whether somebody is there.

    A line with a robot has none.
    """
    plant = plant_of(request)
    scan = plant.scans.start(plant.line(line_id))
    waited_s = wait_s(request, wait)
    await plant.scans.wait(scan.id, waited_s)
    headers = {"Location": f"/lines/{line_id}/scans/{scan.id}", **wait_headers(waited_s)}
    return json_response(scan, 202 if scan.status == "running" else 200, headers)


@router.get("/lines/{line_id}/scans/{scan_id}", Right.VIEW, response_model=Scan)
async def get_scan(request: Request, line_id: LineId, scan_id: str, wait: Wait = None) -> Response:
    """Get a scan, at once or when it is over."""
    plant = plant_of(request)
    line = plant.line(line_id)
    if plant.scans.get(scan_id).line_id != line.id:
        raise NotFound(f"Line {line.id} has no scan {scan_id}.")
    waited_s = wait_s(request, wait)
    return json_response(await plant.scans.wait(scan_id, waited_s), headers=wait_headers(waited_s))


@router.get("/lines/{line_id}/trace", Right.VIEW, response_model=Trace)
async def get_trace(
    request: Request,
    line_id: LineId,
    last: Annotated[int, Query(ge=1, le=MAX_TRACE_ENTRIES, description="How many records.")] = 1000,
    since: Annotated[AwareDatetime | None, Query(description="Only records not before this time.")] = None,
) -> Response:
    """Give the newest bytes of the line, a robot's too, both ways, with their times."""
    plant = plant_of(request)
    recorder = plant.recorders[plant.port(line_id).id]
    # Writing thousands of records as text takes milliseconds, in which no stop may wait.
    content = await asyncio.to_thread(lambda: _trace(line_id, recorder.entries(last, since)))
    return Response(content, media_type="application/json")


def _trace(line_id: str, entries: Sequence[BaseModel]) -> str:
    records = ",".join(entry.model_dump_json() for entry in entries)
    return f'{{"line_id":"{line_id}","entries":[{records}]}}'


def _info(plant: Plant, port: Line | FicsLine) -> LineInfo | RobotLineInfo:
    shared = {
        "line_id": port.id,
        "address": port.transport.address,
        "state": port.state,
        "down_reason": port.trouble,
        "waiting": port.waiting(),
        "counters": dict(port.counters),
    }
    if isinstance(port, FicsLine):
        (robot_id,) = (robot.id for robot in plant.robots() if robot.line is port)
        return RobotLineInfo(**shared, protocol="fics", robot_id=robot_id, mode=port.mode, online=port.online)
    return LineInfo(
        **shared,
        protocol="rorze",
        controllers=port.controllers,
        stop_mode="interject" if port.interject_stops else "after_reply",
        strict=port.strict,
        bodies=_addresses(port, port.bodies),
        offline=_addresses(port, sorted(port.offline)),
        groups=_addresses(port, list(port.groups)),
    )


def _addresses(line: Line, numbers: list[int]) -> list[str]:
    return [f"{line.id}.{number:02X}" for number in numbers]
