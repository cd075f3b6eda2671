"""Errors between a request and a controller, each told in one sentence."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, NamedTuple, Protocol, Self

from typing_extensions import TypeAliasType

from gateway import texts
from gateway.core.next_calls import NextCall, filled_in
from gateway.texts import Text, has, text
from protocols.table import Command, Effect

Moved = TypeAliasType("Moved", Literal["no", "yes", "unknown"])


class GatewayError(Exception):
    """A request was not carried out, or its outcome is not known.

    `kind` is the stable name of the error, `moved` says whether the motor did anything because of the
    request, `remedy` what to do next, `next` the calls that do it, `retryable` whether the same request may
    succeed later without a change.
    """

    kind: ClassVar[str] = "gateway-error"
    title: ClassVar[str]
    title_ja: ClassVar[str]
    moved: Moved = "no"
    retryable: bool = False
    usual_remedy: ClassVar[str] = "Read the state there is now, and decide anew."
    """Next step for the caller, if an error names no better one."""
    detail_ja: str = ""
    """Empty where it is told in English only."""
    remedy_ja: str = ""
    reserved: tuple[str, str] | None = None
    """Detail and remedy for callers who see a part of the plant: without the names of the rest."""

    def __init_subclass__(cls, titled: str = "") -> None:
        """Take the title of its kind from the catalogue, or another one of `problems`."""
        cls.title, cls.title_ja = text(f"problems.{titled or cls.kind}.title")

    def __init__(self, detail: str, remedy: str = "", next_calls: Sequence[NextCall] = ()) -> None:
        super().__init__(detail)
        self.detail = detail
        self.remedy = remedy or self.usual_remedy
        self.next = tuple(next_calls)

    @classmethod
    def worded(cls, key: str, next_calls: Sequence[NextCall] = (), /, **facts: object) -> Self:
        """Make one in the words of the catalogue: `errors.KEY`."""
        detail, remedy = words_of_error(key, facts)
        return cls(detail.en, remedy.en, next_calls).in_japanese(detail.ja, remedy.ja)

    def reword(self, key: str, /, **facts: object) -> None:
        """Say it in other words of the catalogue."""
        detail, remedy = words_of_error(key, facts)
        self.detail, self.remedy = detail.en, remedy.en
        self.in_japanese(detail.ja, remedy.ja)

    def in_japanese(self, detail: str, remedy: str = "") -> Self:
        """Say it in Japanese, too."""
        self.detail_ja, self.remedy_ja = detail, remedy
        return self

    def reservedly(self, detail: str, remedy: str) -> Self:
        """Say it without names of parts that were not asked for, too."""
        self.reserved = detail, remedy
        return self

    def withhold_names(self) -> None:
        """Name nothing to the caller but what was asked for."""
        if self.reserved is not None:
            self.detail, self.remedy = self.reserved


GatewayError.title, GatewayError.title_ja = text(f"problems.{GatewayError.kind}.title")


def words_of_error(key: str, facts: Mapping[str, object]) -> tuple[Text, Text]:
    """Find detail and remedy at `errors.KEY` of the catalogue; an empty remedy is the usual one."""
    remedy = f"errors.{key}.remedy"
    return text(f"errors.{key}.detail", **facts), text(remedy, **facts) if has(remedy) else Text("", "")


class NotFound(GatewayError):
    """The line, body, group, move, scan or command does not exist."""

    kind = "not-found"
    usual_remedy = "Ask for something that there is; the collections list it."


class Ambiguous(GatewayError):
    """A short address fits bodies, or groups, on several lines."""

    kind = "ambiguous-address"


class InvalidRequest(GatewayError):
    """The request can never be carried out as it stands."""

    kind = "invalid-request"
    usual_remedy = "Correct the request; /docs tells what can be asked."


class Outdated(GatewayError):
    """The document is no longer as the sender of the change has read it."""

    kind = "precondition-failed"

    def __init__(self) -> None:
        super().__init__(
            "It is no longer what If-Match names; nothing was changed.", "Read it again, and decide anew."
        )


class Misplaced(NamedTuple):
    """A fault in a text, and its place: line and column count from 1."""

    line: int
    column: int
    reason: str


class InvalidText(InvalidRequest):
    """A text of many lines that can never be used as it stands."""

    kind = "invalid-text"
    faults: Sequence[Misplaced] = ()

    def __init__(self, field: str, detail: str, remedy: str, faults: Sequence[Misplaced]) -> None:
        super().__init__(detail, remedy)
        self.field, self.faults = field, faults


class NotAllowed(GatewayError):
    """The configuration forbids it."""

    kind = "not-allowed"


class BodyBusy(GatewayError):
    """The body, or the line, is doing something that excludes the request."""

    kind = "body-busy"
    retryable = True


class NotSent(GatewayError):
    """Nothing was written to the line for this request, and nothing will be."""

    kind = "not-sent"
    retryable = True


class PortNotOpen(NotSent):
    """The line's port is not open."""

    kind = "line-down"


