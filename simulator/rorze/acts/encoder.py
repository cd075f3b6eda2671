"""The encoder's ratio and its step-out detection: commands P (RC-420 manual 13.7, 14).

The multiplier and the adjustment after a move are not acted out.
"""

from dataclasses import replace

from protocols.rorze.encoder import EncoderRatio, GetEncoderRatio, SetEncoderRatio
from simulator.rorze.actions import acts_out
from simulator.rorze.controller import Rc420


@acts_out(GetEncoderRatio)
def get_ratio(axis: Rc420, command: GetEncoderRatio, now: float) -> EncoderRatio:
    return EncoderRatio(ratio=axis.settings.encoder_ratio)


@acts_out(SetEncoderRatio)
def set_ratio(axis: Rc420, command: SetEncoderRatio, now: float) -> None:
    """The encoder of the simulated axis is always one that fits the ratio; its count stays what it was."""
    count = axis.encoder(now)
    axis.settings = replace(axis.settings, encoder_ratio=command.ratio)
    axis.set_encoder(count, now)
