"""The frames of each family, as a replay knows them: what they ask, what answers them, what is drawn anew."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Final

from protocols.fics.commands import read
from protocols.fics.row import FicsCommand
from protocols.rorze.commands import COMMANDS
from protocols.table import Effect, WireFault

NUMBERED: Final = frozenset({"gateway: fence", "gateway: probe"})
"""The callers of questions whose numbers are drawn, and that tell nothing but their own."""
UNIT: Final = b"|"
"""Separator of the selected unit and the text in a key."""
_MARK: Final = re.compile(rb"GW-[0-9a-f]{8}")
_DIGITS: Final = re.compile(rb"\d+")
_SELECTED: Final = re.compile(rb"UNT (\d+)")
_UNIT_NOW: Final = re.compile(rb"^UNT \d+")
_ANY_MARK: Final = b"GW-........"


class Dialect(ABC):
    """A family's frames, each with its end."""

    fence_number: "re.Pattern[bytes]"

    def __init__(self) -> None:
        """Begin with no frame."""
        self.unit = b""
        """The unit that is selected, where there are units."""
        self._drawn: dict[bytes, bytes] = {}

    def key(self, frame: bytes, caller: str | None) -> bytes:
        """The part that a frame has in common with the same one of another life."""
        text = _MARK.sub(_ANY_MARK, frame)
        return self.unit + UNIT + (self.fence_number.sub(b"[#]", text) if caller in NUMBERED else text)

    def drawn_number(self, frame: bytes, caller: str | None) -> int | None:
        """The number of a fence; None of all else."""
        found = self.fence_number.search(frame) if caller in NUMBERED else None
        return None if found is None else int(b"".join(_DIGITS.findall(found[0])))

    def saw(self, _frame: bytes, /) -> None:
        """Note what a frame has changed that frames behind it depend on."""
        return

    def prepares(self, _frame: bytes, /) -> bool:
        """Tell whether it only has an effect on how frames behind it are understood."""
        return False

    def reply_to(self, frame: bytes, caller: str | None) -> bytes | None:
        """A reply that tells nothing: the number of a fence, or that a command was taken; or none."""
        if caller in NUMBERED:
            return self.numbered(frame)
        return None if self.asks(frame) else self.acknowledgement(frame)

    @abstractmethod
    def numbered(self, frame: bytes) -> bytes:
        """The answer to a fence."""

    @abstractmethod
    def acknowledgement(self, frame: bytes) -> bytes | None:
        """The reply that says that a command was taken."""

    def note(self, then: bytes, now: bytes, caller: str | None) -> None:
        """Take a frame of this life for one of the recording: what it has drawn stands for that of then."""
        pairs = list(zip(_MARK.findall(then), _MARK.findall(now), strict=False))
        if caller in NUMBERED:
            numbers = (map(self.written_number, self.fence_number.findall(frame)) for frame in (then, now))
            pairs += zip(*numbers, strict=False)
        for drawn_then, drawn_now in pairs:
            self._drawn.pop(drawn_then, None)
            if drawn_then != drawn_now:
                self._drawn[drawn_then] = drawn_now

    def of_now(self, reply: bytes) -> bytes:
        """A recorded reply with what was drawn in this life."""
        drawn = self._drawn
        pattern = b"|".join(map(re.escape, drawn)) or None
        return reply if pattern is None else re.sub(pattern, lambda match: drawn[match[0]], reply)

    def fitted(self, reply: bytes, now: bytes, caller: str | None) -> bytes:
        """A recorded reply as an answer to a frame of this life: with its marks, and a fence's number."""
        reply = self.of_now(reply)
        number = self.fence_number.search(now) if caller in NUMBERED else None
        return reply if number is None else self.fence_number.sub(self.written_number(number[0]), reply)

    def written_number(self, number: bytes) -> bytes:
        """The number of a fence as its answer has it."""
        return number

    @abstractmethod
    def target(self, frame: bytes, /) -> bytes:
        """The addressee of a frame: the frames of one keep their order."""

    @abstractmethod
    def effect(self, frame: bytes) -> Effect | None:
        """The effect of a frame; None where it is no command."""

    @abstractmethod
    def answers(self, reply: bytes, frame: bytes) -> bool:
        """Tell whether a reply may answer a frame."""

    def is_unasked(self, _reply: bytes, /) -> bool:
        """Tell whether it is a message that answers nothing."""
        return False

    def asks(self, frame: bytes) -> bool:
        """Tell whether it only asks."""
        return self.effect(frame) is Effect.READ


