"""The cost of a bridge to OPC UA with 120 axes: its start, its memory, and 1,200 changes a second."""

import asyncio
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from statistics import quantiles
from tempfile import TemporaryDirectory
from typing import Any, Final

from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

from benchmarks.figures import Figure, Target
from benchmarks.opcua_gateway import CHANGES_PER_S, addresses
from benchmarks.processes import MOTION_GATEWAY, cpu_s, free_port, module, resident_mib, serving
from tests.bridges.opcua.stand import URI, make_certificate

ROUNDS: Final = 3
ITEMS: Final = (
    "ActualPosition",
    "Online",
    "Moving",
    "Homed",
    "PowerCycled",
    "MoveId",
    "Lock.Locked",
    "Lock.LockingUser",
    "Lock.LockingClient",
    "Lock.RemainingLockTime",
)
PUBLISHING_MS: Final = 100
SETTLE_S: Final = 2.0


async def run(seconds: float) -> list[Figure]:
    """Start a bridge on a stand-in for a gateway, and monitor ten values of each of 120 axes."""
    rounds = [await _round(seconds) for _ in range(ROUNDS)]
    start_s, bare_s, mib, p99_ms, share = zip(*rounds, strict=True)
    publishing = [float(PUBLISHING_MS)] * ROUNDS
    nothing = [0.0] * ROUNDS
    return [
        # 4 s where the bare server takes 1.8 s, as on a quiet core.
        Figure("OPC UA, 120 axes: start to ready", "s", start_s, bare_s, Target("figure", "<=", 4.0)),
        Figure("OPC UA, 120 axes: memory", "MiB", mib, nothing, Target("figure", "<=", 160.0)),
        Figure("OPC UA, 1200 items, 1200/s: p99", "ms", p99_ms, publishing, Target("ratio", "<=", 3.0)),
        Figure("OPC UA, 1200 changes/s: processor", "%", share, nothing, Target("figure", "<=", 20.0)),
    ]


async def _round(seconds: float) -> tuple[float, float, float, float, float]:
    with TemporaryDirectory() as folder:
        place = Path(folder)
        gateway, port = free_port(), free_port()
        certificate, key = _certificate(place)
        config = place / "bridge.toml"
        config.write_text(
            f"[gateway]\nurl = 'http://127.0.0.1:{gateway}'\n"
            f"[opcua]\nlisten = '127.0.0.1:{port}'\ntrusted = '{place / 'trusted'}'\nposition_rate = 10.0\n"
        )
        bare_s = await _bare_s()
        program = ["bridge", "opcua", "--config", str(config), "--data", str(place / "data")]
        async with module("benchmarks.opcua_gateway", gateway):
            begun_at = time.perf_counter()
            async with serving([*MOTION_GATEWAY, *program], port, None) as bridge:
                start_s = time.perf_counter() - begun_at
                client = _client(f"opc.tcp://127.0.0.1:{port}/")
                await client.set_security(
                    SecurityPolicyBasic256Sha256,
                    certificate,
                    key,
                    mode=ua.MessageSecurityMode.SignAndEncrypt,
                )
                async with client:
                    heard = _Heard()
                    await _monitor(client, heard)
                    await asyncio.sleep(SETTLE_S)
                    heard.delays_ms.clear()
                    used_s, measured_at = cpu_s(bridge), time.perf_counter()
                    await asyncio.sleep(seconds)
                    took_s = time.perf_counter() - measured_at
                    share = 100 * (cpu_s(bridge) - used_s) / took_s
                    p99_ms = quantiles(heard.delays_ms, n=100)[98]
                    if len(heard.delays_ms) < 0.9 * seconds * CHANGES_PER_S * len(addresses()):
                        raise RuntimeError(f"Of the changes only {len(heard.delays_ms)} have come.")
                return start_s, bare_s, resident_mib(bridge.pid), p99_ms, share


async def _bare_s() -> float:
    """Start the library's own server with nothing in it, and give how long that takes."""
    script = "import asyncio; from asyncua import Server; asyncio.run(Server().init())"
    begun_at = time.perf_counter()
    process = await asyncio.create_subprocess_exec(sys.executable, "-c", script)
    await process.wait()
    return time.perf_counter() - begun_at


class _Heard:
    """The delays of the positions that a client hears."""

    def __init__(self) -> None:
        self.delays_ms: list[float] = []

    def datachange_notification(self, _node: Any, value: Any, data: Any) -> None:
        """Keep how old a position is when it comes."""
        source = data.monitored_item.Value.SourceTimestamp
        if isinstance(value, float) and source is not None:
            self.delays_ms.append(1e3 * (datetime.now(UTC) - source).total_seconds())


async def _monitor(client: Client, heard: _Heard) -> None:
    own = await client.get_namespace_index("urn:motion-gateway")
    nodes = [
        client.get_node(ua.NodeId(f"{address}.{item}", own)) for address in addresses() for item in ITEMS
    ]
    subscription = await client.create_subscription(PUBLISHING_MS, heard)
    await subscription.subscribe_data_change(nodes)


def _client(url: str) -> Client:
    client = Client(url, timeout=60)
    client.application_uri = URI
    client.set_user("everybody")
    client.set_password("any")
    return client


def _certificate(folder: Path) -> tuple[Path, Path]:
    """Make a client's certificate, which the bridge trusts, and its key."""
    trusted = folder / "trusted"
    trusted.mkdir()
    certificate, key = make_certificate(folder)
    return certificate.replace(trusted / certificate.name), key
