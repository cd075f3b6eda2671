"""Numbers of event types and alarm causes, for systems that know things by numbers: none ever changes."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Final

_TABLES: Final = [
    tomllib.loads(file.read_text("utf-8")) for file in Path(__file__).parents[1].glob("*/numbers.toml")
]
"""Tables of numbers: of the gateway with its families, and of the packages of extensions."""


def _all(of: str) -> Mapping[str, int]:
    rows = (row for table in _TABLES for row in table.get(of, {}).items())
    return dict(sorted(rows, key=lambda row: row[1]))


EVENTS: Final = _all("events")
"""Number of each type of event."""
ALARMS: Final = _all("alarms")
"""Number of each cause of an alarm."""
