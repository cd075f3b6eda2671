"""Moves of SCARA robots with a speed of their own: the same pattern is written to all axes before they start.

As of bodies (`limited_speed`), it is the reserved one, in RAM. Along a path a pattern counts the way of the
finger's end, so all controllers have to hold the same (RC-420 manual 13.10.3); where axes turn alone each
counts its own pulses (13.10.9).
"""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace

from gateway.core.errors import InvalidRequest
from gateway.rorze.bodies import Body
from gateway.rorze.plans import Wish, limited, slow_pattern_of, standard_of
from gateway.rorze_scara.geometry import WHOLE_TURN_MDEG
from gateway.rorze_scara.requests import ScaraMoveRequest, TurnSpeed
from gateway.rorze_scara.scara import Scara
from protocols.rorze.profile import SpeedParameters


def wish_of(scara: Scara, request: ScaraMoveRequest) -> Wish | None:
    """Give what the `max_speed` of a move comes to in each controller; None where it has none."""
    limit = request.max_speed
    if limit is None:
        return None

    async def wish(bodies: Sequence[Body]) -> Sequence[SpeedParameters]:
        standards = await asyncio.gather(*(standard_of(body) for body in bodies))
        if isinstance(limit, TurnSpeed):
            tops = [round(limit.exactly * it / WHOLE_TURN_MDEG) for it in scara.robot.pulses_per_turn]
        else:
            standards, tops = [_gentlest(standards)] * len(bodies), [limit.thousandths] * len(bodies)
        if min(tops) < 1:
            raise InvalidRequest("max_speed: it comes to less than one pulse a second; nothing was sent.")
        return [it.capped(top) for it, top in zip(standards, tops, strict=True)]

    return wish


def with_own_pattern(scara: Scara, request: ScaraMoveRequest) -> ScaraMoveRequest:
    """The request as it is sent; errors as of `slow_pattern_of`."""
    if request.max_speed is None:
        return request
    return request.model_copy(update={"pattern": slow_pattern_of(scara.members)})


@asynccontextmanager
async def at_own_speed(scara: Scara, request: ScaraMoveRequest) -> AsyncIterator[ScaraMoveRequest]:
    """Give a request with the pattern that has its `max_speed`, if it has one; errors as of `limited`."""
    wish = wish_of(scara, request)
    if wish is None:
        yield request
        return
    async with limited(scara.group, wish):
        yield with_own_pattern(scara, request)


def _gentlest(standards: Sequence[SpeedParameters]) -> SpeedParameters:
    """The ramp of the axis that accelerates least, and no speed that one of them does not allow."""
    ramp = min(standards, key=lambda it: it.acceleration)
    return replace(ramp, low=min(it.low for it in standards), high=min(it.high for it in standards))
