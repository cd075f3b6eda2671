"""Recordings of the plant: taken on request or at an alarm, kept in the data directory."""

import asyncio
import csv
import json
import logging
import os
import shutil
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import lru_cache, partial
from io import StringIO
from math import inf
from pathlib import Path
from typing import Any, Final, Literal, TypeVar

from pydantic import Field

from gateway.core.aside import aside
from gateway.core.errors import NotFound
from gateway.core.events import Event, EventHub
from gateway.core.journal.writes import Value
from gateway.core.origin import hex_digits
from gateway.core.records import Record, request_id_field
from gateway.core.times import happens
from gateway.core.works import CutOff, Jobs
from gateway.families import registered
from gateway.version import VERSION
from recordings import form
from transports.recorder import History, Piece, Recorder, clocks
from transports.trace import Record as TraceRecord
from transports.trace import TraceEntry, escape

log = logging.getLogger(__name__)

GATEWAY: Final = "The gateway"
"""Caller in whose name recordings are made."""
FOLDER: Final = "recordings"
HISTORY: Final = 1000
SPOOL_S: Final = 1.0
"""Seconds after which an event is on the disk, while a recording is under way."""
REQUESTS_BYTES: Final = 2_000_000
STATES_BYTES: Final = 8_000_000
STATES_REACH_S: Final = 60.0
"""Every state is noted again after this time, though it is the same."""
LONGEST_AFTER_ALARM_S: Final = 600.0
"""A recording that alarms begin again and again ends after this time."""
FRAMES_BEFORE: Final = 4096
"""Frames of which the last answer before a recording is kept in it."""
_TARGETS: Final = ("line_id", *(name for kind in registered() for name in kind.names if name.endswith("_id")))
"""The names in a request of what it is about."""
PIECES_AT_ONCE: Final = 8
"""Some 500 records, which take a millisecond beside the event loop."""
PART: Final = ".part"
LONGEST_LINE: Final = 100_000

_TIME: Final = '"time":"'
EVENTS_AT_ONCE: Final = 64


def _asking(table: str, columns: str, end: str) -> tuple[str, str]:
    """The columns of a table, and what asks for its rows of a time: those that were not over before it."""
    times = f"(at >= ?1 OR {end} IS NULL OR {end} >= ?1) AND at <= ?2"
    return columns, f"SELECT {columns} FROM {table} WHERE {times} ORDER BY id"  # noqa: S608  # our own names


_JOURNAL: Final = {
    "intents": _asking(
        "intents",
        "id, at, target, command, effect, frame, caller, request_id, move_id, written_at, ended_at, "
        "outcome, detail",
        "ended_at",
    ),
    "moves": _asking("moves", "id, target, final, at, record", "nullif(final, 0)"),
    "alarms": _asking("alarms", "id, at, target, cause, reset_at, reset_by, record", "reset_at"),
}
"""Tables of the journal in a recording, in the words of `motion-gateway journal export`."""

Noted = tuple[int, int, str]
"""Wall time, the time of the clock that never jumps, and the rest of a line of JSON, an object."""
R = TypeVar("R", bound=tuple[Any, ...])


class RecordingInfo(Record):
    """One recording, under way or kept."""

    id: str = Field(description="Id of the recording, which sorts by time.")
    status: Literal["running", "finished", "failed"] = "running"
    cause: Literal["request", "alarm"] = "request"
    alarm_id: str | None = Field(default=None, description="The alarm that has begun it.")
    lines: list[str]
    whole_plant: bool = Field(default=True, description="True if these are all lines.")
    since: datetime = Field(description="Beginning of the recorded time.")
    until: datetime | None = Field(
        default=None, description="End of the recorded time; null while the recording goes on."
    )
    bytes: int | None = Field(default=None, description="Size of its file.")
    complete: bool = Field(
        default=True,
        description="False where the gateway ended in the middle of it: it holds what was on the disk.",
    )
    error: str | None = Field(default=None, description="Reason for which there is no file.")
    request_id: str | None = request_id_field()
    started_at: datetime
    ended_at: datetime | None = None


