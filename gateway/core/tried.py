"""Assumptions about real hardware that were tried on a line, from the report of its commissioning."""

import json
from collections.abc import Sequence
from typing import NamedTuple

from gateway.core.tables import LineTable

CONTRADICTS, DIFFERS, UNKNOWN = "contradicts", "differs", "cannot_tell"


class Untried(NamedTuple):
    """Assumptions about a line that were not tried there, or that do not hold."""

    line_id: str
    assumptions: Sequence[str]
    """Assumptions that could not be told, or do not hold; empty where nothing was tried."""
    meaning: str
    """One sentence."""


def untried(line: LineTable) -> Untried | None:
    """Read the report of a line; None if all its assumptions were tried and hold. It reads a file."""
    if line.commissioned is None:
        command = f"`motion-gateway commission {line.id}`"
        return Untried(
            line.id, (), f"Its assumptions about real hardware were never tried: {command} tries them."
        )
    try:
        results = json.loads(line.commissioned.read_text("utf-8"))["results"]
        found = {result["assumption"]: result["result"] for result in results}
    except (OSError, ValueError, KeyError, TypeError):
        return Untried(line.id, (), f"{line.commissioned} is no report that can be read: nothing is known.")
    for result, meaning in (
        (CONTRADICTS, "Some assumptions do not hold, and no setting makes up for it: do not run motion."),
        (DIFFERS, "Some assumptions do not hold: see the report for the settings that make up for it."),
        (UNKNOWN, "Some assumptions about real hardware were not tried."),
    ):
        slugs = [slug for slug, outcome in found.items() if outcome == result]
        if slugs:
            return Untried(line.id, slugs, meaning)
    return None
