"""Leases as locks: DI's LockingServices on each axis, line and robot."""

import asyncio
import logging
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any, Final
from urllib.parse import quote

from asyncua import ua
from motion_gateway_client import Answer, AsyncGateway, GatewayError

from bridges.opcua.methods import Commands, Request, checked, result, status_of
from bridges.opcua.nodes import Argument, Space, Type, told
from bridges.opcua.sessions import GUEST

log = logging.getLogger(__name__)

TTL_S: Final = 30.0
"""Seconds until a lock ends without RenewLock: the longest lease that the gateway allows."""
AGAIN_S: Final = 1.0
"""Interval in seconds between readings of the present locks, whose remaining time falls."""
DONE: Final = 0
NOT: Final = -1
"""Status of the methods (DI 7.6) where it is locked already, or is not locked."""
NOT_HIS: Final = frozenset({ua.StatusCodes.BadLocked, ua.StatusCodes.BadNotFound})
STATES: Final = (
    ("Locked", Type.Boolean, ua.ObjectIds.Boolean, False),
    ("LockingClient", Type.String, ua.ObjectIds.String, ""),
    ("LockingUser", Type.String, ua.ObjectIds.String, ""),
    ("RemainingLockTime", Type.Double, ua.ObjectIds.Duration, 0.0),
)
CONTEXT: Final = (Argument("Context", Type.String, "Whatever helps others to know who has locked it"),)


def _status(name: str) -> tuple[Argument]:
    return (Argument(f"{name}Status", Type.Int32, "0: done; -1: it is locked already, or is not locked"),)


def _lease_of(scope: str) -> str | None:
    """The lease that who asks has on something, as paths have it."""
    guest = GUEST.get()
    lease = None if guest is None else guest.leases.get(scope)
    return None if lease is None else quote(lease[0], safe="")


def _done(name: str, answer: Answer | None) -> ua.CallMethodResult:
    """Make the answer of a lock method; `answer` is None if there is no lease to ask the gateway about.

    In DI a lock of another client, or one that has expired, is not a failed call but a status that it
    returns.
    """
    status = ua.StatusCodes.BadNotFound if answer is None else status_of(answer)
    is_done = status == ua.StatusCodes.Good
    if status in NOT_HIS:
        status = ua.StatusCodes.Good
    return result(status, _status(name), DONE if is_done else NOT)


class Locks:
    """The locks of the plant's nodes."""

    def __init__(self, space: Space, commands: Commands, gateway: AsyncGateway) -> None:
        self._space, self._commands, self._gateway = space, commands, gateway
        self.news = asyncio.Event()
        """Set when a lease may be otherwise."""
        self._names: dict[str, str] = {}
        """Addresses that have a lock, as leases name them, and the names of their nodes."""
        self._ids: dict[str, str] = {}
        """Ids of the leases that stand, by the addresses that they cover."""
        self._told: dict[str, tuple[Any, ...]] = {}

    def add(self, name: str, address: str, node: ua.NodeId) -> None:
        """Add the lock of an axis, a line or a robot."""
        space, lock, scope = self._space, f"{name}.Lock", address.rstrip("/")
        if scope in self._names and self._names[scope] != name and space.has(f"{self._names[scope]}.Lock"):
            return  # an axis of a robot, which is leased as a whole
        self._names[scope] = name
        self._told.pop(name, None)
        object_ = space.object(node, lock, ("Lock", space.di), space.type("LockingServicesType"), address)
        for state, type_, data_type, value in STATES:
            variant = ua.Variant(value, type_)
            space.property(
                object_, f"{lock}.{state}", (state, space.di), variant, address, data_type=data_type
            )
        for method, takes, handler in (
            ("InitLock", CONTEXT, self._init),
            ("RenewLock", (), self._renew),
            ("ExitLock", (), self._exit),
            ("BreakLock", (), self._break),
        ):
            call = checked(takes, self._bound(handler, scope))
            space.method(
                object_,
                f"{lock}.{method}",
                (method, space.di),
                call,
                address,
                takes=takes,
                gives=_status(method),
            )
        self.news.set()

    def _bound(self, handler: Any, scope: str) -> Any:
        async def call(*_given: Any) -> ua.CallMethodResult:
            answer = await handler(scope)
            self.news.set()
            return answer

        return call

    async def _init(self, scope: str) -> ua.CallMethodResult:
        """Take a lease for the session of the caller."""
        guest = GUEST.get()
        answer = await self._commands.ask(Request("/leases", {"scope": scope, "ttl_s": TTL_S}))
        if guest is not None and answer.is_success:
            guest.leases[scope] = (answer.content["lease"], str(answer.content["token"]))
        return _done("InitLock", answer)

    async def _renew(self, scope: str) -> ua.CallMethodResult:
        id_ = _lease_of(scope)
        answer = None if id_ is None else await self._commands.ask(Request(f"/leases/{id_}/renew"))
        return _done("RenewLock", answer)

    async def _exit(self, scope: str) -> ua.CallMethodResult:
        id_, guest = _lease_of(scope), GUEST.get()
        answer = None if id_ is None else await self._commands.ask(Request(f"/leases/{id_}", method="DELETE"))
        if guest is not None:
            guest.leases.pop(scope, None)
        return _done("ExitLock", answer)

    async def _break(self, scope: str) -> ua.CallMethodResult:
        """End the lease of any client, as an admin may."""
        answer = None
        if scope in self._ids:
            id_ = quote(self._ids[scope], safe="")
            answer = await self._commands.ask(Request(f"/leases/{id_}", method="DELETE"))
        return _done("BreakLock", answer)

    async def run(self) -> None:
        """Tell the leases that stand, for ever."""
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(AGAIN_S if self._ids else None):
                    await self.news.wait()
            self.news.clear()
            try:
                leases = (await self._gateway.call("GET", "/leases"))["leases"]
            except GatewayError as error:
                log.info("leases cannot be read yet: %s", error)
                await asyncio.sleep(AGAIN_S)
                self.news.set()
                continue
            await self._tell(leases)

    async def _tell(self, leases: list[dict[str, Any]]) -> None:
        standing = {address: lease for lease in leases for address in (*lease["covers"], lease["scope"])}
        self._ids = {address: lease["lease"] for address, lease in standing.items()}
        for scope, name in self._names.items():
            lease = standing.get(scope)
            values: tuple[Any, ...] = (False, "", "", 0.0)
            if lease is not None:
                holder = lease["holder"].partition(" (")[0]
                values = (True, lease["scope"], holder, round(1e3 * lease["expires_in_s"]))
            if self._told.get(name) == values or not self._space.has(f"{name}.Lock"):
                continue
            self._told[name] = values
            for (state, type_, _, _), value in zip(STATES, values, strict=True):
                node = self._space.id(f"{name}.Lock.{state}")
                number = float(value) if type_ == Type.Double else value
                await self._space.write(node, told(ua.Variant(number, type_), datetime.now(UTC)))
