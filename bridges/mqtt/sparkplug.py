"""The plant as an edge node of Sparkplug B: births, deaths and data of its devices. It is only read."""

import asyncio
import json
import logging
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Any, Final

import aiomqtt

from bridges.common.feed import SIDE as GATEWAY
from bridges.common.mirror import Document, Mirror
from bridges.common.process import Host
from bridges.mqtt.broker import Connection, new_client
from bridges.mqtt.settings import MqttFile, Sparkplug
from bridges.mqtt.sparkplug_payload import NAMESPACE, DataType, Metric, Value, commanded, encode
from bridges.mqtt.topics import SHOWN, state_of

log = logging.getLogger(__name__)

REBIRTH: Final = "Node Control/Rebirth"
BD_SEQ: Final = "bdSeq"
NUMBERS: Final = 256
"""Sequence numbers begin anew after 255."""
VERSION: Final = "3.1.1"
"""Version of MQTT, whatever the file says: with 5, a DISCONNECT would have to ask for the will."""
TRY_AGAIN_S: Final = 2.0
LEAVE_S: Final = 1.0
METRICS: Final[Mapping[str, tuple[str, DataType]]] = {
    "online": ("Online", DataType.BOOLEAN),
    "moving": ("Moving", DataType.BOOLEAN),
    "homed": ("Homed", DataType.STRING),
    "power_cycled": ("Power Cycled", DataType.BOOLEAN),
    "move_id": ("Move", DataType.STRING),
    "position": ("Position", DataType.INT64),
    "position_age_s": ("Position Age", DataType.DOUBLE),
    "last_heard_at": ("Last Heard", DataType.DATE_TIME),
}
"""Metrics of a device: their names, and the members of its document."""
_AGES: Final = frozenset({"Position Age", "Last Heard"})
"""Go with other changes, and make none themselves."""


class HostGone(Exception):
    """The primary host is offline, so the edge node goes offline too and publishes nothing."""


