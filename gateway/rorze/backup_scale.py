"""A backup whose pulses are of another length than those of the body it is restored to."""

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Final

from pydantic import ValidationError

from gateway.core.errors import InvalidRequest
from gateway.core.restore_record import ScaleDifference, Units
from gateway.rorze.backup import Contents
from gateway.rorze.backup_places import Command, Section, given, normal
from gateway.rorze.bodies import Body
from gateway.rorze.units import Scale
from protocols.rorze import encoder, inputs_outputs, interpolation, modes, origin, patterns, speeds
from protocols.rorze.commands import Row
from protocols.rorze.notation import BILLION
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.programs import SetProgramMemory
from protocols.rorze.stall_sensor import SetStallSensorInterval

IN_PULSES: Final[Mapping[Row, tuple[str, ...]]] = {
    SetPositionEntry: ("pulses",),
    modes.SetSoftLimits: ("lower", "upper"),
    inputs_outputs.SetInterruptRange: ("lower", "upper"),
    origin.SetOriginOffset: ("offset",),
    SetStallSensorInterval: ("interval",),
    encoder.SetEncoderStallThreshold: ("threshold",),
    encoder.SetEncoderRatio: ("ratio",),
    encoder.SetAdjustmentLimit: ("limit",),
    encoder.SetAdjustmentSpeed: ("speed",),
    interpolation.SetPulsesPerTurn: ("pulses",),
    speeds.SetStartSpeed: ("speed",),
    speeds.SetMaximumSpeed: ("speed",),
    speeds.SetMaximumAcceleration: ("acceleration",),
    patterns.SetSpeedChange: ("begin", "end", "speed"),
}
"""The fields that grow with the pulses a unit is. Percent, times and counts of tries do not."""
FARTHEST: Final = BILLION - 1
"""As a bound it says that there is none; as a place it is one."""


def for_body(wanted: Contents, body: Body, units: Units | None) -> tuple[Contents, ScaleDifference | None]:
    """Give what a body is to hold, and how its scale differs from that of the backup, if it does.

    A backup that does not tell its scale is taken as it is, and so is one for a body of the same scale.

    :raises InvalidRequest: the scales differ, and `units` does not say what to do, or it cannot be done.
    """
    if wanted.scale is None or _is_same(wanted.scale, body.scale):
        return wanted, None
    own = "no scale" if body.scale is None else body.scale.words
    differ = f"The backup was made at {wanted.scale.words}, and {body.address} has {own}"
    if units is None:
        raise InvalidRequest(
            f"{differ}: the same pulses would be other places; nothing was sent.",
            "Say `units`: keep_pulses restores the pulses as they are, convert keeps the lengths and speeds.",
        )
    found = ScaleDifference(target=body.address, backup=wanted.scale.words, controller=own, units=units)
    if units == "keep_pulses":
        return wanted, found
    factor = None if body.scale is None else body.scale.per(wanted.scale)
    if factor is None:
        raise InvalidRequest(f"{differ}: one is not converted to the other; nothing was sent.", TAKE_OUT)
    for why in _hindrances(wanted):
        raise InvalidRequest(f"{differ}: {why}; nothing was sent.", TAKE_OUT)
    return _converted(wanted, factor), found


TAKE_OUT: Final = "Take out what cannot be converted, or say `units`: keep_pulses."


def _is_same(one: Scale, other: Scale | None) -> bool:
    return other is not None and other.per(one) == 1


def _hindrances(wanted: Contents) -> Iterator[str]:
    """Why a backup is not converted: numbers whose unit is not known here, or that no scale converts."""
    if wanted.in_encoder_counts:
        yield "in encoder mode its positions are encoder counts (EAS), which are not converted"
    if wanted.instructions:
        yield "its [program] may have amounts in pulses, which are not converted"
    memories = wanted.places.get("memories", {}).values()
    if any(isinstance(it, SetProgramMemory) and it.memory[0] == "D" for it in memories):
        yield "data memories of [memories] may be amounts in pulses, which are not converted"


def _converted(wanted: Contents, factor: Fraction) -> Contents:
    places: dict[Section, dict[str, Command]] = {
        name: {key: _scaled(command, factor) for key, command in commands.items()}
        for name, commands in wanted.places.items()
    }
    return Contents(places, wanted.program)


def _scaled(command: Command, factor: Fraction) -> Command:
    """The same length or speed: the nearest whole number of pulses, or of hundredths where there are such.

    :raises InvalidRequest: the controller does not take so much, or so little.
    """
    fields = IN_PULSES.get(type(command), ())
    place = isinstance(command, SetPositionEntry)
    values = {name: it for name in fields if (it := getattr(command, name)) and (place or abs(it) < FARTHEST)}
    scaled = {
        name: round(it * factor) if isinstance(it, int) else round(float(Fraction(str(it)) * factor), 2)
        for name, it in values.items()
    }
    try:
        return normal(type(command)(**{**given(command), **scaled}))
    except ValidationError:
        text = f"{command.code}{command.written()}"
        told = ", ".join(f"{name} {it}" for name, it in scaled.items())
        raise InvalidRequest(
            f"{text} comes to {told}, which {command.code} does not take; nothing was sent.", TAKE_OUT
        ) from None
