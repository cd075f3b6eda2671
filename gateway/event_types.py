"""All types of events that the gateway publishes."""

from gateway.core.event_types import CORE, table_of
from gateway.fics import event_types as fics
from gateway.rorze import event_types as rorze

EVENT_TYPES = table_of(CORE, rorze.TYPES, fics.TYPES)
