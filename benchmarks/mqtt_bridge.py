"""The delay that a bridge to MQTT adds: to an event, to a stop, and to the stops of others.

The yardsticks are the gateway's own WebSocket and its HTTP, in the same run; the broker is a mosquitto.
"""

import asyncio
import json
import shutil
import sys
import time
from asyncio.subprocess import Process
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from uuid import uuid4

import aiomqtt
import httpx
from motion_gateway_client import AsyncGateway
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from websockets.asyncio.client import connect

from benchmarks.figures import Figure, Target
from benchmarks.gateways import gateway_on_line
from benchmarks.http_client import Door
from benchmarks.processes import MOTION_GATEWAY, accepts, free_port, running, set_apart
from benchmarks.stop_latency import full_gateway, stops_ms
from bridges.common.mirror import Mirror
from bridges.common.state import Figures
from bridges.mqtt.broker import NO_DELAY, Connection
from bridges.mqtt.retained import Retained

BODIES = list(range(8))
MOVERS = BODIES[:7]
STOPPED = "07"
MANY = 1200
START_S = 60.0
WARM_S = 3.0
ROOT = "motion/bench"
MOVE = {"kind": "relative", "direction": "cw", "distance": {"value": 10, "unit": "pulse"}}
ROUNDS = 4
"""Rounds, without a bridge and beside one in turn."""
ELSEWHERE = 5
"""Niceness of the bridge and its broker, which stand for another machine: the gateway goes first."""
WAYS = ("p50", 0.5), ("p99", 0.99)
FIRST_STOPS, LEAST_STOPS = 20, 1000
"""Stops of each way: the first find connections, models and routes new; of the rest ten are beyond p99."""


async def run(seconds: float) -> list[Figure]:
    """Measure events and stops with movers that move all the time, and 1,200 states after a connect."""
    if shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin") is None:
        return []
    with set_apart() as apart:
        async with AsyncExitStack() as stack:
            _, web = await stack.enter_async_context(gateway_on_line(BODIES, apart))
            broker = await stack.enter_async_context(_broker())
            http = await stack.enter_async_context(
                httpx.AsyncClient(base_url=f"http://127.0.0.1:{web}", timeout=60)
            )
            await stack.enter_async_context(_bridge(web, broker))
            async with _moving(http), _Client(broker) as client:
                by_socket, by_mqtt = await _arrivals(web, broker, seconds / 5)
                by_http, by_command = await _in_turn(
                    lambda: _stop_by_http(http), client.stop, seconds=2 * seconds / 5
                )
            states_s = await _states_s(broker)
    alone, held_alone, beside, held_beside = await _stops_to_the_line(2 * seconds / 5)
    later = sorted(1e3 * (by_mqtt[key] - by_socket[key]) for key in by_mqtt.keys() & by_socket.keys())
    rate = len(later) / (seconds / 5)
    behind = zip(WAYS, (5.0, 20.0), strict=True)
    return [
        *(
            Figure(
                f"MQTT: event after the WebSocket at {rate:.0f}/s: {name}",
                "ms",
                [_at(later, share)],
                [0.0],
                Target("figure", "<=", most),
            )
            for (name, share), most in behind
        ),
        Figure(
            "MQTT: stop by it over one by HTTP: p99",
            f"ms of {len(by_command)}",
            [_at(by_command, 0.99)],
            [_at(by_http, 0.99)],
            Target("ratio", "<=", 1.2),
        ),
        Figure(
            "MQTT: stop to the line beside a bridge: p99",
            "ms",
            [_at(beside, 0.99)],
            [_at(alone, 0.99)],
            Target("ratio", "<=", 1.1),
        ),
        Figure(
            "MQTT: the gateway's loop held longest beside a bridge",
            "ms",
            [max(held_beside, default=0.0)],
            [max(held_alone, default=0.0)],
            Target("figure", "<=", 10.0),
        ),
        Figure(f"MQTT: {MANY} states after a connect", "s", [states_s], [1.0], Target("figure", "<=", 1.0)),
    ]


async def _stops_to_the_line(seconds: float) -> tuple[list[float], list[float], list[float], list[float]]:
    """Stop moving bodies, without a bridge and beside one; and how long the gateway's loop was held."""
    held: list[tuple[float, float]] = []

    async def watch(process: Process) -> None:
        assert process.stdout
        while said := await process.stdout.readline():
            at, held_ms = map(float, said.split())
            held.append((at, held_ms))

    async def stop_and_watch(stops: list[float], pauses: list[float]) -> None:
        begun_at = time.monotonic()
        stops += await stops_ms(line, Door(web), seconds / (2 * ROUNDS))
        pauses += [held_ms for at, held_ms in held if at >= begun_at]

    alone, held_alone, beside, held_beside = [list[float]() for _ in range(4)]
    async with full_gateway(program="benchmarks.watched_loop") as (line, web, process):
        watching = asyncio.create_task(watch(process))
        await stops_ms(line, Door(web), WARM_S)  # models and routes are built when they are used first
        for _ in range(ROUNDS):
            await stop_and_watch(alone, held_alone)
            async with _broker(ELSEWHERE) as broker, _bridge(web, broker, ELSEWHERE):
                await stop_and_watch(beside, held_beside)
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)
    return alone, held_alone, beside, held_beside


def _at(values: list[float], share: float) -> float:
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


