"""The encoder, its step-out detection, the adjustment after a move: commands P (RC-420 manual 13.7, 14)."""

from collections.abc import Callable
from dataclasses import replace

from protocols.rorze.encoder import (
    ClearEncoderStallError,
    EncoderMultiplier,
    GetAdjustment,
    GetAdjustmentDelay,
    GetAdjustmentLimit,
    GetAdjustmentSpeed,
    GetEncoderMultiplier,
    GetEncoderRatio,
    GetEncoderStallDetection,
    GetEncoderStallError,
    GetEncoderStallThreshold,
    SetAdjustment,
    SetAdjustmentDelay,
    SetAdjustmentLimit,
    SetAdjustmentSpeed,
    SetEncoderMultiplier,
    SetEncoderRatio,
    SetEncoderStallDetection,
    SetEncoderStallThreshold,
)
from protocols.rorze.profile import steady
from protocols.rorze.stall_sensor import StallError
from simulator.rorze.actions import acts_out
from simulator.rorze.acts.kept import keeps
from simulator.rorze.acts.patterns import Ramps
from simulator.rorze.acts.speeds import start_speed_of
from simulator.rorze.axis import ENCODER_MODE
from simulator.rorze.controller import Rc420, StallFinder
from simulator.rorze.motor import STALL_CAUSE, Halted, Leg, Pause, Task
from simulator.rorze.settings import STANDARD
from simulator.rorze.world import CCW, CW

ADJUSTMENT_TICK_S = 0.01
"""The unit of PTS."""

MULTIPLIERS = {"double": 2, "quadruple": 4}


@acts_out(GetEncoderMultiplier)
def get_multiplier(axis: Rc420, command: GetEncoderMultiplier, now: float) -> EncoderMultiplier:
    (name,) = [name for name, edges in MULTIPLIERS.items() if edges == axis.settings.encoder_multiplier]
    return EncoderMultiplier.model_validate({"multiplier": name})


@acts_out(SetEncoderMultiplier)
def set_multiplier(axis: Rc420, command: SetEncoderMultiplier, now: float) -> None:
    """From here on the counter counts so; what it has counted stays."""
    count = axis.encoder(now)
    axis.settings = replace(axis.settings, encoder_multiplier=MULTIPLIERS[command.multiplier])
    axis.set_encoder(count, now)


keeps(GetEncoderRatio, SetEncoderRatio, "encoder_ratio")


# Step-out detection


keeps(GetEncoderStallThreshold, SetEncoderStallThreshold, "encoder_tolerance")
keeps(GetEncoderStallDetection, SetEncoderStallDetection, "encoder_stall_detection")


@acts_out(GetEncoderStallError)
def get_error(axis: Rc420, command: GetEncoderStallError, now: float) -> StallError:
    return StallError(stalled=int(StallFinder.ENCODER in axis.stalls))


@acts_out(ClearEncoderStallError)
def clear_error(axis: Rc420, command: ClearEncoderStallError, now: float) -> None:
    axis.clear_stalls(StallFinder.ENCODER)


# Adjustment


def correction(axis: Rc420, target: int | None, ramps: Ramps) -> Callable[[float], Task]:
    """The correction after a move to a target, in the unit of the mode; None is a move without an end.

    :raises Refused: 40 where the speed of the adjustment was never set.
    """
    settings = axis.settings
    if target is None or not settings.adjust or settings.mode != ENCODER_MODE:
        return _uncorrected
    speed = settings.adjust_speed or start_speed_of(axis, STANDARD)
    return _adjustment(axis, target, speed, ramps)


def _uncorrected(_now: float) -> Task:
    yield from ()


def _adjustment(axis: Rc420, target: int, speed: int, ramps: Ramps) -> Callable[[float], Task]:
    """The adjustment of the encoder counter to the target after a move (13.7.5).

    13.7.5 calls its failure a limit error, the pages of PKD and PKS a STALL error.
    """

    def adjust(now: float) -> Task:
        left = axis.settings.adjust_limit
        if axis.encoder(now) != target:
            now = yield Pause(now + axis.settings.adjust_delay * ADJUSTMENT_TICK_S)
        while missing := axis.pulses_to_count(target, now):
            if not left:
                axis.stalls.add(StallFinder.ENCODER)
                raise Halted(STALL_CAUSE)
            step = min(abs(missing), left)
            left -= step
            now = yield Leg(CW if missing > 0 else CCW, steady(step, speed, *ramps))

    return adjust


keeps(GetAdjustment, SetAdjustment, "adjust")
keeps(GetAdjustmentLimit, SetAdjustmentLimit, "adjust_limit")
keeps(GetAdjustmentSpeed, SetAdjustmentSpeed, "adjust_speed")
keeps(GetAdjustmentDelay, SetAdjustmentDelay, "adjust_delay")
