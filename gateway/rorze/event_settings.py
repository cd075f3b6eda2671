"""What bodies report unasked: set as the configuration says, for no flash keeps it (EMS, ESS)."""

import asyncio
from contextlib import suppress

from gateway.core.errors import GatewayError
from gateway.core.lanes import Lane
from gateway.rorze.bodies import Body
from gateway.rorze.config import Events
from protocols.rorze.inputs_outputs import GetInputs, GetSensors
from protocols.rorze.modes import GetEventKinds, GetEventMask, SetEventKinds, SetEventMask

CHECK_S = 1.0
"""Whether it may have forgotten its settings is considered this often; that asks nothing."""
RETRY_S = 60.0
"""They are read this often where nothing is known to have happened."""


async def watch_events(body: Body, events: Events) -> None:
    """See again and again that a body reports what it should."""
    settled: tuple[object, ...] | None = None
    look_at = 0.0
    while True:
        life, now = _life_of(body), asyncio.get_running_loop().time()
        if body.line.state == "ready" and body.online and (life != settled or now >= look_at):
            with suppress(GatewayError):
                if await _settle(body, events):
                    settled, look_at = life, now + RETRY_S
        await asyncio.sleep(CHECK_S)


def _life_of(body: Body) -> tuple[object, ...]:
    """Changes where it may have lost its settings."""
    return body.line.set_ups, body.power.losses, body.power.mark.text


async def _settle(body: Body, events: Events) -> bool:
    """Set what is not as it should be, and know the state from which edges count; False while it moves.

    :raises GatewayError: it was not done, or not read back.
    """
    mask, _ = await body.ask(GetEventMask(), lane=Lane.BACKGROUND)
    kinds, _ = await body.ask(GetEventKinds(), lane=Lane.BACKGROUND)
    wanted = events.mask
    masked = all((bits or 0) == getattr(wanted, kind) for kind, bits in mask.mask)
    right = masked and kinds.kinds == events.kinds
    if not right and (body.move is not None or body.moving is not False):
        return False
    if not right:
        await body.ask(SetEventMask(mask=wanted), lane=Lane.BACKGROUND)
        await body.ask(SetEventKinds(kinds=events.kinds), lane=Lane.BACKGROUND)
    if events.sensors:
        await body.ask(GetSensors(), lane=Lane.BACKGROUND)
    if events.inputs:
        await body.ask(GetInputs(), lane=Lane.BACKGROUND)
    return right
