"""Runs the plant and its HTTP server in one process and one event loop: this process owns the ports."""

import asyncio
import gc
import logging
import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from ipaddress import ip_address
from pathlib import Path

import uvicorn

from app.descriptors import connections_possible
from gateway.config import Config, Server
from gateway.core.journal.opening import open_journal
from gateway.plant import Plant

log = logging.getLogger(__name__)

STREAMS_S = 1.0
"""How long event streams may take to deliver what there is and to close."""
REQUESTS_S = 2.0
"""How long requests may take to end by themselves; then the lines are closed, which answers whoever waits."""


class CannotListen(OSError):
    """The HTTP port cannot be had; the message says which and why."""


async def serve(config: Config, data: Path) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. What `on_exit` leaves moving runs on in the controllers.

    :raises CannotListen: no line was opened.
    :raises InUse, TooNew: the journal in `data` belongs to another gateway; no line was opened.
    """
    from api.app import create_app, make_documents

    with _listener(config.server) as listener:
        plant = Plant(config, journal=open_journal(data))
        app = create_app(plant)
        make_documents(app)
        server = _Server(_uvicorn_config(app, config.server))
        end = _End(plant, server)
        await plant.start()
        try:
            # What has been made by now stays: looking it through again would hold up every line for 50 ms.
            gc.collect()
            gc.freeze()
            plant.watch.start()
            log.info("running on http://%s:%d", config.server.host, listener.getsockname()[1])
            serving = asyncio.create_task(server.serve([listener]), name="server")
            await end.told(serving)
            await plant.wind_down()
            plant.events.close()
            await server.end_streams()
            await server.end_requests(serving)
        finally:
            await plant.close()
        await serving


class _End:
    """The signals that tell the gateway to end."""

    def __init__(self, plant: Plant, server: "_Server") -> None:
        self._plant, self._server = plant, server
        self._told = asyncio.Event()
        for number in _signals():
            asyncio.get_running_loop().add_signal_handler(number, self._tell, number)

    async def told(self, serving: "asyncio.Task[None]") -> None:
        """Wait for the first signal, or for a server that ends without one."""
        waiting = asyncio.create_task(self._told.wait(), name="signals")
        await asyncio.wait({serving, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()

    def _tell(self, number: int) -> None:
        """End because of a signal; after a second one nobody is waited for."""
        name = signal.Signals(number).name
        if self._told.is_set():
            log.warning("%s again: ending without waiting any longer", name)
            self._plant.hurry()
            self._server.force_exit = True
        else:
            log.info("%s: shutting down; nothing begins to move any more", name)
            self._told.set()


def _signals() -> list[signal.Signals]:
    """Those that end the gateway; that of a closed terminal too, unless it was started with nohup."""
    ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return [signal.SIGINT, signal.SIGTERM, *([] if ignored else [signal.SIGHUP])]


def _listener(settings: Server) -> socket.socket:
    host = "127.0.0.1" if settings.host == "localhost" else settings.host
    family = socket.AF_INET6 if ip_address(host).version == 6 else socket.AF_INET
    try:
        return socket.create_server((host, settings.port), family=family, backlog=2048)
    except OSError as error:
        why = os.strerror(error.errno or 0)
        raise CannotListen(
            f"The gateway cannot listen on {settings.host}:{settings.port}: {why}. No line was opened."
        ) from None


class _Server(uvicorn.Server):
    """A server whose signals are ours, and that ends step by step."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to us: before and after the server the plant has to end too."""
        yield

    async def end_streams(self) -> None:
        """Let WebSockets close as their routes close them; server-sent events end as requests do."""
        with suppress(TimeoutError):
            async with asyncio.timeout(STREAMS_S):
                while self._has_websockets() and not self.force_exit:  # noqa: ASYNC110
                    await asyncio.sleep(0.02)  # uvicorn has no event for it

    def _has_websockets(self) -> bool:
        kind = self.config.ws_protocol_class
        return kind is not None and any(isinstance(it, kind) for it in self.server_state.connections)

    async def end_requests(self, serving: "asyncio.Task[None]") -> None:
        """Take no more requests, and let those that are under way end."""
        self.should_exit = True
        await asyncio.wait({serving}, timeout=0 if self.force_exit else REQUESTS_S)


def _uvicorn_config(asgi: object, settings: Server) -> uvicorn.Config:
    from api.front.protocols import protocols

    http, websocket = protocols(connections_possible(settings.max_connections))
    return uvicorn.Config(
        asgi,  # type: ignore[arg-type]  # FastAPI is an ASGI application; its stubs say so less exactly
        http=http,
        ws=websocket,
        ws_per_message_deflate=False,
        ws_max_size=65536,
        workers=1,
        access_log=False,
        log_config=None,
        headers=[("X-Content-Type-Options", "nosniff")],
        server_header=False,
        proxy_headers=False,
        lifespan="off",
        # By then the lines are closed, and whoever still waits has had an answer.
        timeout_graceful_shutdown=int(2 * REQUESTS_S),
    )
