"""Publishes the plant's documents as retained messages: all after each connect, then each change."""

import asyncio
from collections.abc import Callable, Iterable
from typing import Final

import aiomqtt

from bridges.common.mirror import SWEEP_S, Document, Mirror
from bridges.common.state import Figures
from bridges.mqtt.broker import STATES_AT_ONCE, Connection
from bridges.mqtt.topics import STATES, state_of, topic_of, written

EXPIRES_IN_S: Final = int(3 * SWEEP_S)
"""Life of a retained state at the broker in seconds: an old one expires unless a sweep publishes it again."""
STORED_WITHIN_S: Final = 2.0
"""A broker gives what it has stored under a filter by then."""
QUIET_S: Final = 0.2
"""Silence in seconds after which the broker has sent all that it has stored."""


class Retained:
    """The documents of a mirror at the broker; the newest of each is published, not each one in between."""

    def __init__(self, root: str, mirror: Mirror, figures: Figures) -> None:
        self._root, self._mirror, self._figures = root, mirror, figures
        self._due: dict[str, None] = {}
        self._news = asyncio.Event()

    def note(self, path: str, _document: Document | None) -> None:
        """Have a document told, or that it is gone."""
        self._due[path] = None
        self._news.set()

    async def tell(self, connection: Connection, told_all: Callable[[], object]) -> None:
        """Tell all that is known, and then what changes, until the connection fails.

        :raises aiomqtt.MqttError: it has.
        """
        await self._mirror.known.wait()
        self._due |= dict.fromkeys(self._mirror.documents)
        while True:
            due, self._due = self._due, {}
            await self._publish(connection, due)
            if not self._due:
                told_all()
                self._news.clear()
                await self._news.wait()

    async def _publish(self, connection: Connection, paths: Iterable[str]) -> None:
        left = iter(paths)

        async def publish_next() -> None:
            for path in left:
                await self._publish_one(connection, path)

        await asyncio.gather(*(publish_next() for _ in range(STATES_AT_ONCE)))

    async def _publish_one(self, connection: Connection, path: str) -> None:
        topic = f"{self._root}/{topic_of(path)}"
        if path not in self._mirror.documents:
            await connection.publish(topic, b"", retain=True)
            return
        stays = path.startswith("/alarms/")
        payload = written(state_of(path, self._mirror.documents))
        await connection.publish(topic, payload, retain=True, expires_in_s=None if stays else EXPIRES_IN_S)
        self._figures.documents.inc()

    def topics(self) -> set[str]:
        """Give the topics of all that is known."""
        return {f"{self._root}/{topic_of(path)}" for path in self._mirror.documents}


def filters(root: str) -> list[str]:
    """Give the filters of all that is retained below a root."""
    return [f"{root}/{state}" for state in STATES]


async def clear_stale(
    connection: Connection, listener: aiomqtt.Client, retained: Retained, root: str
) -> None:
    """Take back what an earlier life has left at the broker of things that are there no more."""
    ours = retained.topics()
    for topic_filter in filters(root):
        await listener.subscribe(topic_filter, qos=0)
    stale: list[str] = []
    try:
        async with asyncio.timeout(STORED_WITHIN_S) as patience:
            async for message in listener.messages:
                if message.retain and str(message.topic) not in ours:
                    stale.append(str(message.topic))
                quiet_at = asyncio.get_running_loop().time() + QUIET_S
                patience.reschedule(min(patience.when() or quiet_at, quiet_at))
    except TimeoutError:
        pass
    for topic in stale:
        await connection.publish(topic, b"", retain=True)
