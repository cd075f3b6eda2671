"""Runs the plant process: its HTTP server, and what follows the servers and the gateways."""

import asyncio
import gc
import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager

import uvicorn

from app.process import notify
from app.server import HSTS, bound, listen
from app.tls import Certificate
from fleet.engine import Unfit
from fleet.fitness import faults_of, require_fit_streams, unseen
from fleet.front import Front, create_app
from fleet.settings import PlantConfig
from gateway.core.toml_files import ConfigError
from gateway.membership import Engine

log = logging.getLogger(__name__)
logging.getLogger("httpx").setLevel(logging.WARNING)  # it tells of each request


async def _require_fit(engine: Engine) -> None:
    """Refuse servers that are set so that events could be lost; those that are away may come later."""
    faults = await asyncio.to_thread(lambda: list(faults_of(engine)))
    if faults:
        raise ConfigError("\n".join(faults))
    for warning in await asyncio.to_thread(lambda: list(unseen(engine))):
        log.warning("%s", warning)
    try:
        await require_fit_streams(engine, "plant")
    except Unfit as unfit:
        raise ConfigError(str(unfit)) from unfit


class _Server(uvicorn.Server):
    """A server whose signals are ours."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to `serve`, which ends the event streams first."""
        yield


async def serve(config: PlantConfig, port: int | None = None) -> None:
    """Serve until SIGINT or SIGTERM.

    :raises CannotListen: the port cannot be had.
    :raises ConfigError: the certificate cannot be used, or the servers are set so that events could be lost.
    """
    await _require_fit(config.plant)
    settings = config.server if port is None else config.server.model_copy(update={"port": port})
    certificate = (
        Certificate(settings.tls_certificate, settings.tls_key)
        if settings.tls_certificate and settings.tls_key
        else None
    )
    front = Front(config)
    ending = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, ending.set)
    with bound(settings) as listener:
        server = _Server(
            uvicorn.Config(
                create_app(front, config),
                ws="websockets-sansio",
                ws_max_size=65536,
                access_log=False,
                log_config=None,
                server_header=False,
                headers=[("X-Content-Type-Options", "nosniff"), *(HSTS if certificate else ())],
                proxy_headers=bool(settings.trusted_proxies),
                forwarded_allow_ips=list(settings.trusted_proxies),
                root_path=settings.root_path,
                ssl_context_factory=(lambda *_: certificate.context) if certificate else None,
                lifespan="off",
                timeout_graceful_shutdown=2,
            )
        )
        listen(listener, settings)
        front.start()
        gc.collect()
        gc.freeze()  # a full collection looks through nothing of what is loaded: a stop would wait for it
        watch = [asyncio.create_task(certificate.watch())] if certificate else []
        scheme = "https" if certificate else "http"
        log.info("running on %s://%s:%d", scheme, settings.host, listener.getsockname()[1])
        notify("READY=1")
        serving = asyncio.create_task(server.serve([listener]), name="server")
        waiting = asyncio.create_task(ending.wait(), name="signals")
        await asyncio.wait({serving, waiting}, return_when=asyncio.FIRST_COMPLETED)
        notify("STOPPING=1")
        front.feed.close()
        server.should_exit = True
        await serving
        await front.aclose()
        for task in (*watch, waiting):
            task.cancel()
