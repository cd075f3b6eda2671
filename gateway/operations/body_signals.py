"""Inputs, outputs and sensors of bodies."""

from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.rorze import signals
from gateway.rorze.family import Rorze
from gateway.rorze.signals import Cause, ErrorOutput, Signal


@needs(Right.VIEW)
async def inputs(plant: Plant, body_id: str) -> tuple[list[Signal], float]:
    """Read all inputs, and when they were told; errors as of `signals.inputs`."""
    return await signals.inputs(plant.family(Rorze).body(body_id))


@needs(Right.VIEW)
async def outputs(plant: Plant, body_id: str) -> tuple[list[Signal], float]:
    """Read all outputs, and when they were told; errors as of `signals.outputs`."""
    return await signals.outputs(plant.family(Rorze).body(body_id))


@needs(Right.VIEW)
async def sensors(plant: Plant, body_id: str) -> tuple[dict[str, bool], float]:
    """Read all sensors, and when they were told; errors as of `signals.sensors`."""
    return await signals.sensors(plant.family(Rorze).body(body_id))


@needs(Right.OPERATE)
async def switch(plant: Plant, body_id: str, output: int, on: bool) -> Signal:
    """Switch an output and read it back; errors as of `signals.switch`."""
    return await signals.switch(plant.family(Rorze).body(body_id), output, on=on)


@needs(Right.OPERATE)
async def pulse(plant: Plant, body_id: str, output: int, duration_ms: int) -> Signal:
    """Invert an output for a time; errors as of `signals.pulse`."""
    return await signals.pulse(plant.family(Rorze).body(body_id), output, duration_ms)


@needs(Right.VIEW)
async def error_outputs(plant: Plant, body_id: str) -> list[ErrorOutput]:
    """Read which outputs report errors; errors as of `signals.error_outputs`."""
    return await signals.error_outputs(plant.family(Rorze).body(body_id))


@needs(Right.SETUP)
async def set_error_output(
    plant: Plant, body_id: str, cause: Cause, output: int | None, on: bool | None
) -> ErrorOutput:
    """Set the output that reports a cause; errors as of `signals.set_error_output`."""
    return await signals.set_error_output(plant.family(Rorze).body(body_id), cause, output, on=on)


@needs(Right.OPERATE)
async def take_back_errors(plant: Plant, body_id: str) -> list[ErrorOutput]:
    """Take back all error outputs; errors as of `signals.take_back_errors`."""
    return await signals.take_back_errors(plant.family(Rorze).body(body_id))
