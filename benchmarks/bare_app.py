"""The yardstick of the HTTP benchmarks: a bare FastAPI application that asks a TCP server once a request.

One route does what a gateway has to do besides: it writes a command to the disk first, and fences it.
"""

import asyncio
import sqlite3
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryDirectory
from threading import Thread

import uvicorn
from fastapi import FastAPI
from pydantic import BaseModel

FRAME_END = b"\r"


class Asked(BaseModel):
    """Content of a request."""

    retries: int


class Answer(BaseModel):
    """Content of an answer."""

    body_id: str
    reply: str


class FarEnd:
    """One connection, on which one question is asked at a time, as on a serial line."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer
        self._free = asyncio.Lock()

    async def ask(self, text: str) -> str:
        """Send a frame and wait for the one that comes back."""
        async with self._free:
            self._writer.write(text.encode() + FRAME_END)
            return (await self._reader.readuntil(FRAME_END)).decode()


class Disk:
    """A SQLite file and the thread that writes it: all that waits is one commit."""

    def __init__(self, path: Path) -> None:
        self._loop = asyncio.get_running_loop()
        self._waiting: SimpleQueue[tuple[str, asyncio.Future[None]]] = SimpleQueue()
        Thread(target=self._run, args=(path,), daemon=True).start()

    async def keep(self, text: str) -> None:
        """Write a text, and wait until a loss of power cannot undo it."""
        done: asyncio.Future[None] = self._loop.create_future()
        self._waiting.put((text, done))
        await done

    def _run(self, path: Path) -> None:
        file = sqlite3.connect(path, isolation_level=None)
        file.executescript("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; CREATE TABLE kept (text TEXT)")
        while True:
            taken = self._take()
            file.execute("BEGIN")
            file.executemany("INSERT INTO kept VALUES (?)", [(text,) for text, _ in taken])
            file.execute("COMMIT")
            self._loop.call_soon_threadsafe(_settle, [done for _, done in taken])

    def _take(self) -> list[tuple[str, "asyncio.Future[None]"]]:
        taken = [self._waiting.get()]
        try:
            while True:
                taken.append(self._waiting.get_nowait())
        except Empty:
            return taken


def _settle(futures: list["asyncio.Future[None]"]) -> None:
    for future in futures:
        future.set_result(None)


def create_app(far_port: int) -> FastAPI:
    """Make the application; it connects when it starts."""
    ends: list[FarEnd] = []
    disks: list[Disk] = []

    @asynccontextmanager
    async def connected(_app: FastAPI) -> AsyncIterator[None]:
        ends.append(FarEnd(*await asyncio.open_connection("127.0.0.1", far_port)))
        with TemporaryDirectory() as folder:
            disks.append(Disk(Path(folder) / "kept.db"))
            yield

    app = FastAPI(lifespan=connected)

    @app.get("/hello")
    async def hello() -> dict[str, str]:
        return {"hello": "world"}

    @app.get("/bodies/{body_id}/position")
    async def read(body_id: str) -> Answer:
        return Answer(body_id=body_id, reply=await ends[0].ask(f"&{body_id}6PD"))

    @app.post("/bodies/{body_id}/commands/set-homing-retries")
    async def command(body_id: str, asked: Asked) -> Answer:
        return Answer(body_id=body_id, reply=await ends[0].ask(f"&{body_id}0RS{asked.retries}"))

    @app.post("/bodies/{body_id}/kept/set-homing-retries")
    async def keep_and_command(body_id: str, asked: Asked) -> Answer:
        text = f"&{body_id}0RS{asked.retries}"
        await disks[0].keep(text)
        await ends[0].ask(f"&{body_id}3NDP[0001]")
        return Answer(body_id=body_id, reply=await ends[0].ask(text))

    return app


if __name__ == "__main__":
    # The same server settings as the gateway's own.
    uvicorn.run(
        create_app(int(sys.argv[2])),
        port=int(sys.argv[1]),
        loop="uvloop",
        http="httptools",
        access_log=False,
        log_config=None,
        server_header=False,
        proxy_headers=False,
    )
