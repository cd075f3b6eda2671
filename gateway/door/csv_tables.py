"""Tables as CSV: read as they are downloaded, and as Excel writes them."""

import csv
from collections.abc import Iterable, Sequence
from io import StringIO
from typing import Annotated, Final

from pydantic import Field

from gateway.core.aside import aside
from gateway.core.errors import InvalidRequest
from gateway.door.strict_json import MAX_ITEMS

CSV: Final = "text/csv"
Table = Annotated[bytes, Field(description="A table as CSV, in UTF-8.")]
Row = tuple[int, list[str]]
"""The number of a line, from 1, and its cells."""


async def read_table(content: bytes, header: Sequence[str]) -> list[Row]:
    """Read a table with exactly these columns.

    Excel may write a byte order mark, semicolons with decimal commas, and empty lines: all are taken.

    :raises InvalidRequest: it is another table; the message names the line.
    """
    return await aside(table_of, content, header)


def table_of(content: bytes, header: Sequence[str]) -> list[Row]:
    """Read a table; errors as of `read_table`."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InvalidRequest("The request body is no CSV: it is not UTF-8 text; nothing was sent.") from None
    semicolons = ";" in text.partition("\n")[0]
    delimiter = ";" if semicolons else ","
    try:
        lines = list(csv.reader(StringIO(text, newline=""), delimiter=delimiter, strict=True))
    except csv.Error:
        raise InvalidRequest("The request body is no CSV: a line cannot be read; nothing was sent.") from None
    cells = [[cell.strip() for cell in line] for line in lines]
    if not cells or [cell.casefold() for cell in cells[0]] != [name.casefold() for name in header]:
        raise InvalidRequest(f"line 1: the columns are {','.join(header)}; nothing was sent.")
    rows = [(place, line) for place, line in enumerate(cells[1:], 2) if any(line)]
    if len(rows) > MAX_ITEMS:
        raise InvalidRequest(f"The table has more than {MAX_ITEMS} lines; nothing was sent.")
    for place, line in rows:
        if len(line) != len(header):
            raise InvalidRequest(
                f"line {place}: it has {len(line)} columns, not {len(header)}; nothing was sent."
            )
    if not rows:
        raise InvalidRequest("The table has no positions; nothing was sent.")
    if not semicolons:
        return rows
    return [(place, [_decimal_comma(place, cell) for cell in line]) for place, line in rows]


def _decimal_comma(place: int, cell: str) -> str:
    """Read a point for a comma; a point between semicolons may part thousands, and nothing is guessed."""
    if "." in cell:
        raise InvalidRequest(
            f"line {place}: {cell}: between semicolons decimals stand behind a comma; nothing was sent."
        )
    return cell.replace(",", ".")


def csv_of(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write a table; what is null is left empty."""
    text = StringIO()
    writer = csv.writer(text)
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()
