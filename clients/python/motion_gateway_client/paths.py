"""Paths of the gateway."""

import re
from typing import Any, Final
from urllib.parse import quote

_BODY: Final = re.compile(r"(?:.*\.)?([0-9][0-9A-Fa-f])")
FIRST_GROUP: Final = 0x80


def filled(path: str, /, **values: object) -> str:
    """Put values into a path's braces."""
    return path.format_map({name: quote(str(value), safe="") for name, value in values.items()})


def path_of(address: str) -> str:
    """Where something stands: a body 3F or arm.3F, a group 80, a robot r1, or a unit r1/units/1."""
    if "/" in address:
        return f"/robots/{quote(address)}"
    match = _BODY.fullmatch(address)
    if match is None:
        return f"/robots/{quote(address, safe='')}"
    kind = "groups" if int(match[1], 16) >= FIRST_GROUP else "bodies"
    return f"/{kind}/{quote(address, safe='')}"


def given(values: dict[str, Any]) -> dict[str, Any]:
    """Leave out what is not given; of a list, join the members."""
    return {
        name: ",".join(value) if isinstance(value, list) else value
        for name, value in values.items()
        if value is not None
    }