class BodyOffline(NotSent):
    """The body has stopped answering; it is probed in the background."""

    kind = "body-offline"


class QueueFull(NotSent):
    """Too many requests wait for this body."""

    kind = "queue-full"


class Expired(NotSent):
    """The request could not be started in the time it allowed."""

    kind = "expired"

    def __init__(self, waited_for: str = "line") -> None:
        super().__init__(f"The {waited_for} was not free in time; nothing was sent.", "Try again.")


class Cancelled(NotSent):
    """A stop, or the end of the gateway, removed the request from the queue."""

    kind = "cancelled"
    retryable = False  # what somebody has just stopped must not be started again by a program


class StoppedFirst(Cancelled):
    """A stop came between a request and the moment it could be sent."""

    def __init__(self) -> None:
        super().__init__(
            "A stop came first; nothing was sent.", "Send the command again if it is still wanted."
        )


class HeldUp(NotSent):
    """The gateway was suspended, or held up for seconds, between a request and its turn to be sent."""

    kind = "held-up"

    def __init__(self) -> None:
        super().__init__(
            "The gateway was suspended or held up for seconds, so the request may be older than its sender "
            "expects; nothing was sent.",
            "Send it again if it is still wanted.",
        )


class GatewayEnding(NotSent):
    """The gateway has been told to end: it lets nothing begin any more."""

    kind = "shutting-down"

    def __init__(self) -> None:
        super().__init__(
            "The gateway is shutting down; nothing was sent.", "Send it again when the gateway is back."
        )


Overtaking = type[StoppedFirst] | type[HeldUp] | type[GatewayEnding]
"""Reasons to revoke a command between its admission and its write."""
OVERTAKEN = StoppedFirst, HeldUp, GatewayEnding


class PowerCycled(NotSent):
    """A controller was switched off and on: its positions may be wrong, and a person has to confirm that."""

    kind = "power-cycled"
    retryable = False


class NoReply(GatewayError):
    """The command was written, and no reply could be credited to it.

    Only motion could have moved something; if no `command` is named, that is unknown.
    """

    kind = "no-reply"
    moved: Moved = "unknown"

    def __init__(self, detail: str, remedy: str = "", command: Command[Any] | None = None) -> None:
        super().__init__(detail, remedy)
        if command is not None and command.effect not in (Effect.MOTION, Effect.STOP):
            self.moved = "no"
            self.retryable = command.may_repeat


class GarbledReply(NoReply):
    """The command was written, and what came back could not be its reply."""

    kind = "garbled-reply"


class NotExecuted(GatewayError):
    """The command was written, but the controller's own state proves that it was not executed."""

    kind = "not-executed"


class MoveFailed(GatewayError):
    """A move was begun and did not end as it should."""

    kind = "move-failed"
    moved: Moved = "yes"


