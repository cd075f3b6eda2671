"""The gateway's events, from where the last life has come to: none is missed, and gaps are told."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Any, Final

from motion_gateway_client import AsyncGateway, GatewayError, Refused

from bridges.common.mirror import Mirror
from bridges.common.position import Position
from bridges.common.state import Figures, State

log = logging.getLogger(__name__)

TRY_AGAIN_S: Final = 2.0
GAP: Final = "stream.gap"
SIDE: Final = "gateway"

Event = dict[str, Any]
"""A CloudEvent as the gateway tells it."""
Take = Callable[[Event], Awaitable[None]]


class Feed:
    """Follows the events, and keeps the mirror up to date with them."""

    def __init__(
        self,
        gateway: AsyncGateway,
        position: Position,
        mirror: Mirror,
        state: State,
        figures: Figures,
        worked: Callable[[str], object],
    ) -> None:
        self._gateway, self._position, self._mirror = gateway, position, mirror
        self._state, self._figures, self._worked = state, figures, worked
        mirror.on_trouble = self._on_connection

    async def run(self, take: Take) -> None:
        """Give each event to `take`, in order, one after the other, for ever.

        While `take` waits no more are read: the gateway keeps them. `take` has `Position.reach` called when
        the event is delivered for good; from there the next life goes on.
        """
        after = self._position.cursor
        while True:
            try:
                await self._mirror.known.wait()
                events = self._gateway.events(
                    after=after, snapshot=after is None, on_connection=self._on_connection
                )
                async for event in events:
                    if after is None:
                        self._position.begin(event["cursor"])
                    after = event["cursor"]
                    self._note(event)
                    await take(event)  # type: ignore[arg-type]  # of each type there is one dictionary
            except GatewayError as error:
                self._on_connection(error)
            await asyncio.sleep(TRY_AGAIN_S)

    def _note(self, event: Any) -> None:
        if event["type"] == GAP:
            self._figures.gaps.inc()
            log.warning(
                "events after %s are missing: the gateway has them no more; all states are read again",
                event["data"]["requested"],
            )
        self._mirror.note(event)

    def _on_connection(self, error: GatewayError | None) -> None:
        self._worked(SIDE)
        if error is None:
            self._state.up(SIDE)
        elif isinstance(error, Refused):
            self._state.down(SIDE, f"it refuses the bridge's own key ({error.status}): {error}")
        else:
            self._state.down(SIDE, str(error))
