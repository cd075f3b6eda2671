"""How a stream of bytes is cut into lines that end with CR."""

from dataclasses import dataclass

CR = b"\r"


@dataclass(frozen=True, slots=True)
class Garbage:
    """Bytes that are no line of a protocol."""

    data: bytes
    why: str


class Lines:
    """Cuts a stream at CR. A line that grows too long is given once, cut, and its tail is dropped."""

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self._begun = b""
        self._cut = False

    def feed(self, data: bytes) -> list[bytes]:
        """Take bytes, give the lines that are complete now, without their CR."""
        text = self._begun + data
        *lines, self._begun = text.split(CR)
        if len(text) > self._longest:
            lines = [line[: self._longest + 1] for line in lines]
        if lines and self._cut:
            del lines[0]  # the tail of a line that was given before
            self._cut = False
        if len(self._begun) > self._longest:
            self._begun = self._begun[: self._longest + 1]
            lines += [] if self._cut else [self._begun]
            self._cut = True
        return lines

    def pending(self) -> int:
        """Bytes after the last CR; 0 for a line that has grown too long, whose end is not waited for."""
        return 0 if self._cut else len(self._begun)
