"""A gateway as a part of a plant of several: what the configuration says of that, and how it is going."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field

from gateway.core.tables import Array, Slug, Table


def _check_server(text: str) -> str:
    url = urlsplit(text)
    if url.scheme not in {"nats", "tls"} or not url.hostname or url.path or url.username is not None:
        raise ValueError(
            f"must be a server such as nats://127.0.0.1:4222 or tls://nats1.example, not {text!r}"
        )
    return text


def _check_monitor(text: str) -> str:
    url = urlsplit(text)
    if url.scheme not in {"http", "https"} or not url.hostname or url.query:
        raise ValueError(f"must be an address such as http://127.0.0.1:8222, not {text!r}")
    return text.rstrip("/")


def check_gateway_url(text: str) -> str:
    """Refuse what is no address at which keys may be shown: TLS, or this machine."""
    url = urlsplit(text)
    at_home = url.scheme == "http" and url.hostname in {"127.0.0.1", "localhost", "::1"}
    if not url.hostname or url.query or url.fragment or not (url.scheme == "https" or at_home):
        raise ValueError(f"must be an address such as https://stocker1.example:8420, not {text!r}")
    return text.rstrip("/")


class Engine(Table):
    """The NATS servers that carry copies of events, and the registry, between the gateways of a plant."""

    servers: Array[Annotated[str, AfterValidator(_check_server)]] = Field(min_length=1)
    credentials: Annotated[Path, Field(strict=False)] | None = None
    """A file with one line, `USER:PASSWORD`; left out, the servers ask for none."""
    ca: Annotated[Path, Field(strict=False)] | None = None
    """Authorities (PEM) that certificates are checked against; left out, those of the system."""
    monitor: Array[Annotated[str, AfterValidator(_check_monitor)]] = ()
    """Addresses at which the servers tell their settings for a check, such as http://127.0.0.1:8222."""


class PlantOfGateways(Engine):
    """The plant that this gateway belongs to, and its name there."""

    name: Slug
    url: Annotated[str, AfterValidator(check_gateway_url)] | None = None
    """Address at which the plant reaches this gateway; left out, the one it listens at."""


@dataclass(slots=True)
class Membership:
    """State of this gateway in the plant, written by the part that forwards its events; the rest reads it."""

    name: str
    """Name of this gateway in the plant."""
    trouble: str | None = None
    """Why the plant's servers are not reached, once that has lasted; the gateway itself goes on."""
    forwarded: int = 0
    """Events that the plant's stream has taken since the start."""
    behind: int = 0
    """Events that it has not taken yet."""
