"""The state of a line for its users."""

from enum import StrEnum


class LineState(StrEnum):
    """The state of a line for its users now."""

    DOWN = "down"
    SILENT = "silent"
    """The port is open, but no controller answers on it, or it echoes what is written."""
    STANDBY = "standby"
    """Another gateway has it, or may have it; this one does not open it by itself."""
    SETTING_UP = "setting_up"
    READY = "ready"
    OUT_OF_STEP = "out_of_step"
