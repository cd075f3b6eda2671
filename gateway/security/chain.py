"""The security log as files: lines of JSON, each with the hash of the line before.

A line that was changed, taken out or moved breaks the chain there. Lines that were cut off at the end are
missed by the file `head`, which names the last; who can write here can forge both, and the whole chain. Only
a copy elsewhere, or a head that was written down, shows that.
"""

import fcntl
import json
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, NamedTuple

from gateway.security.entries import LOG_CHANGED, LOG_MENDED, LOG_PRUNED, Entry

FOLDER: Final = "security"
FILE_BYTES: Final = 1 << 20
"""A file that is longer is followed by another."""
LONGEST_LINE: Final = 32_768
"""Longest line of an entry, in bytes."""
ZEROS: Final = "0" * 64
_HEAD: Final = "head"
_LOCK: Final = "lock"
_LINE: Final = re.compile(rb'(\{.*),"hash":"([0-9a-f]{64})"\}')

Draft = Mapping[str, Any]
"""An entry without its number and its hashes."""


class Head(NamedTuple):
    """The last entry: who has written it down can see later that nothing before it was changed."""

    number: int
    hash: str

    def __str__(self) -> str:
        return f"{self.number}:{self.hash}"


class ChainVerdict(NamedTuple):
    """The result of checking a chain."""

    head: Head
    """Last entry of the chain."""
    first: int
    """The number of its first entry; 0 where there is none."""
    fault: str | None
    """The first entry that does not hold, and why; None where all do."""
    torn: bool
    """True if the last line was cut off while it was written: the next start takes it off."""


class Chain:
    """The files in a data directory. Processes that write take turns; methods may wait for the disk."""

    def __init__(self, data: Path) -> None:
        self.folder = data / FOLDER
        self._head: Head | None = None
        self._seen: tuple[object, ...] = ()

    def append(self, drafts: Sequence[Draft]) -> list[str]:
        """Write entries so that a loss of power does not take them; gives their lines.

        :raises OSError: nothing of them was written.
        """
        with _turn(self.folder, fcntl.LOCK_EX):
            file, found = self._look()
            head, lines = self._head or Head(0, ZEROS), []
            for draft in (*found, *drafts):
                head, line = _line_after(head, draft)
                lines.append(line)
            if not file.name or _size_of(file) > FILE_BYTES:
                file = self.folder / f"entries-{head.number - len(lines) + 1:012}.jsonl"
            _write(file, "".join(lines).encode("ascii"))
            self._head, self._seen = head, _state_of(file)
            _note_head(self.folder, head)
            return lines

    def forget(self, before: datetime) -> Draft | None:
        """Take away the oldest file, if all its entries are older, and say so first; gives that entry.

        :raises OSError: nothing was taken away.
        """
        oldest, *later = _files(self.folder) or [Path()]
        if not later:
            return None
        last = next(_entries_of(oldest.read_bytes()), None)
        if last is None or last.time >= before:
            return None
        told = draft(LOG_PRUNED.name, data={"through": last.number, "hash": last.hash})
        self.append([told])
        oldest.unlink()
        return told

    def _look(self) -> tuple[Path, list[Draft]]:
        """Find the last file and the last entry, and say what is wrong with them."""
        files = _files(self.folder)
        file = files[-1] if files else Path()
        if self._head is not None and files and self._seen == _state_of(file):
            return file, []
        found = _mended(file) if files else []
        last = _last_of(files)
        kept = max(
            head for head in (self._head, _noted_head(self.folder), Head(0, ZEROS)) if head is not None
        )
        if last.number < kept.number or (last.number == kept.number and last.hash != kept.hash):
            why = f"The log ends with entry {last.number}, and {kept.number} was written as {kept.hash}."
            found.append(draft(LOG_CHANGED.name, data={"why": why}))
            last = kept
        self._head = last
        return file, found