@dataclass
class RecordedSpan:
    """The sources of a recording."""

    events: EventHub
    recorders: Mapping[str, Recorder]
    requests: History[Noted]
    states: History[Noted]
    configuration: Callable[[Sequence[str]], Mapping[str, Any]]
    """Gives the configuration of some lines."""
    trajectories: Callable[[], Iterable[Any]]
    """Gives the places where motors were seen during the newest moves."""
    line_of: Callable[[str], str | None]
    """The line of a subject or a target; None of what is about no line."""
    read_journal: Callable[[str, Sequence[Value]], Sequence[tuple[Any, ...]]]
    """Reads rows beside the writer; none where there is no journal."""


@dataclass
class _Run:
    """A recording under way."""

    record: RecordingInfo
    ends_at: float
    """Time of the event loop."""
    recorders: Mapping[str, Recorder]
    at: dict[str, int]
    """The number of the last record that is on the disk: of each line, the requests and the states."""
    enough: asyncio.Event = field(default_factory=asyncio.Event)


class Recordings(Jobs[RecordingInfo]):
    """The recordings of a gateway: those in its data directory, and those under way."""

    def __init__(self, taken: RecordedSpan, most_bytes: int, before_s: float, after_s: float) -> None:
        """`before_s` and `after_s` are recorded around an alarm; with both 0 nothing is."""
        super().__init__(HISTORY, "recording", lambda _: GATEWAY)
        self._taken = taken
        self._most_bytes = most_bytes
        self._before_s, self._after_s = before_s, after_s
        self._folder: Path | None = None
        self._runs: dict[str, _Run] = {}
        self._salvaging: asyncio.Task[None] | None = None
        self.on_end: Callable[[RecordingInfo], object] = lambda _: None

    def keep_in(self, data: Path) -> None:
        """Keep recordings in a data directory, and list those that are there."""
        self._folder = folder = data / FOLDER
        for unfinished in folder.glob("*.tmp"):
            unfinished.unlink(missing_ok=True)
        for path in sorted(folder.glob(f"*{form.SUFFIX}")):
            try:
                self._keep(info_of(path))
            except (OSError, form.NotARecording):
                log.exception("%s cannot be read; it is left as it is", path)

    def salvage(self) -> None:
        """Begin to make recordings of what an earlier life of the gateway had on the disk."""
        parts = sorted(self._folder.glob(f"*{PART}")) if self._folder else []
        if parts:
            self._salvaging = asyncio.create_task(self._salvage(parts), name="recordings of an earlier life")

    async def close(self) -> None:
        """Break off all work; the next life makes recordings of what is on the disk."""
        if self._salvaging is not None:
            self._salvaging.cancel()
            await asyncio.gather(self._salvaging, return_exceptions=True)
        await super().close()

    async def _salvage(self, parts: Sequence[Path]) -> None:
        for part in parts:
            try:
                until = _last_write(part)
                await asyncio.to_thread(_cut_to_whole_lines, part)
                manifest = form.Manifest.model_validate_json((part / form.MANIFEST).read_bytes())
                record = _record(part.stem, manifest)
                record.complete, record.until, record.ended_at = False, until, until
                await self._finish(record, part, manifest)
            except (OSError, ValueError):
                log.exception("%s cannot be made a recording, and is removed", part)
                await asyncio.to_thread(shutil.rmtree, part, ignore_errors=True)

    @property
    def folder(self) -> Path:
        """Where they are kept.

        :raises NotFound: nowhere.
        """
        if self._folder is None:
            raise NotFound("This gateway has no data directory, so it keeps no recordings.")
        return self._folder

    def list(self) -> list[RecordingInfo]:
        """All that there are, the newest first."""
        return sorted(self._records.values(), key=lambda record: record.id, reverse=True)

    def start(
        self,
        lines: Sequence[str] | None,
        last_s: float,
        for_s: float,
        *,
        cause: Literal["request", "alarm"] = "request",
        alarm_id: str | None = None,
    ) -> RecordingInfo:
        """Begin to record lines, or all: the last seconds, and those to come.

        :raises NotFound: they cannot be kept.
        """
        now = datetime.now(UTC)
        if self.folder.is_symlink():
            raise NotFound(f"{self.folder} is a link; nothing is recorded there.")
        chosen = (
            self._taken.recorders
            if lines is None
            else {line_id: self._taken.recorders[line_id] for line_id in lines}
        )
        record = RecordingInfo(
            id=f"{now:%Y%m%dT%H%M%S%f}-{hex_digits(4)}",
            cause=cause,
            alarm_id=alarm_id,
            lines=list(chosen),
            whole_plant=len(chosen) == len(self._taken.recorders),
            since=now - timedelta(seconds=last_s),
            started_at=now,
        )
        since_ns = clocks()[1] - int(last_s * 1e9)
        at = {
            form.line_member(line_id): recorder.history.before(since_ns)
            for line_id, recorder in chosen.items()
        }
        at[form.REQUESTS] = self._taken.requests.before(since_ns)
        # The last that was noted of each is what holds at the beginning.
        at[form.STATES] = self._taken.states.before(since_ns - int(STATES_REACH_S * 1e9))
        run = _Run(record, asyncio.get_running_loop().time() + for_s, dict(chosen), at)
        self._runs[record.id] = run
        self.begin(record, self._run(run), "recording")
        return record

    @property
    def takes_alarms(self) -> bool:
        """True if an alarm begins a recording."""
        return bool(self._before_s or self._after_s)

    def note(self, event: Event) -> None:
        """Begin a recording where an alarm is raised, or let the one that another has begun go on."""
        if event.type != "alarm.raised" or self._folder is None:
            return
        loop = asyncio.get_running_loop()
        for run in self._runs.values():
            if run.record.cause == "alarm":
                begun_s = (datetime.now(UTC) - run.record.since).total_seconds()
                if begun_s < LONGEST_AFTER_ALARM_S:
                    run.ends_at = loop.time() + self._after_s
                return
        alarm_id = event.data.get("id")
        self.start(None, self._before_s, self._after_s, cause="alarm", alarm_id=alarm_id)

    async def finish(self, record: RecordingInfo) -> None:
        """End a recording now: what was recorded until now is kept."""
        if (run := self._runs.get(record.id)) is not None:
            run.enough.set()
        await self.wait(record, inf)

    async def remove(self, record: RecordingInfo) -> None:
        """Break a recording off, or delete its file."""
        self.break_off(record)
        await self.wait(record, inf)
        self._records.pop(record.id, None)
        for path in (self.file_of(record), self._part_of(record)):
            await asyncio.to_thread(_delete, path)

    def file_of(self, record: RecordingInfo) -> Path:
        """The file of a recording that is over."""
        return self.folder / f"{record.id}{form.SUFFIX}"

    def _part_of(self, record: RecordingInfo) -> Path:
        return self.folder / f"{record.id}{PART}"

    def cut_off(self, record: RecordingInfo, why: CutOff, /) -> None:
        """Say that it has no file."""
        record.status, record.error = "failed", f"{why.what}."

    async def _run(self, run: _Run) -> None:
        record, part = run.record, self._part_of(run.record)
        manifest = self._manifest(run)
        try:
            await asyncio.to_thread(_begin, part, manifest)
            await self._spool_before(run, part)
            while not run.enough.is_set():
                await self._spool(run, part)
                left_s = run.ends_at - asyncio.get_running_loop().time()
                if left_s <= 0 or await self._is_too_large(part):
                    break
                await happens(run.enough, min(SPOOL_S, left_s))
            record.until = datetime.now(UTC)
            await self._spool(run, part)
            await self._finish(record, part, manifest)
        except OSError as error:
            why = error.strerror or str(error)
            record.status, record.error = "failed", f"The disk has not taken it: {why}. The gateway goes on."
            log.warning("recording %s has failed: %s", record.id, why)
            await asyncio.to_thread(_delete, part)
        finally:
            del self._runs[record.id]
        record.ended_at = datetime.now(UTC)
        self.on_end(record)

    def _manifest(self, run: _Run) -> form.Manifest:
        record, taken = run.record, self._taken
        at_ns, monotonic_ns = clocks()
        reaches: dict[str, datetime] = {}
        for line_id, recorder in run.recorders.items():
            first = recorder.history.first
            if first > 1 and run.at[form.line_member(line_id)] < first:
                oldest = recorder.history.pieces()[0].records()[0]
                reaches[line_id] = TraceEntry.of(oldest).at
        return form.Manifest(
            gateway=VERSION,
            epoch=taken.events.epoch,
            from_=record.since,
            to=datetime.now(UTC),
            clocks=form.Clocks(at=datetime.fromtimestamp(at_ns / 1e9, UTC), monotonic_ns=monotonic_ns),
            lines=record.lines,
            whole_plant=record.whole_plant,
            cause=record.cause,
            alarm_id=record.alarm_id,
            reaches=reaches,
            configuration=dict(taken.configuration(record.lines)),
        )

    async def _is_too_large(self, part: Path) -> bool:
        return await asyncio.to_thread(_size, part) > self._most_bytes

    async def _spool_before(self, run: _Run, part: Path) -> None:
        """Write the last answer to each frame before the recording: a replay needs what was asked then."""
        for line_id, recorder in run.recorders.items():
            exchanges = Exchanges(recorder.opening)
            end = run.at[form.line_member(line_id)]
            for piece in recorder.history.pieces():
                if piece.first <= end:
                    await aside(exchanges.add, piece, end)
            await aside(_append, part / form.before_member(line_id), exchanges.lines())

    async def _spool(self, run: _Run, part: Path) -> None:
        """Write what is new."""
        for line_id, recorder in run.recorders.items():
            await self._append_new(run, part, form.line_member(line_id), recorder.history, _trace_line)
        if run.record.whole_plant:
            await self._append_new(run, part, form.STATES, self._taken.states, _noted_line)
        noted = _noted_line if run.record.whole_plant else partial(self._noted_of, run)
        await self._append_new(run, part, form.REQUESTS, self._taken.requests, noted)

    async def _append_new(
        self, run: _Run, part: Path, member: str, history: History[R], write: Callable[[R], bytes]
    ) -> None:
        pieces = history.pieces(run.at[member])
        for first in range(0, len(pieces), PIECES_AT_ONCE):
            some = pieces[first : first + PIECES_AT_ONCE]
            run.at[member] = await aside(_append_pieces, part / member, some, run.at[member], write)

    def _noted_of(self, run: _Run, noted: Noted) -> bytes:
        """Write a request, if it was about one of the lines."""
        values = json.loads(noted[2])["values"]
        names = [str(values[column]) for column in _TARGETS if column in values]
        is_ours = all(self._taken.line_of(name) in run.recorders for name in names)
        return _noted_line(noted) if is_ours else b""

    async def _finish(self, record: RecordingInfo, part: Path, manifest: form.Manifest) -> None:
        """Add what is kept elsewhere, and make it one file."""
        manifest.to, manifest.complete = record.until or manifest.to, record.complete
        lines = None if record.whole_plant else frozenset(record.lines)
        events = [event async for event in self._events(manifest.from_, manifest.to, lines)]
        await aside(_append, part / form.EVENTS, events, "wb")
        await asyncio.to_thread(self._write_journal, part, manifest, lines)
        await aside(_append, part / form.SAMPLES, self._samples(manifest.from_, lines), "wb")
        await asyncio.to_thread((part / form.MANIFEST).write_bytes, _json_of(manifest))
        await self._make_room(record, await asyncio.to_thread(_size, part))
        target = self.file_of(record)
        packing = form.pack(part, target)
        while await aside(next, packing, packing) is None:
            pass
        record.status, record.bytes = "finished", target.stat().st_size
        self._records.setdefault(record.id, record)
        await self._make_room(record, 0)
        await asyncio.to_thread(_delete, part)

    async def _make_room(self, record: RecordingInfo, more: int) -> None:
        """Delete the oldest recordings beyond the limit: requests never push out recordings of alarms."""
        rivals = [
            rival
            for rival in self.list()
            if rival.cause == record.cause and rival is not record and rival.bytes
        ]
        left = self._most_bytes // 2 - more // 5 - (record.bytes or 0)
        for rival in rivals:
            left -= rival.bytes or 0
            if left < 0:
                await self.remove(rival)

    async def _events(
        self, begin: datetime, end: datetime, lines: frozenset[str] | None
    ) -> AsyncIterator[bytes]:
        hub = self._taken.events
        first = hub.last + 1
        while first > hub.first and _time_of(hub.event(first - 1)) >= begin:
            first -= 1
            if first % EVENTS_AT_ONCE == 0:
                await asyncio.sleep(0)
        for number in range(first, hub.last + 1):
            event = hub.event(number)
            if _time_of(event) <= end and (lines is None or self._taken.line_of(event.subject) in lines):
                yield event.json.encode() + b"\n"
            if number % EVENTS_AT_ONCE == 0:
                await asyncio.sleep(0)

    def _write_journal(self, part: Path, manifest: form.Manifest, lines: frozenset[str] | None) -> None:
        """Write the intents, moves and alarms of the time."""
        values = manifest.from_.timestamp(), manifest.to.timestamp()
        with (part / form.JOURNAL).open("wb") as file:
            for table, (columns, sql) in _JOURNAL.items():
                names = columns.split(", ")
                for row in self._taken.read_journal(sql, values):
                    told = dict(zip(names, row, strict=True))
                    if lines is None or self._taken.line_of(told["target"]) in lines:
                        file.write(form.json_line({"table": table, **told}))

    def _samples(self, begin: datetime, lines: frozenset[str] | None) -> Iterator[bytes]:
        yield _csv_line(form.SAMPLE_COLUMNS)
        for trajectory in self._taken.trajectories():
            move = trajectory.move
            if lines is not None and self._taken.line_of(move.body_id) not in lines:
                continue
            for time_s, place in trajectory.places:
                at = trajectory.time_of(time_s)
                axes = place.items() if isinstance(place, Mapping) else [("", place)]
                for axis, position in axes if at >= begin else ():
                    yield _csv_line((at.isoformat(), move.body_id, move.id, round(time_s, 6), axis, position))


