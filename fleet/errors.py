"""Errors that only a plant of several gateways has."""

from typing import Final

from gateway.core.errors import GatewayError, NotSent

USE_HARDWARE: Final = "If anything moves there, use its hardware stop."


class GatewayUnreached(NotSent):
    """The gateway that owns what was asked for was not reached; nothing was sent to it."""

    kind = "gateway-unreached"
    retryable = True


class NameTaken(NotSent):
    """Two gateways have the name in an address, so the motor is ambiguous. Nothing was sent."""

    kind = "gateway-conflict"
    retryable = False


class AnswerLost(GatewayError):
    """A gateway was asked, and its answer did not come."""

    kind = "gateway-answer-lost"
    moved = "unknown"


class GatewaysUnreached(GatewayError):
    """Not every gateway has confirmed a stop of the plant."""

    kind = "gateways-unreached"
    moved = "unknown"
