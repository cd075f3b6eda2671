"""Runs the plant and its HTTP server in one process and one event loop: this process owns the ports."""

import asyncio
import logging
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING, Any

import uvicorn

from app.access import AccessControl
from app.data_directory import require_no_links
from app.process import (
    Watchdog,
    connections_possible,
    expect_long_start,
    notify,
    short_collections,
    watchdog_wanted,
)
from app.tls import Certificate
from gateway.access.principal import EVERYBODY, asking
from gateway.config import Config, Server
from gateway.config_file import ConfigFile
from gateway.core.aside import SWITCH_S
from gateway.core.errors import GatewayError
from gateway.core.journal.disk import SqliteDisk
from gateway.core.journal.opening import OpenedJournal, longest_s, open_journal
from gateway.core.leases import LeaseTokens
from gateway.core.operation import Operation
from gateway.core.origin import Origin, acting
from gateway.core.parts import GATEWAY
from gateway.core.toml_files import ConfigError
from gateway.door import configuration
from gateway.door.nightly import Nightly
from gateway.door.state_log import note_states
from gateway.memory import make_sense
from gateway.plant import Plant
from gateway.security import entries
from gateway.security.log import Keeping, SecurityLog
from gateway.security.syslog import SyslogSender

if TYPE_CHECKING:
    from fleet.member import Member

log = logging.getLogger(__name__)

STREAMS_S = 1.0
"""Seconds that event streams may take to deliver what there is and to close."""
HANDSHAKE_S = 5.0
"""Seconds that a client may take to agree on TLS."""
QUICK_START_S = 10.0
"""A start that may take longer is told before."""
START_S = 60.0
"""Seconds for the rest of a start, as TimeoutStartSec in packaging/motion-gateway.service."""
BACKLOG = 2048
"""Connections that may wait to be accepted."""
REQUESTS_S = 2.0
"""Seconds that requests may take to end; then the lines are closed, which answers all that wait."""
HSTS = [("Strict-Transport-Security", "max-age=31536000")]
"""A browser that was here over TLS never asks in plain text; a proxy with TLS of its own says so itself."""


class CannotListen(OSError):
    """The HTTP port cannot be had; the message says which and why."""


@dataclass(frozen=True)
class Special:
    """Additions of the demo to a gateway."""

    rows: Sequence[Operation] = ()
    """Operations besides those of the table."""
    open_disk: Callable[[Path], SqliteDisk] = SqliteDisk
    """Opens the journal's disk of a directory."""
    welcome: Callable[[str], object] = lambda _url: None
    """Called with the address as soon as clients are served."""


async def serve(
    config: Config, data: Path, file: ConfigFile | None = None, special: Special = Special()
) -> None:
    """Serve until SIGINT, SIGTERM, or the end of the terminal; SIGHUP from elsewhere reads the `file` again.

    `data` is where the keys, the names and the journal are. Motors that `on_exit` leaves moving run on.

    :raises CannotListen: no line was opened.
    :raises ConfigError: `data` has a symbolic link, no client could be let in, or the certificate cannot be
        used; no line was opened.
    :raises InUse, TooNew: the journal in `data` belongs to another gateway; no line was opened.
    """
    from api.app import create_app

    require_no_links(data)
    sys.setswitchinterval(SWITCH_S)
    access = AccessControl(config, data)
    member_of = _membership_maker(config)
    with bound(config.server) as listener:
        signals = _Signals()
        journal = _journal(data, special.open_disk)
        security = SecurityLog(data, Keeping(config.security.keep_days, config.security.refusals_per_minute))
        sending = _sending(config, security)
        plant = Plant(
            config,
            journal=journal,
            lease_tokens=LeaseTokens(data),
            file=file,
            security=security,
            owners_in=data,
        )
        plant.names.keep_in(data)
        plant.works.recordings.keep_in(data)
        nightly = Nightly(plant, data / "backups")
        plant.works.commissionings.walk = _ask_only
        app = create_app(plant, access.credentials, special.rows)
        server = _Server(_uvicorn_config(app, config.server, access.certificate))
        signals.concern(plant, server)
        if watchdog_wanted():
            plant.served.on_change.append(partial(_feed_watchdog, plant))
            plant.served.on_change()
        listen(listener, config.server)
        await plant.start()
        noting = asyncio.create_task(note_states(plant), name="states")
        try:
            with short_collections():
                plant.admission.watch.start()
                scheme = "https" if access.certificate else "http"
                url = f"{scheme}://{config.server.host}:{listener.getsockname()[1]}"
                log.info("the journal and the keys are in %s", data)
                log.info("running on %s", url)
                special.welcome(url)
                access.on_key = lambda what, key: plant.events.publish(f"gateway.key.{what}", GATEWAY, key)
                access.start()
                nightly.start()
                member = member_of(plant, url, access.certificate)
                notify("READY=1", "STATUS=")
                serving = asyncio.create_task(server.serve([listener]), name="server")
                await signals.wait_for_end(serving)
                notify("STOPPING=1")
                await nightly.close()
                await plant.wind_down()
                if member is not None:
                    await member.stop()
                plant.events.close()
                await server.end_streams()
                await server.end_requests(serving)
        finally:
            noting.cancel()
            await plant.close()
            await access.stop()
            if sending is not None:
                await asyncio.to_thread(sending.close)
        await serving


