"""Outcomes of a command, and of its reply, when one bit of it is flipped on the way."""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

from gateway.core.exchange import Exchange, Lane, More
from gateway.fics.session import FicsSession
from gateway.rorze.session import ReplyFrame, RorzeSession
from protocols.fics import link as fics
from protocols.fics.commands import ROWS
from protocols.fics.commands import read as read_fics
from protocols.fics.row import NAME_LENGTH, FicsCommand
from protocols.rorze import link as rorze
from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import FIRST_GROUP, LAST_GROUP, LINK_MASTER, LinkMasterCommand, RorzeCommand
from protocols.table import Command, Effect, WireFault

CR = b"\r"
HEAD_LENGTH = len(">&3F6PD")
MEMBERS = b"[01:][02:]"
"""Members, which the manual leaves out of a group's printed answers."""
_NUMBER = re.compile(r"[+-]?\d+(?:\.\d*)?")


class Sent(StrEnum):
    """The far end's reading of a command with a flipped bit; the later, the worse."""

    SAME = "the same"
    """The flipped bit means nothing."""
    NOTHING = "nothing"
    """The far end hears no command, or one that it refuses or does not end."""
    OTHER_TARGET = "another body"
    """Another body has a command. The one that was meant is silent: nothing is credited."""
    OTHER_COMMAND = "another command"
    """Another command is done, and its reply bears another name: nothing is credited."""
    SEEN = "another value, seen"
    """A command with other parameters, as its reply shows: the reply is not credited."""
    OTHER_VALUE = "another value"
    """A command with other parameters, whose reply is that of the command that was meant."""


class Heard(StrEnum):
    """The gateway's reading of a reply with a flipped bit."""

    NOTHING = "nothing"
    """Not credited: a fence follows, and the outcome is found out or unknown."""
    REFUSAL = "a refusal"
    """Read as a refusal of the command."""
    OTHER_VALUE = "another value"
    """Read as another reply that the command could have had."""


class Outcome(NamedTuple):
    """The outcome of one flip."""

    flipped: bytes
    kind: Sent | Heard
    moves: bool = False
    """A motion that was not meant may begin."""


class Done(NamedTuple):
    """An action of the far end, with its answer."""

    kind: Sent
    command: Command[Any]
    answer: bytes


@dataclass
class Row(ABC):
    """A command of a family with an example of it, and of its reply, as they stand on the wire."""

    code: str
    name: str
    command: bytes
    reply: bytes

    def sent(self) -> Iterator[Outcome]:
        """Flip each bit of the command."""
        return map(self.arrives, flips(self.command + CR))

    def heard(self) -> Iterator[Outcome]:
        """Flip each bit of the reply."""
        return (Outcome(reply, self.comes_back(reply)) for reply in flips(self.reply + CR))

    @abstractmethod
    def _requests(self, stream: bytes) -> Iterator[Done]:
        """Commands that the far end hears and carries out."""

    @abstractmethod
    def comes_back(self, reply: bytes) -> Heard:
        """Credit a reply to the command that was meant."""

    def arrives(self, flipped: bytes) -> Outcome:
        """Let the far end hear it, and answer.

        :raises AssertionError: an answer to something else was credited.
        """
        done = list(self._requests(flipped))
        worst = max((outcome.kind for outcome in done), key=list(Sent).index, default=Sent.NOTHING)
        for one in done:
            if (
                one.kind not in (Sent.SAME, Sent.OTHER_VALUE)
                and self.comes_back(one.answer) is not Heard.NOTHING
            ):
                raise AssertionError(f"{one.answer!r} was credited to {self.command!r}")
        wrong = [one.command for one in done if one.kind is not Sent.SAME]
        return Outcome(flipped, worst, any(command.effect is Effect.MOTION for command in wrong))

    def _credited(self, frames: Sequence[Any], exchange: Exchange[Any, Any, Any]) -> Any:
        """The outcome that the exchange takes for its reply; None if it takes none."""
        outcomes = (exchange.credit(frame, 0.0) for frame in frames)
        return next((outcome for outcome in outcomes if outcome is not None), None)


