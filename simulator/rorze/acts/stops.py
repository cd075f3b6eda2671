"""Stops and speed changes on the way: commands 5 (RC-420 manual 13.3.6, 14)."""

from protocols.rorze.profile import SpeedParameters
from protocols.rorze.stops import (
    Accelerate,
    ChangeSpeed,
    Decelerate,
    GetStopSpeedSet,
    SetStopSpeedSet,
    StopDecelerating,
    StopImmediately,
    StopSpeedSet,
)
from simulator.rorze.actions import Refused, acts_out
from simulator.rorze.acts.speeds import parameters_of
from simulator.rorze.controller import MOVING, Rc420
from simulator.rorze.motion import PulseTrain
from simulator.rorze.motor import STOP_CAUSE

AT_REST, SEARCHING = 0x56, 0x5C


def _train(axis: Rc420) -> PulseTrain:
    """The pulses whose speed may be changed.

    :raises Refused: 56 at rest, 5C during an origin search, and during an interpolation, an assumption.
    """
    if axis.motor.train is None:
        raise Refused(AT_REST)
    if axis.motor.searching or axis.motor.interpolating:
        raise Refused(SEARCHING)
    return axis.motor.train


def _stop_parameters(axis: Rc420) -> SpeedParameters | None:
    """The speed set that 5MS chose; one that cannot be used keeps no stop from happening (an assumption)."""
    if axis.stop_speed_set is None:
        return None
    try:
        return parameters_of(axis, axis.stop_speed_set)
    except Refused:
        return None


@acts_out(StopImmediately)
def stop_immediately(axis: Rc420, _: StopImmediately, now: float) -> None:
    if axis.refuses_second_stop and axis.motor.braking:
        raise Refused(MOVING)
    if axis.motor.moving:
        axis.motor.stop(STOP_CAUSE, now)
        axis.io.outputs.give_clear(now)


@acts_out(StopDecelerating)
def stop_decelerating(axis: Rc420, _: StopDecelerating, now: float) -> None:
    axis.motor.decelerate(_stop_parameters(axis), now)


@acts_out(Accelerate)
def _accelerate(axis: Rc420, _: Accelerate, now: float) -> None:
    _train(axis).accelerate(now)


@acts_out(ChangeSpeed)
def _change_speed(axis: Rc420, command: ChangeSpeed, now: float) -> None:
    _train(axis).change_speed(now, command.speed)


@acts_out(Decelerate)
def _decelerate(axis: Rc420, _: Decelerate, now: float) -> None:
    _train(axis).decelerate(now)


@acts_out(GetStopSpeedSet)
def _get_stop_speed_set(axis: Rc420, _: GetStopSpeedSet, _now: float) -> StopSpeedSet:
    return StopSpeedSet(speed_set=axis.stop_speed_set)


@acts_out(SetStopSpeedSet)
def _set_stop_speed_set(axis: Rc420, command: SetStopSpeedSet, _now: float) -> None:
    axis.stop_speed_set = command.speed_set
