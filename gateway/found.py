"""A controller found at a port, in words and as a table of the configuration."""

import re
from dataclasses import dataclass, field
from itertools import count
from typing import Any

from protocols.fics.link import Terminator
from protocols.fics.system import SystemVersion

AXES = ("X", "Y", "Z", "@", "W", "U", "V", "R")
"""Names of a robot's axes here, in order; the robot cannot be asked for its own."""
TERMINAL_AXES = 3
"""Number of axes of a robot that has not told it."""
_NAMES = re.compile("[0-9A-Fa-f]{2}(?:,[0-9A-Fa-f]{2})*")
LONGEST_IDENTITY = 100
"""Characters of an answer to XID that are repeated."""


@dataclass(slots=True)
class FoundLine:
    """An RC-400 that has answered, and the bodies that have so far."""

    address: str
    controllers: str
    """Answer to XID."""
    bodies: list[int] = field(default_factory=list)
    complete: bool = False
    """True if all 120 body numbers were asked."""

    def named(self) -> list[int]:
        """The bodies that the link master names (XID, RC-420 manual 17.2)."""
        told = self.controllers.strip()
        return [int(number, 16) for number in told.split(",")] if _NAMES.fullmatch(told) else []

    def in_words(self) -> str:
        """Say who was found."""
        bodies = ", ".join(f"{body:02X}" for body in self.bodies) or "none"
        return f"{self.address}: an RC-400 with bodies {bodies}."

    def comment(self) -> str:
        """Say what the table does not."""
        answer = "".join(character for character in self.controllers if character.isprintable())[
            :LONGEST_IDENTITY
        ]
        told = f"An RC-400; to XID it answered {answer or 'nothing more'}."
        if not self.complete:
            return f"{told}\nNot all 120 body numbers were asked: `motion-gateway scan` finds the others."
        if not self.bodies:
            return f"{told}\nNone of its bodies answered: check their power, then `motion-gateway scan`."
        return told

    def table(self, taken: set[str]) -> dict[str, Any]:
        """The table that serves it, under an id that is taken now."""
        bodies = [{"id": f"{body:02X}"} for body in self.bodies]
        return {"id": take("line", taken), "address": self.address, "bodies": bodies}


@dataclass(slots=True)
class FoundRobot:
    """A Fics that has answered."""

    address: str
    terminator: Terminator
    mode: int | None = None
    version: SystemVersion | None = None
    units: dict[int, int] = field(default_factory=dict)
    """Number of motor axes by unit; empty if it has told none."""

    def in_words(self) -> str:
        """Say who was found."""
        version = "" if self.version is None else f" of version {self.version.version}"
        mode = "" if self.mode is None else f", in communication mode {self.mode}"
        told = (f"unit {number} of {axes} axes" for number, axes in sorted(self.units.items()))
        units = ", ".join(told) or "units that it does not tell"
        return f"{self.address}: a Fics{version}{mode}, with {units}."

    def comment(self) -> str:
        """Say what the table does not: the names of axes in it are a guess."""
        return (
            f"{self.in_words()}\n"
            "A robot does not tell the names of its axes, or what they are counted in; in motion no units:\n"
            "compare this with its set-up before anything moves."
        )

    def table(self, taken: set[str]) -> dict[str, Any]:
        """The table that serves it, under ids that are taken now."""
        units = sorted((self.units or {1: TERMINAL_AXES}).items())
        return {
            "id": take("cell", taken),
            "address": self.address,
            "protocol": "fics",
            "terminator": self.terminator,
            "robot": {
                "id": take("r", taken),
                "units": [{"number": number, "axes": list(AXES[:axes])} for number, axes in units],
            },
        }


Found = FoundLine | FoundRobot


def take(word: str, taken: set[str]) -> str:
    """Take the first id of a word and a number that is free."""
    name = next(name for name in (f"{word}{number}" for number in count(1)) if name not in taken)
    taken.add(name)
    return name
