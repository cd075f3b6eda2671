"""The bridge to MQTT: one connection after the other, and what is done on each."""

import asyncio
import gc
import logging
from contextlib import suppress
from functools import partial
from typing import Any, Final

import aiomqtt
from motion_gateway_client import GatewayError
from paho.mqtt.subscribeoptions import SubscribeOptions

from bridges.common.mirror import Document
from bridges.common.process import Host, Kind
from bridges.mqtt import operations
from bridges.mqtt.broker import CLOUD_EVENT, EVENTS_AT_ONCE, Connection, NotTaken, new_client, will
from bridges.mqtt.checks import check
from bridges.mqtt.commands import Commands
from bridges.mqtt.operations import Operation, Operations
from bridges.mqtt.outbox import Letter, Outbox, Send
from bridges.mqtt.retained import Retained, clear_stale
from bridges.mqtt.settings import MqttFile
from bridges.mqtt.sparkplug import Node
from bridges.mqtt.topics import COMMANDS, STATUS, now, topic_of_event, written

log = logging.getLogger(__name__)

SIDE: Final = "broker"
PAUSES_S: Final = (0.2, 0.5, 1.0, 2.0, 5.0)
"""Before each further try to reach the broker; the last one from then on."""
TRY_AGAIN_S: Final = 5.0
LEAVE_S: Final = 2.0
"""Longest wait at the end, in seconds, for the answers to commands and the last messages."""
HELD_S: Final = 10.0
"""A connection that lasts longer was a good one."""
SETTLE_S: Final = 2.0
"""Most clients of a broker that has fallen try it again after a second."""
STATUS_S: Final = 15.0
"""The status is told again after this time: it proves that the broker takes what is published."""
NO_STATES: Final = "states are being told"
NO_EVENTS: Final = "events begin in a moment"
NO_COMMANDS: Final = "commands are not taken yet"
LIVE: Final = ("body.position", "robot.position")


