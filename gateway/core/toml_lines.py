"""Where each key of a TOML text stands: the line numbers that `tomllib` does not tell."""

import re
from collections.abc import Iterator, Sequence

KeyPath = tuple[str | int, ...]
"""Keys and array indices from the top of the document."""

_KEY = r"""(?:[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*')"""
_DOTTED = rf"{_KEY}(?:\s*\.\s*{_KEY})*"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]")
_ASSIGNMENT = re.compile(rf"\s*({_DOTTED})\s*=")
_LONG_QUOTE = re.compile(r'"""|\'\'\'')


class LineIndex:
    """The line of every table and key of a valid TOML text; what stands inside a value has its key's line."""

    def __init__(self, text: str) -> None:
        self._lines: dict[KeyPath, int] = {}
        self._tables_in: dict[KeyPath, int] = {}
        self._table: KeyPath = ()
        self._headers: list[tuple[KeyPath, int]] = []
        self._text = text.split("\n")
        in_long_string = False
        for number, line in enumerate(self._text, 1):
            if not in_long_string:
                if line.lstrip().startswith("#"):
                    continue
                self._read(line, number)
            in_long_string ^= len(_LONG_QUOTE.findall(line)) % 2 == 1

    def __contains__(self, path: KeyPath) -> bool:
        """Say whether a table or a key has a line of its own."""
        return path in self._lines

    def line_of(self, path: KeyPath) -> int:
        """Find the line, from 1, of a key or else of the nearest table around it."""
        while path and path not in self._lines:
            path = path[:-1]
        return self._lines.get(path, 1)

    def end_of_table(self, path: KeyPath) -> int:
        """The line, from 0, after a table and all that is in it; comments above the next belong to that."""
        begun = self._headers.index((path, self._lines[path]))
        after = (line for other, line in self._headers[begun + 1 :] if other[: len(path)] != path)
        end = next(after, len(self._text) + 1) - 1
        while end and (not self._text[end - 1].strip() or self._text[end - 1].lstrip().startswith("#")):
            end -= 1
        return end

    def _read(self, line: str, number: int) -> None:
        if header := _HEADER.match(line):
            self._enter(_parts(header[2]), is_array=header[1] == "[[")
            self._lines.setdefault(self._table, number)
            self._headers.append((self._table, number))
        elif assignment := _ASSIGNMENT.match(line):
            path = self._table
            for part in _parts(assignment[1]):
                path = (*path, part)
                self._lines.setdefault(path, number)

    def _enter(self, parts: list[str], *, is_array: bool) -> None:
        """Follow a header; a name of an array on the way means the array's newest table."""
        path: KeyPath = ()
        for depth, part in enumerate(parts, 1):
            path = (*path, part)
            if is_array and depth == len(parts):
                self._tables_in[path] = self._tables_in.get(path, 0) + 1
            if path in self._tables_in:
                path = (*path, self._tables_in[path] - 1)
        self._table = path


_TOKEN = re.compile(
    r"""\"{3}(?:\\.|[^\\])*?\"{3}|'{3}.*?'{3}|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|\#[^\n]*|\s+|.""", re.DOTALL
)


def end_of_array(text: str, begin: int) -> tuple[int, str]:
    """Where the array that begins at a `[` can take more: after its last sign, which is given too."""
    depth, end = 0, begin
    for token in _TOKEN.finditer(text, begin):
        sign = token[0]
        if sign.isspace() or sign.startswith("#"):
            continue
        depth += (sign in "[{") - (sign in "]}")
        if depth == 0:
            break
        end = token.end()
    return end, text[end - 1]


def place_in_value(text: str, begin: int, path: KeyPath) -> tuple[int, int]:
    """Find what stands at a path in the value that begins at a place: its begin and its end.

    A key that an inline table does not have stands, without a sign, behind the table's bracket.

    :raises LookupError: no table is there.
    """
    tokens = [
        token for token in _TOKEN.finditer(text, begin) if not token[0].isspace() and token[0][0] != "#"
    ]
    at = 0
    for depth, part in enumerate(path, 1):
        is_array, opened = isinstance(part, int), tokens[at].end()
        if tokens[at][0] != ("[" if is_array else "{"):
            raise LookupError(part)
        elements = _elements(tokens, at + 1)
        at = next(
            (place for number, (key, place) in enumerate(elements) if part == (number if is_array else key)),
            -1,
        )
        if at < 0 and (depth < len(path) or is_array):
            raise LookupError(part)
        if at < 0:
            return opened, opened
    return tokens[at].start(), tokens[_behind(tokens, at) - 1].end()


def _elements(tokens: Sequence[re.Match[str]], at: int) -> Iterator[tuple[str, int]]:
    """The elements of an array, or of an inline table with their keys: where the value of each begins."""
    while tokens[at][0] not in "]}":
        end, key = _behind(tokens, at), ""
        signs = [token[0] for token in tokens[at:end]]
        if "=" in signs and tokens[at][0] not in "[{":
            key, at = "".join(signs[: signs.index("=")]).strip("\"'"), at + signs.index("=") + 1
        yield key, at
        at = end + (tokens[end][0] == ",")


def _behind(tokens: Sequence[re.Match[str]], at: int) -> int:
    """The token behind an element: a comma, or the end of what it is in."""
    depth = 0
    while depth or tokens[at][0] not in (",", "]", "}"):
        depth += (tokens[at][0] in "[{") - (tokens[at][0] in "]}")
        at += 1
    return at


def _parts(dotted: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_KEY, dotted)]
