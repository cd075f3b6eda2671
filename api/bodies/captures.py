"""Captures of a body over HTTP: an edge on input 8 or 9 records where the motor is."""

from typing import Annotated, Literal

from fastapi import Path, Request, Response
from pydantic import BaseModel, Field

from api.bodies.names import body_of
from api.common.requests import (
    BodyId,
    Wait,
    json_response,
    new_router,
    origin,
    plant_of,
    wait_headers,
    wait_s,
)
from gateway.core.rights import Right
from gateway.operations import body_captures
from gateway.rorze.captures import Capture, CapturePulse, CaptureRequest, Edge

router = new_router("captures")

Port = Annotated[int, Path(ge=8, le=9, description="Input that can interrupt, 8 or 9.", examples=[8])]


class CapturedValue(BaseModel):
    """An entry of the position table that takes a value."""

    kind: Literal["position", "encoder", "encoder_in_pulses"]
    number: int = Field(description="Position number.")
    pulses: int | None = Field(
        description="Null until an edge comes; where another host has armed the input, 0. Encoder counts for "
        "`encoder`."
    )
    value: float | None = Field(description="The same in `unit`; null without a scale, and for `encoder`.")
    unit: str | None


class CaptureBounds(BaseModel):
    """The stretch of positions in which an edge counts."""

    lower: int = Field(description="In pulses.")
    upper: int = Field(description="In pulses.")


class CaptureState(BaseModel):
    """How an input is set up to capture, and what it has captured."""

    body_id: str
    input: int
    name: str | None = Field(description="From the configuration.")
    edge: Edge = Field(description="What it waits for; off: it is not armed, or not any more.")
    armed: bool
    captured: bool | None = Field(description="Null where no entry takes a value.")
    recorded: list[CapturedValue]
    pulse: CapturePulse | None
    between: CaptureBounds | None = Field(description="Null: everywhere.")


class CaptureList(BaseModel):
    """The captures of both inputs."""

    body_id: str
    captures: list[CaptureState]


@router.get("/bodies/{body_id}/captures", Right.VIEW, response_model=CaptureList)
async def list_captures(request: Request, body_id: BodyId) -> Response:
    """Ask the controller how both inputs capture, and what they have captured (CPD, CFD, CSD, 3ND)."""
    found = await body_captures.read_all(plant_of(request), origin(), body_id)
    states = [_state(request, body_id, it) for it in found]
    return json_response(CaptureList(body_id=states[0].body_id, captures=states))


@router.get("/bodies/{body_id}/captures/{port}", Right.VIEW, response_model=CaptureState)
async def get_capture(request: Request, body_id: BodyId, port: Port, wait: Wait = None) -> Response:
    """Ask for a capture, at once or when an edge has come; a move that ends without one disarms it too."""
    waited_s = wait_s(request, wait)
    found = await body_captures.wait(plant_of(request), origin(), body_id, port, waited_s)
    return json_response(_state(request, body_id, found), headers=wait_headers(waited_s))


@router.put("/bodies/{body_id}/captures/{port}", Right.OPERATE, response_model=CaptureState)
async def arm_capture(request: Request, body_id: BodyId, port: Port, capture: CaptureRequest) -> Response:
    """Let an input capture in the next move (CSS, CFS, CPS), once; refused while the motor moves."""
    armed = await body_captures.arm(plant_of(request), origin(), body_id, port, capture)
    return json_response(_state(request, body_id, armed))


@router.delete("/bodies/{body_id}/captures/{port}", Right.OPERATE, response_model=CaptureState)
async def disarm_capture(request: Request, body_id: BodyId, port: Port) -> Response:
    """Let an input capture nothing (CPS), and forget its entries, which are set to 0 (CFS).

    Refused while the motor moves.
    """
    found = await body_captures.disarm(plant_of(request), origin(), body_id, port)
    return json_response(_state(request, body_id, found))


def _state(request: Request, body_id: str, capture: Capture) -> CaptureState:
    body = body_of(request, body_id)
    bounds = capture.between
    recorded = []
    for kind, number, pulses in capture.recorded:
        scale = None if kind == "encoder" or pulses is None else body.scale
        recorded.append(
            CapturedValue(
                kind=kind,
                number=number,
                pulses=pulses,
                value=None if scale is None or pulses is None else scale.value(pulses),
                unit=None if scale is None else scale.unit,
            )
        )
    return CaptureState(
        body_id=body.address,
        input=capture.input,
        name=body.input_names.get(capture.input),
        edge=capture.edge,
        armed=capture.edge != "off",
        captured=capture.captured,
        recorded=recorded,
        pulse=capture.pulse,
        between=None if bounds is None else CaptureBounds(lower=bounds.lower, upper=bounds.upper),
    )
