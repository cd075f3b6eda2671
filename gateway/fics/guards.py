"""Rules that every frame to a robot but a question passes in the instant in which it is written."""

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.fics.exchange import FicsExchange
from protocols.table import Effect


def motion_without_proof(exchange: FicsExchange, _: float) -> GatewayError | None:
    """A motion that came here without proof of all it depends on is no move, and nobody would follow it."""
    if exchange.command.effect is not Effect.MOTION or exchange.needs is not None:
        return None
    name = exchange.command.wire_name()
    return InvalidRequest(
        f"{name} starts a move, and has no record of it; nothing was sent.", "Start a move."
    )
