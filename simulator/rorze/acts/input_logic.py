"""Contacts and noise filters of the inputs: commands D (RC-420 manual 13.9, 14)."""

from dataclasses import replace

from protocols.rorze.input_logic import (
    GetInputLogic,
    GetNoiseFilter,
    GetSensorLogic,
    InputLogic,
    NoiseFilter,
    SensorLogic,
    SetInputLogic,
    SetNoiseFilter,
    SetSensorLogic,
)
from simulator.rorze.actions import acts_out
from simulator.rorze.controller import Rc420

CONTACTS = ("normally_open", "normally_closed")


def _changed(word: int, command: SetInputLogic | SetSensorLogic) -> int:
    """A logic word with all bits, or with one of them, as the command has it."""
    if command.bits is not None:
        return command.bits
    if command.bit is None or command.contact is None:
        return word
    return word & ~(1 << command.bit) | CONTACTS.index(command.contact) << command.bit


@acts_out(GetNoiseFilter)
def get_noise_filter(axis: Rc420, command: GetNoiseFilter, now: float) -> NoiseFilter:
    return NoiseFilter(count=axis.settings.noise_counts[command.bit])


@acts_out(SetNoiseFilter)
def set_noise_filter(axis: Rc420, command: SetNoiseFilter, now: float) -> None:
    if command.bit is None:
        everywhere = (command.count,) * len(axis.settings.noise_counts)
        axis.settings = replace(axis.settings, noise_counts=everywhere)
    else:
        axis.settings = axis.settings.with_item("noise_counts", command.bit, command.count)
    axis.io.settings_changed(now)


@acts_out(GetInputLogic)
def get_input_logic(axis: Rc420, command: GetInputLogic, now: float) -> InputLogic:
    word = axis.settings.input_logic
    if command.bit is None:
        return InputLogic(bits=word)
    return InputLogic.model_validate({"contact": CONTACTS[word >> command.bit & 1]})


@acts_out(SetInputLogic)
def set_input_logic(axis: Rc420, command: SetInputLogic, now: float) -> None:
    axis.settings = replace(axis.settings, input_logic=_changed(axis.settings.input_logic, command))
    axis.io.settings_changed(now)


@acts_out(GetSensorLogic)
def get_sensor_logic(axis: Rc420, command: GetSensorLogic, now: float) -> SensorLogic:
    word = axis.settings.sensor_logic
    if command.bit is None:
        return SensorLogic(bits=word)
    return SensorLogic.model_validate({"contact": CONTACTS[word >> command.bit & 1]})


@acts_out(SetSensorLogic)
def set_sensor_logic(axis: Rc420, command: SetSensorLogic, now: float) -> None:
    axis.settings = replace(axis.settings, sensor_logic=_changed(axis.settings.sensor_logic, command))
    axis.io.settings_changed(now)
