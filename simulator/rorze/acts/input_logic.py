"""Contacts and noise filters of the inputs: commands D (RC-420 manual 13.9, 14)."""

from dataclasses import replace
from typing import Any

from protocols.rorze.input_logic import (
    GetInputLogic,
    GetNoiseFilter,
    GetSensorLogic,
    NoiseFilter,
    SetInputLogic,
    SetNoiseFilter,
    SetSensorLogic,
)
from protocols.table import Reply
from simulator.rorze.actions import acts_out
from simulator.rorze.acts.kept import Row
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


def _logic(getter: Row, setter: Row, setting: str) -> None:
    """Act out the commands that set and tell a logic word, or one of its bits."""
    reply = getter.reply_type()

    @acts_out(getter)
    def tell(axis: Rc420, command: Any, now: float) -> Reply:
        word = getattr(axis.settings, setting)
        if command.bit is None:
            return reply.model_validate({"bits": word})
        return reply.model_validate({"contact": CONTACTS[word >> command.bit & 1]})

    @acts_out(setter)
    def change(axis: Rc420, command: Any, now: float) -> None:
        word: Any = _changed(getattr(axis.settings, setting), command)
        axis.settings = replace(axis.settings, **{setting: word})
        axis.io.settings_changed(now)


_logic(GetInputLogic, SetInputLogic, "input_logic")
_logic(GetSensorLogic, SetSensorLogic, "sensor_logic")
