"""Runs the plant and its HTTP server in one process and one event loop: this process owns the ports."""

import asyncio
import gc
import logging
import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from ipaddress import ip_address

import uvicorn

from gateway.config import Config, Server
from gateway.events import EventHub
from gateway.plant import Plant

log = logging.getLogger(__name__)

SHUTDOWN_S = 3
"""How long open requests and streams may take to end."""


class CannotListen(OSError):
    """The HTTP port cannot be had; the message says which and why."""


async def serve(config: Config) -> None:
    """Serve until SIGINT or SIGTERM. Bounded moves run on in the controllers; nothing more is sent.

    :raises CannotListen: no line was opened.
    """
    from api.app import create_app

    with _listener(config.server) as listener:
        plant = Plant(config)
        server = _StreamEndingServer(_uvicorn_config(create_app(plant)), plant.events)
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, server.end, number)
        await plant.start()
        try:
            # What has been made by now stays: looking it through again would hold up every line for 50 ms.
            gc.collect()
            gc.freeze()
            log.info("running on http://%s:%d", config.server.host, listener.getsockname()[1])
            await server.serve([listener])
        finally:
            await plant.close()


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


class _StreamEndingServer(uvicorn.Server):
    """A server whose signals are ours, and that ends the event streams before it waits for its clients."""

    def __init__(self, config: uvicorn.Config, events: EventHub) -> None:
        super().__init__(config)
        self._events = events

    def end(self, number: int) -> None:
        """Shut down because of a signal; a second one does not wait for anybody."""
        self._events.close()
        self.handle_exit(number, None)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to us: after the server the plant has to be closed too."""
        yield


def _uvicorn_config(asgi: object) -> uvicorn.Config:
    return uvicorn.Config(
        asgi,  # type: ignore[arg-type]  # FastAPI is an ASGI application; its stubs say so less exactly
        http="httptools",
        ws="websockets-sansio",
        ws_per_message_deflate=False,
        ws_max_size=65536,
        workers=1,
        access_log=False,
        log_config=None,
        server_header=False,
        proxy_headers=False,
        lifespan="off",
        timeout_graceful_shutdown=SHUTDOWN_S,
    )
