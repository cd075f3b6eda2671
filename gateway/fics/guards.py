"""Rules that every frame to a robot but a question passes in the instant in which it is written."""

from collections.abc import Callable
from typing import Any, Final

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.fics.backup_restore import RobotRestore
from gateway.fics.errors import RobotBusy
from gateway.fics.exchange import FicsExchange
from gateway.fics.settings import SETTINGS
from protocols.fics.positions import BeginPositionUpload, ClearPositions
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSmoothAcceleration
from protocols.fics.variables import SetVariable
from protocols.table import Effect

RESTORED: Final[tuple[type[FicsCommand[Any]], ...]] = (
    *(SetSmoothAcceleration, BeginPositionUpload, ClearPositions, SetVariable),
    *(setting.write for setting in SETTINGS.values()),
)
"""What changes something that a backup has."""


def motion_without_proof(exchange: FicsExchange, _: float) -> GatewayError | None:
    """A motion that came here without proof of all it depends on is no move, and nobody would follow it."""
    if exchange.command.effect is not Effect.MOTION or exchange.needs is not None:
        return None
    name = exchange.command.wire_name()
    return InvalidRequest(
        f"{name} starts a move, and has no record of it; nothing was sent.", "Start a move."
    )


def amid_a_restore(
    restored: Callable[[], RobotRestore | None],
) -> Callable[[FicsExchange, float], GatewayError | None]:
    """Make the guard by which nothing else moves or changes a robot that is being `restored`."""

    def guard(exchange: FicsExchange, _: float) -> GatewayError | None:
        command = exchange.command
        if command.effect is not Effect.MOTION and not isinstance(command, RESTORED):
            return None
        restore = restored()
        if restore is None or restore.lets_pass(exchange):
            return None
        return RobotBusy(
            f"A backup is being restored to the robot; {command.wire_name()} was not sent.",
            "Wait for its end or cancel it.",
        )

    return guard