class Bridge:
    """Everything that goes on between a gateway and a broker."""

    def __init__(self, file: MqttFile, host: Host) -> None:
        self._file, self._host, self._root = file, host, file.root
        self._v5 = file.mqtt.version == "5"
        self._events = Outbox(at_once=EVENTS_AT_ONCE, on_arrival=host.figures.events.inc)
        self._retained = Retained(file.root, host.mirror, host.figures)
        self._operations: Operations | None = None
        self._commands = Commands(file.root, host.callers, host.figures, self._find)
        self._status_news = asyncio.Event()
        self._connection: Connection | None = None
        if file.mqtt.commands:
            host.state.begin(NO_COMMANDS)
        self._node = Node(file, file.mqtt.sparkplug, host) if file.mqtt.sparkplug else None
        host.state.on_change = self._status_changed
        host.mirror.on_change = self._document_changed

    async def run(self) -> None:
        """Work until cancelled; then commands are answered, and the broker is told."""
        works = [self._host.feed.run(self._take), self._connect(), self._set_aside()]
        if self._file.mqtt.commands:
            works.append(self._read_operations())
        if self._node:
            works.append(self._node.run())
        if self._file.mqtt.positions:
            works.append(self._follow_positions())
        async with asyncio.TaskGroup() as group:
            for work in works:
                group.create_task(work)

    async def _set_aside(self) -> None:
        """Keep what is there for good from the garbage collector, which would hold a stop up for 20 ms."""
        await self._host.mirror.known.wait()
        gc.collect()
        gc.freeze()

    # the gateway's side

    def _status_changed(self) -> None:
        self._status_news.set()
        if self._node:
            self._node.note("/lines/", None)

    def _document_changed(self, path: str, document: Document | None) -> None:
        self._retained.note(path, document)
        if self._node:
            self._node.note(path, document)

    async def _take(self, event: dict[str, Any]) -> None:
        """Hand an event to the outbox, which knows when it is delivered for good."""
        settled = partial(self._host.position.reach, event["cursor"])
        topic = f"{self._root}/{topic_of_event(event)}"
        await self._events.put(Letter(topic, written(event), CLOUD_EVENT, on_settled=settled))

    async def _read_operations(self) -> None:
        while True:
            await self._host.state.wait_for("gateway")
            try:
                self._operations = await operations.read(self._host.gateway)
                self._host.state.done(NO_COMMANDS)
                await self._host.state.wait_for("gateway", connected=False)  # the next may be another version
            except GatewayError as error:
                log.info("the gateway's document cannot be read yet, and stops alone pass: %s", error)
                await asyncio.sleep(TRY_AGAIN_S)

    def _find(self, path: str) -> Operation | None:
        return (self._operations.find if self._operations else operations.without_document)(path)

    async def _follow_positions(self) -> None:
        """Publish live positions while the broker is there; one that was not sent is forgotten."""
        mqtt = self._file.mqtt
        while True:
            try:
                events = self._host.gateway.events(
                    bodies=mqtt.positions, types=LIVE, sample=mqtt.position_rate
                )
                async for event in events:
                    await self._tell_position(event)
            except GatewayError as error:
                log.warning("mqtt.positions: %s", error)
            await asyncio.sleep(TRY_AGAIN_S)

    async def _tell_position(self, event: Any) -> None:
        if event["type"] not in LIVE or self._connection is None:
            return
        payload = written({**event["data"], "time": event["time"]})
        with suppress(aiomqtt.MqttError):
            await self._connection.publish(f"{self._root}{event['subject']}/position", payload, qos=0)

    # the broker's side

    async def _connect(self) -> None:
        failures = 0
        clock = asyncio.get_running_loop().time
        while True:
            begun_at = clock()
            try:
                last_word = will(self._file, self._topic(STATUS), self._status("the bridge is gone"))
                async with new_client(self._file, last_word, keep_s=self._file.mqtt.will_delay_s) as client:
                    await self._use(Connection(client, v5=self._v5))
            except* (aiomqtt.MqttError, OSError, ValueError) as group:
                self._lost(group)
            failures = 0 if clock() - begun_at > HELD_S else failures + 1
            await asyncio.sleep(PAUSES_S[min(failures, len(PAUSES_S) - 1)])

    def _lost(self, group: BaseExceptionGroup[Exception]) -> None:
        error: BaseException = group
        while isinstance(error, BaseExceptionGroup):
            error = error.exceptions[0]
        host, port = self._file.mqtt.place
        self._host.life.worked(SIDE)
        self._host.state.down(SIDE, f"{host}:{port}: {error}")

    async def _use(self, connection: Connection) -> None:
        """Do all that there is to be done on a connection, until it fails or the bridge ends."""
        self._connection = connection
        for what in (NO_EVENTS, NO_STATES):
            self._host.state.begin(what)
        self._host.state.up(SIDE)
        try:
            async with asyncio.TaskGroup() as group:
                for work in self._works(connection):
                    group.create_task(work)
        except asyncio.CancelledError:
            await self._leave(connection)
            raise
        finally:
            self._connection = None

    def _works(self, connection: Connection) -> list[Any]:
        send = partial(self._send, connection)
        return [
            self._listen(connection),
            self._deliver_events(send),
            self._commands.answers.deliver(partial(self._send_answer, connection)),
            self._retained.tell(connection, partial(self._host.state.done, NO_STATES)),
            self._clear_stale(connection),
            self._tell_status(connection),
        ]

    async def _send(self, connection: Connection, letter: Letter) -> None:
        await connection.publish(
            letter.topic, letter.payload, content_type=letter.content_type, correlation=letter.correlation
        )
        self._host.life.worked(SIDE)

    async def _send_answer(self, connection: Connection, letter: Letter) -> None:
        """Send an answer: its client names the topic, where the bridge may have no right to write."""
        try:
            await self._send(connection, letter)
        except NotTaken as error:
            log.warning("an answer has gone nowhere: the broker says that %s", error)

    async def _deliver_events(self, send: Send) -> None:
        """Deliver events, once the broker's other clients have had a moment to come back."""
        await asyncio.sleep(SETTLE_S)
        self._host.state.done(NO_EVENTS)
        await self._events.deliver(send)

    async def _leave(self, connection: Connection) -> None:
        """Answer the commands under way, and say that the bridge ends; the broker does not say it then."""
        delivering = asyncio.create_task(
            self._commands.answers.deliver(partial(self._send_answer, connection))
        )
        with suppress(TimeoutError, aiomqtt.MqttError):
            async with asyncio.timeout(LEAVE_S):
                await self._commands.end()
                await self._commands.answers.empty()
                await connection.publish(
                    self._topic(STATUS), self._status("the bridge has ended", now()), retain=True
                )
        delivering.cancel()
        await asyncio.gather(delivering, return_exceptions=True)

    async def _listen(self, connection: Connection) -> None:
        """Take commands if the file says so; notice the end of the connection in any case."""
        stored = 0
        if self._file.mqtt.commands:
            stored = await self._subscribe(connection)
        async for message in connection.client.messages:
            self._host.life.worked(SIDE)
            self._commands.take(message, stored=stored > 0)
            stored -= 1

    async def _subscribe(self, connection: Connection) -> int:
        """Subscribe to commands, and give how many the broker may have had stored.

        It gives what it has stored at the first subscription alone; with the second everything is new.
        """
        commands = self._topic(f"{COMMANDS}/#")
        if not self._v5:
            await connection.client.subscribe(commands, qos=1)
            return 0  # what is stored is told by its flag
        for handling in (SubscribeOptions.RETAIN_SEND_ON_SUBSCRIBE, SubscribeOptions.RETAIN_DO_NOT_SEND):
            options = SubscribeOptions(qos=1, retainAsPublished=True, retainHandling=handling)
            await connection.client.subscribe(commands, options=options)
        return len(connection.client.messages)

    async def _clear_stale(self, connection: Connection) -> None:
        await self._host.mirror.known.wait()
        async with new_client(self._file, None, suffix="-stale") as listener:
            await clear_stale(connection, listener, self._retained, self._root)

    async def _tell_status(self, connection: Connection) -> None:
        """Tell each change, and now and then anew."""
        while True:
            self._status_news.clear()
            self._events.settle()
            await connection.publish(self._topic(STATUS), self._status(), retain=True)
            self._host.life.worked(SIDE)
            with suppress(TimeoutError):
                async with asyncio.timeout(STATUS_S):
                    await self._status_news.wait()

    def _status(self, gone: str | None = None, since: str | None = None) -> bytes:
        status = self._host.status()
        if gone is not None:
            status |= {"state": "offline", "reason": gone, "since": since}
        return written(status)

    def _topic(self, name: str) -> str:
        return f"{self._root}/{name}"


KIND: Final = Kind(MqttFile, ("gateway", SIDE), lambda file: lambda host: Bridge(file, host).run(), check)
