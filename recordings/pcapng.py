"""Recordings as pcapng: every record of every line, for Wireshark (draft-ietf-opsawg-pcapng).

A line is an interface of link type USER0; a record is a packet with its direction, and the request behind it
as its comment. An event of the port (opened, lost, closed) is a packet without bytes, with that word as its
comment.
"""

import heapq
import struct
from collections.abc import Iterable, Iterator
from typing import BinaryIO, Final

from recordings.form import Recording, families_of, line_member
from transports.trace import TraceEntry, wall_ns

USER0: Final = 147
_SECTION, _INTERFACE, _PACKET = 0x0A0D0D0A, 1, 6
_END, _COMMENT, _NAME, _DESCRIPTION, _FLAGS, _RESOLUTION = 0, 1, 2, 3, 2, 9
_APPLICATION: Final = 4
_DIRECTIONS: Final = {"rx": 1, "tx": 2}
_NANOSECONDS: Final = 9


def write(recording: Recording, file: BinaryIO) -> int:
    """Write all lines of a recording in the order of time; gives how many records there were.

    :raises NotARecording: a record cannot be read.
    :raises OSError: the file cannot be written.
    """
    manifest = recording.manifest
    file.write(_section(f"motion-gateway {manifest.gateway}"))
    families = families_of(manifest.configuration)
    file.writelines(_interface(line_id, families.get(line_id, "")) for line_id in manifest.lines)
    count = 0
    for _, interface, entry in heapq.merge(*_of_lines(recording, manifest.lines)):
        file.write(_packet(interface, entry))
        count += 1
    return count


class _Timed(tuple[int, int, TraceEntry]):
    """A record in the order of time: of a line, records stay in their order."""

    __slots__ = ()

    def __lt__(self, other: object) -> bool:
        return isinstance(other, _Timed) and self[:2] < other[:2]


def _of_lines(recording: Recording, lines: Iterable[str]) -> list[Iterator[_Timed]]:
    return [_of_line(recording, number, line_id) for number, line_id in enumerate(lines)]


def _of_line(recording: Recording, interface: int, line_id: str) -> Iterator[_Timed]:
    for _, entry in recording.entries(line_member(line_id)):
        yield _Timed((entry.monotonic_ns, interface, entry))


def _section(application: str) -> bytes:
    head = struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)
    return _block(_SECTION, head + _options((_APPLICATION, application.encode())))


def _interface(name: str, family: str) -> bytes:
    options = _options(
        (_NAME, name.encode()), (_DESCRIPTION, family.encode()), (_RESOLUTION, bytes([_NANOSECONDS]))
    )
    return _block(_INTERFACE, struct.pack("<HHI", USER0, 0, 0) + options)


def _packet(interface: int, entry: TraceEntry) -> bytes:
    at, data = wall_ns(entry.at), entry.data
    direction = _DIRECTIONS.get(entry.kind)
    head = struct.pack("<IIIII", interface, at >> 32, at & 0xFFFFFFFF, len(data), len(data))
    comment = entry.request_id if direction else entry.kind
    options = _options(
        *([(_COMMENT, comment.encode())] if comment else ()),
        *([(_FLAGS, struct.pack("<I", direction))] if direction else ()),
    )
    return _block(_PACKET, head + _padded(data) + options)


def _options(*options: tuple[int, bytes]) -> bytes:
    written = b"".join(struct.pack("<HH", code, len(value)) + _padded(value) for code, value in options)
    return written + struct.pack("<HH", _END, 0) if options else b""


def _block(kind: int, content: bytes) -> bytes:
    length = len(content) + 12
    return struct.pack("<II", kind, length) + content + struct.pack("<I", length)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)
