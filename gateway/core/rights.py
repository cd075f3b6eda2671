"""The rights of callers; a small closed list."""

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from protocols.table import Effect


class Right(StrEnum):
    """A permission of a caller. Each is granted on its own: none includes another."""

    OPEN = "open"
    """Needs no permission: whether the gateway lives, and which version it is."""
    VIEW = "view"
    """Read states, positions, settings, events, documents and figures."""
    STOP = "stop"
    """Stop motors by software."""
    OPERATE = "operate"
    """Move motors, and set what changes while a cell runs: outputs, variables, errors that were seen to."""
    SETUP = "setup"
    """Change settings, tables, programs, groups, the flash memory and the communication."""
    ADMIN = "admin"
    """Change who may do what, and the configuration."""


RIGHT_OF: Final[Mapping[Effect, Right]] = {
    Effect.READ: Right.VIEW,
    Effect.SETTING: Right.SETUP,
    Effect.CLEARING: Right.OPERATE,
    Effect.MOTION: Right.OPERATE,
    Effect.STOP: Right.STOP,
    Effect.MAINTENANCE: Right.SETUP,
}
"""The right that each effect of a command takes."""
