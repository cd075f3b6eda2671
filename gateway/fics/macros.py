"""The macros of a robot that are known: nobody can ask it for their names (C-HOST manual 1-7)."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from gateway.core.errors import ControllerRefused
from protocols.fics.macros import RunMacro

UNKNOWN = "E12"
"""So a robot refuses a macro that it does not have."""


@dataclass
class Macros:
    """What the configuration says of them, and which the robot has refused since the gateway was started."""

    titles: Mapping[str, str] = field(default_factory=dict)
    refused: set[str] = field(default_factory=set)

    def names(self) -> list[str]:
        """All names, those of the configuration first."""
        return [*self.titles, *sorted(self.refused - self.titles.keys())]

    def note(self, command: object, refusal: ControllerRefused | None) -> None:
        """Note whether the robot has a macro, when it has answered its call."""
        if not isinstance(command, RunMacro):
            return
        if refusal is None:
            self.refused.discard(command.macro)
        elif refusal.error_code == UNKNOWN:
            self.refused.add(command.macro)
