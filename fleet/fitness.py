"""Servers and streams that must not be used for a plant, seen before anything relies on them.

A server that does not sync each message acknowledges events that a power cut takes back; a stream with two
replicas stops with either server; docs/plant.md names who has measured that.
"""

import json
import logging
from collections.abc import Iterator
from typing import Any, Final
from urllib.error import URLError
from urllib.parse import urlsplit
from urllib.request import urlopen

from fleet.engine import (
    EngineTrouble,
    Unfit,
    connected,
    fault_of_stream,
    registry_settings,
    require_fit,
    stream_settings,
)
from gateway.membership import Engine

log = logging.getLogger(__name__)

MONITOR_PORT: Final = 8222
"""Default port on which servers publish their settings."""
WITHIN_S: Final = 2.0
OLDEST: Final = (2, 12)
"""The first version that takes several events together or not at all."""
_STREAMS: Final = ("PLANT", "KV_gateways")


def faults_of(engine: Engine) -> Iterator[str]:
    """Why the servers must not be used, one sentence each; takes seconds where they do not answer."""
    for monitor in _monitors(engine):
        try:
            told, streams = _asked(f"{monitor}/varz"), _asked(f"{monitor}/jsz?streams=true&config=true")
        except (OSError, ValueError):
            continue
        yield from (
            f"{monitor}: {fault}" for fault in (*_faults_of_server(told), *_faults_of_streams(streams))
        )


def unseen(engine: Engine) -> Iterator[str]:
    """Servers that do not tell their settings, one sentence each."""
    for monitor in _monitors(engine):
        try:
            _asked(f"{monitor}/varz")
        except (OSError, ValueError) as error:
            why = getattr(error, "reason", None) or error
            yield (
                f"plant: nobody can see at {monitor} whether sync_interval is always ({why}): name the "
                "monitoring address of each server in plant.monitor"
            )


async def require_fit_streams(engine: Engine, name: str) -> None:
    """Look at the streams that there are; servers that are away say nothing against them.

    :raises Unfit: one must not be used as it is.
    """
    try:
        async with connected(engine, name, f"_INBOX_{name}") as connection:
            for settings in (stream_settings(1), registry_settings(1)):
                told = await connection.ask(f"STREAM.INFO.{settings['name']}")
                require_fit(told.get("config"))
    except EngineTrouble as trouble:
        if isinstance(trouble, Unfit):
            raise
        log.info("the streams of the plant cannot be looked at now: %s", trouble)


def _monitors(engine: Engine) -> list[str]:
    if engine.monitor:
        return list(engine.monitor)
    hosts = dict.fromkeys(urlsplit(url).hostname or "" for url in engine.servers)
    return [f"http://{f'[{host}]' if ':' in host else host}:{MONITOR_PORT}" for host in hosts]


def _asked(url: str) -> Any:
    try:
        with urlopen(url, timeout=WITHIN_S) as answer:  # noqa: S310  # of the configuration, http or https
            return json.loads(answer.read())
    except URLError as error:
        raise OSError(error.reason) from error


def _faults_of_server(told: Any) -> Iterator[str]:
    version = str(told.get("version", ""))
    if tuple(int(number) for number in version.split(".")[:2] if number.isdecimal()) < OLDEST:
        yield f"nats-server {version or 'without a version'} is too old: the plant takes 2.12 or newer"
    settings = (told.get("jetstream") or {}).get("config")
    if not settings:
        yield "the server runs without JetStream: start it with jetstream { sync_interval: always }"
    elif not settings.get("sync_always"):
        seconds = settings.get("sync_interval", 0) / 1e9
        yield (
            f"sync_interval is {seconds:g} s, not always: what it has acknowledged is gone after a power "
            "cut. Set jetstream { sync_interval: always }"
        )


def _faults_of_streams(told: Any) -> Iterator[str]:
    for account in told.get("account_details") or ():
        for stream in account.get("stream_detail") or ():
            if stream["name"] in _STREAMS and (fault := fault_of_stream(stream.get("config") or {})):
                yield f"stream {stream['name']}: {fault}"