class Rorze(Dialect):
    """RC-400 lines."""

    fence_number = re.compile(rb"P\[\d+\]")

    def written_number(self, number: bytes) -> bytes:
        """Four digits (RC-420 manual 14.3)."""
        return b"P[%04d]" % int(number[2:-1])

    def is_unasked(self, reply: bytes, /) -> bool:
        """Tell whether it comes from the addresses 7D and 7E (RC-420 manual 12)."""
        return reply[:4] in (b">&7D", b">&7E")

    def target(self, frame: bytes, /) -> bytes:
        """The body, after the introducer."""
        return frame[:3] if frame[:1] == b"&" else frame[:2]

    def effect(self, frame: bytes) -> Effect | None:
        """That of the row of its code."""
        begin = len(self.target(frame))
        row = COMMANDS.get(frame[begin : begin + 3].decode("latin-1"))
        return None if row is None else row.effect

    def prepares(self, frame: bytes, /) -> bool:
        """Tell whether a frame sets the mark by which a later question sees a loss of power."""
        return _MARK.search(frame) is not None

    def numbered(self, frame: bytes) -> bytes:
        """An entry of the position table, or a data memory."""
        number = self.fence_number.search(frame)
        written = self.written_number(number[0]) if number else b""
        return b">" + frame[: len(self.target(frame)) + 3] + written + b",+000000000\r"

    def acknowledgement(self, frame: bytes) -> bytes | None:
        """Body and code (RC-420 manual 12)."""
        return None if self.effect(frame) is None else b">" + frame[: len(self.target(frame)) + 3] + b"\r"

    def answers(self, reply: bytes, frame: bytes) -> bool:
        """Tell whether a reply has the body and the code of a frame."""
        return reply[1 : 1 + len(self.target(frame)) + 3] == frame[: len(self.target(frame)) + 3]


class Fics(Dialect):
    """Robots."""

    fence_number = re.compile(rb"V\d+")

    def __init__(self) -> None:
        """Begin with no unit selected that is known."""
        super().__init__()
        self._confirms = False

    def saw(self, frame: bytes, /) -> None:
        """Select a unit, or a mode of communication."""
        if (selected := _SELECTED.match(frame)) is not None:
            self.unit = selected[1]
        elif frame.startswith(b"MOD "):
            self._confirms = frame.startswith(b"MOD 3")

    def prepares(self, frame: bytes, /) -> bool:
        """Selects a unit."""
        return _SELECTED.match(frame) is not None

    def fitted(self, reply: bytes, now: bytes, caller: str | None) -> bytes:
        """With the unit that is selected now."""
        fitted = super().fitted(reply, now, caller)
        if now.startswith(b"MOD") and fitted.startswith(b"MOD "):
            self._confirms = fitted.startswith(b"MOD 3")
        return _UNIT_NOW.sub(b"UNT " + self.unit, fitted) if self.unit and now == b"UNT\r" else fitted

    def numbered(self, frame: bytes) -> bytes:
        """A variable."""
        return frame.rstrip(b"\r\n") + b"=+0\r"

    def acknowledgement(self, frame: bytes) -> bytes | None:
        """The bare name, in Ver.3 (C-HOST manual 1-1-1)."""
        return frame[:3] + b"\r" if self._confirms and self.effect(frame) is not None else None

    def target(self, _frame: bytes, /) -> bytes:
        """There is one."""
        return b""

    def effect(self, frame: bytes) -> Effect | None:
        """That of its row."""
        row = self._row(frame)
        return None if row is None else row.effect

    def answers(self, reply: bytes, frame: bytes) -> bool:
        """With the same name, or one by which its row is answered, as POR is by POS and POE."""
        row, name = self._row(frame), frame.lstrip(b"!\r")[:3].decode("latin-1")
        return reply[:3].decode("latin-1") in {name, *(row.reply_names if row else ())}

    @staticmethod
    def _row(frame: bytes) -> FicsCommand[Any] | None:
        try:
            return read(*frame.decode("latin-1").strip("!\r\n").partition(" ")[::2])
        except WireFault:
            return None


DIALECTS: Final[dict[str, Callable[[], Dialect]]] = {"rorze": Rorze, "fics": Fics}
