"""Position and encoder counters: commands 6 (RC-420 manual 13.7, 14)."""

from protocols.rorze.position import (
    EncoderCount,
    GetEncoderCount,
    GetEncoderPosition,
    GetPosition,
    SetEncoderCount,
    SetPosition,
    SignedPulses,
)
from simulator.rorze.actions import acts_out
from simulator.rorze.axis import ENCODER_MODE, held
from simulator.rorze.controller import Rc420


@acts_out(GetPosition)
def _get_position(axis: Rc420, _: GetPosition, now: float) -> SignedPulses:
    return SignedPulses(pulses=axis.position(now))


@acts_out(SetPosition)
def _set_position(axis: Rc420, command: SetPosition, now: float) -> None:
    ratio = axis.settings.encoder_ratio
    if command.position == "encoder":
        axis.set_pulse_position(axis.encoder_in_pulses(now), now)
    elif axis.settings.mode == ENCODER_MODE:
        axis.set_encoder(command.position, now)
        axis.set_pulse_position(held(round(command.position * ratio)), now)
    else:
        axis.set_pulse_position(command.position, now)


@acts_out(GetEncoderCount)
def _get_encoder_count(axis: Rc420, _: GetEncoderCount, now: float) -> EncoderCount:
    return EncoderCount(count=axis.encoder(now))


@acts_out(SetEncoderCount)
def _set_encoder_count(axis: Rc420, command: SetEncoderCount, now: float) -> None:
    if command.count == "position":
        axis.set_encoder(held(int(axis.pulse_position(now) / axis.settings.encoder_ratio)), now)
    else:
        axis.set_encoder(command.count, now)


@acts_out(GetEncoderPosition)
def _get_encoder_position(axis: Rc420, _: GetEncoderPosition, now: float) -> SignedPulses:
    return SignedPulses(pulses=axis.encoder_in_pulses(now))
