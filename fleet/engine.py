"""NATS as the plant uses it: connections that end at the first doubt, the subjects, and the stream of events.

Nothing that decides about motion goes through it: it carries copies, and one of two ways of a stop.
"""

import asyncio
import json
import logging
import ssl
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Final

import nats
from nats.aio.client import Client
from nats.aio.msg import Msg
from nats.errors import Error, NoRespondersError

from gateway.membership import Engine

log = logging.getLogger(__name__)

STREAM: Final = "PLANT"
BUCKET: Final = "gateways"
OWNERS: Final = "owners"
STOP: Final = "mg.stop"
"""Every gateway hears a stop of the plant here."""
CURSOR: Final = "Mg-Cursor"
"""The header with the place in the gateway's journal behind an event."""
MESSAGE_ID: Final = "Nats-Msg-Id"
LAST_SEQUENCE: Final = "Nats-Expected-Last-Subject-Sequence"

CONNECT_S: Final = 2
PING_S: Final = 1
PINGS: Final = 2
"""Unanswered pings after which a server is given up, for example one that is suspended."""
ANSWER_S: Final = 5.0
CLOSE_S: Final = 1.0
LOOK_S: Final = 0.2
NOBODY: Final = (
    "the servers have no stream for it yet, which the plant process makes; or they are just starting"
)
KEEP_DAYS: Final = 30
REGISTRY_TTL_S: Final = 10
_NS: Final = 1_000_000_000


class EngineTrouble(Exception):
    """The servers are not reached, or do not do what the plant needs; the message says why."""


class Unfit(EngineTrouble):
    """A server, or a stream, must not be used as it is set."""


def events_of(gateway: str) -> str:
    """The subject of a gateway's events; only that gateway writes there."""
    return f"mg.{gateway}.ev"


def claim_of(gateway: str, line: str) -> str:
    """The subject at which a gateway says that it has a line; only that gateway writes there."""
    return f"$KV.{OWNERS}.{gateway}.{line}"


def reports_of(gateway: str, request_id: str) -> str:
    """The subject at which a gateway reports of a stop; only that gateway writes there."""
    return f"mg.{gateway}.stop.{request_id}"


def entry_of(gateway: str) -> str:
    """The subject of a gateway's entry in the registry; only that gateway writes there."""
    return f"$KV.{BUCKET}.{gateway}"


class Connection:
    """A connection to one of the servers; it is not mended, but ends, and another one is made."""

    def __init__(self, client: Client) -> None:
        self.nats = client
        self.ended = asyncio.create_task(self._watch(), name="connection to the servers")
        """Done when it has ended."""

    async def _watch(self) -> None:
        while self.nats.is_connected:  # noqa: ASYNC110  # the library does not always tell of its end
            await asyncio.sleep(LOOK_S)

    async def request(
        self, subject: str, content: bytes | object = b"", headers: dict[str, str] | None = None
    ) -> Msg:
        """Ask, and wait for the answer.

        :raises EngineTrouble: there was none.
        """
        payload = content if isinstance(content, bytes) else json.dumps(content).encode()
        try:
            return await self.nats.request(subject, payload, timeout=ANSWER_S, headers=headers)
        except NoRespondersError:
            raise EngineTrouble(NOBODY) from None
        except (Error, TimeoutError, OSError) as error:
            raise EngineTrouble(_why(error)) from error

    async def ask(self, call: str, content: object = b"") -> dict[str, Any]:
        """Use the API of JetStream; an `error` is in the answer.

        :raises EngineTrouble: there was none.
        """
        return dict(json.loads((await self.request(f"$JS.API.{call}", content)).data))


@asynccontextmanager
async def connected(engine: Engine, name: str, inbox: str) -> AsyncIterator[Connection]:
    """Connect to the first server that answers, for as long as the context lasts.

    :raises EngineTrouble: none does; or a file that is needed cannot be read.
    """
    options: dict[str, Any] = {
        **_credentials(engine),
        "name": f"motion-gateway {name}",
        "inbox_prefix": inbox,
        "allow_reconnect": False,
        "connect_timeout": CONNECT_S,
        "max_reconnect_attempts": 1,
        "ping_interval": PING_S,
        "max_outstanding_pings": PINGS,
        "error_cb": _note_error,
        "tls": _tls(engine),
    }
    client = await _reached(engine.servers, options)
    connection = Connection(client)
    try:
        yield connection
    finally:
        connection.ended.cancel()
        await _close(client)


