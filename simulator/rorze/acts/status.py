"""Status, end causes and what the controller tells of itself: commands 9 (RC-420 manual 13.8, 14)."""

from protocols.rorze.status import (
    ClearControllerStatus,
    ControllerStatus,
    EndCause,
    GetControllerStatus,
    GetEndCause,
    GetInformation,
    Information,
    SetUserComment,
)
from simulator.rorze.actions import acts_out
from simulator.rorze.controller import STALL_ERROR, Rc420

VERSION = "RC-420 Ver0001.00 by RORZE(2001-01-01)"
"""An invented version in the printed form."""


@acts_out(GetControllerStatus)
def _get_status(axis: Rc420, command: GetControllerStatus, _now: float) -> ControllerStatus:
    status = axis.status_now()
    if axis.forgets_errors:
        axis.status = 0
    if command.bit is None:
        return ControllerStatus(bits=status)
    return ControllerStatus(on=status >> command.bit & 1)


@acts_out(ClearControllerStatus)
def _clear_status(axis: Rc420, _: ClearControllerStatus, _now: float) -> None:
    axis.status &= STALL_ERROR


@acts_out(GetEndCause)
def _get_end_cause(axis: Rc420, _: GetEndCause, _now: float) -> EndCause:
    return EndCause(bits=axis.end_cause)


@acts_out(GetInformation)
def _get_information(axis: Rc420, command: GetInformation, _now: float) -> Information:
    if command.comment_number is None:
        return Information(text=VERSION)
    return Information(text=axis.settings.comments[command.comment_number - 1])


@acts_out(SetUserComment)
def _set_comment(axis: Rc420, command: SetUserComment, _now: float) -> None:
    axis.settings = axis.settings.with_item("comments", command.comment_number - 1, command.text)
