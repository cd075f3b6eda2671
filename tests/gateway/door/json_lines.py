"""A second front end, as small as one can be: requests as lines of JSON over a Unix socket."""

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from gateway.core.errors import GatewayError
from gateway.door import Door


@asynccontextmanager
async def serving(door: Door, path: Path) -> AsyncIterator[None]:
    """Serve a door at a socket."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async for line in reader:
            writer.write(json.dumps(await _answer(door, json.loads(line))).encode() + b"\n")
            await writer.drain()
        writer.close()

    server = await asyncio.start_unix_server(serve, path)
    async with server:
        yield


async def _answer(door: Door, asked: dict[str, Any]) -> dict[str, Any]:
    try:
        told = await door.call(asked["name"], asked.get("arguments"), asked.get("request"), asked.get("key"))
    except GatewayError as error:
        return {"error": error.kind, "detail": error.detail, "moved": error.moved}
    return {"result": told}


class Client:
    """Asks over the socket."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    async def ask(self, name: str, **asked: Any) -> dict[str, Any]:
        """Ask for an operation, with `arguments`, `request` and `key`."""
        self._writer.write(json.dumps({"name": name, **asked}).encode() + b"\n")
        answer: dict[str, Any] = json.loads(await self._reader.readline())
        return answer


@asynccontextmanager
async def connected(path: Path) -> AsyncIterator[Client]:
    """Connect to a socket."""
    reader, writer = await asyncio.open_unix_connection(path, limit=2**24)
    try:
        yield Client(reader, writer)
    finally:
        writer.close()
        await writer.wait_closed()
