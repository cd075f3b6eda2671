"""Names that people give to stored things, kept in one file of the data directory."""

import asyncio
import json
import logging
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Final, Protocol

from pydantic import Field, TypeAdapter, ValidationError

from gateway.core.errors import GatewayError
from gateway.core.records import RequestModel, example
from gateway.core.tables import Name
from gateway.core.whole_files import write_whole

log = logging.getLogger(__name__)

FILE: Final = "names.json"
_KEPT: Final = TypeAdapter(dict[str, dict[int, Name]])


class NotKept(GatewayError):
    """A name was given, and cannot be written down."""

    kind = "name-not-kept"

    def __init__(self, cause: OSError) -> None:
        super().__init__(
            f"The name cannot be written to the data directory: {cause.strerror}. Everything else was done.",
            "See to the disk, and give the name again.",
        )


class PositionName(RequestModel, json_schema_extra=example(name="unload")):
    """A name for a position."""

    name: Name | None = Field(description="Name of the position; null takes the name away.")


class Nameable(Protocol):
    """A thing to be stored, which may have a name."""

    @property
    def number(self) -> int:
        """Its place in the table."""

    @property
    def name(self) -> str | None:
        """The name that is given to it; None for none."""


def given(wanted: Iterable[Nameable]) -> dict[int, str]:
    """The names that are given to things as they are stored; those without keep what they have."""
    return {entry.number: entry.name for entry in wanted if entry.name is not None}


class Names:
    """Names by the address of the things' holder, and by number; without a directory in memory only."""

    def __init__(self) -> None:
        self._names: dict[str, dict[int, str]] = {}
        self._file: Path | None = None
        self._writing = asyncio.Lock()
        self.on_named: Callable[[str, Mapping[int, str]], None] = lambda _address, _names: None
        """Called with the names that were given, after they were written down."""

    def keep_in(self, directory: Path) -> None:
        """Read what is there, and write there from now on; a file that cannot be read is put aside."""
        self._file = file = directory / FILE
        try:
            self._names = _KEPT.validate_json(file.read_bytes())
        except FileNotFoundError:
            return
        except (OSError, ValidationError):
            aside = file.with_suffix(".unreadable")
            log.exception("%s cannot be read, and is kept as %s", file, aside)
            file.replace(aside)

    def of(self, address: str) -> Mapping[int, str]:
        """The names of the things that stand there."""
        return self._names.get(address, {})

    async def name(self, address: str, names: Mapping[int, str]) -> None:
        """Give names; an empty one takes the name away.

        :raises NotKept: they cannot be written to the disk.
        """
        async with self._writing:
            kept = {number: name for number, name in {**self.of(address), **names}.items() if name}
            wanted = {**self._names, address: dict(sorted(kept.items()))}
            if self._file is not None and wanted != self._names:
                try:
                    await asyncio.to_thread(_write, self._file, wanted)
                except OSError as error:
                    raise NotKept(error) from error
            self._names = wanted
            if names:
                self.on_named(address, names)


def _write(file: Path, names: Mapping[str, Mapping[int, str]]) -> None:
    write_whole(file, json.dumps(names, ensure_ascii=False, indent=1, sort_keys=True))
