"""A body's inputs, outputs, sensors and error outputs over HTTP."""

from collections.abc import Iterable
from datetime import datetime
from typing import Annotated, Any, Self

from fastapi import Path, Request, Response
from pydantic import BaseModel, Field, model_validator

from api.bodies.info import SensorBits
from api.bodies.names import body_of
from api.common.requests import BodyId, age_ms_of, json_response, new_router, origin, plant_of, utc_of
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.operations import body_signals
from gateway.rorze.signals import Cause, Signal
from gateway.rorze.signals import ErrorOutput as Reporting
from protocols.rorze.notation import BILLION

router = new_router("inputs and outputs")

Output = Annotated[int, Path(ge=0, le=15, description="General output, 0-15.", examples=[3])]
CausePath = Annotated[
    Cause, Path(description="What it reports; `limit` is that of either direction.", examples=["limit"])
]


class SignalState(BaseModel):
    """An input or an output."""

    number: int
    name: str | None = Field(description="From the configuration.")
    on: bool


class Reading(BaseModel):
    """What a controller has told."""

    body_id: str
    read_at: datetime = Field(description="When the controller's answer came.")
    age_ms: float = Field(description="How old the answer was when it was passed on.")


class BodyInputs(Reading):
    """The general inputs, after their logic (DIS) and their noise filters (DCS)."""

    inputs: list[SignalState]


class BodyOutputs(Reading):
    """The general outputs; in servo mode output 0 is the CLR signal."""

    outputs: list[SignalState]


class BodySensors(Reading):
    """The sensors, after their logic (DLS)."""

    sensors: SensorBits


class OutputSwitch(RequestModel, json_schema_extra=example(on=True)):
    """What an output shall be."""

    on: bool


class OutputPulse(RequestModel, json_schema_extra=example(duration_ms=200)):
    """For how long an output is inverted."""

    duration_ms: int = Field(ge=1, lt=BILLION)


class ErrorOutputState(BaseModel):
    """The output that reports a cause of errors."""

    cause: Cause
    output: int | None = Field(description="Null: nothing reports it.")
    name: str | None = Field(description="Of the output, from the configuration.")
    on: bool | None = Field(description="The state it takes on an error.")
    standing: bool = Field(description="Whether it has come, and was not taken back since.")


class BodyErrorOutputs(BaseModel):
    """The outputs that report errors."""

    body_id: str
    error_outputs: list[ErrorOutputState]


class ErrorOutputChoice(RequestModel, json_schema_extra=example(output=7, on=True)):
    """Which output reports a cause, and how."""

    output: int | None = Field(ge=0, le=15, description="General output; null: nothing reports it.")
    on: bool | None = Field(default=None, description="The state it takes on an error; with `output`.")

    @model_validator(mode="after")
    def _both_or_none(self) -> Self:
        if (self.output is None) is not (self.on is None):
            raise ValueError("give on with output, and neither without the other")
        return self


@router.get("/bodies/{body_id}/inputs", Right.VIEW, response_model=BodyInputs)
async def get_body_inputs(request: Request, body_id: BodyId) -> Response:
    """Ask the controller for all ten inputs (CID)."""
    found, at = await body_signals.inputs(plant_of(request), origin(), body_id)
    return json_response(BodyInputs(**_reading(request, body_id, at), inputs=_states(found)))


@router.get("/bodies/{body_id}/outputs", Right.VIEW, response_model=BodyOutputs)
async def get_body_outputs(request: Request, body_id: BodyId) -> Response:
    """Ask the controller for all sixteen outputs (COD)."""
    found, at = await body_signals.outputs(plant_of(request), origin(), body_id)
    return json_response(BodyOutputs(**_reading(request, body_id, at), outputs=_states(found)))


@router.put("/bodies/{body_id}/outputs/{output}", Right.OPERATE, response_model=SignalState)
async def switch_body_output(
    request: Request, body_id: BodyId, output: Output, wanted: OutputSwitch
) -> Response:
    """Switch an output (COS), which ends its pulse, and read it back; `not-done` where it is not as asked."""
    plant, caller = plant_of(request), origin()
    return json_response(_state(await body_signals.switch(plant, caller, body_id, output, on=wanted.on)))


@router.post("/bodies/{body_id}/outputs/{output}/pulses", Right.OPERATE, response_model=SignalState)
async def pulse_body_output(
    request: Request, body_id: BodyId, output: Output, wanted: OutputPulse
) -> Response:
    """Invert an output for a time (CBS); refused while it is inverted, and where it reports an error."""
    plant, caller = plant_of(request), origin()
    return json_response(_state(await body_signals.pulse(plant, caller, body_id, output, wanted.duration_ms)))


@router.get("/bodies/{body_id}/sensors", Right.VIEW, response_model=BodySensors)
async def get_body_sensors(request: Request, body_id: BodyId) -> Response:
    """Ask the controller for all six sensors (CLD)."""
    found, at = await body_signals.sensors(plant_of(request), origin(), body_id)
    return json_response(BodySensors(**_reading(request, body_id, at), sensors=SensorBits(**found)))


@router.get("/bodies/{body_id}/error-outputs", Right.VIEW, response_model=BodyErrorOutputs)
async def get_error_outputs(request: Request, body_id: BodyId) -> Response:
    """Ask the controller which outputs report errors (CED), and which errors stand (CRD)."""
    found = await body_signals.error_outputs(plant_of(request), origin(), body_id)
    return _error_outputs(request, body_id, found)


@router.put("/bodies/{body_id}/error-outputs/{cause}", Right.SETUP, response_model=BodyErrorOutputs)
async def set_error_output(
    request: Request, body_id: BodyId, cause: CausePath, wanted: ErrorOutputChoice
) -> Response:
    """Set the output that reports a cause (CES), and read it back. Each cause takes one of its own."""
    plant, caller = plant_of(request), origin()
    held = await body_signals.set_error_output(plant, caller, body_id, cause, wanted.output, on=wanted.on)
    return _error_outputs(request, body_id, [held])


@router.post("/bodies/{body_id}/error-outputs/reset", Right.OPERATE, response_model=BodyErrorOutputs)
async def reset_error_outputs(request: Request, body_id: BodyId) -> Response:
    """Take back all error outputs (CRS), which refuse moves while they stand."""
    found = await body_signals.take_back_errors(plant_of(request), origin(), body_id)
    return _error_outputs(request, body_id, found)


def _reading(request: Request, body_id: str, at: float) -> dict[str, Any]:
    address = body_of(request, body_id).address
    return {"body_id": address, "read_at": utc_of(at), "age_ms": age_ms_of(at)}


def _state(signal: Signal) -> SignalState:
    return SignalState(number=signal.number, name=signal.name, on=signal.on)


def _states(signals: Iterable[Signal]) -> list[SignalState]:
    return [_state(signal) for signal in signals]


def _error_outputs(request: Request, body_id: str, found: Iterable[Reporting]) -> Response:
    body = body_of(request, body_id)
    states = [
        ErrorOutputState(
            cause=it.cause,
            output=it.output,
            name=None if it.output is None else body.output_names.get(it.output),
            on=it.on,
            standing=it.standing,
        )
        for it in found
    ]
    return json_response(BodyErrorOutputs(body_id=body.address, error_outputs=states))
