"""A cable between processes that can be cut: nothing passes, and neither end is told."""

import asyncio
import threading
from contextlib import closing, suppress
from typing import Any, Final

CHUNK: Final = 1 << 16


class Cable(threading.Thread):
    """Passes TCP connections on to a port of this machine, until it is cut."""

    def __init__(self, far_end: int) -> None:
        super().__init__(daemon=True)
        self._far_end = far_end
        self._loop = asyncio.new_event_loop()
        self._whole = asyncio.Event()
        self._listens = threading.Event()
        self.port = 0
        """Port of the near end."""
        self.start()
        self._listens.wait()

    def run(self) -> None:
        """Serve until the end."""
        with closing(self._loop):
            self._loop.run_until_complete(self._serve())

    async def _serve(self) -> None:
        self._whole.set()
        self._over = asyncio.Event()
        server = await asyncio.start_server(self._join, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        self._listens.set()
        await self._over.wait()
        server.close()
        tasks = [it for it in asyncio.all_tasks() if it is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.sleep(0)  # for closed sockets

    async def _join(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await self._whole.wait()
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._far_end)
        except OSError:
            writer.close()
            return
        await asyncio.gather(self._pass(reader, far_writer), self._pass(far_reader, writer))

    async def _pass(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            with suppress(OSError):
                while content := await reader.read(CHUNK):
                    await self._whole.wait()
                    writer.write(content)
                    await writer.drain()
        finally:
            writer.close()

    def _now(self, deed: Any) -> None:
        self._loop.call_soon_threadsafe(deed)

    def cut(self) -> None:
        """Let nothing pass any more."""
        self._now(self._whole.clear)

    def mend(self) -> None:
        """Let pass what has waited, and all that comes."""
        self._now(self._whole.set)

    def end(self) -> None:
        """Take it away."""
        self._now(self._over.set)
        self.join()