class RorzeRow(Row):
    """A command of a body, or of the link master."""

    FENCE, ITS_REPLY = b"&3F3NDP[1234]\r", b">&3F3NDP[1234],+000000001\r"
    """The next frame on the line, and its reply: a frame that has lost its end runs into it."""

    def __init__(self, row: type[RorzeCommand[Any]]) -> None:
        command, reply = _longest(row)
        super().__init__(row.code, row.name(), command.encode(), reply.encode())
        [request] = rorze.RequestReader().feed(self.command + CR)
        assert isinstance(request, rorze.Request)
        self.body, self.meant = request.body, row.read(request.text[3:])
        if FIRST_GROUP <= self.body <= LAST_GROUP:
            self.reply += MEMBERS
        self._session = RorzeSession([self.body])

    def _requests(self, stream: bytes) -> Iterator[Done]:
        for request in rorze.RequestReader().feed(stream + self.FENCE):
            if isinstance(request, rorze.Garbage) or request.text == "3NDP[1234]":
                continue
            row = COMMANDS.get(request.text[:3])
            if row is None or issubclass(row, LinkMasterCommand) is not (request.body == LINK_MASTER):
                continue
            try:
                command = row.read(request.text[3:])
            except WireFault:
                continue
            kind = _kind(self.meant, command) if request.body == self.body else Sent.OTHER_TARGET
            yield Done(kind, command, self._answer(request.body, command))

    @staticmethod
    def _answer(body: int, command: RorzeCommand[Any]) -> bytes:
        told = _like_its_example(command, len("&3F6PD"), HEAD_LENGTH)
        members = MEMBERS if FIRST_GROUP <= body <= LAST_GROUP else b""
        return f">&{body:02X}{command.code}{told}".encode() + members + CR

    def comes_back(self, reply: bytes) -> Heard:
        exchange = self._session.exchange(self.body, self.meant, Lane.READ)
        frames = rorze.LinkReader().feed(reply + self.ITS_REPLY)
        replies = [frame for frame in frames if isinstance(frame, ReplyFrame)]
        credited = self._credited(replies, exchange)
        if credited is None:
            return Heard.NOTHING
        if isinstance(credited, rorze.Refusal):
            return judged(self.reply[:HEAD_LENGTH], reply, None)
        return judged(self.reply[:HEAD_LENGTH], reply + self.ITS_REPLY, self._written(credited.replies))

    def _written(self, replies: Mapping[int, Any]) -> str:
        if self.body < FIRST_GROUP or self.body == LINK_MASTER:
            return str(replies[self.body].written())
        return "".join(f"[{member:02X}:{reply.written()}]" for member, reply in replies.items())


class FicsRow(Row):
    """A command of a robot, in Ver.3 mode unless said otherwise; in Ver.2 only queries are answered."""

    FENCE, ITS_REPLY = b"VAR V42\r", b"VAR V42=+1\r"

    def __init__(
        self, row: type[FicsCommand[Any]], reader: type[fics.Ver2Reader | fics.Ver3Reader] = fics.Ver3Reader
    ) -> None:
        command, reply = _longest(row)
        super().__init__(row.code or "macro", row.name(), command.encode(), reply.encode())
        self.meant = read_fics(command[:NAME_LENGTH], command[NAME_LENGTH + 1 :])
        self._session, self._reader = FicsSession("r1"), reader

    def _requests(self, stream: bytes) -> Iterator[Done]:
        for request in fics.FicsRequestReader().feed(stream + self.FENCE):
            if isinstance(request, fics.Garbage) or request == fics.FicsRequest("VAR", "V42"):
                continue
            try:
                command = read_fics(request.name, request.arguments)
            except WireFault:
                continue
            same = command.wire_name() == self.meant.wire_name()
            kind = _kind(self.meant, command) if same else Sent.OTHER_COMMAND
            yield Done(kind, command, self._answer(command))

    @staticmethod
    def _answer(command: FicsCommand[Any]) -> bytes:
        told = _like_its_example(command, NAME_LENGTH + 1 if command.code else 0, NAME_LENGTH + 1)
        return f"{command.answered_as or command.wire_name()} {told}".strip().encode() + CR

    def comes_back(self, reply: bytes) -> Heard:
        exchange = self._session.exchange(self.meant, Lane.READ)
        frames = self._reader().feed(reply + self.ITS_REPLY)
        credited = self._credited(frames, exchange)
        if credited is None:
            return Heard.NOTHING
        if isinstance(credited, fics.FicsRefusal | fics.SystemFailure):
            return judged(self.reply[:NAME_LENGTH], reply, None)
        replies = [reply for reply, _ in exchange.parts] if credited is More.MORE else credited.replies
        return judged(self.reply[:NAME_LENGTH], reply + self.ITS_REPLY, _first(replies))


