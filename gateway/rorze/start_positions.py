"""Interpolated moves begin where their controllers were told that the axes stand (RC-420 manual 13.10.7).

A controller turns its axis by what it has calculated from these positions, wherever the axis stands.
"""

from collections.abc import Mapping
from typing import Any, Final, cast

from gateway.core.errors import GatewayError, NoReply, NotSent
from gateway.core.lanes import Lane
from gateway.rorze.bodies import Body, Group, R
from gateway.rorze.readings import believed
from protocols.rorze.interpolation import (
    GetDrivenAxis,
    GetStartPosition,
    MoveToExtensionStart,
    StartInterpolation,
    TurnFinger,
)
from protocols.rorze.row import RorzeCommand

FROM_TOLD_POSITIONS: Final = (StartInterpolation, MoveToExtensionStart, TurnFinger)


class PreparationOutdated(GatewayError):
    """An interpolated move was prepared for other positions than those in which the axes stand."""

    kind = "preparation-outdated"


async def require_start_positions(
    target: Body | Group, command: RorzeCommand[Any], positions: Mapping[Body, int]
) -> None:
    """See that an interpolated move was prepared for where the axes stand, in pulses (HCD, HPD).

    Every controller that is asked to move must hold the position of each axis that moves.

    :raises PreparationOutdated: one does not, or was told positions after its preparation.
    :raises ControllerRefused, NotSent: one did not tell.
    """
    if not isinstance(command, FROM_TOLD_POSITIONS):
        return
    if isinstance(command, StartInterpolation):
        _require_prepared(positions)
    try:
        for body, driven in (await _of_all(target, GetDrivenAxis())).items():
            told = await _of_all(target, GetStartPosition(axis=driven.axis))
            for controller, start in told.items():
                if start.pulses != positions[body]:
                    raise _outdated(
                        f"{controller.address} was told that axis {driven.axis} stands at {start.pulses}, "
                        f"and {body.address} stands at {positions[body]}"
                    )
    except NoReply as error:
        raise NotSent(
            f"{target.address} did not tell what its move was prepared for; the move was not sent.",
            error.remedy,
        ) from None


def _require_prepared(bodies: Mapping[Body, int]) -> None:
    for body in bodies:
        if body.prepared.is_prepared is False:
            raise _outdated(
                f"Nobody has prepared {body.address} since it was told positions, moved or lost its power"
            )


async def _of_all(target: Body | Group, question: RorzeCommand[R]) -> dict[Body, R]:
    async def ask() -> dict[Body, R]:
        if isinstance(target, Body):
            return {target: (await target.ask(question, lane=Lane.VERIFY))[0]}
        replies = await target.ask(question, lane=Lane.VERIFY)
        for reply in replies.values():
            if isinstance(reply, GatewayError):
                raise reply
        return cast("dict[Body, R]", replies)

    return await believed(target.line, ask)


def _outdated(why: str) -> PreparationOutdated:
    return PreparationOutdated.worded("preparation.outdated", why=why)
