"""The line protocol of C-HOST: bytes to frames and back, in both modes (C-HOST manual 1-1-1, 1-2, 2)."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any, ClassVar, Final, Literal

from protocols.fics.commands import ROWS
from protocols.fics.row import NAME_LENGTH, FicsCommand, WhenAnswered
from protocols.lines import CR, Lines
from protocols.lines import Garbage as Garbage
from protocols.table import Reply, WireFault

Terminator = Literal["cr", "crlf"]
TERMINATORS: Final[Mapping[Terminator, bytes]] = MappingProxyType({"cr": CR, "crlf": CR + b"\n"})
"""Line ends. The manual's figure is lost: CR is an assumption, and a reader takes either."""

LONGEST_LINE = 512
"""Bytes of a line, in either direction; the dual-port RAM holds half of it (C-HOST manual 1-4)."""

FRAMES_KEPT = 1024
"""Frames that are kept: who polls says the same again and again."""


@dataclass(frozen=True, slots=True)
class QueryAnswer:
    """A name and data: what a query is answered with."""

    name: str
    payload: str


@dataclass(frozen=True, slots=True)
class Completion:
    """A bare name: Ver.3 has done what the command says, or the last of several answers was sent."""

    name: str


@dataclass(frozen=True, slots=True)
class FicsRefusal:
    """A command was not carried out (Ver.3); the error is `E` and two digits."""

    told_as: ClassVar[str] = "refusal"
    """Word for it in the audit."""

    name: str
    error: str


@dataclass(frozen=True, slots=True)
class SystemFailure:
    """A command ended with an error of the system (Ver.3), three digits."""

    told_as: ClassVar[str] = "failure"
    """Word for it in the audit."""

    name: str
    error: str


Frame = QueryAnswer | Completion | FicsRefusal | SystemFailure | Garbage

TAKES_ERRORS = "ERR"
"""The query whose answer looks like a refusal or a failure."""

_REPLIES: Final = {row.answered_as or row.code: row.reply_type() for row in ROWS if row.is_query()}
_NAME = rf"[A-Z0-9]{{{NAME_LENGTH}}}"
_REPLY = re.compile(rf"({_NAME})(?: ([ -~]*))?")
_REQUEST = re.compile(rf"({_NAME})([ -~]*)")
_REFUSED = re.compile(r"E[0-9][0-9]")
_FAILED = re.compile(r"[0-9]{3}")
_BLANKS = b" \t"
_PADDING = b"\n\x00"


def encode(command: FicsCommand[Any], terminator: Terminator = "cr") -> bytes:
    """Build the frame of a command.

    :raises ValueError: it is too long.
    """
    return frame(command.text, terminator)


@lru_cache(FRAMES_KEPT)
def frame(text: str, terminator: Terminator = "cr") -> bytes:
    """Build a frame from a name and its arguments.

    :raises ValueError: it would not stay one frame, has no name, or is too long.
    """
    if _REQUEST.fullmatch(text) is None:
        raise ValueError(f"{text!r} is no command: three capitals or digits, then plain text")
    if len(text) > LONGEST_LINE:
        raise ValueError(f"the command has {len(text)} characters, {LONGEST_LINE} are allowed")
    return text.encode("ascii") + TERMINATORS[terminator]


class _Reader:
    """Cuts the bytes of a Fics into frames; how they were split on the way makes no difference."""

    def __init__(self, classify: Callable[[str, str | None], Frame]) -> None:
        self._lines = Lines(LONGEST_LINE)
        self._classify = classify

    def feed(self, data: bytes) -> list[Frame]:
        """Take bytes, give the frames that are complete now."""
        classify = self._classify
        return [_frame(line, classify) for text in self._lines.feed(data) if (line := text.strip(_PADDING))]

    def pending(self) -> int:
        """Bytes of a line that has begun and not ended."""
        return self._lines.pending()


class Ver2Reader(_Reader):
    """Reads Ver.2 mode, where only queries are answered, and errors have to be asked for."""

    def __init__(self) -> None:
        super().__init__(_in_ver_2)


