"""Which defaults of a configuration were weakened, each said plainly."""

from typing import Final

from pydantic import BaseModel, Field

from gateway.config import Config
from gateway.rorze import config as rorze


class Weakened(BaseModel):
    """A setting that protects less than its default."""

    setting: str = Field(description="As the configuration writes it.")
    value: str | None = Field(description="What it is set to; null to those who are no admins.")
    meaning: str = Field(description="What that allows.")


_OF_ALL: Final = {
    "max_connections": "More connections at once than usual: a flood takes more of the machine."
}
_OF_ONE_KEY: Final = {
    "subscribers_per_key": "One key may have more event streams than usual.",
    "requests_per_key": "One key may have more requests under way than usual.",
    "moves_per_key_and_s": "One key may start more moves a second than usual.",
}
"""Limits, weaker when they are higher, and what that allows."""


def weakened(config: Config) -> list[Weakened]:
    """Name every weakened default."""
    server, access = config.server, config.access
    found: list[tuple[object, str, object, str]] = [
        (access.mode == "open", "access.mode", access.mode, "Everybody on this machine may do everything."),
        (
            access.lease_mode == "off",
            "access.lease_mode",
            access.lease_mode,
            "Nobody can keep others from moving what he moves.",
        ),
        (not server.is_local, "server.host", server.host, "Other machines reach the gateway."),
        (
            not server.is_local and not server.tls_certificate,
            "server.tls_certificate",
            "none",
            "The way from the proxy to the gateway is plain text.",
        ),
        (
            server.trusted_proxies,
            "server.trusted_proxies",
            server.trusted_proxies,
            "These say who a client is, and whether it speaks TLS.",
        ),
        (
            server.allowed_origins,
            "server.allowed_origins",
            server.allowed_origins,
            "Pages of these origins may use the gateway with a key.",
        ),
        (server.raw_commands, "server.raw_commands", True, "Commands may be sent as plain text."),
        (server.allow_endless_moves, "server.allow_endless_moves", True, "Moves may have no end."),
    ]
    for place, settings, limits in (("server", server, _OF_ALL), ("access", access, _OF_ONE_KEY)):
        for name, meaning in limits.items():
            limit, usual = getattr(settings, name), type(settings).model_fields[name].default
            found.append((limit > usual, f"{place}.{name}", limit, meaning))
    for line in config.lines:
        for body in line.bodies if isinstance(line, rorze.Line) else ():
            place = f"lines.{line.id}.bodies.{body.id}"
            found += [
                (
                    not body.power_comment,
                    f"{place}.power_comment",
                    0,
                    "No mark tells of a loss of power.",
                ),
                (
                    not body.needs_origin,
                    f"{place}.needs_origin",
                    False,
                    "It moves to places after a loss of power, though they may be elsewhere.",
                ),
            ]
    return [
        Weakened(setting=setting, value=_written(value), meaning=meaning)
        for it_is, setting, value, meaning in found
        if it_is
    ]


def _written(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