def draft(
    type_: str,
    target: str = "",
    *,
    caller: str | None = "gateway",
    address: str | None = None,
    request_id: str | None = None,
    count: int = 1,
    since: datetime | None = None,
    data: Mapping[str, Any] | None = None,
) -> Draft:
    """Write down what happens now, to be put into the chain."""
    return {
        "time": _in_iso(datetime.now(UTC)),
        "type": type_,
        "caller": caller,
        "address": address,
        "request_id": request_id,
        "target": target,
        "count": count,
        "since": since and _in_iso(since),
        "data": data or {},
    }


def verify(data: Path, head: str | None = None) -> ChainVerdict:
    """Follow the chain from its first entry to its last, and look for one that was written down as a head.

    :raises FileNotFoundError: there is no log.
    :raises OSError: it cannot be read.
    """
    folder = data / FOLDER
    if not folder.is_dir():
        raise FileNotFoundError(f"There is no security log in {data}.")
    with _turn(folder, fcntl.LOCK_SH):
        return _Verification(head).of(folder)


def content(data: Path) -> dict[str, bytes]:
    """Read all files of a chain at one moment, by their names; none where there is no log.

    :raises OSError: one cannot be read.
    """
    folder = data / FOLDER
    if not folder.is_dir():
        return {}
    with _turn(folder, fcntl.LOCK_SH):
        return {file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.name != _LOCK}


def newest(data: Path, limit: int, before: int | None = None) -> list[Entry]:
    """Read up to `limit` entries before a number, the newest first; leave out lines that are none."""
    found: list[Entry] = []
    for file in reversed(_files(data / FOLDER)):
        with suppress(FileNotFoundError):  # it was old enough
            for entry in _entries_of(file.read_bytes()):
                if before is None or entry.number < before:
                    found.append(entry)
                if len(found) == limit:
                    return found
    return found


class _Verification:
    """One walk along a chain."""

    def __init__(self, known: str | None) -> None:
        self._head = Head(0, ZEROS)
        self._known, self._has_known = known, known is None
        self._first: Entry | None = None
        self._forgotten = {Head(0, ZEROS)}
        """The entries after which a chain may begin: those that it says were forgotten."""

    def of(self, folder: Path) -> ChainVerdict:
        files, torn = _files(folder), False
        fault: str | None = None
        for file in files:
            *lines, rest = file.read_bytes().split(b"\n")
            for number, line in enumerate(lines, 1):
                fault = fault or self._fault_of(line, f"{file.name}, line {number}")
            torn = bool(rest) and file == files[-1]
            if rest and not torn:
                fault = fault or f"{file.name}: its last line is cut off, and another file follows."
        return ChainVerdict(
            self._head,
            self._first.number if self._first else 0,
            fault or self._fault_of_beginning() or self._fault_of_end(folder),
            torn,
        )

    def _fault_of(self, line: bytes, place: str) -> str | None:
        entry = _entry_of(line)
        if entry is None:
            return f"{place}: it is no entry."
        named = f"Entry {entry.number} ({place})"
        if sha256(_LINE.fullmatch(line)[1]).hexdigest() != entry.hash:  # type: ignore[index]  # an entry is one
            return f"{named} was changed: its hash is another."
        if self._first is None:
            self._first = entry
        elif entry.number != self._head.number + 1:
            return f"{named} comes after {self._head.number}: entries are missing, or were moved."
        elif entry.previous != self._head.hash:
            return f"{named} does not follow {self._head.number}, whose hash is another."
        if entry.type == LOG_PRUNED.name:
            self._forgotten.add(Head(entry.data.get("through", 0), entry.data.get("hash", "")))
        self._head = Head(entry.number, entry.hash)
        self._has_known = self._has_known or str(self._head) == self._known
        return None

    def _fault_of_beginning(self) -> str | None:
        first = self._first
        if first is None or Head(first.number - 1, first.previous) in self._forgotten:
            return None
        return f"Entry {first.number} is the first, and no entry says that those before it were forgotten."

    def _fault_of_end(self, folder: Path) -> str | None:
        if not self._has_known:
            return f"No entry is {self._known}: it was cut off, forged or forgotten."
        noted = _noted_head(folder)
        if noted is None or noted.number < self._head.number or noted == self._head:
            return None
        return f"Entry {self._head.number} is the last, and {noted.number} was written as {noted.hash}."