@asynccontextmanager
async def _broker(nice: int = 0) -> AsyncIterator[int]:
    port = free_port()
    program = (
        shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin") or "mosquitto"
    )
    with TemporaryDirectory() as folder:
        config = Path(folder) / "mosquitto.conf"
        config.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\nset_tcp_nodelay true\n")
        async with running(program, "-c", str(config), nice=nice):
            await _until(lambda: accepts(port))
            yield port


async def _until(look: Callable[[], Awaitable[bool]]) -> None:
    async with asyncio.timeout(START_S):
        while not await look():  # noqa: ASYNC110  # another program tells nobody
            await asyncio.sleep(0.05)


@asynccontextmanager
async def _bridge(web: int, broker: int, nice: int = 0) -> AsyncIterator[None]:
    listen = free_port()
    with TemporaryDirectory() as folder:
        config = Path(folder) / "bridge.toml"
        config.write_text(
            f'[gateway]\nurl = "http://127.0.0.1:{web}"\nname = "bench"\n'
            f'[bridge]\nlisten = "127.0.0.1:{listen}"\nlog_level = "warning"\n'
            f'[callers.me]\n[mqtt]\nurl = "mqtt://127.0.0.1:{broker}"\ncommands = true\n'
        )
        command = [*MOTION_GATEWAY, "bridge", "mqtt", "--config", str(config), "--data", folder]
        async with running(sys.executable, *command, nice=nice), httpx.AsyncClient() as http:

            async def online() -> bool:
                try:
                    return (await http.get(f"http://127.0.0.1:{listen}/status")).is_success
                except httpx.TransportError:
                    return False

            await _until(online)
            yield


@asynccontextmanager
async def _moving(http: httpx.AsyncClient) -> AsyncIterator[None]:
    """Have bodies move all the time."""

    async def move(body: int) -> None:
        while True:
            await http.post(f"/bodies/{body:02X}/moves?wait=5", json=MOVE)

    tasks = [asyncio.create_task(move(body)) for body in MOVERS]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def _arrivals(web: int, broker: int, seconds: float) -> tuple[dict[str, float], dict[str, float]]:
    """Note when each event arrives by WebSocket and by MQTT."""
    by_socket: dict[str, float] = {}
    by_mqtt: dict[str, float] = {}

    async def hear_socket() -> None:
        async with connect(f"ws://127.0.0.1:{web}/events") as socket:
            async for text in socket:
                by_socket[json.loads(text)["id"]] = time.monotonic()

    async def hear_mqtt() -> None:
        async with aiomqtt.Client("127.0.0.1", broker, socket_options=NO_DELAY) as client:
            await client.subscribe(f"{ROOT}/events/#", qos=1)
            async for message in client.messages:
                by_mqtt[json.loads(bytes(message.payload))["id"]] = time.monotonic()

    tasks = [asyncio.create_task(hearing) for hearing in (hear_socket(), hear_mqtt())]
    await asyncio.sleep(seconds)
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    return by_socket, by_mqtt


async def _in_turn(*ways: Callable[[], Awaitable[object]], seconds: float) -> list[list[float]]:
    """Stop in one way and then in the other: what else goes on meets both. Gives milliseconds by ways."""
    took: list[list[float]] = [[] for _ in ways]
    end_at = time.monotonic() + seconds
    while time.monotonic() < end_at or len(took[0]) < FIRST_STOPS + LEAST_STOPS:
        for stop, times in zip(ways, took, strict=True):
            begun_at = time.monotonic()
            await stop()
            times.append(1e3 * (time.monotonic() - begun_at))
    return [times[FIRST_STOPS:] for times in took]


async def _stop_by_http(http: httpx.AsyncClient) -> None:
    (await http.post(f"/bodies/{STOPPED}/stop", json={})).raise_for_status()


class _Client:
    """Commands over MQTT, and waits for the answers."""

    def __init__(self, broker: int) -> None:
        self._answers = f"answers/{uuid4().hex}"
        self._client = aiomqtt.Client(
            "127.0.0.1", broker, protocol=aiomqtt.ProtocolVersion.V5, socket_options=NO_DELAY
        )

    async def __aenter__(self) -> "_Client":
        await self._client.__aenter__()
        await self._client.subscribe(self._answers, qos=1)
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._client.__aexit__(None, None, None)

    async def stop(self) -> None:
        properties = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
        properties.ResponseTopic = self._answers
        await self._client.publish(
            f"{ROOT}/cmd/me/bodies/{STOPPED}/stop", b"{}", qos=1, properties=properties
        )
        answer = await anext(aiter(self._client.messages))
        assert json.loads(bytes(answer.payload))["status"] == 200


async def _states_s(broker: int) -> float:
    """Tell 1,200 states that are known to a broker."""
    mirror = Mirror(AsyncGateway())
    body = {"online": True, "moving": False, "position": 0, "homed": "yes", "name": "x" * 20, "status": []}
    for number in range(MANY):
        name = f"line{number // 120}.{number % 120:02X}"
        mirror.documents[f"/bodies/{name}"] = {**body, "body_id": name}
    mirror.known.set()
    told = asyncio.Event()
    async with aiomqtt.Client(
        "127.0.0.1",
        broker,
        protocol=aiomqtt.ProtocolVersion.V5,
        socket_options=NO_DELAY,
        max_inflight_messages=64,
    ) as client:
        client.pending_calls_threshold = 1 << 20
        begun_at = time.monotonic()
        telling = asyncio.create_task(
            Retained("many", mirror, Figures()).tell(Connection(client, v5=True), told.set)
        )
        await told.wait()
        took_s = time.monotonic() - begun_at
        telling.cancel()
        await asyncio.gather(telling, return_exceptions=True)
    return took_s
