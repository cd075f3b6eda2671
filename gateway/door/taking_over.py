"""Taking a line over: a person's decision, carried out in the same way as each start."""

import asyncio
from typing import Final

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.line_state import LineState
from gateway.plant import Plant
from gateway.security import entries

WAIT_S: Final = 2.0
"""Frames of the old owner that are on their way have arrived by then."""
READY_S: Final = 20.0
_READY: Final = (LineState.READY, LineState.OUT_OF_STEP)


async def take_over(plant: Plant, line_id: str, old: str) -> None:
    """Take a line over, and wait until it is ready, or for as long as that may take.

    :raises NotFound: there is no such line.
    :raises InvalidRequest: it has no spare, is this gateway's already, or never was that of the old one.
    :raises NotSent: it cannot be written down; nothing has changed.
    """
    port = plant.port(line_id)
    owners = plant.peers.ownership.owners.get(line_id)
    if owners is None:
        raise InvalidRequest(
            f"Line {line_id} has no spare; nothing was changed.",
            'Name the gateways that may have it: owners = ["stocker1", "spare1"].',
        )
    if old not in owners or old == plant.peers.ownership.name:
        raise NotFound(
            f"No other gateway {old} may have line {line_id}; nothing was changed.",
            f"It may be had by {', '.join(owners)}.",
        )
    if port.state in _READY:
        raise InvalidRequest(
            f"Line {line_id} is this gateway's, and ready; nothing was changed.", "There is nothing to do."
        )
    plant.access.security.note(entries.LINE_TAKEN_OVER, line_id, old=old)
    await asyncio.sleep(WAIT_S)
    await plant.take_over(line_id, old)
    for _ in range(int(READY_S / 0.1)):
        if port.state in _READY:
            return
        await asyncio.sleep(0.1)
