"""The output of commands: JSON for scripts, tables and progress for people."""

import json
import sys
import time
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Self

import typer

Row = tuple[str, ...]


def json_text(content: object) -> str:
    """Write an answer over several lines, Japanese as it is."""
    return json.dumps(content, ensure_ascii=False, indent=2)


def table(head: Row, body: Iterable[Row]) -> str:
    """Write rows below their heads, in columns."""
    rows = [head, *body]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)


QUIET_S = 2.0
"""Seconds without words: a command that ends sooner needs none."""
_CLEAR = "\r\x1b[K"


class ProgressLine:
    """One line on a terminal, written over and over; in a file a line for each different sentence."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began_at = clock()
        self._last = ""
        self._terminal = sys.stderr.isatty()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.clear()

    def say(self, sentence: str) -> None:
        """Show what goes on now."""
        if sentence == self._last or self._clock() - self._began_at < QUIET_S:
            return
        self._last = sentence
        typer.echo(f"{_CLEAR}{sentence}" if self._terminal else sentence, err=True, nl=not self._terminal)

    def note(self, sentence: str) -> None:
        """Say something that stays, whenever it is."""
        self.clear()
        typer.echo(sentence, err=True)

    def clear(self) -> None:
        """Take the line away again."""
        if self._last and self._terminal:
            typer.echo(_CLEAR, err=True, nl=False)
        self._last = ""
