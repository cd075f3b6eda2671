"""The states of a port, of a stop and of the journal's disk, drawn as one page.

`python -m gateway.core.states > docs/states.md` draws table.
"""

from collections.abc import Mapping
from enum import Enum
from typing import Any, Final, NamedTuple

from gateway.core import line_state, stops
from gateway.core.drawn import BY, table_of
from gateway.core.journal import journal


class StateTable(NamedTuple):
    """A table of states, with what a reader has to know before."""

    title: str
    text: str
    news: type[Enum]
    steps: Mapping[Any, Mapping[Any, Any]]


TABLES: Final = (
    StateTable(
        "The port of a line",
        "`gateway/core/line_state.py`. A line that is ready is told as `out_of_step` while a fence is "
        "under way ([the fence](fence.md)). Every `line.down` follows a `line.up`.",
        line_state.PortNews,
        line_state.TABLE,
    ),
    StateTable(
        "A stop",
        "`gateway/core/stops.py`. The state is that of the stop's report. Only a standstill that was proved "
        "confirms it, and nothing changes it after that.",
        stops.StopNews,
        stops.TABLE,
    ),
    StateTable(
        "The call for the hardware stop",
        "`gateway/core/stops.py`. It goes out once, beside the repetitions of the stop. Where the proof that "
        "was under way then shows a standstill, the motor had stopped in time.",
        stops.CallNews,
        stops.CALLS,
    ),
    StateTable(
        "The disk of the journal",
        "`gateway/core/journal/journal.py`. While the disk is in trouble only reads and stops are sent.",
        journal.DiskNews,
        journal.TABLE,
    ),
)


def drawing() -> str:
    """The tables as a page of the documentation."""
    head = (
        "# States",
        "",
        "A cell has the next state and *what is done*; a dash is news that changes nothing.",
        BY,
        "",
    )
    tables = (
        line
        for table in TABLES
        for line in (f"## {table.title}", "", table.text, "", *table_of(table.news, table.steps), "")
    )
    return "\n".join([*head, *tables])


if __name__ == "__main__":
    print(drawing(), end="")
