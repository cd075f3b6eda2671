"""Parts of a plant, as scopes and leases name them, and the spelling of their addresses.

The command line needs it, and loads nothing else for it.
"""

import re
from typing import Final, NamedTuple

GATEWAY: Final = "/gateway"
"""The subject of what is about no part, but the gateway itself."""


class Part(NamedTuple):
    """A body, a robot or a whole line, and the line it is on."""

    line_id: str
    address: str

    @property
    def is_line(self) -> bool:
        """Say whether the part is a whole line."""
        return self.address == self.line_id

    def contains(self, other: "Part") -> bool:
        """Say whether the other part is this one, or on this line."""
        return self == other or (self.is_line and self.line_id == other.line_id)

    def meets(self, other: "Part") -> bool:
        """Say whether one of both contains the other."""
        return self.contains(other) or other.contains(self)


_NUMBERED = re.compile("(?:[a-z][a-z0-9-]*[.])?[0-9][0-9a-f]", re.ASCII | re.IGNORECASE)
"""Numbers of bodies and groups all begin with a digit, ids of robots with a letter."""
_ROBOT = re.compile("[a-z][a-z0-9-]*(?:/units/[0-9]+)?", re.ASCII | re.IGNORECASE)


def is_numbered(text: str) -> bool:
    """Say whether it is the address of a body or a group: `3F`, `arm.80`."""
    return _NUMBERED.fullmatch(text) is not None


def numbered_address(text: str) -> str:
    """Write the address of a body or group as it is answered, `arm.3F`; whether there is one shows later."""
    line, dot, number = text.rpartition(".")
    return f"{line.lower()}{dot}{number.upper()}"


def spelled(text: str) -> str | None:
    """Write any address as it is answered, `r1/units/1`; None if it is none."""
    if is_numbered(text):
        return numbered_address(text)
    return text.lower() if _ROBOT.fullmatch(text) else None
