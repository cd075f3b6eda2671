"""Other values for keys of a line in the text of a configuration, whose comments stay; shown as a diff."""

import tomllib
from collections.abc import Mapping
from difflib import unified_diff
from typing import Any

from gateway.config import parse
from gateway.config_file import value_text
from gateway.core.toml_files import ConfigError
from gateway.core.toml_lines import KeyPath, LineIndex, place_in_value


def changed(text: str, line_id: str, changes: Mapping[str, Any], name: str) -> str:
    """Give the text of a configuration with other values for keys of a line; its comments stay.

    :raises ConfigError: its form is not understood, or it would be no configuration; `name` is its file.
    """
    wanted: Any = tomllib.loads(text)
    for key, value in changes.items():
        path = _path_of(wanted, line_id, key)
        text = _set(text, path, value, name)
        table: Any = wanted
        for part in path[:-1]:
            table = table[part]
        table[path[-1]] = value
    parse(text, name)
    if tomllib.loads(text) != wanted:
        raise ConfigError(f"{name}: its form is not understood: change it by hand: {dict(changes)}")
    return text


def diff(before: str, after: str, name: str) -> str:
    """Show what changes, as `diff -u` does."""
    rows = unified_diff(before.splitlines(True), after.splitlines(True), name, f"{name} (proposed)")
    return "".join(rows)


def _path_of(document: Any, line_id: str, key: str) -> KeyPath:
    """Where a key of a line stands in the document; tables in arrays are named by their ids."""
    path: list[str | int] = ["lines", _place(document["lines"], line_id)]
    table: Any = document["lines"][path[-1]]
    for part in key.split("."):
        if isinstance(table, list):
            path.append(_place(table, part))
            table = table[_place(table, part)]
        else:
            path.append(part)
            table = table.get(part, {})
    return tuple(path)


def _place(tables: Any, its_id: str) -> int:
    return next(place for place, table in enumerate(tables) if table["id"] == its_id)


def _set(text: str, path: KeyPath, value: Any, name: str) -> str:
    """Replace the line of a key, or add one at the head of its table; or its place in an inline table."""
    index, rows = LineIndex(text), text.split("\n")
    written = f"{path[-1]} = {value_text(value)}"
    if path in index:
        place = index.line_of(path) - 1
        rows[place] = written + _comment_of(rows[place])
    elif path[:-1] in index and "=" not in rows[index.line_of(path[:-1]) - 1]:
        rows.insert(index.line_of(path[:-1]), written)
    else:
        return _set_inline(text, path, value, name)
    return "\n".join(rows)


def _set_inline(text: str, path: KeyPath, value: Any, name: str) -> str:
    """Replace the value of a key in an inline table, or add the key at its head."""
    index = LineIndex(text)
    depth = next(length for length in range(len(path), -1, -1) if not length or path[:length] in index)
    row = sum(len(line) + 1 for line in text.split("\n")[: index.line_of(path[:depth]) - 1])
    try:
        begin, end = place_in_value(text, text.index("=", row) + 1, path[depth:])
    except (LookupError, ValueError):
        written = f"{path[-1]} = {value_text(value)}"
        raise ConfigError(f"{name}: write `{written}` into {'.'.join(map(str, path[:-1]))} by hand") from None
    added = value_text(value) if begin != end else f" {path[-1]} = {value_text(value)},"
    return text[:begin] + added + text[end:]


def _comment_of(row: str) -> str:
    """The comment behind a value, with the blanks before it."""
    for place, sign in enumerate(row):
        if sign == "#" and _is_whole(row[:place]):
            return row[len(row[:place].rstrip()) :]
    return ""


def _is_whole(assignment: str) -> bool:
    try:
        return bool(tomllib.loads(assignment.strip()))
    except tomllib.TOMLDecodeError:
        return False
