"""The end of a plant: nothing begins any more, what would never end is stopped, what still moves is named."""

import asyncio
import logging
from collections.abc import Collection
from contextlib import suppress
from functools import partial
from typing import Literal

from gateway.core.admission import Admission
from gateway.core.errors import GatewayEnding
from gateway.core.family import AnyLine, Registered, Site
from gateway.core.origin import Origin, acting
from gateway.core.parts import GATEWAY
from gateway.core.supervisor import Deed, do_in_turn, insist, supervise

log = logging.getLogger(__name__)

WIND_DOWN_S = 3.0
"""Stops have this time to be confirmed."""
HURRY_S = 0.3
"""Seconds for the end in a hurry: a stop that was asked for has been written by then."""

WHAT = "the end of the gateway"


class WindDown:
    """Done once, before the streams end and the lines are closed."""

    def __init__(
        self,
        site: Site,
        admission: Admission,
        registered: Collection[Registered],
        lines: Collection[AnyLine],
        on_exit: Literal["leave", "stop"],
    ) -> None:
        self._events, self._admission = site.events, admission
        self._registered, self._lines = registered, lines
        self._on_exit = on_exit
        self._task: asyncio.Task[None] | None = None
        self._limit: asyncio.Timeout | None = None
        self._patience_s = WIND_DOWN_S

    async def done(self) -> None:
        """Wind down, or wait until that is done."""
        if self._task is None:
            with acting(Origin("gateway: shutdown")):
                self._task = supervise(WHAT, self._wind_down)
        await asyncio.shield(self._task)

    def hurry(self) -> None:
        """Wait no longer than a stop takes to be written."""
        self._patience_s = HURRY_S
        if self._limit is not None and not self._limit.expired():
            self._limit.reschedule(asyncio.get_running_loop().time() + HURRY_S)

    async def _wind_down(self) -> None:
        tell = partial(self._events.publish, "gateway.shutting_down", GATEWAY, {"on_exit": self._on_exit})
        revoking = (partial(line.revoke, GatewayEnding) for line in self._lines)
        ending = (partial(self._end_motion, package) for package in self._registered)
        insist(WHAT, self._admission.end, tell, *revoking, *ending)
        letting_go = (package.letting_go for package in self._registered)
        await do_in_turn(WHAT, self._at_rest, self._name_what_moves, *letting_go)

    async def _at_rest(self) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(self._patience_s) as self._limit:
                await asyncio.gather(*(package.at_rest() for package in self._registered))
        self._limit = None

    def _end_motion(self, package: Registered) -> tuple[Deed, ...]:
        return package.end_motion(everything=self._on_exit == "stop")

    def _name_what_moves(self) -> None:
        for package in self._registered:
            for what, subject, why, move in package.left_moving():
                log.warning("%s is left moving, as far as is known: %s", subject.rpartition("/")[2], why)
                data = {"move_id": move, "detail": why}
                self._events.publish(f"{what}.left_moving", subject, data, move)
