"""The file of a recording: a zip of a manifest, what went over each line, events, journal and samples."""

import json
import os
import zipfile
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError

from transports.trace import TraceEntry

MANIFEST: Final = "manifest.json"
EVENTS: Final = "events.jsonl"
JOURNAL: Final = "journal.jsonl"
SAMPLES: Final = "samples.csv"
REQUESTS: Final = "requests.jsonl"
STATES: Final = "states.jsonl"
SUFFIX: Final = ".mgrec"
SAMPLE_COLUMNS: Final = ("time", "body_id", "move_id", "time_s", "axis", "position")
PIECE: Final = 65_536
_LEVEL: Final = 1


def line_member(line_id: str) -> str:
    """Name the member with the records of a line."""
    return f"lines/{line_id}.jsonl"


def before_member(line_id: str) -> str:
    """Name the member with the last exchange of each frame before the recording begins."""
    return f"before/{line_id}.jsonl"


class Clocks(BaseModel):
    """Both clocks at one moment: the records of lines have both."""

    at: datetime
    monotonic_ns: int


class Manifest(BaseModel):
    """The subject of a recording."""

    model_config = ConfigDict(populate_by_name=True)

    version: Literal[1] = 1
    """The version of the format."""
    gateway: str
    """The version of the gateway that has recorded it."""
    epoch: str
    """The epoch of its events: the beginning of all their cursors."""
    from_: datetime = Field(alias="from")
    to: datetime
    clocks: Clocks
    lines: list[str]
    whole_plant: bool = True
    """True if these are all its lines: what is about no line is there, too."""
    cause: Literal["request", "alarm"] = "request"
    alarm_id: str | None = None
    complete: bool = True
    """False where the gateway has ended in the middle of it: it ends where the disk had it."""
    reaches: dict[str, datetime] = Field(default_factory=dict)
    """The lines of which the memory had forgotten the beginning, and when their records begin."""
    configuration: dict[str, JsonValue]


class NotARecording(ValueError):
    """A file is no recording, or a part of it cannot be read; the message names the place."""


class Recording:
    """A recording that is read."""

    def __init__(self, path: Path) -> None:
        """Open a file.

        :raises NotARecording: it is no recording.
        :raises OSError: it cannot be read.
        """
        self.path = path
        try:
            self._zip = zipfile.ZipFile(path)
            self.manifest = Manifest.model_validate_json(self._zip.read(MANIFEST))
        except (zipfile.BadZipFile, KeyError) as error:
            raise NotARecording(f"{path} is no recording: {error}.") from None
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            raise NotARecording(f"{path}: {MANIFEST}: {place}: {first['msg']}.") from None

    def close(self) -> None:
        """Close the file."""
        self._zip.close()

    def rows(self, member: str) -> Iterator[tuple[int, dict[str, Any]]]:
        """Read a member of JSON lines: the number of each line, from 1, and its object.

        A member that is not there has none.

        :raises NotARecording: a line cannot be read.
        """
        for number, line in self.lines(member):
            try:
                row = json.loads(line)
            except ValueError as error:
                raise NotARecording(f"{member}:{number}: {error}.") from None
            if not isinstance(row, dict):
                raise NotARecording(f"{member}:{number}: this is no object.")
            yield number, row

    def entries(self, member: str) -> Iterator[tuple[int, TraceEntry]]:
        """Read the records of a line with their numbers; errors as of `rows`."""
        for number, line in self.lines(member):
            try:
                yield number, TraceEntry.model_validate_json(line)
            except ValidationError as error:
                first = error.errors()[0]
                place = ".".join(map(str, first["loc"]))
                raise NotARecording(f"{member}:{number}: {place}: {first['msg']}.") from None

    def text(self, member: str) -> str:
        """Read a whole member; empty where it is not there."""
        return "\n".join(line.decode() for _, line in self.lines(member))

    def lines(self, member: str) -> Iterator[tuple[int, bytes]]:
        """Read the lines of a member with their numbers; errors as of `rows`."""
        if member not in self._zip.namelist():
            return
        try:
            with self._zip.open(member) as file:
                for number, line in enumerate(file, 1):
                    yield number, line.rstrip(b"\n")
        except (zipfile.BadZipFile, EOFError) as error:
            raise NotARecording(f"{self.path}: {member} is damaged: {error}.") from None


@contextmanager
def opened(path: Path) -> Iterator[Recording]:
    """Open a recording for a while; errors as of `Recording`."""
    recording = Recording(path)
    try:
        yield recording
    finally:
        recording.close()


def members(folder: Path) -> Iterator[Path]:
    """The files of a folder that will be a recording, the manifest first."""
    yield folder / MANIFEST
    yield from sorted(file for file in folder.rglob("*") if file.is_file() and file.name != MANIFEST)


def pack(folder: Path, target: Path) -> Generator[None, None, None]:
    """Make a recording of a folder, step by step; there is a whole one in the end, or none.

    :raises OSError: the disk does not take it; nothing of it is left.
    """
    unfinished = target.with_suffix(".tmp")
    try:
        with unfinished.open("wb") as file:
            os.fchmod(file.fileno(), 0o600)
            with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
                for path in members(folder):
                    yield from _add(archive, path, path.relative_to(folder).as_posix())
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(target)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def _add(archive: zipfile.ZipFile, path: Path, name: str) -> Iterator[None]:
    with path.open("rb") as source, archive.open(name, "w", force_zip64=True) as member:
        while piece := source.read(PIECE):
            member.write(piece)
            yield


def json_line(row: Mapping[str, object]) -> bytes:
    """Write an object as a line."""
    return json.dumps(row, ensure_ascii=False, separators=(",", ":")).encode() + b"\n"
