"""A client for the motion gateway: `Gateway` for programs, `AsyncGateway` for asyncio."""

from motion_gateway_client.answers import Answer
from motion_gateway_client.async_gateway import AsyncGateway
from motion_gateway_client.errors import GatewayError, MoveNotOver, MoveNotSucceeded, NoAnswer, Refused
from motion_gateway_client.generated.gateway import Gateway

__all__ = [
    "Answer",
    "AsyncGateway",
    "Gateway",
    "GatewayError",
    "MoveNotOver",
    "MoveNotSucceeded",
    "NoAnswer",
    "Refused",
]
