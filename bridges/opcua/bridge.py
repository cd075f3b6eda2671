"""The bridge to OPC UA: a server, and what keeps its nodes as the plant is."""

import asyncio
import gc
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Final

from asyncua import ua
from motion_gateway_client import GatewayError

from bridges.common.mirror import Document
from bridges.common.process import Host, Kind
from bridges.opcua.certificates import Trusted, own_certificate
from bridges.opcua.checks import check
from bridges.opcua.events import Events, is_end
from bridges.opcua.locks import Locks
from bridges.opcua.methods import Commands, PlantMethods
from bridges.opcua.nodes import Space, share_constants
from bridges.opcua.plant import Axis, Plant
from bridges.opcua.sessions import sign_in
from bridges.opcua.settings import OpcuaFile
from bridges.opcua.stack import PlantListener, PlantServer, forget_sources, quiet_library

log = logging.getLogger(__name__)

SIDE: Final = "listener"
FOLDER: Final = "opcua"
"""Folder in the data directory for the certificates of the server and of its clients."""
LIVE: Final = ("body.position", "robot.position")
LOOK_S: Final = 0.5
"""Interval in seconds between checks of the monitored positions and of the connection to the gateway."""
TRY_AGAIN_S: Final = 5.0
KEYS_EVERY_S: Final = 15.0
"""Interval in seconds between checks that the keys of open sessions are still valid."""
KEY_EVENTS: Final = frozenset({"gateway.key.revoked", "gateway.key.expired"})
READ_WITHIN_S: Final = 2.0
"""A client that asks for new values gets those that were read by then."""
READERS: Final = 4
NEWEST_S: Final = 0.05
"""Values that are younger are not read again."""


