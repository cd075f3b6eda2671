"""Output of commands."""

from app.output import json_text, table


def test_columns_are_as_wide_as_what_stands_in_them() -> None:
    assert table(("A", "LONG"), [("body", "x"), ("", "y")]).splitlines() == [
        "A     LONG",
        "body  x",
        "      y",
    ]


def test_a_table_may_have_heads_alone() -> None:
    assert table(("A", "B"), []) == "A  B"


def test_japanese_stands_in_json_as_it_is() -> None:
    assert json_text({"name": "旋回"}) == '{\n  "name": "旋回"\n}'