class Unproved(GatewayError, titled="move-end-unknown"):
    """A move whose end nothing proves, nor that it was begun."""

    kind = MoveFailed.kind
    moved = "unknown"


def refused_in_motion(address: str, command_code: str) -> NoReply:
    """The error where a motion is refused as in motion that was sent at standstill."""
    return NoReply(
        f"{address} refused {command_code} as in motion, although it had stood still just before: a first "
        "copy of the command may have set it going, or something else has; nothing was sent again.",
        "See what else can move it, and read its status and position before anything else.",
    )


def restarted_in_motion(address: str) -> NoReply:
    """The error where nothing proves what became of a command of the gateway's last life."""
    return NoReply(
        f"The gateway has ended while a command to {address} was under way, and nothing proves what has "
        "become of it; nothing was sent again.",
        "Read its status and position before anything else.",
    )


class MoveOver(GatewayError):
    """A move was to be changed on its way, and has ended."""

    kind = "move-over"


class ErrorText(Protocol):
    """One error of a controller, its meaning and its remedy, in both languages."""

    @property
    def en(self) -> str:
        """The meaning, in English."""

    @property
    def ja(self) -> str:
        """The meaning, in Japanese."""

    @property
    def remedy_en(self) -> str:
        """The remedy, in English."""

    @property
    def remedy_ja(self) -> str:
        """The remedy, in Japanese."""


class ControllerError(GatewayError, titled="controller-error"):
    """An error that a controller has told by a code of its own, so it is worded in both languages."""

    def __init__(self, detail: str, command_code: str, error_code: str | None, text: ErrorText) -> None:
        super().__init__(detail, text.remedy_en)
        self.command_code = command_code
        self.error_code = error_code
        """The code in its manual's notation, such as 0x51 or E05; None where the controller told none."""
        self.detail_ja = f"{command_code}: {text.ja}"
        self.remedy_ja = text.remedy_ja


class ControllerRefused(ControllerError):
    """The controller has answered with an error: the command was not executed.

    `lasting` says that the same request meets it again until it, or a setting, is changed.
    """

    kind = "controller-refused"

    def __init__(
        self, address: str, command_code: str, error_code: str | None, text: ErrorText, *, lasting: bool
    ) -> None:
        super().__init__(self._told(address, command_code, text), command_code, error_code, text)
        self.address = address
        self.lasting = lasting
        self.detail_ja = texts.text("refusals.by-controller", address=address, said=self.detail_ja).ja

    def _told(self, address: str, command_code: str, text: ErrorText) -> str:
        return texts.text("refusals.by-controller", address=address, said=f"{command_code}: {text.en}").en


class CommandGarbled(ControllerRefused):
    """A refusal of something else than what was sent: the line has damaged the command."""

    kind = "command-garbled"
    retryable = True

    def __init__(self, address: str, command_code: str, error_code: str | None, text: ErrorText) -> None:
        super().__init__(address, command_code, error_code, text, lasting=False)
        self.remedy, self.remedy_ja = texts.text("refusals.garbled-remedy")

    def _told(self, address: str, command_code: str, text: ErrorText) -> str:
        return (
            f"{command_code} was sent as the manual has it, and {address} refused what arrived: "
            f"{text.en} The line has damaged it, or the controller is not the one that is configured. "
            "Nothing moved because of it."
        )


def calls_for(
    error: GatewayError, table: Mapping[str, Sequence[NextCall]], **names: object
) -> Sequence[NextCall]:
    """The calls that help: those the error names itself, else those of a table by its code or its kind."""
    if error.next:
        return error.next
    code = error.error_code if isinstance(error, ControllerError) else None
    kinds = [kind.kind for kind in type(error).__mro__ if issubclass(kind, GatewayError)]
    found = next((table[key] for key in (code or "", *kinds) if key in table), ())
    return filled_in(found, names)
