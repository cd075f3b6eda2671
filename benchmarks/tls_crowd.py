"""A stop while 200 clients read and 100 follow events, all over TLS and with keys.

The yardstick is the same gateway before they come.
"""

import asyncio
import ssl
import subprocess
from contextlib import AsyncExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from benchmarks.figures import Figure
from benchmarks.gateways import write_config
from benchmarks.http_client import Door
from benchmarks.processes import announced, free_port, gateway, set_apart
from benchmarks.stop_latency import BODIES, MOVERS, Line, quantile_ms, stops_ms, teach_speeds
from gateway.access.keys import KeyStore
from gateway.access.roles import Role
from simulator.ports import serve_tcp
from simulator.rorze.line import build_line

READERS = 200
SUBSCRIBERS = 100
QUIET_SHARE = 0.25


async def run(seconds: float) -> list[Figure]:
    """Stop moving bodies again and again, first alone and then among the crowd."""
    line = Line(build_line(BODIES, monotonic()))
    async with AsyncExitStack() as stack:
        wire = await serve_tcp(line, "127.0.0.1", 0)
        stack.push_async_callback(wire.aclose)
        folder, web = Path(stack.enter_context(TemporaryDirectory())), free_port()
        authority, key = _certificate(folder)
        config = write_config(folder, web, int(wire.address.rpartition(":")[2]), BODIES)
        limits = "requests_per_key = 50000\nmoves_per_key_and_s = 10000\nsubscribers_per_key = 1000"
        text = config.read_text().replace('mode = "open"', limits)
        config.write_text(
            text.replace("[server]", f'[server]\ntls_certificate = "{authority}"\ntls_key = "{key}"')
        )
        token = KeyStore(config.with_suffix(".data")).create("crowd", Role.ADMIN)
        await stack.enter_async_context(gateway(config, web, stack.enter_context(set_apart())))
        door = Door(web, token, ssl.create_default_context(cafile=authority))
        await asyncio.to_thread(teach_speeds, door, MOVERS)
        quiet = await stops_ms(line, door, QUIET_SHARE * seconds)
        crowd = ("-m", "benchmarks.tls_clients", str(web), str(authority), token, str(READERS))
        await stack.enter_async_context(announced(*crowd, str(SUBSCRIBERS)))
        loud = await stops_ms(line, door, (1 - QUIET_SHARE) * seconds)
    name = f"stop among {READERS} readers and {SUBSCRIBERS} subscribers over TLS"
    return [quantile_ms(f"{name}: p99", 0.99, loud, quiet, 20.0)]


def _certificate(folder: Path) -> tuple[Path, Path]:
    """Make a certificate for this machine, which vouches for itself, and its key."""
    certificate, key = folder / "tls.crt", folder / "tls.key"
    words = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 1 -subj /CN=benchmark"
    place = ("-addext", "subjectAltName=IP:127.0.0.1", "-out", str(certificate), "-keyout", str(key))
    subprocess.run(["openssl", *words.split(), *place], check=True, capture_output=True)
    return certificate, key
