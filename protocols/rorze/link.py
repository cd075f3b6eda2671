"""The line protocol of the RC-400: bytes to frames and back, whatever splits and noise (RC-420 manual 12)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Any, ClassVar, Final, Literal, NamedTuple

from protocols.lines import CR as CR
from protocols.lines import Garbage as Garbage
from protocols.lines import Lines
from protocols.rorze.row import (
    EVENT,
    FIRST_GROUP,
    LAST_BODY,
    LAST_GROUP,
    LINK_MASTER,
    MAX_COMMAND_LENGTH,
    MOVE_ENDED,
    RorzeCommand,
)

LINES_KEPT = 512
"""Decoded lines that are kept, in either direction: who polls hears the same again and again."""
INTRODUCERS = "&$#"
"""`&` is followed by two digits of body number, `$` and `#` (RC-200 series) by one."""

MAX_REPLY_LENGTH = 2048
"""Bytes of a reply; the longest there is, a group's status of 17 members, stays well below."""

NO_REPLY = "something that is no reply"

POISON = b"!" * (MAX_COMMAND_LENGTH + 1) + CR
"""Ends a half command that the far end may hold: together they are too long, so nothing is executed (23h)."""
HalfCommandEnd = Literal["overlong", "line_ends"]
HALF_COMMAND_ENDS: Final[Mapping[HalfCommandEnd, bytes]] = MappingProxyType(
    {"overlong": POISON, "line_ends": POISON + b"\r\n"}
)
"""Ends of a half command; one with another CR, or an LF, behind its CR counts as not sent (17.1)."""


@dataclass(frozen=True, slots=True)
class Answer:
    """A body, or the link master at 7F, has done or accepted a command."""

    body: int
    code: str
    payload: str


@dataclass(frozen=True, slots=True)
class Refusal:
    """A command was not executed; the error code may be missing."""

    told_as: ClassVar[str] = "refusal"
    """Word for it in the audit."""

    body: int
    code: str
    error: int | None


@dataclass(frozen=True, slots=True)
class GroupAnswer:
    """The answers of a virtual body's members, each on its own."""

    body: int
    code: str
    members: Mapping[int, Answer | Refusal] = field(hash=False)


@dataclass(frozen=True, slots=True)
class MoveEnded:
    """The end of a move (address 7D); the value is the 9MD byte, 0 after a normal end."""

    body: int
    code: str
    cause: int


@dataclass(frozen=True, slots=True)
class StatusChanged:
    """A body reports a change of state (address 7E), with the fields of its ESS setting in the order sent."""

    body: int
    fields: Mapping[str, int]


@dataclass(frozen=True, slots=True)
class UnknownMessage:
    """A frame from a special address without a question and of an unknown kind; never dropped."""

    address: int
    text: str


_PROGRAM_TEXT = re.compile(r">&7CUSD\[([0-6][0-9A-F]|7[0-7]):([ -~]*)\]")
"""An assumption: no manual gives the frame in which a user program's text (SDC, SDD) reaches the host."""


class ToldText(NamedTuple):
    """Text that a body's user program sends."""

    body: int
    text: str


def program_text(message: UnknownMessage) -> ToldText | None:
    """Read the text of a user program; None where the message is none."""
    match = _PROGRAM_TEXT.fullmatch(message.text)
    return None if match is None else ToldText(int(match[1], 16), match[2])


Message = MoveEnded | StatusChanged | UnknownMessage
"""A frame that comes without a question."""
Frame = Answer | Refusal | GroupAnswer | Message | Garbage

_STARTS = tuple(f">{introducer}".encode() for introducer in INTRODUCERS)
_PREFIX = r"(?:&(?P<two>[0-9A-F]{2})|[$#](?P<one>[0-9A-F]))"
_REPLY = re.compile(_PREFIX + r"(?P<code>[!-~]{3})(?P<payload>[ -~]*)")
_REQUEST = re.compile(_PREFIX + r"(?P<text>[ -~]*)")
_UNSENDABLE = re.compile(r"[^ -~]|&")
_BLANKS = b"\t \n"
_MEMBER = re.compile(r"\[([0-7][0-9A-F]):((?:[^\[\]]|\[[^\[\]]*\])*)\]")
_MEMBERS = re.compile(rf"(?:{_MEMBER.pattern})+")
_ERROR = re.compile(r"@([0-9A-F]{2})?")
_FIELD = re.compile(r"([CMSIO]):H([0-9A-F]{1,4})|(P):([+-]\d{9})")


def encode(body: int, command: RorzeCommand[Any], introducer: str = "&") -> bytes:
    """Build the frame of a command.

    Errors are those of `frame`.
    """
    return frame(body, command.frame_text, introducer)


@lru_cache(LINES_KEPT)
def frame(body: int, text: str, introducer: str = "&") -> bytes:
    """Build a frame from a code and its parameters.

    :raises ValueError: the address does not exist, or the frame is over 60 characters or not plain text.
    """
    if not (body <= LAST_BODY or FIRST_GROUP <= body <= LAST_GROUP or body == LINK_MASTER):
        raise ValueError(
            f"{body:02X} is no address a command can go to: bodies are 00-77, groups 80-9E, the link 7F"
        )
    digits = f"{body:02X}" if introducer == "&" else f"{body:X}"
    if len(digits) > 2 or (introducer != "&" and len(digits) > 1):
        raise ValueError(f"body {body:02X} cannot be addressed after {introducer}")
    if len(digits) + len(text) > MAX_COMMAND_LENGTH:
        raise ValueError(
            f"the command has {len(digits) + len(text)} characters, {MAX_COMMAND_LENGTH} are allowed"
        )
    if _UNSENDABLE.search(text):
        raise ValueError(f"the command {text!r} has a character that cannot be sent")
    return f"{introducer}{digits}{text}".encode("ascii") + CR


