"""The cursor of the last gateway event that a bridge has delivered, kept on disk for the next start."""

import asyncio
import fcntl
import logging
import os
import re
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Final, Self

log = logging.getLogger(__name__)

WRITTEN_EVERY_S: Final = 0.2
"""Seconds between writes: events delivered in this time before a kill come again, with the same ids."""


_CURSOR: Final = re.compile("[!-~]{1,100}")


class InUse(Exception):
    """Another bridge of this kind has the directory."""


class Position:
    """The cursor of the last event that was delivered for good; a context that holds the directory.

    :raises InUse: another bridge of this kind runs with this directory.
    :raises OSError: the directory cannot be written.
    """

    def __init__(self, data: Path, kind: str) -> None:
        self._path = data / f"{kind}.position"
        self._lock = data / f"{kind}.lock"
        self.cursor: str | None = None
        """Cursor of the last delivered event; None before the first event."""
        self._written: str | None = None
        self._moved = asyncio.Event()

    def __enter__(self) -> Self:
        """Take the directory, and read how far an earlier life has come."""
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._held = os.open(self._lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(self._held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(self._held)
            raise InUse(f"{self._path.parent} is in use by another bridge.") from None
        self.cursor = self._written = self._read()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Write the last, and give the directory back."""
        with suppress(OSError):
            self._write(self.cursor)
        os.close(self._held)

    def _read(self) -> str | None:
        try:
            text = self._path.read_text("ascii", "replace").strip()
            why = "" if _CURSOR.fullmatch(text) else "it names no cursor"
        except FileNotFoundError:
            return None
        except OSError as error:
            text, why = "", str(error.strerror)
        if why:
            log.warning(
                "%s cannot be read (%s): events go on from now; those since the last life are missing",
                self._path,
                why,
            )
        return None if why else text

    def begin(self, cursor: str) -> None:
        """Note where the first life begins, at once: from there on no event is missed."""
        self._write(cursor)
        self.reach(cursor)

    def reach(self, cursor: str) -> None:
        """Note that everything up to here was delivered; it is written soon."""
        self.cursor = cursor
        self._moved.set()

    async def keep(self) -> None:
        """Write each new cursor to the disk until cancelled; a failed write is repeated with the next one."""
        trouble = False
        while True:
            await self._moved.wait()
            self._moved.clear()
            try:
                await asyncio.to_thread(self._write, self.cursor)
                trouble = False
            except OSError as error:
                if not trouble:
                    log.warning(
                        "%s cannot be written (%s): a restart repeats events from %s on",
                        self._path,
                        error.strerror,
                        self._written,
                    )
                trouble = True
                self._moved.set()
            await asyncio.sleep(WRITTEN_EVERY_S)

    def _write(self, cursor: str | None) -> None:
        if cursor == self._written:
            return
        new = self._path.with_suffix(".new")
        with new.open("w", encoding="ascii") as file:
            file.write(f"{cursor}\n")
            file.flush()
            os.fsync(file.fileno())
        new.replace(self._path)
        self._written = cursor
