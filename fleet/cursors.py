"""The cursor of a plant: one place in the journal of each gateway."""

import re
from collections.abc import Mapping
from typing import Final

from gateway.core.errors import InvalidRequest

_CURSOR: Final = "[0-9a-f]{8}-[0-9]{12}"
_PLACE: Final = re.compile(f"([a-z][a-z0-9-]{{0,31}}):({_CURSOR})")


def written(places: Mapping[str, str]) -> str:
    """Write it: `stocker1:05806f8b-000000000009,stocker2:...`; `-` before anything was read."""
    return ",".join(f"{gateway}:{cursor}" for gateway, cursor in sorted(places.items())) or "-"


def read(text: str) -> dict[str, str]:
    """Read a cursor into the places of its gateways; a gateway that is not named begins with its first event.

    :raises InvalidRequest: it is no cursor of a plant.
    """
    if text == "-":
        return {}
    places: dict[str, str] = {}
    for part in text.split(","):
        match = _PLACE.fullmatch(part)
        if match is None:
            raise InvalidRequest(
                f"{text[:80]!r} is no cursor of a plant.",
                "Give the cursor of an answer, or that of each gateway: stocker1:05806f8b-000000000009.",
            )
        places[match[1]] = match[2]
    return places


def is_cursor(text: str) -> bool:
    """Tell if a text is the cursor of a gateway."""
    return re.fullmatch(_CURSOR, text) is not None


def number_of(cursor: str) -> int:
    """The number of the event that a gateway's cursor stands behind."""
    return int(cursor.rpartition("-")[2])


def epoch_of(cursor: str) -> str:
    """The epoch of a gateway's cursor."""
    return cursor.partition("-")[0]
