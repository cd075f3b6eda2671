"""Tables as text/csv."""

import csv
from collections.abc import Iterable, Sequence
from io import StringIO

from fastapi import Response

CSV = "text/csv"


def csv_response(header: Sequence[str], rows: Iterable[Sequence[object]]) -> Response:
    """Answer with a table; what is null is left empty."""
    text = StringIO()
    writer = csv.writer(text)
    writer.writerow(header)
    writer.writerows(["" if cell is None else cell for cell in row] for row in rows)
    return Response(text.getvalue(), media_type=CSV)
