"""Moves that a body refuses because they would end outside its soft limits (RC-420 manual 14, EPS)."""

from typing import Any, Final

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.rorze.bodies import Body
from gateway.rorze.plans import crossed_limit, target_of
from protocols.rorze.position import GetPosition
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply

OUT_OF_RANGE: Final = "0x5D"
"""What the controller answers; it does not say which range is meant."""


async def name_limits(body: Body, command: RorzeCommand[Any], refusal: Reply | GatewayError) -> None:
    """Name the target and the limit, where a refused move leads beyond one; only reads are sent."""
    if not isinstance(refusal, ControllerRefused) or refusal.error_code != OUT_OF_RANGE:
        return
    try:
        here, _ = await body.ask(GetPosition())
        target = await target_of(body, command, here.pulses)
        crossed = None if target is None else await crossed_limit(body, target)
    except GatewayError:
        return  # the refusal stands, with the controller's own words
    if crossed is None:
        return
    refusal.reword("body.beyond-limits", body=body.address, code=refusal.command_code, beyond=crossed.said)
