"""Tries the broker of a bridge's file: whether it lets the bridge in, and how long it takes."""

import asyncio
import secrets
import time
from collections.abc import Callable
from statistics import median
from typing import Final

import aiomqtt

from bridges.mqtt.broker import Connection, new_client
from bridges.mqtt.settings import MqttFile

TRIES: Final = 20
SLOW_S: Final = 0.02
"""A broker on the same network that takes longer waits for acknowledgements of TCP."""
Say = Callable[[str], object]


async def check(file: MqttFile, say: Say) -> list[str]:
    """Connect, and measure from a publish to its arrival; gives what is wrong, a sentence each."""
    host, port = file.mqtt.place
    topic = f"{file.root}/check/{secrets.token_hex(4)}"
    try:
        async with new_client(file, None, suffix="-check") as client:
            await client.subscribe(topic, qos=1)
            delay_s = await _delay_s(Connection(client, v5=file.mqtt.version == "5"), topic)
    except (aiomqtt.MqttError, OSError, ValueError) as error:
        return [f"mqtt.url: the broker at {host}:{port} cannot be used: {error}"]
    except TimeoutError:
        return [
            f"mqtt.url: what is published at {topic} does not come back: the bridge's user has to be allowed "
            "to write and to read it"
        ]
    say(
        f"mqtt.url: the broker at {host}:{port} lets the bridge in; a message arrives after "
        f"{1e3 * delay_s:.1f} ms"
    )
    if delay_s < SLOW_S:
        return []
    return [
        f"mqtt.url: the broker takes {1e3 * delay_s:.0f} ms to hand on a message, for it waits for "
        "acknowledgements of TCP: set `set_tcp_nodelay true` in mosquitto.conf, or what your broker calls it."
    ]


async def _delay_s(connection: Connection, topic: str) -> float:
    delays: list[float] = []
    async with asyncio.timeout(10.0):
        for number in range(TRIES):
            begun_at = time.perf_counter()
            publishing = asyncio.create_task(connection.publish(topic, str(number).encode()))
            await anext(aiter(connection.client.messages))
            delays.append(time.perf_counter() - begun_at)
            await publishing
    return median(delays)
