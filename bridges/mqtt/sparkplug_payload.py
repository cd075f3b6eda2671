"""Payloads of Sparkplug B: the few fields of its message that a node that is only read needs, as Protobuf."""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

NAMESPACE: Final = "spBv1.0"
"""First part of each topic."""
Value = bool | int | float | str | None


class DataType(IntEnum):
    """Types of metrics, by their numbers in the specification (chapter 6.4.16).

    No UInt32: what is widely used to read payloads takes it for null.
    """

    INT32 = 3
    INT64 = 4
    DOUBLE = 10
    BOOLEAN = 11
    STRING = 12
    DATE_TIME = 13


@dataclass(frozen=True, slots=True)
class Metric:
    """One value; in births with its name and alias, in data with the alias alone."""

    value: Value
    datatype: DataType
    name: str | None = None
    alias: int | None = None
    timestamp_ms: int = 0


_VARINT, _FIXED_64, _BYTES, _FIXED_32 = 0, 1, 2, 5
_TIMESTAMP, _METRICS, _SEQ = 1, 2, 3
"""Fields of a payload."""
_NAME, _ALIAS, _AT, _DATATYPE, _IS_NULL = 1, 2, 3, 4, 7
_INT, _LONG, _DOUBLE, _BOOLEAN, _STRING = 10, 11, 13, 14, 15
"""Fields of a metric."""
_BITS_32, _BITS_64 = (1 << 32) - 1, (1 << 64) - 1
_LENGTHS: Final = {_FIXED_64: 8, _FIXED_32: 4}


def encode(metrics: Iterable[Metric], timestamp_ms: int, seq: int | None) -> bytes:
    """Write a payload; a death of a node has no sequence number."""
    parts = [_number(_TIMESTAMP, timestamp_ms), *(_field(_METRICS, _metric(metric)) for metric in metrics)]
    if seq is not None:
        parts.append(_number(_SEQ, seq))
    return b"".join(parts)


def commanded(payload: bytes) -> dict[str | int, Value]:
    """Read the metrics of a command: by name, or alias, what is flag; of all others that they are there.

    :raises ValueError: it is no payload.
    """
    found: dict[str | int, Value] = {}
    for field, value in _fields(payload):
        if field == _METRICS and isinstance(value, bytes):
            its = dict(_fields(value))
            name = its.get(_NAME)
            key = name.decode("utf-8", "replace") if isinstance(name, bytes) else its.get(_ALIAS)
            if isinstance(key, str | int):
                found[key] = bool(its[_BOOLEAN]) if _BOOLEAN in its else None
    return found


def _metric(metric: Metric) -> bytes:
    parts: list[bytes] = []
    if metric.name is not None:
        parts.append(_field(_NAME, metric.name.encode()))
    if metric.alias is not None:
        parts.append(_number(_ALIAS, metric.alias))
    parts += [_number(_AT, metric.timestamp_ms), _number(_DATATYPE, metric.datatype)]
    parts.append(_number(_IS_NULL, 1) if metric.value is None else _value(metric.value, metric.datatype))
    return b"".join(parts)


def _value(value: Value, datatype: DataType) -> bytes:
    match datatype:
        case DataType.INT32:
            return _number(_INT, int(value or 0) & _BITS_32)
        case DataType.INT64 | DataType.DATE_TIME:
            return _number(_LONG, int(value or 0) & _BITS_64)
        case DataType.DOUBLE:
            return _varint(_DOUBLE << 3 | _FIXED_64) + struct.pack("<d", value)
        case DataType.BOOLEAN:
            return _number(_BOOLEAN, int(bool(value)))
        case DataType.STRING:
            return _field(_STRING, str(value).encode())


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3 | _VARINT) + _varint(value)


def _field(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | _BYTES) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    written = bytearray()
    while value > 0x7F:
        written.append(value & 0x7F | 0x80)
        value >>= 7
    written.append(value)
    return bytes(written)


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Read a message field by field.

    :raises ValueError: it is none.
    """
    place = 0
    while place < len(data):
        tag, place = _read_varint(data, place)
        kind = tag & 7
        if kind == _VARINT:
            value, place = _read_varint(data, place)
            yield tag >> 3, value
            continue
        if kind == _BYTES:
            length, place = _read_varint(data, place)
        elif kind in _LENGTHS:
            length = _LENGTHS[kind]
        else:
            raise ValueError("it is no message of Protobuf")
        if place + length > len(data):
            raise ValueError("it ends too early")
        yield tag >> 3, data[place : place + length]
        place += length


def _read_varint(data: bytes, place: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if place >= len(data):
            raise ValueError("it ends too early")
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, place
    raise ValueError("a number is too long")
