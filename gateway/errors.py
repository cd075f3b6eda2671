"""What can go wrong between a request and a controller, said in one sentence each."""

from typing import Any, ClassVar, Literal

from protocols.fics.row import FicsCommand
from protocols.rorze.errors import lookup
from protocols.rorze.row import RorzeCommand
from protocols.table import Retry

Moved = Literal["no", "yes", "unknown"]


class GatewayError(Exception):
    """A request was not carried out, or its outcome is not known.

    `kind` is the stable name of the error, `moved` says whether the motor did anything because of the
    request, `remedy` what to do next, `retryable` whether the same request may succeed later by itself.
    """

    kind: ClassVar[str] = "gateway-error"
    title: ClassVar[str] = "The request was not carried out"
    moved: Moved = "no"
    retryable: bool = False

    def __init__(self, detail: str, remedy: str = "") -> None:
        super().__init__(detail)
        self.detail = detail
        self.remedy = remedy


class NotFound(GatewayError):
    """There is no such line, body, group, move, scan or command."""

    kind = "not-found"
    title = "No such thing"


class Ambiguous(GatewayError):
    """A short address fits bodies, or groups, on several lines."""

    kind = "ambiguous-address"
    title = "Several lines have this address"


class InvalidRequest(GatewayError):
    """The request can never be carried out as it stands."""

    kind = "invalid-request"
    title = "The request is not valid"


class NotAllowed(GatewayError):
    """The configuration forbids it."""

    kind = "not-allowed"
    title = "Switched off in the configuration"


class BodyBusy(GatewayError):
    """The body, or the line, is doing something that excludes the request."""

    kind = "body-busy"
    title = "The body is busy"
    retryable = True


class NotSent(GatewayError):
    """Nothing was written to the line for this request, and nothing will be."""

    kind = "not-sent"
    title = "Nothing was sent"
    retryable = True


class LineDown(NotSent):
    """The line's port is not open."""

    kind = "line-down"
    title = "The line is down"


class BodyOffline(NotSent):
    """The body has stopped answering; it is probed in the background."""

    kind = "body-offline"
    title = "The body does not answer"


class QueueFull(NotSent):
    """Too many requests wait for this body."""

    kind = "queue-full"
    title = "Too many requests are waiting"


class Expired(NotSent):
    """The request could not be started in the time it allowed."""

    kind = "expired"
    title = "It was too late to start"

    def __init__(self, waited_for: str = "line") -> None:
        super().__init__(f"The {waited_for} was not free in time; nothing was sent.", "Try again.")


class Cancelled(NotSent):
    """A stop, or the end of the gateway, removed the request from the queue."""

    kind = "cancelled"
    title = "Cancelled before it was sent"
    retryable = False  # what somebody has just stopped must not be started again by itself


class StoppedFirst(Cancelled):
    """A stop came between a request and the moment it could be sent."""

    def __init__(self) -> None:
        super().__init__(
            "A stop came first; nothing was sent.", "Send the command again if it is still wanted."
        )


class HeldUp(NotSent):
    """The gateway was suspended, or held up for seconds, between a request and its turn to be sent."""

    kind = "held-up"
    title = "The gateway was held up"

    def __init__(self) -> None:
        super().__init__(
            "The gateway was suspended or held up for seconds, so the request may be older than its sender "
            "expects; nothing was sent.",
            "Send it again if it is still wanted.",
        )


class ShuttingDown(NotSent):
    """The gateway has been told to end: it lets nothing begin any more."""

    kind = "shutting-down"
    title = "The gateway is shutting down"

    def __init__(self) -> None:
        super().__init__(
            "The gateway is shutting down; nothing was sent.", "Send it again when the gateway is back."
        )


Overtaking = type[StoppedFirst] | type[HeldUp] | type[ShuttingDown]
"""What can come between the admission of a command and the moment it could be sent."""
OVERTAKEN = StoppedFirst, HeldUp, ShuttingDown


class PowerCycled(NotSent):
    """A controller has been switched off and on: what it knew of places is gone, and somebody has to know."""

    kind = "power-cycled"
    title = "The controller has lost its power"
    retryable = False


class NoReply(GatewayError):
    """The command was written, and no reply could be credited to it.

    Reads and settings move nothing, whether they were executed or not; of every other `command`, and of one
    that is not told, nobody knows.
    """

    kind = "no-reply"
    title = "No reply"
    moved: Moved = "unknown"

    def __init__(
        self, detail: str, remedy: str = "", command: RorzeCommand[Any] | FicsCommand[Any] | None = None
    ) -> None:
        super().__init__(detail, remedy)
        if command is not None and command.retry in (Retry.READ, Retry.SETTING):
            self.moved = "no"
            self.retryable = command.may_repeat()


class GarbledReply(NoReply):
    """The command was written, and what came back could not be its reply."""

    kind = "garbled-reply"
    title = "The reply was garbled"


class NotExecuted(GatewayError):
    """The command was written, but the controller's own state proves that it was not executed."""

    kind = "not-executed"
    title = "The command was lost on its way"


class MoveFailed(GatewayError):
    """A move was begun and did not end as it should."""

    kind = "move-failed"
    title = "The move failed"
    moved = "yes"


class ControllerRefused(GatewayError):
    """The controller has answered with an error: the command was not executed."""

    kind = "controller-refused"
    title = "The controller refused"

    def __init__(self, address: str, code: str, error: int | None) -> None:
        self.address = address
        self.error = error
        self.command_code = code
        row = lookup(error)
        super().__init__(f"{address} refused {code}: {row.en} Nothing moved because of it.", row.remedy_en)


class CommandGarbled(ControllerRefused):
    """A refusal of something else than what was sent: the line has damaged the command."""

    kind = "command-garbled"
    title = "The command was garbled on its way"
    retryable = True

    def __init__(self, address: str, code: str, error: int | None) -> None:
        super().__init__(address, code, error)
        self._tell(lookup(error).en)

    def _tell(self, refusal: str) -> None:
        """Say that it was refused in a way that it cannot be, as it was sent."""
        GatewayError.__init__(
            self,
            f"{self.command_code} was sent as the manual has it, and {self.address} refused what arrived: "
            f"{refusal} The line has damaged it, or the controller is not the one that is configured. "
            "Nothing moved because of it.",
            "Send it again if it is still wanted; if that does not help, check the line and the "
            "configuration.",
        )


def refused(address: str, command: RorzeCommand[Any], error: int | None) -> ControllerRefused:
    """The error of a command that a controller has refused."""
    kind = CommandGarbled if command.rules_out(error) else ControllerRefused
    return kind(address, command.code, error)
