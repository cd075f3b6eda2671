"""Breakdowns inside one RC-420: errors that no command can bring about (RC-420 manual 13.8.2, 21)."""

from dataclasses import dataclass
from typing import Final

from protocols.rorze.errors import ERRORS, ErrorKind
from simulator.rorze.actions import Refused

INTERNAL_ERRORS: Final = frozenset(code for code, row in ERRORS.items() if row.kind is not ErrorKind.COMMAND)
"""Errors of the controller's hardware and of its RS-485 line."""


@dataclass
class Breakdown:
    """The number of commands that are answered with an error, and not done; power changes nothing."""

    error: int = 0
    next_commands: int = 0

    def strike(self) -> None:
        """Let it hit a command.

        :raises Refused: with its error, while commands are left to be hit.
        """
        if self.next_commands:
            self.next_commands -= 1
            raise Refused(self.error)
