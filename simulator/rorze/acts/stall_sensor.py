"""Step-out detection by the STALL sensor: commands Q (RC-420 manual 13.6.2, 14)."""

from protocols.rorze.stall_sensor import (
    ClearStallSensorError,
    GetStallSensorDetection,
    GetStallSensorError,
    GetStallSensorInterval,
    SetStallSensorDetection,
    SetStallSensorInterval,
    StallError,
)
from simulator.rorze.actions import acts_out
from simulator.rorze.acts.kept import keeps
from simulator.rorze.controller import Rc420, StallFinder

keeps(GetStallSensorInterval, SetStallSensorInterval, "stall_interval")
keeps(GetStallSensorDetection, SetStallSensorDetection, "stall_detection")


@acts_out(GetStallSensorError)
def get_error(axis: Rc420, command: GetStallSensorError, now: float) -> StallError:
    return StallError(stalled=int(StallFinder.SENSOR in axis.stalls))


@acts_out(ClearStallSensorError)
def clear_error(axis: Rc420, command: ClearStallSensorError, now: float) -> None:
    axis.clear_stalls(StallFinder.SENSOR)
