"""The table of all operations: those that families list beside what they do."""

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Final

from gateway.core.family import Family, Registered
from gateway.core.operation import (
    LEASED,
    MAX_WAIT_S,
    Expectation,
    Operation,
    PlainText,
    RouteWords,
    Written,
    adapter_of,
    names_in,
)
from gateway.core.rights import Right
from gateway.door import (
    access_keys,
    alarms,
    audit,
    catalogue,
    commissionings,
    configuration,
    events,
    leases,
    lines,
    moments,
    nightly,
    of_http,
    port_scans,
    recordings,
    security_log,
    shifts,
    stops,
    system,
    traces,
)
from gateway.door.commands import rows_of
from gateway.door.doors import rows_of_door
from gateway.families import FAMILIES, registered
from protocols.table import Effect

__all__ = [
    "FAMILIES",
    "LEASED",
    "MAX_WAIT_S",
    "SECTIONS",
    "Effect",
    "Expectation",
    "Operation",
    "PlainText",
    "Right",
    "RouteWords",
    "Written",
    "adapter_of",
    "names_in",
    "operations",
    "operations_of",
    "registered",
]

SECTIONS: Final = (
    stops.ROWS,
    alarms.ROWS,
    audit.ROWS,
    shifts.ROWS,
    moments.ROWS,
    leases.ROWS,
    configuration.ROWS,
    port_scans.ROWS,
    security_log.ROWS,
    access_keys.ROWS,
    access_keys.SESSIONS,
    system.ROWS,
    lines.ROWS,
    lines.TAKE_OVERS,
    commissionings.ROWS,
    nightly.ROWS,
    system.HEALTH,
    events.ROWS,
    of_http.STREAMS,
    catalogue.ROWS,
    of_http.HEALTH,
    traces.ROWS,
    of_http.TICKETS,
    recordings.ROWS,
    of_http.RECORDINGS,
    nightly.TEXTS,
)
"""Operations that take more than one thing of a family: the plant with its names, leases, alarms and logs."""


@cache
def operations() -> tuple[Operation, ...]:
    """All of them, section by section."""
    return tuple(operations_of(registered()))


def operations_of(kinds: Iterable[type[Registered]]) -> Iterator[Operation]:
    """Operations of a plant with these families and extensions, in the order of the documents."""
    for rows in SECTIONS:
        yield from rows
    for kind in kinds:
        for rows in (*rows_of_door(kind), *kind.rows):
            yield from rows
        if issubclass(kind, Family):
            yield from rows_of(kind)
