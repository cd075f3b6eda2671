"""The certificate that a client has shown at the TLS handshake, which has checked who signed it."""

import asyncio
from typing import Any, Final

CERTIFIED: Final = "motion-gateway.certified"
"""Stands in the scope of requests over a connection whose client has shown a certificate: its common name."""


def common_name(transport: asyncio.BaseTransport) -> str | None:
    """The common name in the certificate of the client; None without one, or with several names."""
    shown = transport.get_extra_info("peercert") or {}
    names = [value for part in shown.get("subject", ()) for name, value in part if name == "commonName"]
    return names[0] if len(names) == 1 else None


def note(scope: Any, name: str | None) -> None:
    """Write it into the scope of a request, which is a dictionary as in ASGI."""
    if name is not None:
        scope[CERTIFIED] = name