class Exchanges:
    """The last exchange of each frame on a line before a recording, in the order of time."""

    def __init__(self, opening: Sequence[TraceRecord]) -> None:
        self._records: list[TraceRecord] = []
        self._newest: OrderedDict[bytes, list[TraceRecord]] = OrderedDict()
        for record in opening:
            self._add(record)

    def add(self, piece: Piece[TraceRecord], end: int) -> None:
        """Look through records up to a number."""
        for record in piece.records()[: end - piece.first + 1]:
            self._add(record)

    def _add(self, record: TraceRecord) -> None:
        kind, data = record[2:4]
        if kind == "tx":
            self._newest.pop(data, None)
            self._newest[data] = self._records = [record]
            if len(self._newest) > FRAMES_BEFORE:
                self._newest.popitem(last=False)
        elif kind == "rx" and self._records:
            self._records.append(record)

    def lines(self) -> Iterator[bytes]:
        """Write them."""
        return (_trace_line(record) for records in self._newest.values() for record in records)


def _begin(part: Path, manifest: form.Manifest) -> None:
    part.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    for folder in (part, part / "lines", part / "before"):
        folder.mkdir(mode=0o700)
    for line_id in manifest.lines:
        (part / form.line_member(line_id)).touch()
    (part / form.MANIFEST).write_bytes(_json_of(manifest))