class Node:
    """The edge node: one connection after the other, each with a birth and a death of its own."""

    def __init__(self, file: MqttFile, table: Sparkplug, host: Host) -> None:
        self._file, self._table, self._host, self._mirror = file, table, host, host.mirror
        self._name = file.gateway.name
        self._bd_seq = _KeptNumber(host.data / "sparkplug.bdseq")
        self._seq = 0
        self._aliases: dict[tuple[str, str], int] = {}
        self._numbers = count(1)
        self._told: dict[str, dict[str, Value]] = {}
        """Metrics of each device that is born, as the host knows them."""
        self._rebirth = False
        self._news = asyncio.Event()
        self._host_online: bool | None = None
        self._host_at = 0
        self._ignored = host.figures.counter(
            "sparkplug_commands", "Commands by NCMD and DCMD; none is carried out."
        )

    def note(self, path: str, _document: Document | None) -> None:
        """Something has changed."""
        if path.startswith(("/bodies/", "/lines/", "/robots/", "/alarms/")):
            self._news.set()

    async def run(self) -> None:
        """Be a node, for ever."""
        await self._mirror.known.wait()
        while True:
            death = self._death(self._bd_seq.coming)
            will = aiomqtt.Will(self._topic("NDEATH"), death, qos=1, retain=False)
            try:
                async with new_client(self._file, will, suffix="-sparkplug", version=VERSION) as client:
                    self._bd_seq.take()
                    await self._use(Connection(client, v5=False), death)
            except* (aiomqtt.MqttError, OSError, ValueError) as group:
                log.info("Sparkplug: not connected to the broker: %s", group.exceptions[0])
            await asyncio.sleep(TRY_AGAIN_S)

    async def _use(self, connection: Connection, death: bytes) -> None:
        self._host_online, self._host_at = None if self._table.host else True, 0
        filters = [self._topic("NCMD"), f"{self._topic('DCMD')}/+"]
        if self._table.host:
            filters.append(self._state_topic)
        for topic_filter in filters:
            await connection.client.subscribe(topic_filter, qos=1)
        try:
            await self._work(connection)
        finally:  # of a connection that is closed as it should be, the broker does not tell it
            with suppress(TimeoutError, aiomqtt.MqttError):
                async with asyncio.timeout(LEAVE_S):
                    await connection.publish(self._topic("NDEATH"), death, content_type="")

    async def _work(self, connection: Connection) -> None:
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self._listen(connection))
                group.create_task(self._tell(connection))
        except* HostGone:
            log.info("Sparkplug: the primary host is offline")

    async def _listen(self, connection: Connection) -> None:
        async for message in connection.client.messages:
            topic, payload = str(message.topic), bytes(message.payload)
            if topic == self._state_topic:
                self._hear_host(payload)
            else:
                self._hear_command(topic, payload)

    def _hear_host(self, payload: bytes) -> None:
        """Take the state of the primary host.

        :raises HostGone: it was there, and is offline.
        """
        was_online = self._host_online
        try:
            state = json.loads(payload)
            online, at = state["online"] is True, int(state["timestamp"])
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            log.warning("Sparkplug: the state of the primary host cannot be read: %s", error)
            return
        if at < self._host_at:  # an older one that comes late
            return
        self._host_online, self._host_at = online, at
        self._news.set()
        if was_online and not self._host_online:
            raise HostGone

    def _hear_command(self, topic: str, payload: bytes) -> None:
        """Count a command. A rebirth moves nothing and is done; nothing else is."""
        self._ignored.inc()
        try:
            wanted = commanded(payload)
        except ValueError as error:
            log.warning("Sparkplug: a command at %s cannot be read: %s", topic, error)
            return
        if topic == self._topic("NCMD") and wanted.pop(REBIRTH, None):
            self._rebirth = True
            self._news.set()
        if wanted:
            names = ", ".join(map(str, wanted))[:SHOWN]
            log.warning("Sparkplug: a command at %s is not carried out: %s", topic, names)

    async def _tell(self, connection: Connection) -> None:
        self._rebirth = True
        while True:
            self._news.clear()
            if self._host_online:
                if self._rebirth:
                    self._rebirth = False
                    await self._tell_births(connection)
                await self._tell_changes(connection)
            await self._news.wait()
            await asyncio.sleep(0)

    async def _tell_births(self, connection: Connection) -> None:
        self._seq, self._told = 0, {}
        told = dict(self._of_node())
        await self._send(connection, self._topic("NBIRTH"), [*self._control(), *self._named("", told, {})])
        self._told[""] = told

    async def _tell_changes(self, connection: Connection) -> None:
        """Tell what is otherwise than the host knows: deaths and births of devices first, then data."""
        node = dict(self._of_node())
        if node.keys() != self._told[""].keys():
            await self._tell_births(connection)
        there = dict(devices(self._mirror)) if self._host.state.is_up(GATEWAY) else {}
        for device in [device for device in self._told if device and device not in there]:
            del self._told[device]
            await self._send(connection, f"{self._topic('DDEATH')}/{device}", [])
        for device in [device for device in there if device not in self._told]:
            told = _values(there[device])
            metrics = list(self._named(device, told, there[device]))
            await self._send(connection, f"{self._topic('DBIRTH')}/{device}", metrics)
            self._told[device] = told
        await self._tell_data(connection, self._topic("NDATA"), "", node, {})
        for device, document in there.items():
            topic = f"{self._topic('DDATA')}/{device}"
            await self._tell_data(connection, topic, device, _values(document), document)

    async def _tell_data(
        self, connection: Connection, topic: str, device: str, told: dict[str, Value], document: Document
    ) -> None:
        if self._rebirth:
            return  # no data before the births that somebody has asked for
        before = self._told[device]
        changed = {name: value for name, value in told.items() if before.get(name) != value}
        if changed.keys() - _AGES:
            metrics = [
                Metric(metric.value, metric.datatype, alias=metric.alias, timestamp_ms=metric.timestamp_ms)
                for metric in self._named(device, changed, document)
            ]
            await self._send(connection, topic, metrics)
            self._told[device] = told

    def _control(self) -> Iterator[Metric]:
        now = _now_ms()
        yield Metric(self._bd_seq.number, DataType.INT64, BD_SEQ, timestamp_ms=now)
        yield Metric(False, DataType.BOOLEAN, REBIRTH, timestamp_ms=now)

    def _of_node(self) -> Iterator[tuple[str, Value]]:
        documents = self._mirror.documents
        yield "Alarms", sum(path.startswith("/alarms/") for path in documents)
        for path, document in sorted(documents.items()):
            if path.startswith("/lines/"):
                yield f"Lines/{document['line_id']}", document["state"]

    def _named(self, device: str, told: Mapping[str, Value], document: Document) -> Iterator[Metric]:
        read_at = {"Position": document.get("position_read_at")}
        for name, value in told.items():
            datatype = _DATATYPES.get(name) or (DataType.INT32 if name == "Alarms" else DataType.STRING)
            alias = self._aliases.setdefault((device, name), next(self._numbers))
            yield Metric(value, datatype, name, alias, _ms(read_at.get(name)) or _now_ms())

    async def _send(self, connection: Connection, topic: str, metrics: list[Metric]) -> None:
        await connection.publish(topic, encode(metrics, _now_ms(), self._seq), qos=0, content_type="")
        self._seq = (self._seq + 1) % NUMBERS

    def _death(self, bd_seq: int) -> bytes:
        return encode([Metric(bd_seq, DataType.INT64, BD_SEQ, timestamp_ms=_now_ms())], _now_ms(), None)

    def _topic(self, type_: str) -> str:
        return f"{NAMESPACE}/{self._table.group}/{type_}/{self._name}"

    @property
    def _state_topic(self) -> str:
        return f"{NAMESPACE}/STATE/{self._table.host}"


_DATATYPES: Final = dict(METRICS.values())


def devices(mirror: Mirror) -> Iterator[tuple[str, Document]]:
    """Give the devices that are born: bodies, and units of robots, that answer."""
    for path in sorted(mirror.documents):
        if path.startswith("/bodies/") or "/units/" in path:
            document = state_of(path, mirror.documents)
            if document["online"]:
                yield _device(path, document), document


def _device(path: str, document: Document) -> str:
    """Name a device: no part of a topic has a slash."""
    return (
        document["body_id"] if path.startswith("/bodies/") else f"{document['robot_id']}.{document['number']}"
    )


def _values(document: Document) -> dict[str, Value]:
    return {
        name: _ms(document[member]) if datatype is DataType.DATE_TIME else document[member]
        for member, (name, datatype) in METRICS.items()
        if member in document
    }


def _ms(time_: Any) -> int | None:
    return None if time_ is None else int(datetime.fromisoformat(time_).timestamp() * 1000)


def _now_ms() -> int:
    return int(time.time() * 1000)


class _KeptNumber:
    """A number that goes up with each connection, over restarts: a death names the birth that it ends."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self.number = int(path.read_text("ascii")) % NUMBERS
        except (OSError, ValueError):
            self.number = NUMBERS - 1

    @property
    def coming(self) -> int:
        """The one of the next connection, from 0 to 255."""
        return (self.number + 1) % NUMBERS

    def take(self) -> None:
        """Note that there is a connection with it."""
        self.number = self.coming
        with suppress(OSError):
            self._path.write_text(f"{self.number}\n", "ascii")
