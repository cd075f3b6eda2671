"""The tokens of leases: whole numbers that only grow, over restarts too."""

import asyncio
import os
from pathlib import Path
from typing import Final

from gateway.core.errors import NotSent

FILE: Final = "lease-tokens"
AHEAD: Final = 1000
"""Tokens that are written down as given at once, so that not each takes a write."""


class LeaseTokens:
    """Numbers that are given once. Without a directory they begin anew with each gateway."""

    def __init__(self, directory: Path | None = None) -> None:
        self._path = None if directory is None else directory / FILE
        self._next = 1
        self._end = 1
        self._writing = asyncio.Lock()

    async def next(self) -> int:
        """Give the next number, which is written down as given before.

        :raises NotSent: that cannot be done.
        """
        async with self._writing:
            if self._next >= self._end:
                try:
                    self._next, self._end = await asyncio.to_thread(self._reserve)
                except (OSError, ValueError) as error:
                    raise NotSent(
                        f"No lease was given: its token cannot be written down ({error}).",
                        "Make room in the data directory, or mend the file of tokens.",
                    ) from error
            given, self._next = self._next, self._next + 1
            return given

    def _reserve(self) -> tuple[int, int]:
        if self._path is None:
            return self._end, self._end + AHEAD
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        first = int(self._path.read_text("ascii")) if self._path.exists() else 1
        new = self._path.with_suffix(".new")
        with new.open("w", encoding="ascii") as file:
            file.write(str(first + AHEAD))
            file.flush()
            os.fsync(file.fileno())
        new.replace(self._path)
        directory = os.open(self._path.parent, os.O_RDONLY)
        try:
            os.fsync(directory)
        finally:
            os.close(directory)
        return first, first + AHEAD
