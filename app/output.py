"""The output of commands: JSON for scripts, tables for people."""

import json
from collections.abc import Iterable

Row = tuple[str, ...]


def json_text(content: object) -> str:
    """Write an answer over several lines, Japanese as it is."""
    return json.dumps(content, ensure_ascii=False, indent=2)


def table(head: Row, body: Iterable[Row]) -> str:
    """Write rows below their heads, in columns."""
    rows = [head, *body]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(map(str.ljust, row, widths)).rstrip() for row in rows)
