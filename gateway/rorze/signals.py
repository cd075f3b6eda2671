"""A body's general inputs and outputs, and the outputs that report errors (RC-420 manual 13.9)."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Any, Final, Literal, Self, get_args

from pydantic import Field, model_validator

from gateway.core.errors import GatewayError
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.core.times import age_ms_of, utc_of
from gateway.rorze.asked_body import AskedBody
from protocols.rorze.inputs_outputs import (
    ClearErrorOutputStatus,
    GetErrorOutput,
    GetErrorOutputStatus,
    GetInputs,
    GetOutputs,
    GetSensors,
    PulseOutput,
    SetErrorOutput,
    SetOutputs,
)
from protocols.rorze.notation import BILLION
from protocols.rorze.status import SENSOR_BITS

INPUTS: Final = range(10)
"""D0-D9 of the upper connector; 8 and 9 can interrupt."""
OUTPUTS: Final = range(16)
"""D0-D15 of the lower connector; in servo mode D0 is the CLR signal."""

Cause = Literal["ems", "limit", "stall", "any"]
CAUSES: Final[Sequence[Cause]] = get_args(Cause)


ROWS: Final = Rows("inputs and outputs")
Output = Annotated[int, Field(ge=0, le=15, description="General output, 0-15.", examples=[3])]
CauseName = Annotated[
    Cause,
    Field(description="Cause that it reports; `limit` is that of either direction.", examples=["limit"]),
]


class SignalState(AnswerModel):
    """An input or an output."""

    number: int
    name: str | None = Field(description="Name in the configuration.")
    on: bool


class SignalReading(AnswerModel):
    """Signals as a controller has told them."""

    body_id: str
    read_at: datetime = Field(description="Time of the controller's answer.")
    age_ms: float = Field(description="Age of the answer in ms when it was passed on.")


class BodyInputs(SignalReading):
    """The general inputs, after their logic (DIS) and their noise filters (DCS)."""

    inputs: list[SignalState]


class BodyOutputs(SignalReading):
    """The general outputs; in servo mode output 0 is the CLR signal."""

    outputs: list[SignalState]


class SensorBits(AnswerModel):
    """The sensors, bits of CLD (RC-420 manual 14)."""

    stall: bool
    origin: bool
    cw_limit: bool
    ccw_limit: bool
    in_position: bool
    ems: bool


class BodySensors(SignalReading):
    """The sensors, after their logic (DLS)."""

    sensors: SensorBits


class OutputSwitch(SentBack, json_schema_extra=example(on=True)):
    """A level for an output."""

    read_only = frozenset(("number", "name"))

    on: bool


class OutputPulse(RequestModel, json_schema_extra=example(duration_ms=200)):
    """For how long an output is inverted."""

    duration_ms: int = Field(ge=1, lt=BILLION)


class ErrorOutputState(AnswerModel):
    """The output that reports a cause of errors."""

    cause: Cause
    output: int | None = Field(description="Number of the output; null: nothing reports the cause.")
    name: str | None = Field(description="Name of the output in the configuration.")
    on: bool | None = Field(description="The state it takes on an error.")
    standing: bool = Field(description="True if the cause has come, and was not taken back since.")


class BodyErrorOutputs(AnswerModel):
    """The outputs that report errors."""

    body_id: str
    error_outputs: list[ErrorOutputState]


class ErrorOutputChoice(SentBack, json_schema_extra=example(output=7, on=True)):
    """The output that reports a cause, and its state on an error."""

    read_only = frozenset(("cause", "name", "standing"))

    output: int | None = Field(ge=0, le=15, description="General output; null: nothing reports it.")
    on: bool | None = Field(default=None, description="The state it takes on an error; with `output`.")

    @model_validator(mode="after")
    def _both_or_none(self) -> Self:
        if (self.output is None) is not (self.on is None):
            raise ValueError("give on with output, and neither without the other")
        return self


class NotSwitched(GatewayError):
    """An output was switched, and what was read back is not what it should be."""

    kind = "not-done"
    retryable = True


@ROWS.get("/bodies/{body_id}/inputs")
async def get_body_inputs(body: AskedBody) -> BodyInputs:
    """Ask the controller for all ten inputs (CID)."""
    reply, answered = await body.ask(GetInputs())
    states = _states(INPUTS, body.input_names, reply.bits or 0)
    return BodyInputs(**_reading(body, answered.at), inputs=states)


@ROWS.get("/bodies/{body_id}/outputs")
async def get_body_outputs(body: AskedBody) -> BodyOutputs:
    """Ask the controller for all sixteen outputs (COD)."""
    reply, answered = await body.ask(GetOutputs())
    states = _states(OUTPUTS, body.output_names, reply.bits or 0)
    return BodyOutputs(**_reading(body, answered.at), outputs=states)


@ROWS.put("/bodies/{body_id}/outputs/{output}", Right.OPERATE)
async def switch_body_output(body: AskedBody, output: Output, wanted: OutputSwitch) -> SignalState:
    """Switch an output (COS), which ends its pulse, and read it back; `not-done` where it is not as asked."""
    wanted.require_unchanged(SignalState(number=output, name=body.output_names.get(output), on=wanted.on))
    await body.ask(SetOutputs(bit=output, on=int(wanted.on)))
    signal = await _output(body, output)
    if signal.on is not wanted.on:
        raise NotSwitched(
            f"Output {output} of {body.address} was switched {'on' if wanted.on else 'off'}, and is not: in "
            "servo mode output 0 is the CLR signal, and a user program or an error may switch others.",
            "Read the outputs.",
        )
    return signal


@ROWS.post("/bodies/{body_id}/outputs/{output}/pulses", Right.OPERATE)
async def pulse_body_output(body: AskedBody, output: Output, wanted: OutputPulse) -> SignalState:
    """Invert an output for a time (CBS); refused while it is inverted, and where it reports an error."""
    await body.ask(PulseOutput(bit=output, duration_ms=wanted.duration_ms))
    return await _output(body, output)


@ROWS.get("/bodies/{body_id}/sensors")
async def get_body_sensors(body: AskedBody) -> BodySensors:
    """Ask the controller for all six sensors (CLD)."""
    reply, answered = await body.ask(GetSensors())
    bits = reply.bits or 0
    told = {name: bool(bits >> place & 1) for place, name in enumerate(SENSOR_BITS)}
    return BodySensors(**_reading(body, answered.at), sensors=SensorBits(**told))


@ROWS.get("/bodies/{body_id}/error-outputs")
async def get_error_outputs(body: AskedBody) -> BodyErrorOutputs:
    """Ask the controller which outputs report errors (CED), and which errors stand (CRD)."""
    # Each cause alone, for the order of the bits that tell all at once is not known.
    states = [await _error_output(body, cause) for cause in CAUSES]
    return BodyErrorOutputs(body_id=body.address, error_outputs=states)


@ROWS.put("/bodies/{body_id}/error-outputs/{cause}", Right.SETUP)
async def set_error_output(body: AskedBody, cause: CauseName, wanted: ErrorOutputChoice) -> BodyErrorOutputs:
    """Set the output that reports a cause (CES), and read it back. Each cause takes one of its own."""
    if wanted.told:
        wanted.require_unchanged(await _error_output(body, cause))
    state = None if wanted.on is None else int(wanted.on)
    await body.ask(SetErrorOutput(cause=cause, output=wanted.output, state=state))
    held = await _error_output(body, cause)
    if (held.output, held.on) != (wanted.output, wanted.on):
        raise NotSwitched(
            f"The output that reports {cause} of {body.address} was set, and is another afterwards.",
            "Set it again.",
        )
    return BodyErrorOutputs(body_id=body.address, error_outputs=[held])


@ROWS.post("/bodies/{body_id}/error-outputs/reset", Right.OPERATE)
async def reset_error_outputs(body: AskedBody) -> BodyErrorOutputs:
    """Take back all error outputs (CRS), which refuse moves while they stand."""
    await body.ask(ClearErrorOutputStatus())
    return await get_error_outputs(body)


def _reading(body: AskedBody, at: float) -> dict[str, Any]:
    return {"body_id": body.address, "read_at": utc_of(at), "age_ms": age_ms_of(at)}


def _states(numbers: range, names: Mapping[int, str], bits: int) -> list[SignalState]:
    return [
        SignalState(number=number, name=names.get(number), on=bool(bits >> number & 1)) for number in numbers
    ]


async def _output(body: AskedBody, output: int) -> SignalState:
    reply, _ = await body.ask(GetOutputs(bit=output))
    return SignalState(number=output, name=body.output_names.get(output), on=bool(reply.on))


async def _error_output(body: AskedBody, cause: Cause) -> ErrorOutputState:
    setting, _ = await body.ask(GetErrorOutput(cause=cause))
    standing, _ = await body.ask(GetErrorOutputStatus(cause=cause))
    return ErrorOutputState(
        cause=cause,
        output=setting.output,
        name=None if setting.output is None else body.output_names.get(setting.output),
        on=None if setting.state is None else bool(setting.state),
        standing=bool(standing.on),
    )
