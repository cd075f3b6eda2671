"""Scans of ports: who is there that no line serves, and the table that would serve it."""

import asyncio
import re
import secrets
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Final, Literal

from pydantic import Field, JsonValue

from gateway.config import Config, Server
from gateway.core import parts
from gateway.core.errors import BodyBusy, InvalidRequest
from gateway.core.events import EventHub
from gateway.core.records import Record
from gateway.core.supervisor import insist
from gateway.core.works import Jobs
from gateway.found import Found
from gateway.search import addresses_of, search, serial_devices
from transports import Transport
from transports.addresses import Address

HISTORY = 100
DEVICES: Final = {
    "serial": re.compile(r"/dev/(?:tty[A-Za-z]\w*|pts/\d+)", re.ASCII),
    "dpram": re.compile(r"/dev/uio\d+", re.ASCII),
}
"""The devices that a request may name: no disk, no memory, no console of the machine."""
_INSTEAD: Final = {
    "tcp": "Name an IP address in server.line_networks of the configuration file, or else a private one.",
    "device": "Name a device such as /dev/ttyUSB0 or /dev/uio0; others stand in the configuration file only.",
}
GATEWAY: Final = "The gateway"
"""Caller in whose name scans are made."""
BROKEN_OFF: Final = "It was broken off; what was found until then stands here."


class FoundPort(Record):
    """A controller that answered at a port."""

    address: str
    told: str = Field(description="The controllers in words.")
    line: dict[str, JsonValue] = Field(description="A table `[[lines]]` that serves it, for `POST /lines`.")
    comment: str = Field(
        description="Facts that the table does not hold; of a robot, settings to compare first."
    )


class PortScan(Record):
    """One scan of ports."""

    id: str
    ports: list[str]
    status: Literal["running", "finished", "failed"] = "running"
    doing: list[str] = Field(default_factory=list, description="Present work at the ports, in words.")
    found: list[FoundPort] = Field(
        default_factory=list,
        description="Controllers that were found, once the scan is over or was broken off.",
    )
    notes: list[str] = Field(default_factory=list, description="Reasons for which ports could not be asked.")
    error: str | None = None
    started_at: datetime
    ended_at: datetime | None = None


class Port(Record):
    """A serial port of the gateway's machine."""

    port: str
    line_id: str | None = Field(description="The line that has it.")


class PortScans(Jobs[PortScan]):
    """The scans of ports; one at a time."""

    def __init__(
        self, events: EventHub, config: Callable[[], Config], open_transport: Callable[[str], Transport]
    ) -> None:
        super().__init__(HISTORY, "scan of ports", lambda _: GATEWAY)
        self._events, self._config, self._open_transport = events, config, open_transport

    def ports(self) -> list[Port]:
        """The serial ports of this machine; it looks into directories."""
        return [
            Port(port=addresses, line_id=self._line_at(addresses_of(addresses)[0]))
            for addresses in serial_devices()
        ]

    def start(self, ports: Sequence[str]) -> PortScan:
        """Begin to ask who is at ports, at every baud rate where none is named; nothing moves.

        :raises BodyBusy: another scan of ports is running.
        :raises InvalidRequest: a port is none, is a file, or a line has it; nothing was sent.
        """
        for running in self.under_way():
            raise BodyBusy(f"Scan {running.id} of ports is still running.", "Wait for it, or break it off.")
        addresses = [self._free(port) for port in ports]
        scan = PortScan(id=secrets.token_hex(6), ports=list(ports), started_at=datetime.now(UTC))
        found: list[Found] = []
        task = self.begin(scan, self._run(scan, addresses, found), "scan of ports")
        ended = partial(self._ended, scan, found, task)
        task.add_done_callback(lambda _: insist("the end of a scan of ports", ended))
        return scan

    def _free(self, port: str) -> list[str]:
        try:
            addresses = addresses_of(port)
        except ValueError as error:
            raise InvalidRequest(
                f"{error}. Nothing was sent.",
                "Name ports as /dev/ttyUSB0, tcp://HOST:PORT or dpram:///dev/uio0.",
            ) from None
        if line_id := self._line_at(addresses[0]):
            raise InvalidRequest(
                f"Line {line_id} has the port {port}; nothing was sent.",
                "Name a port that no line has; a scan of the line itself finds more of its bodies.",
            )
        require_device(addresses[0], self._config().server)
        return addresses

    def _line_at(self, address: str) -> str | None:
        return next(
            (line.id for line in self._config().lines if _place_of(line.address) == _place_of(address)), None
        )

    async def _run(self, scan: PortScan, addresses: Sequence[Sequence[str]], found: list[Found]) -> None:
        doing: dict[str, str] = {}

        def tell(address: str, what: str) -> None:
            doing[address.partition("?")[0]] = f"{address}: {what}"
            scan.doing = list(doing.values())

        await search(addresses, found, tell, note=scan.notes.append, open_transport=self._open_transport)

    def _ended(self, scan: PortScan, found: Sequence[Found], task: "asyncio.Task[None]") -> None:
        """Note the end, maybe before it had begun."""
        done = not (task.cancelled() or task.exception())
        scan.status, scan.error = ("finished", None) if done else ("failed", BROKEN_OFF)
        scan.found, scan.doing = self._tables(found), []
        scan.ended_at = datetime.now(UTC)
        self._events.publish(f"gateway.scan.{scan.status}", parts.GATEWAY, scan.model_dump(mode="json"))

    def _tables(self, found: Sequence[Found]) -> list[FoundPort]:
        config = self._config()
        taken = {taken_id for line in config.lines for taken_id in (line.id, *line.unique_ids().values())}
        taken |= {thing.id for made in config.made().values() for thing in made}
        return [
            FoundPort(address=at.address, told=at.in_words(), line=at.table(taken), comment=at.comment())
            for at in sorted(found, key=lambda one: one.address)
        ]


def require_device(address: str, server: Server) -> None:
    """Refuse what is no port of controllers: what is written to another device or host would do harm there.

    :raises InvalidRequest: it is no serial port, no UIO device, nor in the networks of lines; nothing was
        sent.
    """
    if why := foreign(address, server):
        kind = "tcp" if address.startswith("tcp:") else "device"
        raise InvalidRequest(f"{why}; nothing was sent.", _INSTEAD[kind])


def foreign(address: str, server: Server) -> str | None:
    """Say why a place is none where controllers are looked for, if it is none."""
    parsed = Address.parse(address)
    if parsed.scheme == "tcp":
        return (
            None if server.may_request(parsed.host) else f"{parsed.host} is in no network of terminal servers"
        )
    place = Path(parsed.path).resolve()
    if DEVICES[parsed.scheme].fullmatch(str(place)) and not place.is_file():
        return None
    kind = "serial port" if parsed.scheme == "serial" else "UIO device"
    return f"{parsed.path} is no {kind}, so no device of the gateway's machine for controllers"


def _place_of(address: str) -> tuple[object, ...]:
    """Make the key that all addresses of one port share; a device has several names."""
    parsed = Address.parse(address)
    return (
        parsed.scheme,
        parsed.host,
        parsed.port,
        Path(parsed.path).resolve() if parsed.scheme != "tcp" else None,
    )