async def _reached(servers: Sequence[str], options: dict[str, Any]) -> Client:
    why = ""
    for server in servers:
        client = Client()
        given = {**options, "tls": options["tls"] if server.startswith("tls:") else None}
        try:
            async with asyncio.timeout(CONNECT_S):  # by itself the library would try for minutes
                await client.connect(server, **given)
        except (Error, TimeoutError, OSError, nats.errors.ProtocolError) as error:
            why = f"{server}: {_why(error)}"
            await _close(client)
        else:
            return client
    raise EngineTrouble(why)


async def _close(client: Client) -> None:
    with suppress(Error, TimeoutError, OSError):
        async with asyncio.timeout(CLOSE_S):
            await client.close()


def _tls(engine: Engine) -> ssl.SSLContext | None:
    if not any(server.startswith("tls:") for server in engine.servers):
        return None
    try:
        return ssl.create_default_context(cafile=engine.ca)
    except OSError as error:
        raise EngineTrouble(f"plant.ca {engine.ca} cannot be used: {error.strerror or error}") from None


def _credentials(engine: Engine) -> dict[str, str]:
    if engine.credentials is None:
        return {}
    user, password = credentials_in(engine.credentials)
    return {"user": user, "password": password}


def credentials_in(file: Path) -> tuple[str, str]:
    """Read the user and the password of a file.

    :raises EngineTrouble: it cannot be read, or has another form.
    """
    try:
        line = file.read_text("utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise EngineTrouble(f"plant.credentials {file} cannot be read: {why}") from None
    user, colon, password = line.partition(":")
    if not (user and colon and password) or "\n" in line:
        raise EngineTrouble(f"plant.credentials {file} has to be one line, USER:PASSWORD")
    return user, password


async def _note_error(error: Exception) -> None:
    log.debug("NATS: %s", error)


def _why(error: BaseException) -> str:
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).removeprefix("nats: ")


def stream_settings(replicas: int) -> dict[str, Any]:
    """The settings of the stream that has the events of all gateways."""
    return {
        "name": STREAM,
        "subjects": [events_of("*")],
        "storage": "file",
        "retention": "limits",
        "discard": "old",
        "num_replicas": replicas,
        "max_age": KEEP_DAYS * 24 * 3600 * _NS,
        "duplicate_window": 120 * _NS,
        "allow_direct": True,
        "allow_atomic": True,
    }


def registry_settings(replicas: int) -> dict[str, Any]:
    """The settings of the bucket that the gateways put themselves into."""
    return {
        "name": f"KV_{BUCKET}",
        "subjects": [f"$KV.{BUCKET}.>"],
        "storage": "memory",
        "discard": "new",
        "num_replicas": replicas,
        "max_msgs_per_subject": 1,
        "max_age": REGISTRY_TTL_S * _NS,
        "duplicate_window": REGISTRY_TTL_S * _NS,
        "allow_direct": True,
        "allow_rollup_hdrs": True,
        "deny_delete": True,
    }


def owners_settings(replicas: int) -> dict[str, Any]:
    """The settings of the bucket in which gateways say which lines with a spare they have."""
    return {
        "name": f"KV_{OWNERS}",
        "subjects": [f"$KV.{OWNERS}.>"],
        "storage": "file",
        "discard": "new",
        "num_replicas": replicas,
        "max_msgs_per_subject": 1,
        "allow_direct": True,
        "allow_rollup_hdrs": True,
        "deny_delete": True,
    }


async def ensure(connection: Connection, settings: dict[str, Any]) -> dict[str, Any]:
    """Make a stream that is missing, and give what the server tells of it.

    :raises EngineTrouble: it cannot be made, or must not be used as it is.
    """
    name = settings["name"]
    told = await connection.ask(f"STREAM.INFO.{name}")
    if told.get("error", {}).get("code") == 404:
        told = await connection.ask(f"STREAM.CREATE.{name}", settings)
    if "error" in told:
        raise EngineTrouble(f"stream {name}: {told['error'].get('description', 'it cannot be used')}")
    require_fit(told["config"])
    return told


def require_fit(config: dict[str, Any] | None) -> None:
    """Refuse a stream that must not be used as it is set; one that is not there may be made.

    :raises Unfit: it must not.
    """
    if config is not None and (fault := fault_of_stream(config)):
        raise Unfit(f"stream {config['name']}: {fault}")


def fault_of_stream(config: dict[str, Any]) -> str | None:
    """Why a stream must not be used as it is set; None where it may be."""
    if config.get("num_replicas") == 2:
        return (
            "it has two replicas, so that it stops with either server and is no safer than with one: use one "
            "server, or three"
        )
    if config.get("name") == STREAM and not (config.get("allow_atomic") and config.get("allow_direct")):
        return (
            "it was made without allow_atomic and allow_direct: delete it, and it is made anew and refilled"
        )
    return None