class LinkReader:
    """Cuts the bytes of an RC-400 into frames; how they were split on the way makes no difference."""

    def __init__(self) -> None:
        self._lines = Lines(MAX_REPLY_LENGTH)

    def feed(self, data: bytes) -> list[Frame]:
        """Take bytes, give the frames that are complete now."""
        frames: list[Frame] = []
        for line in self._lines.feed(data):
            frames += _split(line)
        return frames

    def pending(self) -> int:
        """Bytes of a frame that has begun and not ended."""
        return self._lines.pending()


@dataclass(frozen=True, slots=True)
class Request:
    """A command as it reaches the RC-400: blanks removed, neither code nor parameters checked yet."""

    introducer: str
    body: int
    text: str

    def too_long(self) -> bool:
        """Say whether the command has more than 60 characters and must be refused with 23h."""
        return len(self.text) + (2 if self.introducer == "&" else 1) > MAX_COMMAND_LENGTH


class RequestReader:
    """Cuts the bytes of a host into requests: the RC-400's side of the line."""

    def __init__(self) -> None:
        self._lines = Lines(4 * MAX_COMMAND_LENGTH)

    def feed(self, data: bytes) -> list[Request | Garbage]:
        """Take bytes, give the requests that are complete now; stray CR and LF are nothing."""
        lines = (line.strip(b"\t \n") for line in self._lines.feed(data))
        return [_request(line) for line in lines if line]


@lru_cache(LINES_KEPT)
def _request(line: bytes) -> Request | Garbage:
    match = _REQUEST.fullmatch(_without_blanks(line).decode("ascii", "replace"))
    if match is None:
        return Garbage(line, "not a command")
    return Request(match[0][0], int(match["two"] or match["one"], 16), match["text"])


def _without_blanks(line: bytes) -> bytes:
    """Tabs and spaces in a command are ignored, but the manual prints comments (9VS) that keep theirs."""
    head, comma, comment = line.partition(b",")
    head = head.translate(None, _BLANKS)
    keeps = head[3:6] == b"9VS" or head[2:5] == b"9VS"
    return head + comma + (comment if keeps else comment.translate(None, _BLANKS))


@lru_cache(LINES_KEPT)
def _split(text: bytes) -> tuple[Frame, ...]:
    """Resynchronise: what stands before the last start of a reply is noise, or a reply that lost its end."""
    if len(text) > MAX_REPLY_LENGTH:
        return (Garbage(text, "a line too long for a reply"),)
    start = max(map(text.rfind, _STARTS))
    noise = (text[:start] if start >= 0 else text).strip(b"\n\x00")
    frames = _parse(text[start + 1 :]) if start >= 0 else []
    if noise:
        why = "an echo of our own command" if noise[:1] in (b"&", b"$", b"#") else NO_REPLY
        frames.insert(0, Garbage(noise, why))
    return tuple(frames)


def _parse(raw: bytes) -> list[Frame]:
    match = _REPLY.fullmatch(raw.decode("ascii", "replace"))
    if match is None:
        return [Garbage(b">" + raw, NO_REPLY)]
    two, one, code, payload = match.groups()
    address = int(two or one, 16)
    if address <= LAST_BODY or address == LINK_MASTER:
        return [_answer(address, code, payload) or Garbage(b">" + raw, "a malformed error code")]
    if FIRST_GROUP <= address <= LAST_GROUP:
        return [_group(address, code, payload) or Garbage(b">" + raw, "a malformed group reply")]
    known = _unsolicited(address, code, payload)
    return known or [UnknownMessage(address, f">{raw.decode('ascii')}")]


def _answer(body: int, code: str, payload: str) -> Answer | Refusal | None:
    if not payload.startswith("@"):
        return Answer(body, code, payload)
    error = _ERROR.fullmatch(payload)
    return Refusal(body, code, int(error[1], 16) if error[1] else None) if error else None


def _group(body: int, code: str, payload: str) -> GroupAnswer | Refusal | None:
    if _ERROR.fullmatch(payload):
        refusal = _answer(body, code, payload)
        return refusal if isinstance(refusal, Refusal) else None
    members = {member: _answer(member, code, text) for member, text in _members(payload.removeprefix("@"))}
    complete = {member: answer for member, answer in members.items() if answer is not None}
    if not members or len(complete) < len(members):
        return None
    return GroupAnswer(body, code, MappingProxyType(complete))


def _members(payload: str) -> list[tuple[int, str]]:
    """The bracketed members; none at all if anything else stands there, or one stands twice."""
    if _MEMBERS.fullmatch(payload) is None:
        return []
    members = [(int(body, 16), text) for body, text in _MEMBER.findall(payload)]
    return members if len(dict(members)) == len(members) else []


def _unsolicited(address: int, code: str, payload: str) -> list[Frame]:
    members = _members(payload)
    if address == MOVE_ENDED and all(re.fullmatch("[0-9A-F]{2}", text) for _, text in members):
        return [MoveEnded(body, code, int(text, 16)) for body, text in members]
    if address == EVENT and code == "XED":
        changes = [_status(body, text) for body, text in members]
        return [change for change in changes if change] if all(changes) else []
    return []


def _status(body: int, text: str) -> StatusChanged | None:
    fields: dict[str, int] = {}
    for item in text.split(",") if text else ():
        match = _FIELD.fullmatch(item)
        if match is None:
            return None
        fields[match[1] or match[3]] = int(match[2], 16) if match[1] else int(match[4])
    return StatusChanged(body, MappingProxyType(fields))
