"""The spelling of addresses, for the command line as well, which loads nothing else for it."""

import re

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
