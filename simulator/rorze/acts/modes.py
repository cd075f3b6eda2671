"""Operating mode, pulse format, soft limits, event messages: commands E (RC-420 manual 13.1, 13.11, 14)."""

from dataclasses import replace

from protocols.rorze.modes import (
    EventKinds,
    EventMask,
    EventMasks,
    EventStatus,
    GetEventKinds,
    GetEventMask,
    GetEventStatus,
    GetOperatingMode,
    GetPulseFormat,
    GetSoftLimits,
    SetEventKinds,
    SetEventMask,
    SetOperatingMode,
    SetPulseFormat,
    SetSoftLimits,
)
from protocols.rorze.notation import Bounds, Interval
from simulator.rorze.actions import acts_out
from simulator.rorze.acts.kept import keeps
from simulator.rorze.controller import Rc420
from simulator.rorze.settings import FARTHEST

MODES = ("stepping", "encoder", "servo")
PULSE_FORMATS = ("pulse_direction", "cw_ccw")


def stretch(interval: Interval) -> tuple[int, int]:
    """The positions of an interval; all of them where none are given."""
    if interval.lower is None or interval.upper is None:
        return -FARTHEST, FARTHEST
    return interval.lower, interval.upper


keeps(GetOperatingMode, SetOperatingMode, "mode", MODES)
keeps(GetPulseFormat, SetPulseFormat, "pulse_output", PULSE_FORMATS)


@acts_out(GetSoftLimits)
def get_soft_limits(axis: Rc420, command: GetSoftLimits, now: float) -> Bounds:
    lower, upper = axis.settings.movable_range
    return Bounds(lower=lower, upper=upper)


@acts_out(SetSoftLimits)
def set_soft_limits(axis: Rc420, command: SetSoftLimits, now: float) -> None:
    axis.settings = replace(axis.settings, movable_range=stretch(command))


@acts_out(GetEventMask)
def get_event_mask(axis: Rc420, command: GetEventMask, now: float) -> EventMasks:
    return EventMasks(mask=axis.events.mask)


@acts_out(SetEventMask)
def set_event_mask(axis: Rc420, command: SetEventMask, now: float) -> None:
    given = command.mask
    axis.events.mask = EventMask(
        controller=given.controller or 0,
        end_cause=given.end_cause or 0,
        sensors=given.sensors or 0,
        inputs=given.inputs or 0,
    )


@acts_out(GetEventStatus)
def get_event_status(axis: Rc420, command: GetEventStatus, now: float) -> EventStatus:
    return EventStatus(status=axis.events.content(axis.status_values(now)))


@acts_out(GetEventKinds)
def get_event_kinds(axis: Rc420, command: GetEventKinds, now: float) -> EventKinds:
    return EventKinds(kinds=axis.events.kinds)


@acts_out(SetEventKinds)
def set_event_kinds(axis: Rc420, command: SetEventKinds, now: float) -> None:
    axis.events.kinds = command.kinds
