"""Addresses in a plant: those of a gateway with its name in front, `stocker1:line1.3F`."""

import re
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

COLLECTIONS: Final = ("bodies", "groups", "robots", "scaras", "lines", "leases", "alarms")
"""Parts of a path that an address follows."""
_PATH: Final = re.compile(f"/({'|'.join(COLLECTIONS)})/")
_ADDRESSES: Final = frozenset(
    {
        *("body_id", "robot_id", "line_id", "group_id", "scara_id", "lease", "scope"),
        *("covers", "members", "groups", "bodies", "offline", "part_of"),
    }
)
"""Fields with addresses: one, or a list."""


class Place(NamedTuple):
    """A path of the plant: the gateway that it leads to, and the path there."""

    gateway: str
    path: str


def place_of(path: str) -> Place | None:
    """Take the gateway's name out of a path; None where it has none."""
    collection, _, rest = path.removeprefix("/").partition("/")
    address, slash, more = rest.partition("/")
    gateway, colon, own = address.partition(":")
    if collection not in COLLECTIONS or not (gateway and colon and own):
        return None
    return Place(gateway, f"/{collection}/{own}{slash}{more}")


def path_outward(gateway: str, path: str) -> str:
    """Put the gateway's name into a path of its own: `/bodies/line1.3F/moves/7` or `/gateway`."""
    if path == "/gateway":
        return f"/gateways/{gateway}"
    return _PATH.sub(lambda match: f"{match[0]}{gateway}:", path, count=1) if _PATH.match(path) else path


def outward(gateway: str, told: Any, field: str = "") -> Any:
    """Put the gateway's name before all addresses in what it tells, and into all paths."""
    if isinstance(told, Mapping):
        return {name: outward(gateway, value, name) for name, value in told.items()}
    if isinstance(told, list):
        return [outward(gateway, item, field) for item in told]
    if field == "token" and isinstance(told, int):
        return f"{gateway}:{told}"
    if not isinstance(told, str) or not told:
        return told
    return f"{gateway}:{told}" if field in _ADDRESSES else path_outward(gateway, told)


def tokens_for(gateway: str, shown: str) -> str:
    """Give those lease tokens that are for a gateway: `stocker1:17` for this one alone, `17` for any."""
    tokens = (token.strip().rpartition(":") for token in shown.split(","))
    return ", ".join(token for name, _, token in tokens if token and name in ("", gateway))
