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

MESSAGES: Final = 200
APART_S: Final = 0.001
"""A broker that waits for the acknowledgement of TCP holds up what follows so closely."""
SLOW_S: Final = 0.01
"""Delay in seconds, from a publish to its arrival, that five of 100 messages exceed with such a broker."""
ROUNDS: Final = 3
"""The middle one counts: the machine may be busy in another."""
WITHIN_S: Final = 10.0
Say = Callable[[str], object]


async def check(file: MqttFile, say: Say) -> list[str]:
    """Connect, and measure from a publish to its arrival; gives what is wrong, a sentence each."""
    host, port = file.mqtt.place
    topic = f"{file.root}/check/{secrets.token_hex(4)}"
    try:
        rounds = [sorted(await _delays_s(file, topic)) for _ in range(ROUNDS)]
    except (aiomqtt.MqttError, OSError, ValueError) as error:
        return [f"mqtt.url: the broker at {host}:{port} cannot be used: {error}"]
    if not all(rounds):
        return [
            f"mqtt.url: what is published at {topic} does not come back: the bridge's user has to be allowed "
            "to write and to read it"
        ]
    half_s, most_s = (median(delays[int(share * len(delays))] for delays in rounds) for share in (0.5, 0.95))
    say(
        f"mqtt.url: the broker at {host}:{port} lets the bridge in; half of the messages arrive within "
        f"{1e3 * half_s:.1f} ms, 95 of 100 within {1e3 * most_s:.1f} ms"
    )
    if most_s < SLOW_S:
        return []
    return [
        f"mqtt.url: five of 100 messages take {1e3 * most_s:.0f} ms, as with a broker that waits for "
        "acknowledgements of TCP: set `set_tcp_nodelay true` in mosquitto.conf, or what your broker calls it"
    ]


async def _delays_s(file: MqttFile, topic: str) -> list[float]:
    """Send messages one closely after the other to another client; one that is lost has no delay."""
    delays: list[float] = []

    async def hear(client: aiomqtt.Client) -> None:
        async for message in client.messages:
            delays.append(time.perf_counter() - float(bytes(message.payload)))
            if len(delays) == MESSAGES:
                return

    async with (
        new_client(file, None, suffix="-check") as one,
        new_client(file, None, suffix="-heard") as other,
    ):
        await other.subscribe(topic, qos=0)
        hearing = asyncio.create_task(hear(other))
        connection = Connection(one, v5=file.mqtt.version == "5")
        for _ in range(MESSAGES):
            await connection.publish(topic, repr(time.perf_counter()).encode())
            await asyncio.sleep(APART_S)
        await asyncio.wait([hearing], timeout=WITHIN_S)
        hearing.cancel()
    return delays
