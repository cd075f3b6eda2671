"""Ports that move bytes and know no commands."""

from transports.addresses import create
from transports.base import (
    Receiver,
    Transport,
    TransportError,
    TransportLost,
    TransportRefused,
    TransportUnavailable,
)

__all__ = [
    "Receiver",
    "Transport",
    "TransportError",
    "TransportLost",
    "TransportRefused",
    "TransportUnavailable",
    "create",
]
