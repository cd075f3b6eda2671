"""All types of events that the gateway publishes."""

from collections.abc import Mapping

from gateway import snapshot
from gateway.core.event_types import CORE, EventType, table_of
from gateway.families import FAMILIES


def event_types() -> Mapping[str, EventType]:
    """The types of the core and of every family, by their names."""
    return table_of(CORE, snapshot.TYPES, *(family.event_types for family in FAMILIES.values()))


EVENT_TYPES = event_types()
