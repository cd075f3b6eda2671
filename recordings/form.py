"""The file of a recording: a zip of a manifest, what went over each line, events, journal and samples."""

import json
import os
import zipfile
import zlib
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError, model_validator

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
UNPACKED_TIMES: Final = 200
"""The most bytes of a recording for each byte of its file, but for a small one."""
SMALL: Final = 64 << 20
"""Bytes of a recording that may be small in its file."""


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_text_or_none(value: object) -> bool:
    return value is None or isinstance(value, str)


def _is_whole(value: object) -> bool:
    return type(value) is int


def _is_object(value: object) -> bool:
    return isinstance(value, dict)


def _is_time(value: object) -> bool:
    try:
        return isinstance(value, str) and datetime.fromisoformat(value).tzinfo is not None
    except ValueError:
        return False


def _is_number(value: object) -> bool:
    return isinstance(value, str) and value.isdecimal()


FIELDS: Final[Mapping[str, Mapping[str, Callable[[object], bool]]]] = MappingProxyType(
    {
        EVENTS: {
            "sequence": _is_number,
            "time": _is_time,
            "type": _is_text,
            "subject": _is_text,
            "data": _is_object,
        },
        STATES: {"monotonic_ns": _is_whole, "path": _is_text, "state": _is_object},
        REQUESTS: {
            "monotonic_ns": _is_whole,
            "operation": _is_text,
            "values": _is_object,
            "caller": _is_text_or_none,
            "request_id": _is_text_or_none,
        },
    }
)
"""The fields of each object of a member that are read, each with its check."""


def line_member(line_id: str) -> str:
    """Name the member with the records of a line."""
    return f"lines/{line_id}.jsonl"


def before_member(line_id: str) -> str:
    """Name the member with the last exchange of each frame before the recording begins."""
    return f"before/{line_id}.jsonl"


def families_of(configuration: Mapping[str, object]) -> dict[str, str]:
    """Tell which family speaks on each line of a configuration."""
    lines = configuration.get("lines")
    tables = lines if isinstance(lines, list) else []
    return {
        str(table.get("id")): str(table.get("protocol", "rorze"))
        for table in tables
        if isinstance(table, dict)
    }


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

    @model_validator(mode="after")
    def _configure_each_line(self) -> Self:
        if strange := set(self.lines) - families_of(self.configuration).keys():
            raise ValueError(f"the configuration has no line {min(strange)}")
        return self


class NotARecording(ValueError):
    """A file is no recording, or a part of it cannot be read; the message names the place."""


DAMAGED: Final = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError)
"""Raised by a zip that is damaged, packed otherwise, or kept by a password."""


def first_of(error: ValidationError) -> str:
    """The first thing that is wrong, behind its place where it has one."""
    first = error.errors()[0]
    place = "".join(f"{part}: " for part in [".".join(map(str, first["loc"]))] if part)
    return place + first["msg"].removeprefix("Value error, ")


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
            unpacked = sum(member.file_size for member in self._zip.infolist())
            if unpacked > max(SMALL, UNPACKED_TIMES * path.stat().st_size):
                raise NotARecording(
                    f"{path} is no recording: unpacked it would have {unpacked >> 20} MiB, more than "
                    f"{UNPACKED_TIMES} times its size."
                )
            self.manifest = Manifest.model_validate_json(self._zip.read(MANIFEST))
        except ValidationError as error:
            raise NotARecording(f"{path}: {MANIFEST}: {first_of(error)}.") from None
        except (*DAMAGED, KeyError) as error:
            raise NotARecording(f"{path} is no recording: {error}.") from None

    def close(self) -> None:
        """Close the file."""
        self._zip.close()

    def rows(self, member: str) -> Iterator[tuple[int, dict[str, Any]]]:
        """Read a member of JSON lines: the number of each line, from 1, and its object.

        A member that is not there has none.

        :raises NotARecording: a line cannot be read, or has not the fields that are read of it.
        """
        for number, _, row in self.objects(member):
            yield number, row

    def objects(self, member: str) -> Iterator[tuple[int, bytes, dict[str, Any]]]:
        """Read the same, with each line as it is."""
        fields = FIELDS.get(member, {})
        for number, line in self.lines(member):
            try:
                row = json.loads(line)
            except (ValueError, RecursionError) as error:
                raise NotARecording(f"{member}:{number}: {error}.") from None
            if not isinstance(row, dict):
                raise NotARecording(f"{member}:{number}: this is no object.")
            for name, is_right in fields.items():
                if name not in row or not is_right(row[name]):
                    raise NotARecording(f"{member}:{number}: {name} is missing, or of another kind.")
            yield number, line, row

    def entries(self, member: str) -> Iterator[tuple[int, TraceEntry]]:
        """Read the records of a line with their numbers; errors as of `rows`."""
        for number, line in self.lines(member):
            try:
                yield number, TraceEntry.model_validate_json(line)
            except ValidationError as error:
                raise NotARecording(f"{member}:{number}: {first_of(error)}.") from None

    def text(self, member: str) -> str:
        """Read a whole member; empty where it is not there."""
        return "\n".join(line.decode("utf-8", "replace") for _, line in self.lines(member))

    def lines(self, member: str) -> Iterator[tuple[int, bytes]]:
        """Read the lines of a member with their numbers; errors as of `rows`."""
        if member not in self._zip.namelist():
            return
        try:
            with self._zip.open(member) as file:
                for number, line in enumerate(file, 1):
                    yield number, line.rstrip(b"\n")
        except DAMAGED as error:
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