class Ver3Reader(_Reader):
    """Reads Ver.3 mode, where completions, refusals and failures come between the answers."""

    def __init__(self) -> None:
        super().__init__(_in_ver_3)


@lru_cache(FRAMES_KEPT)
def _frame(line: bytes, classify: Callable[[str, str | None], Frame]) -> Frame:
    """Classify a line; the payload is None after a bare name."""
    if len(line) > LONGEST_LINE:
        return Garbage(line, "a line too long for an answer")
    match = _REPLY.fullmatch(line.decode("ascii", "replace"))
    return classify(match[1], match[2]) if match else Garbage(line, "something that is no answer")


def _in_ver_2(name: str, payload: str | None) -> Frame:
    return Completion(name) if payload is None else QueryAnswer(name, payload)


def _in_ver_3(name: str, payload: str | None) -> Frame:
    if payload is None:
        return Completion(name)
    if name != TAKES_ERRORS and _REFUSED.fullmatch(payload):
        return FicsRefusal(name, payload)
    # Of a unit with one axis, `VST 100` is a time if it was asked for: see `credit`.
    if _FAILED.fullmatch(payload) and not _can_answer(name, payload):
        return SystemFailure(name, payload)
    return QueryAnswer(name, payload)


def line_of(found: QueryAnswer | Completion | FicsRefusal | SystemFailure) -> bytes:
    """Write a frame as it came, without its end."""
    if isinstance(found, Completion):
        return found.name.encode("ascii")
    data = found.payload if isinstance(found, QueryAnswer) else found.error
    return f"{found.name} {data}".encode("ascii")


def _can_answer(name: str, payload: str) -> bool:
    """Say whether the query of that name can have this payload as its answer."""
    reply = _REPLIES.get(name)
    if reply is None:
        return False
    try:
        reply.read(payload)
    except WireFault:
        return False
    return True


def credit(
    command: FicsCommand[Any], found: Frame
) -> Reply | Completion | FicsRefusal | SystemFailure | None:
    """Give the meaning of a frame for a command that is outstanding; None if it is not for this command.

    A query gets a reply; one with several gets a completion after the last. Any other command gets a
    completion. Both may get a refusal or a failure instead.
    """
    if isinstance(found, Garbage):
        return None
    if isinstance(found, Completion):
        ends = command.ends_with if command.answered is WhenAnswered.ALWAYS else _name(command)
        return found if found.name == ends else None
    if isinstance(found, QueryAnswer):
        return _credit_answer(command, found)
    return found if found.name == _name(command) else None


def _credit_answer(command: FicsCommand[Any], found: QueryAnswer) -> Reply | SystemFailure | None:
    if found.name != (command.answered_as or _name(command)):
        return None
    if command.answered is not WhenAnswered.ALWAYS:
        return SystemFailure(found.name, found.payload) if _FAILED.fullmatch(found.payload) else None
    try:
        reply: Reply = command.read_reply(found.payload)
    except WireFault:
        return None
    return reply


def _name(command: FicsCommand[Any]) -> str:
    return command.code or command.wire_name()


@dataclass(frozen=True, slots=True)
class FicsRequest:
    """A command as it reaches a Fics: blanks removed, neither name nor arguments checked yet."""

    name: str
    arguments: str


class FicsRequestReader:
    """Cuts the bytes of a host into requests: the Fics' side of the line."""

    def __init__(self) -> None:
        self._lines = Lines(LONGEST_LINE)

    def feed(self, data: bytes) -> list[FicsRequest | Garbage]:
        """Take bytes, give the requests that are complete now; empty lines are nothing."""
        lines = (line.strip(_PADDING + _BLANKS) for line in self._lines.feed(data))
        return [_request(line) for line in lines if line]


def _request(line: bytes) -> FicsRequest | Garbage:
    if len(line) > LONGEST_LINE:
        return Garbage(line, "a line too long for a command")
    match = _REQUEST.fullmatch(line.translate(None, _BLANKS).decode("ascii", "replace"))
    return FicsRequest(match[1], match[2]) if match else Garbage(line, "not a command")
