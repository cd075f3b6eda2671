"""Step-out detection by the STALL sensor: commands Q (RC-420 manual 13.6.2, 14)."""

from dataclasses import replace

from protocols.rorze.stall_sensor import (
    ClearStallSensorError,
    Enabled,
    GetStallSensorDetection,
    GetStallSensorError,
    GetStallSensorInterval,
    SetStallSensorDetection,
    SetStallSensorInterval,
    StallError,
    StallInterval,
)
from simulator.rorze.actions import acts_out
from simulator.rorze.controller import Rc420, StallFinder


@acts_out(GetStallSensorInterval)
def get_interval(axis: Rc420, command: GetStallSensorInterval, now: float) -> StallInterval:
    return StallInterval(interval=axis.settings.stall_interval)


@acts_out(SetStallSensorInterval)
def set_interval(axis: Rc420, command: SetStallSensorInterval, now: float) -> None:
    axis.settings = replace(axis.settings, stall_interval=command.interval)


@acts_out(GetStallSensorDetection)
def get_detection(axis: Rc420, command: GetStallSensorDetection, now: float) -> Enabled:
    return Enabled(enabled=axis.settings.stall_detection)


@acts_out(SetStallSensorDetection)
def set_detection(axis: Rc420, command: SetStallSensorDetection, now: float) -> None:
    axis.settings = replace(axis.settings, stall_detection=command.enabled)


@acts_out(GetStallSensorError)
def get_error(axis: Rc420, command: GetStallSensorError, now: float) -> StallError:
    return StallError(stalled=int(StallFinder.SENSOR in axis.stalls))


@acts_out(ClearStallSensorError)
def clear_error(axis: Rc420, command: ClearStallSensorError, now: float) -> None:
    axis.clear_stalls(StallFinder.SENSOR)
