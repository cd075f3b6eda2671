"""Tables for people."""

from collections.abc import Iterable

Row = tuple[str, ...]


def table(head: Row, body: Iterable[Row]) -> str:
    """Write rows below their heads, in columns."""
    rows = [head, *body]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
