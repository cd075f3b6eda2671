"""The file of the configuration: read again while the gateway runs, compared, changed with its comments."""

import asyncio
import json
import os
import secrets
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from difflib import unified_diff
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from gateway.config import Config, load, parse
from gateway.core.errors import NotSent
from gateway.core.records import Record
from gateway.core.toml_files import ConfigError
from gateway.core.toml_lines import KeyPath, LineIndex, end_of_array, place_in_value


class LineChange(Record):
    """The change of a line."""

    line_id: str
    change: Literal["added", "removed", "changed"]
    keys: list[str] = Field(description="Keys of the line that have changed: `bodies.40`, `reply_timeout_s`.")


class Changes(Record):
    """The differences between the configuration that is served and another."""

    lines: list[LineChange] = Field(description="All others go on undisturbed.")
    needs_restart: list[str] = Field(description="Keys whose change takes a restart of the gateway.")


def changes(served: Config, wanted: Config) -> Changes:
    """Compare two configurations."""
    before, after = served.served(), wanted.served()
    lines = [
        LineChange(line_id=line_id, change="removed", keys=[]) for line_id in before if line_id not in after
    ]
    for line_id, line in after.items():
        if line_id not in before:
            lines.append(LineChange(line_id=line_id, change="added", keys=[]))
        elif keys := list(_differences(before[line_id], line)):
            lines.append(LineChange(line_id=line_id, change="changed", keys=keys))
    before, after = (
        config.model_dump(include={"server", "access", "security", "plant"}) for config in (served, wanted)
    )
    return Changes(lines=lines, needs_restart=list(_differences(before, after, 1)))


def _differences(one: Mapping[str, Any], other: Mapping[str, Any], depth: int = 0) -> Iterator[str]:
    """The keys that differ, those of arrays of tables by the ids in these."""
    for key in dict.fromkeys((*one, *other)):
        left, right = (_by_id(table.get(key)) for table in (one, other))
        if left == right:
            continue
        tables = isinstance(left, Mapping) and isinstance(right, Mapping)
        if tables and (depth or _is_by_id(one.get(key)) or _is_by_id(other.get(key))):
            yield from (f"{key}.{name}" for name in _differences(left, right))
        else:
            yield key


def _is_by_id(value: Any) -> bool:
    return isinstance(value, Sequence) and bool(value) and isinstance(value[0], Mapping) and "id" in value[0]


def _by_id(value: Any) -> Any:
    """An array of tables as a table."""
    if _is_by_id(value):
        return {table["id"]: table for table in value}
    return {} if value == () else value


class ConfigFile:
    """A file that is read, and to which lines and bodies are added; its comments stay."""

    def __init__(self, path: Path, port: int | None = None) -> None:
        self.path = path
        self._port = port
        """The TCP port that counts instead of the file's."""
        self.turn = asyncio.Lock()
        """Held from reading it until what it says is served: of two changes at once one would be lost."""

    def load(self) -> Config:
        """Read it.

        :raises ConfigError: it cannot be read, or is no configuration.
        """
        return self._on_port(load(self.path))

    def parsed(self, text: str) -> Config:
        """Read what it is to say.

        :raises ConfigError: it would be no configuration.
        """
        return self._on_port(parse(text, str(self.path)))

    def with_line(self, table: Mapping[str, Any], comment: str = "") -> tuple[str, Config]:
        """Give its text with one more line below a comment, and what that means.

        :raises ConfigError: it would be no configuration.
        """
        text, tables = self._read()
        new = text.rstrip("\n") + "\n\n" + _commented(comment) + "".join(_array_table("lines", table))
        return self._checked(new, {**tables, "lines": [*tables.get("lines", []), dict(table)]})

    def with_bodies(
        self, line_id: str, bodies: Sequence[Mapping[str, Any]], comment: str = ""
    ) -> tuple[str, Config]:
        """Give its text with more bodies on a line below a comment, and what that means.

        :raises ConfigError: it would be no configuration.
        """
        text, whole = self._read()
        number = next((n for n, line in enumerate(whole["lines"]) if line["id"] == line_id), -1)
        index, path = LineIndex(text), ("lines", number)
        if path not in index:
            raise ConfigError(f"{self.path}: line {line_id} has no [[lines]] table: add the bodies by hand")
        rows = text.split("\n")
        if (*path, "bodies") in index:
            start = sum(len(row) + 1 for row in rows[: index.line_of((*path, "bodies")) - 1])
            end, last = end_of_array(text, text.index("[", text.index("=", start)))
            values = ", ".join(map(value_text, bodies))
            above = f"{text[:start]}{_commented(comment)}{text[start:end]}"
            new = f"{above}{'' if last in '[,' else ','} {values}{text[end:]}"
        else:
            end = index.end_of_table(path)
            tables = ["".join(_array_table("lines.bodies", body)) for body in bodies]
            added = "\n" + _commented(comment) + "\n".join(tables)
            new = "\n".join((*rows[:end], added.rstrip("\n"), *rows[end:]))
        line = whole["lines"][number]
        line["bodies"] = [*line.get("bodies", []), *map(dict, bodies)]
        return self._checked(new, whole)

    def write(self, text: str) -> None:
        """Replace the file as a whole; it keeps its mode.

        :raises NotSent: it cannot be written.
        """
        new = self.path.with_name(f".{self.path.name}.{secrets.token_hex(4)}")
        try:
            mode = self.path.stat().st_mode & 0o777
            descriptor = os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, mode)
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            new.replace(self.path)
        except OSError as error:
            new.unlink(missing_ok=True)
            raise NotSent(
                f"{self.path} cannot be written: {error.strerror}; nothing was changed.",
                "Let the gateway write in that directory, or change the file by hand and reload it.",
            ) from error

    def _read(self) -> tuple[str, dict[str, Any]]:
        load(self.path)  # says what is wrong with it
        text = self.path.read_text("utf-8-sig")
        return text, tomllib.loads(text)

    def _checked(self, text: str, tables: Mapping[str, Any]) -> tuple[str, Config]:
        """Make sure that a text says this and nothing else."""
        config = parse(text, str(self.path))
        if tomllib.loads(text) != tables:
            raise ConfigError(f"{self.path}: its form is not understood: change it by hand, and reload it")
        return text, self._on_port(config)

    def _on_port(self, config: Config) -> Config:
        if self._port is None:
            return config
        return config.model_copy(update={"server": config.server.model_copy(update={"port": self._port})})


def _commented(comment: str) -> str:
    """Write lines of a comment; what people cannot read is left out."""
    lines = (
        "".join(character for character in line if character.isprintable()) for line in comment.splitlines()
    )
    return "".join(f"# {line}\n" for line in lines)


def _array_table(name: str, table: Mapping[str, Any]) -> Iterator[str]:
    yield f"[[{name}]]\n"
    yield from (f"{_key(key)} = {value_text(value)}\n" for key, value in table.items())


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else value_text(key)


def value_text(value: Any) -> str:
    """Write a value as TOML does."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {value_text(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    return json.dumps(value, ensure_ascii=False)


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
