"""Assumptions about real hardware that were tried on a line, from the report of its commissioning."""

import json
from collections.abc import Sequence
from typing import Final, NamedTuple

from gateway.core.tables import LineTable

MEANINGS: Final = {
    "contradicts": "Some assumptions do not hold, and no setting makes up for it: do not run motion.",
    "differs": "Some assumptions do not hold: the report says what makes up for it, or that nothing has to.",
    "cannot_tell": "Some assumptions about real hardware were not tried.",
}
"""The results of a report that are told of a line, with what they mean, the worst first."""


class Untried(NamedTuple):
    """Assumptions about a line that were not tried there, or that do not hold."""

    line_id: str
    assumptions: Sequence[str]
    """Assumptions that could not be told, or do not hold; empty where nothing was tried."""
    meaning: str
    """One sentence."""


def untried(line: LineTable) -> list[Untried]:
    """Read the report of a line: what was not tried, and what does not hold. It reads a file."""
    if line.commissioned is None:
        command = f"`motion-gateway commission {line.id}`"
        meaning = f"Its assumptions about real hardware were never tried: {command} tries them."
        return [Untried(line.id, (), meaning)]
    try:
        results = json.loads(line.commissioned.read_text("utf-8"))["results"]
        found = {result["assumption"]: result["result"] for result in results}
    except (OSError, ValueError, KeyError, TypeError):
        return [Untried(line.id, (), f"{line.commissioned} is no report that can be read: nothing is known.")]
    told = (
        Untried(line.id, [slug for slug, outcome in found.items() if outcome == result], meaning)
        for result, meaning in MEANINGS.items()
    )
    return [outcome for outcome in told if outcome.assumptions]