class Bridge:
    """Everything that goes on between a gateway and the server."""

    def __init__(self, file: OpcuaFile, host: Host) -> None:
        self._file, self._host = file, host
        folder = host.data / FOLDER
        self._folder = folder
        trusted = Trusted(file.opcua.trusted or folder / "trusted", folder / "rejected")
        self._server = PlantServer(partial(sign_in, host.callers), trusted)
        self._listener = PlantListener(
            self._server, file.place, file.opcua.application_uri, f"motion-gateway {host.name}"
        )
        self._space = Space(self._listener)
        commands = Commands(host.figures)
        self._locks = Locks(self._space, commands, host.gateway)
        self._methods = PlantMethods(self._space, commands, self._locks)
        self._plant = Plant(self._space, host.mirror, self._methods, file.opcua.good_for_s)
        self._plant.is_connected = lambda: host.state.is_up("gateway")
        self._events = Events(self._space, self._server, commands)
        self._due: dict[str, None] = {}
        self._news = asyncio.Event()
        self._keys_due = asyncio.Event()
        host.mirror.on_change = self._note
        host.state.on_change = self._note_all
        self._server.address_of = self._space.address_of
        self._server.refresh = self._refresh

    async def run(self) -> None:
        """Work until cancelled; then all sessions end, and what moves goes on."""
        with _building():
            await self._make()
        await self._host.mirror.known.wait()
        with _building():
            await self._tell_due()
            share_constants(self._server.aspace)
        port = await self._listener.listen()
        host, _ = self._file.place
        log.info(
            "clients connect to opc.tcp://%s:%s/ and are trusted by %s",
            host,
            port,
            self._server.trusted.folder,
        )
        self._host.state.up(SIDE)
        try:
            async with asyncio.TaskGroup() as group:
                for work in self._works():
                    group.create_task(work)
        finally:
            await self._listener.end()

    def _works(self) -> list[Any]:
        return [
            self._host.feed.run(self._take),
            self._tell_changes(),
            self._plant.grow_old(),
            self._follow_monitored(),
            self._read_limits(),
            self._judge_keys(),
            self._locks.run(),
            self._work(),
        ]

    async def _make(self) -> None:
        quiet_library()
        certificate, key = own_certificate(self._folder, self._file.opcua.application_uri)
        await self._listener.init()
        forget_sources()
        share_constants(self._server.aspace)
        await self._listener.load_certificate(certificate)
        await self._listener.load_private_key(key)
        await self._space.load()
        self._methods.of_plant()
        self._events.load()

    # the gateway's side

    def _note(self, path: str, _document: Document | None) -> None:
        self._due[path] = None
        self._news.set()

    def _note_all(self) -> None:
        """Have everything told anew: without the gateway nothing is known."""
        self._due |= dict.fromkeys(self._host.mirror.documents)
        self._news.set()

    async def _tell_changes(self) -> None:
        while True:
            await self._news.wait()
            self._news.clear()
            await self._tell_due()

    async def _tell_due(self) -> None:
        due, self._due = self._due, {}
        alarms = [path for path in due if path.startswith("/alarms/")]
        await self._plant.update([path for path in due if path not in alarms])
        for path in alarms:
            await self._events.tell_alarm(path.rpartition("/")[2], self._host.mirror.documents.get(path))
        self._host.figures.documents.inc(len(due))

    async def _take(self, event: dict[str, Any]) -> None:
        """Tell what an event says; nothing is kept for clients that are away."""
        if is_end(event["type"]):
            await self._events.tell_move(event)
        elif ".lease." in event["type"]:
            self._locks.news.set()
        elif event["type"] in KEY_EVENTS:
            self._keys_due.set()
        self._host.figures.events.inc()
        self._host.position.reach(event["cursor"])

    async def _follow_monitored(self) -> None:
        """Have the positions that clients monitor read live, and no others."""
        following: asyncio.Task[None] | None = None
        followed: frozenset[str] = frozenset()
        try:
            while True:
                wanted = frozenset(self._monitored())
                if wanted != followed:
                    if following is not None:
                        following.cancel()
                    followed = wanted
                    following = asyncio.create_task(self._follow(wanted)) if wanted else None
                await asyncio.sleep(LOOK_S)
        finally:
            if following is not None:
                following.cancel()

    def _monitored(self) -> set[str]:
        space = self._space
        return {
            axis.path.split("/", 2)[2]
            for axis in self._plant.axes.values()
            if space.is_monitored(space.id(f"{axis.node}.ActualPosition"))
        }

    async def _follow(self, addresses: frozenset[str]) -> None:
        gateway, rate = self._host.gateway, self._file.opcua.position_rate
        while True:
            try:
                async for event in gateway.events(bodies=sorted(addresses), types=LIVE, sample=rate):
                    if event["type"] in LIVE:
                        await self._tell_live(event)
            except GatewayError as error:
                log.warning("positions are not followed: %s", error)
            await asyncio.sleep(TRY_AGAIN_S)

    async def _tell_live(self, event: Any) -> None:
        for axis in self._plant.axes_of(event["subject"]):
            await self._tell_read(axis, {**event["data"], "read_at": event["time"]})

    async def _tell_read(self, axis: Axis, position: Document) -> None:
        if axis.name is None:
            self._plant.note(axis, position["pulses"], position["read_at"])
        elif position["coordinates"] == "user" and axis.name in position["axes"]:
            self._plant.note(axis, position["axes"][axis.name]["value"], position["read_at"])
        await self._plant.tell_position(axis)

    async def _read_limits(self) -> None:
        """Ask each axis once for its soft limits, slowly: they change seldom."""
        while True:
            for axis in [
                axis for axis in self._plant.axes.values() if axis.is_online and not axis.limits_known
            ]:
                try:
                    await self._read_limits_of(axis)
                except GatewayError as error:
                    log.info("soft limits of %s cannot be read yet: %s", axis.node, error)
            await asyncio.sleep(TRY_AGAIN_S)

    async def _read_limits_of(self, axis: Axis) -> None:
        if axis.name is not None:
            await self._plant.tell_no_limits(axis)  # to ask would select its unit
            return
        limits = await self._host.gateway.call("POST", f"{axis.path}/commands/get-soft-limits", body={})
        await self._plant.tell_limits(axis, limits["lower"] / axis.scale, limits["upper"] / axis.scale)

    # the clients' side

    async def _refresh(self, nodes: list[ua.NodeId], max_age_s: float) -> None:
        """Read positions again that are older than a client takes, as far as they come in time."""
        wanted = {node for node in nodes if str(node.Identifier).endswith(".ActualPosition")}
        if not wanted:
            return
        axes = [
            axis
            for axis in self._plant.axes.values()
            if self._space.id(f"{axis.node}.ActualPosition") in wanted
        ]
        newest_s = max(max_age_s, NEWEST_S)
        left = iter({axis.path for axis in axes if axis.is_online and self._plant.age_s(axis) > newest_s})

        async def read_next() -> None:
            for path in left:
                await self._read(path)

        reading = [asyncio.ensure_future(read_next()) for _ in range(READERS)]
        _, late = await asyncio.wait(reading, timeout=READ_WITHIN_S)
        for task in late:
            task.cancel()

    async def _read(self, path: str) -> None:
        try:
            position = await self._host.gateway.call("GET", f"{path}/position")
        except GatewayError:
            return  # what is known stays, with its age
        for axis in self._plant.axes_of(path):
            await self._tell_read(axis, position)

    async def _judge_keys(self) -> None:
        """End sessions whose keys the gateway does not know any more."""
        while True:
            try:
                async with asyncio.timeout(KEYS_EVERY_S):
                    await self._keys_due.wait()
            except TimeoutError:
                pass
            self._keys_due.clear()
            for session in self._server.sessions:
                if session.guest is not None and not await session.guest.is_known():
                    log.warning("the session of %s ends: its key is not good any more", session.guest.name)
                    await session.close_session(True)

    async def _work(self) -> None:
        """Tell the watchdog that clients are served."""
        while True:
            self._host.life.worked(SIDE)
            await asyncio.sleep(LOOK_S)


@contextmanager
def _building() -> Iterator[None]:
    """Collect no garbage while nodes are made, which takes a third off the time, nor any of them later."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
    gc.collect()
    gc.freeze()


def protocol(file: OpcuaFile) -> Any:
    """Give what the bridge's process runs."""
    return lambda host: Bridge(file, host).run()


KIND: Final = Kind(OpcuaFile, ("gateway", SIDE), protocol, check)
