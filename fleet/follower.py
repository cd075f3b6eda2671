"""The plant's own side of the servers: it keeps the stream, follows it and the registry, and sends stops."""

import asyncio
import json
import logging
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any, Final

from nats.aio.msg import Msg
from nats.errors import Error

from fleet.engine import (
    BUCKET,
    CURSOR,
    MESSAGE_ID,
    STOP,
    STREAM,
    Connection,
    EngineTrouble,
    connected,
    ensure,
    owners_settings,
    registry_settings,
    reports_of,
    stream_settings,
)
from fleet.feed import RETAINED, Feed, event_of
from fleet.registry import Registry
from fleet.settings import PlantEngine
from fleet.stop_message import StopMessage

log = logging.getLogger(__name__)

AGAIN_S: Final = 1.0
HEARTBEAT_S: Final = 1.0
SILENT_S: Final = 4.0
"""Seconds without a message or a heartbeat after which a stream is asked for anew."""
_NS: Final = 1_000_000_000


class Follower:
    """Follows the servers for as long as the process lives; while they are away all else goes on."""

    def __init__(self, settings: PlantEngine, registry: Registry, feed: Feed) -> None:
        self._settings, self._registry, self._feed = settings, registry, feed
        self.trouble: str | None = "not connected yet"
        """Why the servers are not followed now."""
        self.caught_up = False
        """True once the whole stream was read."""
        self._created: str | None = None
        self._sequence = 0
        """The last message that was read of the stream."""
        self._delivered = 0
        self._told_at = 0.0
        self._connection: Connection | None = None

    async def run(self) -> None:
        """Follow until it is cancelled."""
        while True:
            try:
                await self._follow()
            except EngineTrouble as trouble:
                self._note(str(trouble))
            except Exception as fault:  # the next attempt is made nevertheless
                log.exception("following the servers has met a fault of the plant process itself")
                self._note(f"a fault of the plant process itself, {type(fault).__name__}")
            await asyncio.sleep(AGAIN_S)

    def _note(self, trouble: str) -> None:
        if trouble != self.trouble:
            log.warning("the servers of the plant are not followed: %s", trouble)
        self.trouble = trouble

    async def _follow(self) -> None:
        async with connected(self._settings, "plant", "_INBOX_plant") as connection:
            self._connection = connection
            try:
                await connection.nats.subscribe(f"$KV.{BUCKET}.*", cb=self._hear_entry)
                await ensure(connection, registry_settings(self._settings.replicas))
                await ensure(connection, owners_settings(self._settings.replicas))
                told = await ensure(connection, stream_settings(self._settings.replicas))
                await self._consume(connection, told)
                self.trouble = None
                await self._watch(connection)
            finally:
                self._connection = None

    async def _watch(self, connection: Connection) -> None:
        """Wait for the end of the connection, or of what it tells."""
        loop = asyncio.get_running_loop()
        while not connection.ended.done():
            await asyncio.wait({connection.ended}, timeout=HEARTBEAT_S)
            if loop.time() - self._told_at > SILENT_S:
                raise EngineTrouble("the stream tells nothing any more")
        raise EngineTrouble("the connection has ended")

    async def _consume(self, connection: Connection, told: dict[str, Any]) -> None:
        """Have all messages sent that were not read yet; of another stream all of the newest."""
        state = told["state"]
        if told["created"] != self._created or state["last_seq"] < self._sequence:
            self._created = told["created"]
            self._sequence = max(state["first_seq"], state["last_seq"] - RETAINED + 1, 1) - 1
        self._delivered = 0
        self._told_at = asyncio.get_running_loop().time()
        inbox = connection.nats.new_inbox()
        await connection.nats.subscribe(inbox, cb=self._hear_event)
        wanted = {
            "deliver_subject": inbox,
            "deliver_policy": "by_start_sequence",
            "opt_start_seq": self._sequence + 1,
            "ack_policy": "none",
            "max_deliver": 1,
            "mem_storage": True,
            "num_replicas": 1,
            "idle_heartbeat": int(HEARTBEAT_S * _NS),
            "inactive_threshold": 5 * _NS,
        }
        answer = await connection.ask(f"CONSUMER.CREATE.{STREAM}", {"stream_name": STREAM, "config": wanted})
        if "error" in answer:
            raise EngineTrouble(f"the stream is not told: {answer['error'].get('description')}")
        self.caught_up = self.caught_up or not answer.get("num_pending")

    async def _hear_entry(self, message: Msg) -> None:
        self._registry.note(message.subject, message.data)

    async def _hear_event(self, message: Msg) -> None:
        self._told_at = asyncio.get_running_loop().time()
        headers = message.headers or {}
        if "Status" in headers:
            return
        *_, delivered, in_stream, of_consumer, _time, pending = message.reply.split(".")
        if int(of_consumer) != self._delivered + 1:
            await self._start_anew(f"message {self._delivered + 1} of the stream is missing")
            return
        del delivered
        self._delivered, self._sequence = int(of_consumer), int(in_stream)
        self.caught_up = self.caught_up or pending == "0"
        gateway = message.subject.split(".")[1]
        try:
            cursor = headers[CURSOR]
            event = event_of(gateway, headers.get(MESSAGE_ID, cursor), cursor, message.data.decode())
        except (KeyError, ValueError) as error:
            log.warning("a message of the stream is no event of a gateway: %s", error)
            return
        self._feed.add(event)

    async def _start_anew(self, why: str) -> None:
        log.warning("%s; it is read again", why)
        if self._connection is not None:
            self._connection.ended.cancel()

    @asynccontextmanager
    async def stopping(
        self, stop: StopMessage, on_report: Callable[[Mapping[str, Any]], None]
    ) -> AsyncIterator[None]:
        """Send a stop to all gateways at once, and hear their reports within the context.

        While no server is there nothing is sent: HTTP is the other way.
        """
        connection = self._connection
        if connection is None or connection.ended.done():
            yield
            return

        async def hear(message: Msg) -> None:
            try:
                on_report({**json.loads(message.data), "gateway": message.subject.split(".")[1]})
            except (ValueError, TypeError) as error:
                log.warning("a report of a stop cannot be read: %s", error)

        client = connection.nats
        try:
            subscription = await client.subscribe(reports_of("*", stop.request_id), cb=hear)
            await client.publish(STOP, stop.model_dump_json().encode())
        except (Error, OSError) as error:
            log.warning("a stop was not handed to the servers of the plant: %s", error)
            yield
            return
        try:
            yield
        finally:
            with suppress(Error, OSError):
                await subscription.unsubscribe()
