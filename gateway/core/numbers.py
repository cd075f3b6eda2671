"""Numbers of event types and alarm causes, for systems that know things by numbers: none ever changes."""

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Final

_TABLE: Final = tomllib.loads(resources.files(__package__).joinpath("numbers.toml").read_text("utf-8"))
EVENTS: Final[Mapping[str, int]] = _TABLE["events"]
"""By the type of an event."""
ALARMS: Final[Mapping[str, int]] = _TABLE["alarms"]
"""By the cause of an alarm."""