def _membership_maker(config: Config) -> "Callable[[Plant, str, Certificate | None], Member | None]":
    """Give what makes the gateway a member of its plant, if it belongs to one.

    :raises ConfigError: what that takes is not installed, or the credentials cannot be used.
    """
    settings = config.plant
    if settings is None:
        return lambda _plant, _url, _certificate: None
    try:
        from fleet.engine import EngineTrouble, credentials_in
        from fleet.member import Member
    except ImportError as error:
        raise ConfigError("plant needs nats-py: pip install 'motion-gateway[plant]'") from error
    if settings.credentials is not None:
        try:
            credentials_in(settings.credentials)
        except EngineTrouble as trouble:
            raise ConfigError(str(trouble)) from trouble

    def make(plant: Plant, url: str, certificate: Certificate | None) -> Member | None:
        if plant.peers.membership is None:
            return None
        member = Member(
            settings, plant, plant.peers.membership, url, certificate.fingerprint() if certificate else None
        )
        member.start()
        return member

    return make


async def _ask_only(*given: Any) -> dict[str, Any]:
    """Try a line with questions; the package for it is loaded with the first request."""
    from commissioning.run import ask_only

    return await ask_only(*given)


def _sending(config: Config, security: SecurityLog) -> SyslogSender | None:
    """Have a copy of the security log sent, if the configuration names a server for it.

    :raises ConfigError: its certificates cannot be read.
    """
    wanted = config.security.syslog
    if wanted is None:
        return None
    try:
        syslog = SyslogSender(wanted.address, ca=wanted.ca, certificate=wanted.certificate, key=wanted.key)
    except (OSError, ValueError) as error:
        raise ConfigError(f"security.syslog: its certificates cannot be used: {error}") from error
    security.on_written = syslog.send
    loop = asyncio.get_running_loop()

    def tell(lost: int) -> None:
        note = partial(security.note, entries.SYSLOG_LOST, wanted.address, caller="gateway", lost=lost)
        with suppress(RuntimeError):  # the gateway has ended
            loop.call_soon_threadsafe(note)

    syslog.on_lost = tell
    syslog.start()
    return syslog


def _journal(data: Path, open_disk: Callable[[Path], SqliteDisk]) -> OpenedJournal:
    """Open the journal. A large one takes a while, in which no line is open."""
    if (takes_s := longest_s(data)) > QUICK_START_S:
        why = f"looking over the journal in {data}; no line is opened before"
        log.info("%s; on a slow disk that takes up to %.0f s", why, takes_s)
        expect_long_start(START_S + takes_s, why)
    return open_journal(data, make_sense, open_disk)


def _feed_watchdog(plant: Plant) -> None:
    """Let the lines' own work tell the service manager that the gateway lives."""
    watchdog = Watchdog(plant.ports())
    for port in plant.ports().values():
        port.on_work = partial(watchdog.worked, port.id)


