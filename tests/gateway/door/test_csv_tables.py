"""CSV is read as it is downloaded and as Excel writes it, and nothing is guessed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.errors import InvalidRequest
from gateway.door.csv_tables import csv_of, table_of

HEADER = ("number", "X mm")


@pytest.mark.parametrize(
    "text",
    [
        "number,X mm\r\n1,12.5\r\n",
        "\ufeffnumber;X mm\r\n1;12,5\r\n;\r\n",
        "number,x MM\n\n 1 , 12.5\n,\n",
    ],
)
def test_a_table_is_read(text: str) -> None:
    [(_, cells)] = table_of(text.encode(), HEADER)
    assert cells == ["1", "12.5"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("number;X mm\n1;1.000\n", "line 2: 1.000: between semicolons"),
        ("number;X mm\n1;1,5;2\n", "line 2: it has 3 columns, not 2"),
        ("number,X mm\n1,1,5\n", "line 2: it has 3 columns, not 2"),
        ("number,Y mm\n1,2\n", "line 1: the columns are number,X mm"),
        ("", "line 1: the columns are number,X mm"),
        ("number,X mm\n,\n", "no positions"),
        ('number,X mm\n1,"2\n', "cannot be read"),
    ],
)
def test_another_table_is_refused(text: str, told: str) -> None:
    with pytest.raises(InvalidRequest, match=told):
        table_of(text.encode(), HEADER)


def test_what_is_no_text_is_refused() -> None:
    with pytest.raises(InvalidRequest, match="not UTF-8"):
        table_of(b"\xff\xfen", HEADER)


@given(st.lists(st.tuples(st.integers(0, 2047), st.integers(-(10**9) + 1, 10**9 - 1)), min_size=1))
def test_what_was_written_is_read(rows: list[tuple[int, int]]) -> None:
    read = table_of(csv_of(("number", "pulse"), rows).encode(), ("number", "pulse"))
    assert [tuple(map(int, cells)) for _, cells in read] == rows
