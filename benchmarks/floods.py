"""Floods, one a name, that one client pours on a gateway: `python -m benchmarks.floods PORT KEYS`.

KEYS are those of a viewer, an operator and an administrator as a JSON object by their roles. A name on a
line of its input begins that flood in the place of the last one, an empty line none; it prints how the last
one was answered.
"""

import asyncio
import json
import re
import sys
from base64 import b64encode
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import suppress
from itertools import count
from os import nice
from typing import Any, Final

import uvloop

BLOCK_BYTES: Final = 262_144
PAUSE_S: Final = 0.05
"""Seconds between the bytes of a slow client, and between attempts to sign in that are refused."""
HOLDERS: Final = 40
"""Connections that are kept open, or opened again, at once."""
ASKERS: Final = 8

HEAD_BYTES: Final = 1024
VERSION: Final = b"HTTP/1.1 "
CLOSE: Final = re.compile(rb"\x88[\x02-\x7d](\x03[\xe8-\xff])", re.DOTALL)
"""A frame that closes a WebSocket, with its code."""

Keys = Mapping[str, str]
Told = Counter[int]
"""Number of answers by status, and of closed WebSockets by code."""
Flood = Callable[[int, Keys, Told], Awaitable[None]]

_VIEWER, _OPERATOR, _ADMIN, _STRANGER = "viewer", "operator", "admin", ""
_BODY: Final = "/bodies/01"
_MASK: Final = b"\x80\0\0\0\0"
"""An empty masked payload."""
_DEEP: Final = b"[" * 100_000
_WIDE: Final = b"[" + b",".join([b'{"a":1}'] * 8_000) + b"]"
_MOVE: Final = {"kind": "relative", "direction": "cw", "distance": {"value": 5, "unit": "pulse"}}
_PROGRAM: Final = "1+M500 ; to the right\n" * 11_000
_BAD_PROGRAM: Final = "1+Q500 ; what is that\n" * 11_000
_POSITIONS: Final = json.dumps(
    {"positions": [{"number": number, "pulses": number} for number in (*range(2_047), 9_999)]}
).encode()
_TABLE: Final = "number,position\n" + "".join(f"{number % 900},{number}\n" for number in range(5_000))


# what is said


def _head(method: str, path: str, *headers: str) -> bytes:
    return "\r\n".join([f"{method} {path} HTTP/1.1", "Host: 127.0.0.1", *headers, "", ""]).encode()


def _signed(keys: Keys, role: str) -> list[str]:
    return [f"Authorization: Bearer {keys[role]}"] if role else []


def _request(
    keys: Keys, role: str, method: str, path: str, content: bytes = b"", *headers: str, kind: str = "json"
) -> bytes:
    media = "text/" if kind in ("plain", "csv") else "application/"
    told = [f"Content-Type: {media}{kind}", f"Content-Length: {len(content)}"] if content else []
    return _head(method, path, *_signed(keys, role), *told, *headers) + content


def _handshake(keys: Keys, path: str = "/events") -> bytes:
    return _head(
        *("GET", path, *_signed(keys, _VIEWER), "Connection: Upgrade", "Upgrade: websocket"),
        *("Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: " + b64encode(bytes(16)).decode()),
    )


# how it is said