class _Signals:
    """The signals that tell the gateway to end, or to read its configuration again.

    They are caught before the journal is begun: one that is begun and not ended looks like a crash. They are
    heeded when the event loop turns next, and by then it is known what they concern.
    """

    _plant: Plant
    _server: "_Server"

    def __init__(self) -> None:
        self._ending = asyncio.Event()
        self._reloads: set[asyncio.Task[None]] = set()
        for number in _handled():
            asyncio.get_running_loop().add_signal_handler(number, self._handle, number)

    def concern(self, plant: Plant, server: "_Server") -> None:
        """Say what ends, or is read again."""
        self._plant, self._server = plant, server

    async def wait_for_end(self, serving: "asyncio.Task[None]") -> None:
        """Wait for the first signal, or for a server that ends without one."""
        waiting = asyncio.create_task(self._ending.wait(), name="signals")
        await asyncio.wait({serving, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()

    def _handle(self, number: int) -> None:
        """A SIGHUP means the file, unless it says that the terminal has been closed."""
        if number == signal.SIGHUP and self._plant.file is not None and not _has_lost_terminal():
            task = asyncio.create_task(_reload(self._plant), name="reload")
            self._reloads.add(task)
            task.add_done_callback(self._reloads.discard)
        else:
            self._end(number)

    def _end(self, number: int) -> None:
        """End because of a signal; a second one ends every wait."""
        name = signal.Signals(number).name
        if self._ending.is_set():
            log.warning("%s again: ending without waiting any longer", name)
            self._plant.hurry()
            self._server.force_exit = True
        else:
            log.info("%s: shutting down; nothing begins to move any more", name)
            self._ending.set()


async def _reload(plant: Plant) -> None:
    """Read the configuration again; one that cannot be served leaves everything as it is."""
    notify("RELOADING=1", f"MONOTONIC_USEC={time.monotonic_ns() // 1000}")
    try:
        with asking(EVERYBODY), acting(Origin("SIGHUP")):
            found = await configuration.reload(plant, dry_run=False)
        log.info("SIGHUP: %s", found.model_dump_json())
    except GatewayError as error:
        log.error("SIGHUP: the configuration stays as it was: %s", error.detail)  # noqa: TRY400  # it says all
        plant.events.publish("gateway.reload_failed", GATEWAY, {"reason": error.detail})
    finally:
        notify("READY=1")


def _has_lost_terminal() -> bool:
    """True if the process was started at a terminal that is closed now."""
    return _AT_TERMINAL and not _has_terminal()


def _has_terminal() -> bool:
    try:
        os.close(os.open("/dev/tty", os.O_RDWR | os.O_NOCTTY))
    except OSError:
        return False
    return True


_AT_TERMINAL = _has_terminal()


def _handled() -> list[signal.Signals]:
    """The signals that end the gateway; SIGHUP is one unless it was started with nohup."""
    ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return [signal.SIGINT, signal.SIGTERM, *([] if ignored else [signal.SIGHUP])]


def bound(settings: Server) -> socket.socket:
    """Take the port. Connections are refused until `listen`: a stop would wait unheard.

    :raises CannotListen: it cannot be had.
    """
    host = "127.0.0.1" if settings.host == "localhost" else settings.host
    listener = socket.socket(socket.AF_INET6 if ip_address(host).version == 6 else socket.AF_INET)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if listener.family == socket.AF_INET6:
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        listener.bind((host, settings.port))
    except OSError as error:
        listener.close()
        raise _cannotlisten(settings, error) from None
    return listener


def listen(listener: socket.socket, settings: Server) -> None:
    """Let clients connect.

    :raises CannotListen: another process was faster.
    """
    try:
        listener.listen(BACKLOG)
    except OSError as error:
        raise _cannotlisten(settings, error) from None


def _cannotlisten(settings: Server, error: OSError) -> CannotListen:
    why = os.strerror(error.errno or 0)
    return CannotListen(
        f"The gateway cannot listen on {settings.host}:{settings.port}: {why}. No line was opened."
    )


class _Server(uvicorn.Server):
    """A server whose signals are ours, and that ends step by step."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen. A TLS handshake that does not end gives its place back soon, for it is in no count yet."""
        await super().startup(sockets=[])
        protocol: Any = self.config.http_protocol_class
        for listener in sockets or ():
            server = await asyncio.get_running_loop().create_server(
                partial(protocol, self.config, self.server_state),
                sock=listener,
                ssl=self.config.ssl,
                ssl_handshake_timeout=HANDSHAKE_S if self.config.ssl else None,
                backlog=self.config.backlog,
            )
            self.servers.append(server)

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
        from api.front.websocket_protocol import WebSocketProtocol

        return any(isinstance(connection, WebSocketProtocol) for connection in self.server_state.connections)

    async def end_requests(self, serving: "asyncio.Task[None]") -> None:
        """Take no more requests, and let those that are under way end."""
        self.should_exit = True
        await asyncio.wait({serving}, timeout=0 if self.force_exit else REQUESTS_S)


def _uvicorn_config(asgi: object, settings: Server, certificate: Certificate | None) -> uvicorn.Config:
    from api.front.http_protocol import protocols

    return uvicorn.Config(
        asgi,  # type: ignore[arg-type]  # FastAPI is an ASGI application; its stubs say so less exactly
        http=protocols(connections_possible(settings.max_connections)),
        ws="none",  # that protocol hands WebSockets over itself
        ws_max_size=65536,
        workers=1,
        access_log=False,
        log_config=None,
        headers=[("X-Content-Type-Options", "nosniff"), *(HSTS if certificate else ())],
        server_header=False,
        proxy_headers=False,  # `Proxies` does it
        root_path=settings.root_path,
        ssl_context_factory=(lambda *_: certificate.context) if certificate else None,
        lifespan="off",
        # By then the lines are closed, and all waiters have had an answer.
        timeout_graceful_shutdown=int(2 * REQUESTS_S),
    )
