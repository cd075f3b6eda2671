"""The yardstick of the HTTP benchmarks: a bare FastAPI application that asks a TCP server once a request."""

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import uvicorn
from fastapi import FastAPI
from pydantic import BaseModel

FRAME_END = b"\r"


class Asked(BaseModel):
    """What a request has in its body."""

    retries: int


class Answer(BaseModel):
    """What a request is answered."""

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


def create_app(far_port: int) -> FastAPI:
    """Make the application; it connects when it starts."""
    ends: list[FarEnd] = []

    @asynccontextmanager
    async def connected(_app: FastAPI) -> AsyncIterator[None]:
        ends.append(FarEnd(*await asyncio.open_connection("127.0.0.1", far_port)))
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
