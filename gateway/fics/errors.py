"""Errors of robots, besides those of all controllers."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn, TypeVar

from gateway import texts
from gateway.core.errors import (
    OVERTAKEN,
    BodyBusy,
    CommandGarbled,
    ControllerError,
    ControllerRefused,
    ErrorText,
    GatewayError,
    Moved,
    NoReply,
    NotSent,
    StoppedFirst,
)
from gateway.texts import Text
from protocols.fics.errors import lookup
from protocols.fics.link import FicsRefusal, SystemFailure
from protocols.fics.row import FicsCommand
from protocols.table import Retry

LASTING = frozenset({"E05", "E06", "E07", "E08", "E09", "E11", "E12"})
"""Refusals that the same request meets again until it, or a setting, is changed (C-HOST manual 2-12)."""
IN_MOTION = "E01"
"""The refusal of a command that the manual forbids during motion (C-HOST manual 1-7)."""
CANNOT_BE_CARRIED_OUT = "E10"
T = TypeVar("T")
HOME_FIRST = texts.text("refusals.home-first").en


def refused(robot_id: str, command: FicsCommand[Any], error: str) -> ControllerRefused:
    """The error of a command that a robot has answered with `Enn` (C-HOST manual 2-12)."""
    if command.rules_out(error):
        return CommandGarbled(robot_id, command.wire_name(), error, lookup(error))
    return ControllerRefused(robot_id, command.wire_name(), error, lookup(error), lasting=error in LASTING)


def answered(
    robot_id: str, command: FicsCommand[Any], outcome: T | FicsRefusal | SystemFailure | GatewayError
) -> T:
    """Give the answer of a robot.

    :raises ControllerRefused: the robot has refused the command.
    :raises RobotFailed: the command ended with an error of the system.
    :raises GatewayError: there is no answer; the error says why.
    """
    if isinstance(outcome, FicsRefusal):
        raise refused(robot_id, command, outcome.error)
    if isinstance(outcome, SystemFailure):
        raise RobotFailed(robot_id, command.wire_name(), outcome.error)
    if isinstance(outcome, GatewayError):
        raise outcome
    return outcome


class RefusedBefore(ControllerRefused):
    """A preparation was refused, so the command itself was not sent."""

    def __init__(self, robot_id: str, command: FicsCommand[Any], refusal: ControllerRefused) -> None:
        self.refused: str = refusal.refused if isinstance(refusal, RefusedBefore) else refusal.command_code
        """The code of what the robot has refused."""
        error, name = refusal.error_code or "", command.wire_name()
        super().__init__(robot_id, name, error, lookup(error), lasting=refusal.lasting)
        said = f"{self.refused}: {lookup(error).ja}"
        self.detail_ja = texts.text("refusals.not-sent", said=said, command=name).ja

    def _told(self, address: str, command_code: str, text: ErrorText) -> str:
        return (
            f"{address} refused {self.refused}, which goes before {command_code}: {text.en} "
            f"{command_code} was not sent. Nothing moved because of it."
        )


@contextmanager
def preparing(robot_id: str, command: FicsCommand[Any]) -> Iterator[None]:
    """Do what has to be right before a command: where that is refused, so is what was asked for.

    :raises ControllerRefused: as it was, but of `command`, which was not sent.
    """
    try:
        yield
    except ControllerRefused as refusal:
        refuse_before(robot_id, command, refusal)


def refuse_before(robot_id: str, command: FicsCommand[Any], refusal: ControllerRefused) -> NoReturn:
    """Refuse a command where what goes before it was refused.

    :raises ControllerRefused: always.
    """
    if refusal.command_code == command.wire_name():
        raise refusal
    raise RefusedBefore(robot_id, command, refusal) from refusal


class RobotFailed(ControllerError):
    """A command ended with an error of the system, `nnn`, which stands until DRT (C-HOST manual 2)."""

    kind = "robot-failed"
    moved: Moved = "unknown"

    def __init__(self, robot_id: str, command_code: str, error: str, text: ErrorText | None = None) -> None:
        text = text or lookup(error)
        detail = f"{command_code} of {robot_id} ended with error {error}: {text.en}"
        super().__init__(detail, command_code, error, text)
        self.error = error


class ErrorRemains(RobotFailed):
    """Errors of the system were to be reset, and one still stands; DRT moves nothing (C-HOST manual 2-14)."""

    kind = "error-remains"
    moved = "no"


class RobotBusy(BodyBusy):
    """The robot is doing something that excludes the request."""

    kind = "robot-busy"


class RobotOffline(NotSent):
    """The robot has stopped answering; it is asked again and again in the background."""

    kind = "robot-offline"


class ErrorStands(NotSent, ControllerError):
    """The robot has an error that forbids motion until it is reset."""

    kind = "error-stands"
    retryable = False

    def __init__(self, command_code: str, error: str | None, text: ErrorText) -> None:
        told = texts.text("refusals.not-sent", said=Text(text.en, text.ja), command=command_code)
        ControllerError.__init__(self, told.en, command_code, error, text)
        self.detail_ja = told.ja


class SpeedsNotRestored(NotSent):
    """After a loss of power the robot has not taken its speeds back: it would move at full speed."""

    kind = "speeds-not-restored"


class PositionUnknown(NotSent):
    """The robot does not tell where an axis stands, and the move needs to know it."""

    kind = "position-unknown"
    retryable = False


class NotHomed(PositionUnknown):
    """An axis has not been homed since power-on, and the move needs its position (C-HOST manual 2-9)."""

    kind = "not-homed"


class RefusedUnhomed(ControllerRefused):
    """The robot cannot carry out a command for an axis that is not homed (C-HOST manual 2-12)."""

    kind = NotHomed.kind

    def __init__(self, robot_id: str, command: FicsCommand[Any], axis: str) -> None:
        self._axis = axis
        text = lookup(CANNOT_BE_CARRIED_OUT)
        super().__init__(robot_id, command.wire_name(), CANNOT_BE_CARRIED_OUT, text, lasting=False)
        self.detail_ja += texts.text("refusals.axis-not-homed", axis=axis).ja
        self.remedy, self.remedy_ja = texts.text("refusals.home-first")

    def _told(self, address: str, command_code: str, text: ErrorText) -> str:
        not_homed = texts.text("refusals.axis-not-homed", axis=self._axis)
        return super()._told(address, command_code, text) + not_homed.en


class UnitNotSelected(NotSent):
    """It could not be made sure which unit a command would act on."""

    kind = "unit-not-selected"


class UnitMissing(UnitNotSelected):
    """The configuration names a unit that the robot does not have: it is beyond the range of UNT."""

    kind = "unit-missing"
    retryable = False

    def __init__(self, robot_id: str, unit: int) -> None:
        self.unit = unit
        super().__init__(
            f"Robot {robot_id} says that it has no unit {unit}; nothing more was sent.",
            f"Take unit {unit} of {robot_id} out of the configuration, or correct its number, and reload it.",
        )


class NotProved(NotSent):
    """The line was disturbed between the questions before a motion, so their answers prove nothing."""

    kind = "not-proved"

    def __init__(self, robot_id: str) -> None:
        super().__init__(
            f"The line of robot {robot_id} was disturbed between the questions before the motion, so nobody "
            "knows whether the robot has lost its power; nothing was sent.",
            "Try again; if that does not help, check the line.",
        )


class UploadBrokenOff(GatewayError):
    """Some of the positions of an upload were sent, the rest were not."""

    kind = "upload-broken-off"

    def __init__(self, robot_id: str, last_sent: int, cause: GatewayError) -> None:
        sent = (
            f"Positions up to {last_sent} were sent to {robot_id}"
            if last_sent
            else f"None was sent to {robot_id}"
        )
        why = _what_came_first(cause)
        maybe = " The next one may be stored as well." if isinstance(cause, NoReply) else ""
        super().__init__(
            f"{sent}, then the upload was broken off: {why}.{maybe} Which are stored was not read back.",
            "Read the positions, and upload them again before a move goes to one.",
        )


class RobotPositionsDiffer(GatewayError):
    """Positions were uploaded, and the robot holds others: a line was lost, doubled or garbled on its way."""

    kind = "positions-differ"
    retryable = True


class NotDone(GatewayError):
    """A command was written, and what was read back is not what it should have set."""

    kind = "not-done"

    def __init__(self, detail: str, command: FicsCommand[Any]) -> None:
        super().__init__(detail, "Send it again if it is still wanted.")
        self.retryable = command.retry is Retry.SETTING


class NotReadBack(NoReply):
    """Something was sent, and what has become of it could not be read."""

    kind = "not-read-back"
    moved = "no"

    def __init__(self, done: str, cause: GatewayError) -> None:
        super().__init__(f"{done}, but could not be read back: {_why(cause)}", "Read it again.")


class PartlyChanged(GatewayError):
    """Some of several things were changed, the rest were not."""

    kind = "partly-changed"

    def __init__(self, changed: str, cause: GatewayError) -> None:
        super().__init__(
            f"{changed}, then the change was broken off: {_why(cause)}", "Read, and change the rest."
        )


def _what_came_first(cause: GatewayError) -> str:
    if isinstance(cause, StoppedFirst):
        return "a stop came"
    if isinstance(cause, OVERTAKEN):
        return cause.title[0].lower() + cause.title[1:]
    return cause.detail.rstrip(".")


def _why(cause: GatewayError) -> str:
    """Why the rest was not done; that nothing was sent is true of the rest alone."""
    return f"{cause.title[0].lower()}{cause.title[1:]}." if isinstance(cause, NotSent) else cause.detail