def rows() -> tuple[list[Row], list[Row]]:
    """All commands of both families."""
    return [RorzeRow(row) for row in COMMANDS.values()], [FicsRow(row) for row in ROWS]


def flips(frame: bytes) -> Iterator[bytes]:
    """Every frame that differs in one bit."""
    for place in range(len(frame)):
        for bit in range(8):
            yield frame[:place] + bytes([frame[place] ^ 1 << bit]) + frame[place + 1 :]


def _longest(row: type[Command[Any]]) -> tuple[str, str]:
    pairs = zip(row.example[::2], row.example[1::2], strict=True)
    return max(pairs, key=lambda pair: len(pair[0] + pair[1]))


def _like_its_example(command: Command[Any], before: int, head: int) -> str:
    """Answer as the example of the same form is answered, and repeat what replies repeat.

    `before` and `head` are the lengths of what stands before the parameters and before the reply's.
    """
    row = type(command)
    pairs = zip(row.example[::2], row.example[1::2], strict=True)
    told = next(
        (reply[head:] for sent, reply in pairs if row.read(sent[before:]).form_index == command.form_index),
        row.example[1][head:],
    )
    echoed = {name: value for name in row.echo if (value := getattr(command, name)) is not None}
    return row.reply_type().read(told).model_copy(update=echoed).written() if echoed else told


def _kind(meant: Command[Any], done: Command[Any]) -> Sent:
    """Compare what was meant with what is done in its place, by the same target."""
    if type(done) is not type(meant):
        return Sent.OTHER_COMMAND
    if done == meant:
        return Sent.SAME
    one_to_one = len(meant.reply_type().forms) == len(meant.forms) > 1
    seen = any(getattr(meant, name) not in (None, getattr(done, name)) for name in meant.echo)
    if seen or (one_to_one and meant.form_index != done.form_index):
        return Sent.SEEN
    return Sent.OTHER_VALUE


def judged(head: bytes, heard: bytes, payload: str | None) -> Heard:
    """Look whether what was credited is what came, up to its first CR, and whose it is was not touched.

    Without a payload it was a refusal.

    :raises AssertionError: it was credited wrongly.
    """
    line = heard.partition(CR)[0]
    as_it_came = payload is None or _plain(line.removeprefix(head).decode()) == _plain(payload)
    if not (line.startswith(head) and as_it_came):
        raise AssertionError(f"{line!r} was credited as {payload!r}")
    return Heard.REFUSAL if payload is None else Heard.OTHER_VALUE


def _first(replies: Sequence[Any]) -> str:
    return str(replies[0].written()) if replies else ""


def _plain(text: str) -> str:
    """Write what means the same in one way: 050.50 is 50.5, and what is left out at the end is nothing."""
    text = text.replace(" ", "").rstrip(",")
    return _NUMBER.sub(lambda number: str(float(number[0]) + 0.0), text)
