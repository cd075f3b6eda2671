"""A gateway's API as far as a bridge asks it: 120 bodies, whose positions all change ten times a second."""

import asyncio
import json
import sys
from datetime import UTC, datetime
from typing import Any, Final

LINES: Final = 4
BODIES: Final = 30
CHANGES_PER_S: Final = 10
KEEP_ALIVE_S: Final = 10.0


def addresses() -> list[str]:
    """Give the addresses of all bodies."""
    return [f"line{line}.{body:02X}" for line in range(1, LINES + 1) for body in range(BODIES)]


def _now() -> str:
    return datetime.now(UTC).isoformat().replace("+00:00", "Z")


def _line(name: str) -> dict[str, Any]:
    bodies = [address for address in addresses() if address.startswith(f"{name}.")]
    return {"line_id": name, "state": "ready", "protocol": "rorze", "bodies": bodies}


def _body(address: str) -> dict[str, Any]:
    now = _now()
    return {
        "body_id": address,
        "line_id": address.partition(".")[0],
        "name": "",
        "online": True,
        "last_heard_at": now,
        "known_age_s": 0.0,
        "moving": False,
        "move_id": None,
        "homed": "yes",
        "power_cycled": False,
        "unit": None,
        "pulses_per_unit": None,
        "position": 0,
        "position_read_at": now,
    }


def _answer(path: str) -> dict[str, Any]:
    if path.startswith("/bodies/") and path.endswith("get-soft-limits"):
        return {"lower": -1_000_000, "upper": 1_000_000}
    if path.startswith("/bodies/"):
        return _body(path.removeprefix("/bodies/"))
    names = [f"line{number}" for number in range(1, LINES + 1)]
    identity: dict[str, Any] = {"name": "everybody", "role": "admin", "rights": [], "scope": None}
    answers: dict[str, dict[str, Any]] = {
        "/lines": {"lines": [_line(name) for name in names]},
        "/robots": {"robots": []},
        "/scaras": {"scaras": []},
        "/alarms": {"alarms": []},
        "/leases": {"leases": []},
        "/system/identity": identity,
    }
    return answers[path]


async def _serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    try:
        while head := await reader.readuntil(b"\r\n\r\n"):
            await _serve_one(head.decode("latin-1"), reader, writer)
    except (OSError, asyncio.IncompleteReadError):
        pass
    finally:
        writer.close()


async def _serve_one(head: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    target = head.split(" ", 2)[1]
    lengths = [
        line.split(":")[1] for line in head.split("\r\n") if line.lower().startswith("content-length:")
    ]
    if lengths:
        await reader.readexactly(int(lengths[0]))
    path, _, query = target.partition("?")
    if path == "/events/stream":
        writer.write(
            b"HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n\r\n: ok\n\n"
        )
        await (_stream(writer) if "sample=" in query else _silence(writer))
        return
    body = json.dumps(_answer(path)).encode()
    start = f"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
    writer.write(start.encode() + body)
    await writer.drain()


async def _silence(writer: asyncio.StreamWriter) -> None:
    while True:
        await asyncio.sleep(KEEP_ALIVE_S)
        writer.write(b": still here\n\n")
        await writer.drain()


async def _stream(writer: asyncio.StreamWriter) -> None:
    clock = asyncio.get_running_loop().time
    count, next_at = 0, clock()
    while True:
        count += 1
        writer.write("".join(_event(address, count) for address in addresses()).encode())
        await writer.drain()
        next_at += 1 / CHANGES_PER_S
        await asyncio.sleep(max(next_at - clock(), 0))


def _event(address: str, count: int) -> str:
    now = _now()
    data = {"pulses": count, "counted_in": "pulses", "value": None, "unit": None}
    event = {
        "specversion": "1.0",
        "id": f"{address}-{count}",
        "type": "body.position",
        "subject": f"/bodies/{address}",
        "time": now,
        "cursor": f"e-{count}",
        "data": data,
    }
    return f"id: e-{count}\nevent: body.position\ndata: {json.dumps(event)}\n\n"


async def main(port: int) -> None:
    """Serve until it is ended."""
    async with await asyncio.start_server(_serve, "127.0.0.1", port) as server:
        await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
