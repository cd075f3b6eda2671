"""Exchanges to put into queues, without a line."""

import asyncio
from typing import Any

from gateway.core.exchange import Lane
from gateway.rorze.line import lane_of
from gateway.rorze.session import Outcome, RorzeExchange
from protocols.rorze.link import encode
from protocols.rorze.row import RorzeCommand


def exchange(
    command: RorzeCommand[Any], body: int = 2, lane: Lane | None = None, **more: Any
) -> RorzeExchange:
    """A command for a body, in the lane of its nature."""
    lane = lane_of(command) if lane is None else lane
    return RorzeExchange(command, encode(body, command), lane, target=body, **more)


def waiting(one: RorzeExchange, loop: asyncio.AbstractEventLoop) -> "asyncio.Future[Outcome]":
    """Add a waiter to an exchange."""
    future: asyncio.Future[Outcome] = loop.create_future()
    one.waiters[future] = one.expires_at
    return future
