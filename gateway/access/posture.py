"""Weakened defaults of a configuration, each said plainly."""

from collections.abc import Iterator
from typing import Final

from gateway.config import Config
from gateway.core.tables import Weakness

_A_YEAR_D: Final = 365
_OF_ALL: Final = {
    "max_connections": "More connections at once than usual: a flood takes more of the machine."
}
_OF_ONE_KEY: Final = {
    "subscribers_per_key": "One key may have more event streams than usual.",
    "requests_per_key": "One key may have more requests under way than usual.",
    "moves_per_key_and_s": "One key may start more moves a second than usual.",
}
"""Limits, weaker when they are higher, and what that allows."""


def weakened(config: Config) -> Iterator[Weakness]:
    """Name every weakened default."""
    server, access = config.server, config.access
    proxies, origins = ", ".join(map(str, server.trusted_proxies)), ", ".join(server.allowed_origins)
    far, plain = not server.is_local, not (server.is_local or server.tls_certificate)
    for it_is, setting, value, meaning in (
        (access.mode == "open", "access.mode", "open", "Everybody on this machine may do everything."),
        (
            access.lease_mode == "off",
            "access.lease_mode",
            "off",
            "Nobody can keep others from moving the same motor.",
        ),
        (far, "server.host", server.host, "Other machines reach the gateway."),
        (plain, "server.tls_certificate", "none", "The way from the proxy to the gateway is plain text."),
        (proxies, "server.trusted_proxies", proxies, "These say who a client is, and whether it speaks TLS."),
        (
            origins,
            "server.allowed_origins",
            origins,
            "Pages of these origins may use the gateway with a key; what http:// brings can be forged.",
        ),
        (
            access.mode == "keys" and not 0 < access.key_lifetime_d <= _A_YEAR_D,
            "access.key_lifetime_d",
            access.key_lifetime_d,
            "A key that is lost is good for longer than a year.",
        ),
        (server.raw_commands, "server.raw_commands", True, "Commands may be sent as plain text."),
        (server.allow_endless_moves, "server.allow_endless_moves", True, "Moves may have no end."),
    ):
        if it_is:
            yield Weakness(setting, value, meaning)
    for place, settings, limits in (("server", server, _OF_ALL), ("access", access, _OF_ONE_KEY)):
        for name, meaning in limits.items():
            limit, usual = getattr(settings, name), type(settings).model_fields[name].default
            if limit > usual:
                yield Weakness(f"{place}.{name}", limit, meaning)
    for line in config.lines:
        yield from line.weakened()
