import tomllib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from gateway.core.toml_lines import KeyPath, LineIndex

PLANT = '''\
# [server] is not here """
title = "a [[lines]] in a string"

[server]
port = 8420
"quoted key" = 1
limits.high.soft = 5

[[lines]]
id = "first"
note = """
[[lines]]
id = "not a key"
"""
units = { unit = "mm", pulses_per_unit = 100.0 }
  [[lines.bodies]]
  id = "00"
  [[lines.bodies]]
  id = "3F"
  members = [
      "a = 1",
      "02",
  ]
[[lines]]
id = "second"
[[lines.bodies]]
id = "01"
[lines.trace]
entries = 5
'''


def lines_of(paths: list[KeyPath]) -> list[int]:
    index = LineIndex(PLANT)
    return [index.line_of(path) for path in paths]


def test_tables_and_keys_are_found_where_they_stand() -> None:
    assert lines_of([("title",), ("server",), ("server", "port"), ("server", "quoted key")]) == [2, 4, 5, 6]
    assert lines_of([("server", "limits"), ("server", "limits", "high", "soft")]) == [7, 7]


def test_each_table_of_an_array_is_told_apart() -> None:
    assert lines_of([("lines", 0), ("lines", 0, "id"), ("lines", 1), ("lines", 1, "id")]) == [9, 10, 24, 25]
    bodies: list[KeyPath] = [("lines", 0, "bodies", 1, "id"), ("lines", 1, "bodies", 0, "id")]
    assert lines_of(bodies) == [19, 27]
    assert lines_of([("lines", 1, "trace", "entries")]) == [29]


def test_what_stands_inside_a_value_has_its_keys_line() -> None:
    assert lines_of([("lines", 0, "units", "unit"), ("lines", 0, "bodies", 1, "members", 1)]) == [15, 20]


def test_what_is_missing_has_the_line_of_its_table_and_a_missing_table_line_1() -> None:
    assert lines_of([("lines", 1, "address"), ("server", "host"), ("nowhere", "at all"), ()]) == [24, 4, 1, 1]


def test_text_inside_a_long_string_is_no_key() -> None:
    assert len(tomllib.loads(PLANT)["lines"]) == 2
    assert lines_of([("lines", 2)]) == [1]


NAMES = st.text("abcdefgh-_", min_size=1, max_size=4)
SCALARS = st.integers() | st.booleans() | st.sampled_from(['"x"', "'[y]'", '"a = 1"', "[1, 2]", "{}"])
TABLES = st.dictionaries(NAMES, SCALARS, max_size=4)


@given(st.dictionaries(NAMES, TABLES | st.lists(TABLES, min_size=1, max_size=3), max_size=5), st.data())
def test_every_key_of_any_document_is_found(document: dict[str, Any], data: st.DataObject) -> None:
    lines: list[str] = []
    expected: dict[KeyPath, int] = {}

    def write(line: str, path: KeyPath) -> None:
        lines.extend([""] * data.draw(st.integers(0, 2)))
        lines.append(line)
        expected[path] = len(lines)

    def write_keys(table: dict[str, object], path: KeyPath) -> None:
        for key, value in table.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            write(f"{key} = {text}  # comment", (*path, key))

    for name, tables in document.items():
        if isinstance(tables, dict):
            write(f"[{name}]", (name,))
            write_keys(tables, (name,))
        for number, table in enumerate(tables if isinstance(tables, list) else ()):
            write(f"[[ {name} ]]", (name, number))
            write_keys(table, (name, number))

    text = "\n".join(lines)
    tomllib.loads(text)
    index = LineIndex(text)
    assert {path: index.line_of(path) for path in expected} == expected
