"""Inputs, outputs, interrupts and error outputs: commands C (RC-420 manual 13.9, 14)."""

from dataclasses import replace

from protocols.rorze.inputs_outputs import (
    ERROR_OUTPUT_BITS,
    ClearErrorOutputStatus,
    ErrorOutput,
    ErrorOutputs,
    GetClearPulseTime,
    GetErrorOutput,
    GetErrorOutputStatus,
    GetInputs,
    GetInterruptAction,
    GetInterruptMode,
    GetInterruptRange,
    GetOutputs,
    GetSensors,
    Inputs,
    InterruptAction,
    InterruptMode,
    Outputs,
    PulseOutput,
    Sensors,
    SetClearPulseTime,
    SetClearSignal,
    SetErrorOutput,
    SetInterruptAction,
    SetInterruptMode,
    SetInterruptRange,
    SetOutputs,
)
from protocols.rorze.notation import Bounds
from simulator.rorze import settings
from simulator.rorze.actions import BAD_PARAMETER, Refused, acts_out
from simulator.rorze.acts.kept import keeps
from simulator.rorze.acts.modes import stretch
from simulator.rorze.controller import Rc420
from simulator.rorze.interrupts import INTERRUPT_INPUTS
from simulator.rorze.outputs import CLEAR

TAKEN = 0x67

EDGES = ("off", "falling", "rising")


# Inputs


@acts_out(GetInputs)
def get_inputs(axis: Rc420, command: GetInputs, now: float) -> Inputs:
    bits = axis.io.inputs()
    return Inputs(bits=bits) if command.bit is None else Inputs(on=bits >> command.bit & 1)


@acts_out(GetSensors)
def get_sensors(axis: Rc420, command: GetSensors, now: float) -> Sensors:
    bits = axis.io.sensors()
    return Sensors(bits=bits) if command.bit is None else Sensors(on=bits >> command.bit & 1)


# Outputs


@acts_out(GetOutputs)
def get_outputs(axis: Rc420, command: GetOutputs, now: float) -> Outputs:
    outputs = axis.io.outputs
    if command.bit is None:
        return Outputs(bits=outputs.bits())
    if command.bit == "clear":
        _require(outputs.available(CLEAR))
        return Outputs(on=int(outputs.clear_signal()))
    return Outputs(on=int(outputs.level(command.bit)))


@acts_out(SetOutputs)
def set_outputs(axis: Rc420, command: SetOutputs, now: float) -> None:
    outputs = axis.io.outputs
    if command.bits is not None:
        outputs.set_all(command.bits)
    elif command.bit == "clear":
        _require(outputs.available(CLEAR))
        outputs.set(CLEAR, bool(command.on))
    elif command.bit is not None:
        outputs.set(command.bit, bool(command.on))


@acts_out(PulseOutput)
def pulse_output(axis: Rc420, command: PulseOutput, now: float) -> None:
    outputs = axis.io.outputs
    _require(outputs.available(command.bit) and not outputs.pulsing(command.bit))
    _require(all(taken.output != command.bit for taken in axis.settings.error_outputs.values()))
    outputs.pulse(command.bit, not outputs.level(command.bit), command.duration_ms, now)


keeps(GetClearPulseTime, SetClearPulseTime, "clear_pulse_ms")


@acts_out(SetClearSignal)
def set_clear_signal(axis: Rc420, command: SetClearSignal, now: float) -> None:
    axis.io.outputs.set(CLEAR, bool(command.on))


# Error outputs


@acts_out(GetErrorOutput)
def get_error_output(axis: Rc420, command: GetErrorOutput, now: float) -> ErrorOutput:
    chosen = axis.settings.error_outputs.get(command.cause)
    return ErrorOutput(output=chosen.output, state=chosen.level) if chosen else ErrorOutput()


@acts_out(SetErrorOutput)
def set_error_output(axis: Rc420, command: SetErrorOutput, now: float) -> None:
    chosen = {
        cause: output for cause, output in axis.settings.error_outputs.items() if cause != command.cause
    }
    if command.output is not None and command.state is not None:
        _require(axis.io.outputs.available(command.output))
        if any(taken.output == command.output for taken in chosen.values()):
            raise Refused(TAKEN)
        chosen[command.cause] = settings.ErrorOutput(command.output, command.state)
    axis.settings = replace(axis.settings, error_outputs=chosen)


@acts_out(GetErrorOutputStatus)
def get_error_output_status(axis: Rc420, command: GetErrorOutputStatus, now: float) -> ErrorOutputs:
    outputs = axis.io.outputs
    if command.cause is not None:
        return ErrorOutputs(on=int(outputs.driven(command.cause)))
    return ErrorOutputs(bits=sum(outputs.driven(cause) << bit for cause, bit in ERROR_OUTPUT_BITS.items()))


@acts_out(ClearErrorOutputStatus)
def clear_error_output_status(axis: Rc420, command: ClearErrorOutputStatus, now: float) -> None:
    axis.io.outputs.release_errors()


# Interrupts


@acts_out(GetInterruptAction)
def get_interrupt_action(axis: Rc420, command: GetInterruptAction, now: float) -> InterruptAction:
    actions = axis.settings.interrupt_actions[_place(command.port)]
    if command.recorded is not None:
        return InterruptAction(number=getattr(actions, command.recorded))
    pulse = actions.output
    if pulse is None:
        return InterruptAction()
    return InterruptAction(output=pulse.output, state=pulse.level, duration_ms=pulse.duration_ms)


@acts_out(SetInterruptAction)
def set_interrupt_action(axis: Rc420, command: SetInterruptAction, now: float) -> None:
    place = _place(command.port)
    before = axis.settings.interrupt_actions[place]
    match command.recorded:
        case None:
            actions = replace(before, output=_pulse(command))
        case "position":
            actions = replace(before, position=command.number)
        case "encoder":
            actions = replace(before, encoder=command.number)
        case "encoder_in_pulses":
            actions = replace(before, encoder_in_pulses=command.number)
    axis.settings = axis.settings.with_item("interrupt_actions", place, actions)


def _pulse(command: SetInterruptAction) -> settings.OutputPulse | None:
    if command.output is None or command.state is None or command.duration_ms is None:
        return None
    return settings.OutputPulse(command.output, command.state, command.duration_ms)


@acts_out(GetInterruptMode)
def get_interrupt_mode(axis: Rc420, command: GetInterruptMode, now: float) -> InterruptMode:
    return InterruptMode.model_validate({"edge": EDGES[axis.settings.interrupt_modes[_place(command.port)]]})


@acts_out(SetInterruptMode)
def set_interrupt_mode(axis: Rc420, command: SetInterruptMode, now: float) -> None:
    axis.io.interrupts.arm(command.port, EDGES.index(command.edge))


@acts_out(GetInterruptRange)
def get_interrupt_range(axis: Rc420, command: GetInterruptRange, now: float) -> Bounds:
    lower, upper = axis.settings.interrupt_sections[_place(command.port)]
    return Bounds(lower=lower, upper=upper)


@acts_out(SetInterruptRange)
def set_interrupt_range(axis: Rc420, command: SetInterruptRange, now: float) -> None:
    axis.settings = axis.settings.with_item("interrupt_sections", _place(command.port), stretch(command))


def _place(port: int) -> int:
    return INTERRUPT_INPUTS.index(port)


def _require(possible: bool) -> None:
    if not possible:
        raise Refused(BAD_PARAMETER)
