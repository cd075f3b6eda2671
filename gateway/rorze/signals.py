"""A body's general inputs and outputs, and the outputs that report errors (RC-420 manual 13.9)."""

from collections.abc import Mapping, Sequence
from typing import Final, Literal, NamedTuple, get_args

from gateway.core.errors import GatewayError
from gateway.rorze.bodies import Body
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
from protocols.rorze.status import SENSOR_BITS

INPUTS: Final = range(10)
"""D0-D9 of the upper connector; 8 and 9 can interrupt."""
OUTPUTS: Final = range(16)
"""D0-D15 of the lower connector; in servo mode D0 is the CLR signal."""

Cause = Literal["ems", "limit", "stall", "any"]
CAUSES: Final[Sequence[Cause]] = get_args(Cause)


class Signal(NamedTuple):
    """An input or an output."""

    number: int
    name: str | None
    on: bool


class ErrorOutput(NamedTuple):
    """What reports a cause of errors."""

    cause: Cause
    output: int | None
    """None: nothing reports it."""
    on: bool | None
    """The state it takes on an error."""
    standing: bool
    """Whether the cause has come, and was not taken back since."""


class NotSwitched(GatewayError):
    """An output was switched, and what was read back is not what it should be."""

    kind = "not-done"
    title = "Sent, but not done"
    retryable = True


async def inputs(body: Body) -> tuple[list[Signal], float]:
    """Read all inputs in one frame (CID), and when they were told.

    :raises GatewayError: they were not read.
    """
    reply, answered = await body.ask(GetInputs())
    return _signals(INPUTS, body.input_names, reply.bits or 0), answered.at


async def outputs(body: Body) -> tuple[list[Signal], float]:
    """Read all outputs in one frame (COD), and when they were told.

    :raises GatewayError: they were not read.
    """
    reply, answered = await body.ask(GetOutputs())
    return _signals(OUTPUTS, body.output_names, reply.bits or 0), answered.at


async def sensors(body: Body) -> tuple[dict[str, bool], float]:
    """Read all sensors in one frame (CLD), by their names, and when they were told.

    :raises GatewayError: they were not read.
    """
    reply, answered = await body.ask(GetSensors())
    bits = reply.bits or 0
    return {name: bool(bits >> place & 1) for place, name in enumerate(SENSOR_BITS)}, answered.at


async def switch(body: Body, output: int, *, on: bool) -> Signal:
    """Switch an output (COS) and read it back.

    :raises NotSwitched: it is otherwise afterwards.
    :raises GatewayError: it was refused, not sent, not answered, or not read back.
    """
    await body.ask(SetOutputs(bit=output, on=int(on)))
    signal = await _output(body, output)
    if signal.on is not on:
        raise NotSwitched(
            f"Output {output} of {body.address} was switched {'on' if on else 'off'}, and is not: in servo "
            "mode output 0 is the CLR signal, and a user program or an error may switch others.",
            "Read the outputs.",
        )
    return signal


async def pulse(body: Body, output: int, duration_ms: int) -> Signal:
    """Invert an output for a time (CBS), and give it as it is then.

    :raises GatewayError: it was refused, as where it is inverted already or reports an error, not sent, not
        answered, or not read back.
    """
    await body.ask(PulseOutput(bit=output, duration_ms=duration_ms))
    return await _output(body, output)


async def error_outputs(body: Body) -> list[ErrorOutput]:
    """Read which outputs report errors (CED), and which causes have come (CRD).

    Each cause is asked for alone, for the order of the bits that tell all at once is not known.

    :raises GatewayError: they were not read.
    """
    return [await _error_output(body, cause) for cause in CAUSES]


async def set_error_output(body: Body, cause: Cause, output: int | None, *, on: bool | None) -> ErrorOutput:
    """Set the output that reports a cause (CES), or with None let nothing report it; then read it back.

    :raises NotSwitched: it is otherwise afterwards.
    :raises GatewayError: it was refused, not sent, not answered, or not read back.
    """
    state = None if on is None else int(on)
    await body.ask(SetErrorOutput(cause=cause, output=output, state=state))
    held = await _error_output(body, cause)
    if (held.output, held.on) != (output, on):
        raise NotSwitched(
            f"The output that reports {cause} of {body.address} was set, and is another afterwards.",
            "Set it again.",
        )
    return held


async def take_back_errors(body: Body) -> list[ErrorOutput]:
    """Take back all error outputs (CRS); each takes the opposite of its error state.

    :raises GatewayError: it was not sent, not answered, or not read back.
    """
    await body.ask(ClearErrorOutputStatus())
    return await error_outputs(body)


async def _output(body: Body, output: int) -> Signal:
    reply, _ = await body.ask(GetOutputs(bit=output))
    return Signal(output, body.output_names.get(output), bool(reply.on))


async def _error_output(body: Body, cause: Cause) -> ErrorOutput:
    setting, _ = await body.ask(GetErrorOutput(cause=cause))
    standing, _ = await body.ask(GetErrorOutputStatus(cause=cause))
    on = None if setting.state is None else bool(setting.state)
    return ErrorOutput(cause, setting.output, on, bool(standing.on))


def _signals(numbers: range, names: Mapping[int, str], bits: int) -> list[Signal]:
    return [Signal(number, names.get(number), bool(bits >> number & 1)) for number in numbers]