def poured(
    opening: Callable[[Keys], bytes], repeated: bytes, connections: int = 1, first: bytes | None = None
) -> Flood:
    """Say an opening, and then the same without a pause; begin again where the connection ends.

    `first` is said when the opening was answered; without it that is not waited for.
    """
    block = repeated * max(1, BLOCK_BYTES // len(repeated))

    async def flood(port: int, keys: Keys, told: Told) -> None:
        async def one() -> None:
            async with _Connection(port, told) as connection:
                connection.say(opening(keys))
                if first is not None:
                    await connection.answered.wait()
                    connection.say(first)
                while True:
                    connection.say(block)
                    await connection.drain()

        await _again_and_again(one, connections)

    return flood


def asked(requests: Callable[[Keys], Iterator[bytes]], connections: int = ASKERS) -> Flood:
    """Ask one thing after the other, each when the one before is answered."""

    async def flood(port: int, keys: Keys, told: Told) -> None:
        asking = requests(keys)

        async def one() -> None:
            async with _Connection(port, told, reads=False) as connection:
                for request in asking:
                    connection.say(request)
                    await connection.answer()

        await _again_and_again(one, connections)

    return flood


def opened(opening: Callable[[Keys], bytes], *, reads: bool = True, connections: int = HOLDERS) -> Flood:
    """Hold connections open, and say a byte more now and then."""

    async def flood(port: int, keys: Keys, told: Told) -> None:
        async def one() -> None:
            async with _Connection(port, told, reads=reads) as connection:
                connection.say(opening(keys))
                while True:
                    await asyncio.sleep(PAUSE_S)
                    connection.say(b"x")
                    await connection.drain()

        await _again_and_again(one, connections)

    return flood


def left(opening: Callable[[Keys], bytes], *, half: bool = False, connections: int = HOLDERS) -> Flood:
    """Come, say something and leave, with the whole connection or with half of it."""

    async def flood(port: int, keys: Keys, told: Told) -> None:
        async def one() -> None:
            async with _Connection(port, told, reads=half) as connection:
                connection.say(opening(keys))
                if half:
                    connection.writer.write_eof()
                    await asyncio.sleep(PAUSE_S)
                elif opening(keys):
                    connection.note(await connection.reader.read(HEAD_BYTES))

        await _again_and_again(one, connections)

    return flood


class _Connection:
    """A connection whose answers are counted by their status and thrown away, or not even read."""

    def __init__(self, port: int, told: Told, *, reads: bool = True) -> None:
        self._port, self._told, self._reads = port, told, reads
        self.answered = asyncio.Event()
        """Something was said in answer, or the connection has ended; set where answers are thrown away."""

    async def __aenter__(self) -> "_Connection":
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self._port, limit=2**22)
        self._reading = asyncio.create_task(self._read_away()) if self._reads else None
        return self

    async def __aexit__(self, *_: object) -> None:
        if self._reading is not None:
            self._reading.cancel()
        self.writer.transport.abort()

    def say(self, data: bytes) -> None:
        self.writer.write(data)

    async def drain(self) -> None:
        """Wait until most is sent.

        :raises ConnectionError: the gateway has ended it.
        """
        if self.writer.is_closing() or (self._reading is not None and self._reading.done()):
            raise ConnectionError
        await self.writer.drain()
        await asyncio.sleep(0)

    async def answer(self) -> None:
        head = (await self.reader.readuntil(b"\r\n\r\n")).lower()
        self.note(head)
        length = head.partition(b"content-length:")[2].partition(b"\r")[0]
        await self.reader.readexactly(int(length or 0))
        if b"connection: close" in head:
            raise ConnectionError

    def note(self, answer: bytes) -> None:
        """Count an answer by its status."""
        if answer:
            self._told[int(answer[len(VERSION) :].split(b" ", 2)[0])] += 1

    async def _read_away(self) -> None:
        """Count the first answer, and the code with which a WebSocket is closed."""
        try:
            last = await self.reader.read(HEAD_BYTES)
        finally:
            self.answered.set()
        self.note(last)
        with suppress(OSError):
            while data := await self.reader.read(BLOCK_BYTES):
                last = last[-HEAD_BYTES:] + data
        if closed := CLOSE.search(last):
            self._told[int.from_bytes(closed[1])] += 1


async def _again_and_again(one: Callable[[], Awaitable[None]], connections: int) -> None:
    async def for_ever() -> None:
        while True:
            with suppress(OSError, EOFError):
                await one()
            await asyncio.sleep(0)

    await asyncio.gather(*(for_ever() for _ in range(connections)))


def _same(role: str, method: str, path: str, content: bytes = b"", *headers: str, kind: str = "json") -> Any:
    """One request for ever."""

    def requests(keys: Keys) -> Iterator[bytes]:
        while True:
            yield _request(keys, role, method, path, content, *headers, kind=kind)

    return requests


