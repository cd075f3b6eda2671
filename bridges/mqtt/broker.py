"""The connection to a broker: how it is made, and how it publishes."""

import asyncio
import socket
import ssl
from collections import deque
from collections.abc import Awaitable, Iterator
from contextlib import contextmanager
from typing import Any, Final, TypeVar

import aiomqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from bridges.common.settings import secret_in
from bridges.mqtt.settings import MqttFile
from bridges.mqtt.topics import STOP

T = TypeVar("T")

JSON: Final = "application/json"
CLOUD_EVENT: Final = "application/cloudevents+json"
IN_FLIGHT: Final = 64
"""Messages that wait for their acknowledgement at a time."""
EVENTS_AT_ONCE, STATES_AT_ONCE = 32, 24
"""Shares of `IN_FLIGHT` for events and states: the rest stays free for answers, as to a stop."""
ANSWER_S: Final = 10.0
NO_DELAY: Final = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]
"""Else a small message waits for the acknowledgement of the one before: 40 ms."""


class StopsFirst(asyncio.Queue[aiomqtt.Message]):
    """Messages in the order of their arrival, but stops before all others."""

    _queue: deque[aiomqtt.Message]

    def _put(self, item: aiomqtt.Message) -> None:
        if item.topic.value.endswith(STOP):
            self._queue.appendleft(item)
        else:
            self._queue.append(item)


class NotTaken(aiomqtt.MqttError):
    """The broker has answered that it does not take a message: its user may not write there, for example."""


class TellingClient(aiomqtt.Client):
    """A client whose `publish` fails where the broker refuses the message: the library reads no reason."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._reasons: dict[int, str] = {}

    def _on_publish(self, client: Any, userdata: Any, mid: int, reason_code: Any, properties: Any) -> None:
        if reason_code.is_failure:
            self._reasons[mid] = str(reason_code)
        super()._on_publish(client, userdata, mid, reason_code, properties)

    async def _wait_for(self, fut: Awaitable[T], timeout: float | None) -> T:  # noqa: ASYNC109  # the library's
        """Wait for an answer of the broker; `asyncio.wait_for` loses a cancellation that comes with it."""
        try:
            async with asyncio.timeout(self.timeout if timeout is None else timeout):
                return await fut
        except TimeoutError:
            raise aiomqtt.MqttError("Operation timed out") from None

    @contextmanager
    def _pending_call(self, mid: int, value: Any, pending: dict[int, Any]) -> Iterator[None]:
        with super()._pending_call(mid, value, pending):
            yield
        if reason := self._reasons.pop(mid, None):
            raise NotTaken(reason)


def new_client(
    file: MqttFile,
    will: aiomqtt.Will | None,
    *,
    suffix: str = "",
    keep_s: int = 0,
    version: str | None = None,
) -> TellingClient:
    """Make a client for one connection: unsent messages of an earlier connection are not sent by it.

    The broker keeps the session for `keep_s` seconds after the connection ends, which also bounds the delay
    of the will. Without a `version` of MQTT, that of the file is used.

    :raises OSError: a certificate cannot be used.
    """
    mqtt = file.mqtt
    host, port = mqtt.place
    client = TellingClient(
        host,
        port,
        identifier=file.client_id + suffix,
        username=mqtt.user,
        password=secret_in(mqtt.password_file) if mqtt.password_file else None,
        will=will,
        timeout=ANSWER_S,
        keepalive=mqtt.keepalive_s,
        queue_type=StopsFirst,
        max_inflight_messages=IN_FLIGHT,
        tls_context=_context(file) if mqtt.is_tls else None,
        socket_options=NO_DELAY,
        transport="tcp" if mqtt.websocket_path is None else "websockets",
        websocket_path=mqtt.websocket_path,
        **_session(version or file.mqtt.version, keep_s),
    )
    client.pending_calls_threshold = 1 << 20  # the window bounds them
    return client


def _session(version: str, keep_s: int) -> dict[str, Any]:
    """No session outlives the connection: a command must never be delivered later."""
    if version != "5":
        return {"protocol": aiomqtt.ProtocolVersion.V311, "clean_session": True}
    properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
    # A will is sent with the end of its session: to delay it, the session has to stay. The next life begins
    # with a clean one all the same.
    properties.SessionExpiryInterval = keep_s
    return {"protocol": aiomqtt.ProtocolVersion.V5, "clean_start": True, "properties": properties}


def _context(file: MqttFile) -> ssl.SSLContext:
    context = ssl.create_default_context(cafile=file.mqtt.ca_file)
    if file.mqtt.cert_file and file.mqtt.key_file:
        context.load_cert_chain(file.mqtt.cert_file, file.mqtt.key_file, _no_passphrase)
    return context


def _no_passphrase() -> str:
    """Give an empty passphrase, so that OpenSSL does not ask for one on the terminal of a service."""
    return ""


def will(file: MqttFile, topic: str, payload: bytes) -> aiomqtt.Will:
    """Have the broker publish this when the bridge is gone without a word."""
    properties = None
    if file.mqtt.version == "5":
        properties = Properties(PacketTypes.WILLMESSAGE)  # type: ignore[no-untyped-call]
        properties.WillDelayInterval = file.mqtt.will_delay_s
        properties.ContentType = JSON
        properties.PayloadFormatIndicator = 1
    return aiomqtt.Will(topic, payload, qos=1, retain=True, properties=properties)


class Connection:
    """A connection that is up."""

    def __init__(self, client: aiomqtt.Client, *, v5: bool) -> None:
        self.client, self.v5 = client, v5

    async def publish(
        self,
        topic: str,
        payload: bytes,
        *,
        qos: int = 1,
        retain: bool = False,
        content_type: str = JSON,
        expires_in_s: int | None = None,
        correlation: bytes | None = None,
    ) -> None:
        """Publish, and wait for the acknowledgement if there is one; MQTT 3.1.1 sends the payload alone.

        :raises NotTaken: the broker refuses it.
        :raises aiomqtt.MqttError: the connection is lost, and the message may or may not have been published.
        """
        properties = None
        if self.v5:
            properties = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
            if payload and content_type:
                properties.ContentType = content_type
                properties.PayloadFormatIndicator = 1
            if expires_in_s is not None:
                properties.MessageExpiryInterval = expires_in_s
            if correlation is not None:
                properties.CorrelationData = correlation
        try:
            await self.client.publish(topic, payload, qos=qos, retain=retain, properties=properties)
        except NotTaken as error:
            raise NotTaken(f"it does not take what is published at {topic}: {error}") from None