def _line_after(head: Head, draft_: Draft) -> tuple[Head, str]:
    told = {"number": head.number + 1, **draft_, "previous": head.hash}
    text = json.dumps(told, separators=(",", ":"))[:-1]
    digest = sha256(text.encode("ascii")).hexdigest()
    return Head(head.number + 1, digest), f'{text},"hash":"{digest}"}}\n'


def _entry_of(line: bytes) -> Entry | None:
    if _LINE.fullmatch(line) is None:
        return None
    try:
        return Entry.model_validate_json(line)
    except ValueError:
        return None


def _entries_of(text: bytes) -> Iterator[Entry]:
    """Entries of a file, the newest first."""
    for line in reversed(text.split(b"\n")[:-1]):
        entry = _entry_of(line)
        if entry is not None:
            yield entry


def _last_of(files: Sequence[Path]) -> Head:
    for file in reversed(files):
        for entry in _entries_of(file.read_bytes()):
            return Head(entry.number, entry.hash)
    return Head(0, ZEROS)


def _mended(file: Path) -> list[Draft]:
    """Take off a last line that was not written to its end, and say what it was."""
    with file.open("r+b") as opened:
        text = opened.read()
        end = text.rfind(b"\n") + 1
        if end == len(text):
            return []
        opened.truncate(end)
        os.fsync(opened.fileno())
    torn = text[end : end + LONGEST_LINE // 8].decode("ascii", "backslashreplace")
    return [draft(LOG_MENDED.name, data={"text": torn})]


def _write(file: Path, text: bytes) -> None:
    """Write all of it or nothing."""
    is_new = not file.exists()
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
    descriptor = os.open(file, flags, 0o600)
    try:
        _give_to_owner(descriptor, file.parent)
        before = os.fstat(descriptor).st_size
        try:
            written = 0
            while written < len(text):
                written += os.write(descriptor, text[written:])
            os.fsync(descriptor)
        except OSError:
            with suppress(OSError):
                os.ftruncate(descriptor, before)
            raise
    finally:
        os.close(descriptor)
    if is_new:
        _synchronise(file.parent)


def _synchronise(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _note_head(folder: Path, head: Head) -> None:
    """Name the last entry, after it is on the disk: it may be behind after a loss of power, never ahead."""
    with suppress(OSError):
        descriptor = os.open(folder / _HEAD, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        try:
            _give_to_owner(descriptor, folder)
            os.pwrite(descriptor, f"{head.number:020} {head.hash}\n".encode(), 0)
        finally:
            os.close(descriptor)


def _noted_head(folder: Path) -> Head | None:
    try:
        number, digest = (folder / _HEAD).read_text("ascii").split()
        return Head(int(number), digest)
    except (OSError, ValueError):
        return None


def _files(folder: Path) -> list[Path]:
    """In the order in which they were begun."""
    return sorted(path for path in folder.glob("entries-*.jsonl") if stat.S_ISREG(path.lstat().st_mode))


def _state_of(file: Path) -> tuple[object, ...]:
    found = file.stat()
    return file.name, found.st_ino, found.st_size, found.st_mtime_ns


def _size_of(file: Path) -> int:
    return file.stat().st_size


@contextmanager
def _turn(folder: Path, how: int) -> Iterator[None]:
    """Wait for the turn of this process; where no file can be made for it, only readers go on."""
    reads = how == fcntl.LOCK_SH
    if not reads:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.geteuid() == 0:
            owner = folder.parent.stat()
            os.chown(folder, owner.st_uid, owner.st_gid)
    flags = os.O_RDONLY if reads else os.O_RDWR | os.O_CREAT
    try:
        lock = os.open(folder / _LOCK, flags | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    except OSError:
        if not reads:
            raise
        yield
        return
    try:
        if not reads:
            _give_to_owner(lock, folder)
        fcntl.flock(lock, how)
        yield
    finally:
        os.close(lock)


def _give_to_owner(descriptor: int, folder: Path) -> None:
    """Let the gateway write what root has made."""
    if os.geteuid() == 0:
        owner = folder.stat()
        os.fchown(descriptor, owner.st_uid, owner.st_gid)


def _in_iso(at: datetime) -> str:
    return at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