def _json_of(manifest: form.Manifest) -> bytes:
    return manifest.model_dump_json(by_alias=True, indent=1).encode()


def _append(path: Path, lines: Iterable[bytes], mode: Literal["ab", "wb"] = "ab") -> None:
    with path.open(mode) as file:
        file.writelines(lines)


def _append_pieces(path: Path, pieces: Sequence[Piece[R]], after: int, write: Callable[[R], bytes]) -> int:
    """Append the records of pieces after a number; gives the number of the last."""
    with path.open("ab") as file:
        for piece in pieces:
            records = piece.records()
            file.writelines(map(write, records[max(after - piece.first + 1, 0) :]))
            after = piece.first + len(records) - 1
    return after


def _trace_line(record: TraceRecord) -> bytes:
    """Write a record as `TraceEntry` has it; the model itself would take four times as long."""
    at_ns, monotonic_ns, kind, data, caller, request_id = record
    asked = "" if caller is None else f',"caller":{_quoted(caller)}'
    if request_id is not None:
        asked += f',"request_id":{json.dumps(request_id, ensure_ascii=False)}'
    return _at(at_ns, monotonic_ns) + f'"kind":"{kind}","data":{_data(data)}{asked}}}\n'.encode()


def _at(at_ns: int, monotonic_ns: int) -> bytes:
    """Begin a line with its time."""
    seconds, micros = divmod(at_ns // 1000, 1_000_000)
    at = f"{_second(seconds)}.{micros:06d}Z" if micros else f"{_second(seconds)}Z"
    return f'{{"at":"{at}","monotonic_ns":{monotonic_ns},'.encode()


@lru_cache(4)
def _second(seconds: int) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")


@lru_cache(64)
def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


@lru_cache(512)
def _data(data: bytes) -> str:
    return json.dumps(escape(data))


def _noted_line(noted: Noted) -> bytes:
    at_ns, monotonic_ns, text = noted
    return _at(at_ns, monotonic_ns) + text[1:].encode() + b"\n"


def _csv_line(cells: Iterable[object]) -> bytes:
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue().encode()


def _time_of(event: Event) -> datetime:
    begin = event.json.index(_TIME) + len(_TIME)
    return datetime.fromisoformat(event.json[begin : event.json.index('"', begin)])


def _delete(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _size(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def info_of(path: Path) -> RecordingInfo:
    """Describe the file of a recording; errors as of `form.Recording`."""
    with form.opened(path) as recording:
        record = _record(path.stem, recording.manifest)
    record.status, record.bytes = "finished", path.stat().st_size
    return record


def _record(record_id: str, manifest: form.Manifest) -> RecordingInfo:
    return RecordingInfo(
        id=record_id,
        cause=manifest.cause,
        alarm_id=manifest.alarm_id,
        lines=manifest.lines,
        whole_plant=manifest.whole_plant,
        since=manifest.from_,
        until=manifest.to,
        complete=manifest.complete,
        request_id=None,
        started_at=manifest.clocks.at,
        ended_at=manifest.to,
    )


def _cut_to_whole_lines(part: Path) -> None:
    for path in part.glob("**/*.jsonl"):
        with path.open("rb+") as file:
            end = file.seek(0, os.SEEK_END)
            begin = file.seek(max(end - LONGEST_LINE, 0))
            file.truncate(begin + file.read().rfind(b"\n") + 1)


def _last_write(part: Path) -> datetime:
    newest = max(file.stat().st_mtime for file in part.rglob("*"))
    return datetime.fromtimestamp(newest, UTC)
