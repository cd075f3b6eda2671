"""Tables for people."""

from app.tables import table


def test_columns_are_as_wide_as_what_stands_in_them() -> None:
    assert table(("A", "LONG"), [("body", "x"), ("", "y")]).splitlines() == [
        "A     LONG",
        "body  x",
        "      y",
    ]


def test_a_table_may_have_heads_alone() -> None:
    assert table(("A", "B"), []) == "A  B"
