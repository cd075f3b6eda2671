"""Tables of the code, drawn as pages of the documentation."""

from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from typing import Any, Final, Generic, NamedTuple, TypeVar

BY: Final = "`make documents` draws this page."

S = TypeVar("S")
A = TypeVar("A")


class Transition(NamedTuple, Generic[S, A]):
    """One cell of a table of states."""

    state: S
    """The next state."""
    action: A


def states(head: Sequence[str], news: Iterable[Enum], table: Mapping[Any, Mapping[Any, Any]]) -> str:
    """The page of a table whose rows are states, and whose cells the steps that news takes from them.

    `head` is its title, and the lines below it.
    """
    title, *lines = head
    return "\n".join([f"# {title}", "", *lines, BY, "", *table_of(news, table), ""])


def table_of(news: Iterable[Enum], table: Mapping[Any, Mapping[Any, Any]]) -> list[str]:
    """The lines of a table of states; a transition that changes nothing is a dash."""
    rows = [
        (f"**{_named(state)}**", *(_step(_change(state, steps.get(each))) for each in news))
        for state, steps in table.items()
    ]
    return drawn_table(["state", *map(_named, news)], rows)


def _change(state: Any, step: Any) -> Any:
    stays = isinstance(step, Transition) and step.state == state and not step.action.value
    return None if stays else step


def drawn_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """The lines of a table."""
    lines = [f"| {' | '.join(cells)} |" for cells in (columns, *rows)]
    return [lines[0], "|---" * len(columns) + "|", *lines[1:]]


def _step(step: Any) -> str:
    if step is None or isinstance(step, str):
        return "–"
    end = getattr(step, "ends_as", None)
    state = "as it began to stop" if step.state is None else _named(step.state)
    then = f", then {end}" if end and end != step.state else ""
    return f"{state}{then}" + (f"; *{step.action.value}*" if step.action.value else "")


def _named(state: Any) -> str:
    return str(state.value if isinstance(state, Enum) else state)
