"""Faults of the gateway itself, which nobody has foreseen: they are logged, and the work goes on."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Final

log = logging.getLogger(__name__)

AGAIN_S: Final = (0.5, 30.0)
"""First and longest pause before work that has met a fault is begun again; it doubles in between."""
WELL_S: Final = 60.0
"""Work that has gone on for this time is believed to go on well: the next pause is the first again."""


async def carry_on(what: str, work: Callable[[], Awaitable[None]]) -> None:
    """Do work to its end: after a fault it is begun again."""
    pause_s = AGAIN_S[0]
    loop = asyncio.get_running_loop()
    while True:
        began_at = loop.time()
        try:
            await work()
        except Exception:
            if loop.time() - began_at > WELL_S:
                pause_s = AGAIN_S[0]
            log.exception("%s has met a fault of the gateway itself, and goes on in %g s", what, pause_s)
        else:
            return
        await asyncio.sleep(pause_s)
        pause_s = min(2 * pause_s, AGAIN_S[1])