def _keyed(content: bytes, role: str = _VIEWER) -> Any:
    """Requests with an Idempotency-Key each."""

    def requests(keys: Keys) -> Iterator[bytes]:
        for number in count():
            yield _request(
                keys, role, "POST", f"{_BODY}/moves", content, f"Idempotency-Key: {id(requests)}-{number}"
            )

    return requests


def _socket(repeated: bytes, first: bytes | None = b"") -> Flood:
    return poured(_handshake, repeated, 4, first)


def _said(data: bytes) -> Callable[[Keys], bytes]:
    return lambda _: data


def _chunked(keys: Keys) -> bytes:
    return _head(
        *("PUT", f"{_BODY}/positions", *_signed(keys, _ADMIN), "Content-Type: application/json"),
        "Transfer-Encoding: chunked",
    )


_LONG: Final = b"x" * 60_000

FLOODS: Final[Mapping[str, Flood]] = {
    # HTTP as nobody speaks it
    "connect": left(_said(_head("CONNECT", "/x")), half=True),
    "connect-held": opened(_said(_head("CONNECT", "/x"))),
    "upgrade-to-nonsense": asked(
        _same(_STRANGER, "GET", "/livez", b"", "Connection: Upgrade", "Upgrade: h2c")
    ),
    "pipelined-gets": poured(_said(b""), _head("GET", "/livez"), 8),
    "pipelined-refusals": poured(_said(b""), _head("GET", "/bodies"), 8),
    "empty-lines": poured(_said(b""), b"\r\n", 8),
    "slow-heads": opened(_said(b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")),
    "endless-heads": poured(_said(b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nX: "), b"x", 8),
    "many-headers": poured(_said(b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\n"), b"a:\r\n", 8),
    "chunks-of-a-byte": poured(_chunked, b"1\r\n \r\n", 8),
    "trailers": poured(lambda keys: _chunked(keys) + b"2\r\n{}\r\n0\r\n", b"a: b\r\n", 8),
    "long-queries": asked(_same(_STRANGER, "GET", "/livez?" + "a=b&" * 25_000)),
    "tls-on-the-plain-port": left(_said(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(500))),
    "rubbish": poured(_said(b""), b"\xff\x00\x80rubbish", 8),
    # connections
    "connects-and-leaves": left(_said(b"")),
    "half-closed": left(_said(_head("GET", "/livez")), half=True),
    "not-reading": opened(lambda keys: _request(keys, _VIEWER, "GET", "/docs/all") * 60, reads=False),
    # WebSockets, all of them with a viewer's key
    "pongs": _socket(b"\x8a" + _MASK),
    "pings": _socket(b"\x89" + _MASK),
    "empty-texts": _socket(b"\x81" + _MASK),
    "empty-continuations": _socket(b"\x00" + _MASK, b"\x01" + _MASK),
    "texts-of-a-byte": _socket(b"\x81\x81\0\0\0\0x"),
    "huge-frames": _socket(b"\x82\xfe\xea\x60\0\0\0\0" + _LONG),
    "frames-without-an-end": _socket(b"\x82\xff\0\0\0\1\0\0\0\0\0\0\0\0" + _LONG),
    "frames-ahead-of-the-answer": _socket(b"\x89" + _MASK, None),
    "socket-openers": left(_handshake),
    "stream-openers": left(lambda keys: _request(keys, _VIEWER, "GET", "/events/stream")),
    "trace-followers": poured(
        lambda keys: _handshake(keys, "/lines/line1/trace/stream?last=10000"), b"\x8a" + _MASK, 2, b""
    ),
    # bodies
    "keyed-json-of-a-viewer": asked(_keyed(b"[" + b"1," * 125_000 + b"1]")),
    "keyed-nesting-of-a-viewer": asked(_keyed(_DEEP)),
    "keyed-nesting": asked(_keyed(_DEEP, _OPERATOR)),
    "keyed-wide-json": asked(_keyed(_WIDE[:250_000], _OPERATOR)),
    "idempotency-keys": asked(_keyed(json.dumps(_MOVE | {"speed": "none"}).encode(), _OPERATOR)),
    "bad-json": asked(_same(_OPERATOR, "POST", f"{_BODY}/moves", b'{"kind":' + b'"x",' * 16_000)),
    "nested-json": asked(_same(_OPERATOR, "POST", f"{_BODY}/moves", _DEEP[:65_000])),
    "wide-json": asked(_same(_ADMIN, "PUT", f"{_BODY}/positions", b'{"positions":' + _WIDE + b"}")),
    "whole-tables": asked(_same(_ADMIN, "PUT", f"{_BODY}/positions", _POSITIONS)),
    "big-numbers": asked(
        _same(_OPERATOR, "POST", f"{_BODY}/moves", b"[" + b"9" * 900 + b"," + b"9" * 60_000)
    ),
    "long-texts": asked(
        _same(_OPERATOR, "POST", f"{_BODY}/moves", b'{"kind":"' + b"\xc3\xa9" * 30_000 + b'"}')
    ),
    "csv": asked(_same(_ADMIN, "PUT", f"{_BODY}/positions.csv", _TABLE.encode(), kind="csv")),
    "good-program": asked(_same(_ADMIN, "PUT", "/bodies/01/program", _PROGRAM.encode(), kind="plain")),
    "bad-program": asked(_same(_ADMIN, "PUT", "/bodies/01/program", _BAD_PROGRAM.encode(), kind="plain")),
    "bad-backup": asked(
        _same(_ADMIN, "POST", "/bodies/01/comparisons", json.dumps({"backup": "what=1\n" * 8_000}).encode())
    ),
    # questions
    "traces": asked(_same(_VIEWER, "GET", "/lines/line1/trace?limit=10000")),
    "filtered-traces": asked(_same(_VIEWER, "GET", "/lines/line1/trace?limit=10000&bodies=01")),
    "event-lists": asked(_same(_VIEWER, "GET", "/events?limit=1000")),
    "documents": asked(_same(_VIEWER, "GET", "/openapi.json", b"", "Accept-Encoding: gzip")),
    "metrics": asked(_same(_VIEWER, "GET", "/metrics")),
    "audits": asked(_same(_VIEWER, "GET", "/audit?limit=1000")),
    "plans": asked(
        _same(_OPERATOR, "POST", f"{_BODY}/moves", json.dumps(_MOVE | {"validate_only": True}).encode())
    ),
    "not-there": asked(_same(_VIEWER, "GET", "/nothing/here/at/all")),
    "no-key": asked(_same(_STRANGER, "GET", "/bodies")),
    "wrong-keys": asked(
        _same(_STRANGER, "GET", "/bodies", b"", "Authorization: Bearer mg_aaaaaaaaaaaa_" + "b" * 43)
    ),
    "sign-ins": asked(
        _same(_STRANGER, "POST", "/sign-in", b"key=mg_aaaaaaaaaaaa_bbbb", kind="x-www-form-urlencoded")
    ),
    "options": asked(_same(_STRANGER, "OPTIONS", "/bodies")),
}


async def main(port: int, keys: Keys) -> None:
    """Pour what is asked for until there is nothing more to ask; tell how the one before was answered."""
    loop = asyncio.get_running_loop()
    asking = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(asking), sys.stdin)
    flood: asyncio.Task[None] | None = None
    told: Told = Counter()
    while name := await asking.readline():
        if flood is not None:
            flood.cancel()
            await asyncio.gather(flood, return_exceptions=True)
        print(json.dumps(told), flush=True)
        wanted, told = name.decode().strip(), Counter()
        flood = asyncio.create_task(_pour(wanted, port, keys, told)) if wanted else None


async def _pour(name: str, port: int, keys: Keys, told: Told) -> None:
    await FLOODS[name](port, keys, told)


if __name__ == "__main__":
    nice(5)
    uvloop.run(main(int(sys.argv[1]), json.loads(sys.argv[2])))
