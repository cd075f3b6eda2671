"""Command errors that the gateway's own questions leave at a body are cleared again."""

from typing import Final

from gateway.core.errors import GatewayError
from gateway.rorze.bodies import Body
from protocols.rorze.status import CONTROLLER_STATUS_BITS, ClearControllerStatus, GetControllerStatus

COMMAND_ERROR: Final = 1 << CONTROLLER_STATUS_BITS.index("command_error")


async def clear_own_refusal(body: Body, before: int | None) -> None:
    """Clear the command error that a refused question has set, such as SPD of a pattern that was never set.

    9CS clears all errors but STALL (RC-420 manual 14.9), so it is sent only at rest, and where the command
    error stands alone and was not there `before`. What cannot be cleared now is left: nothing depends on it.
    """
    if before is None or before & COMMAND_ERROR:
        return
    try:
        async with body.line.undivided([body.number]):
            status, _ = await body.ask(GetControllerStatus())
            if status.bits == COMMAND_ERROR:
                await body.ask(ClearControllerStatus())
    except GatewayError:
        return
