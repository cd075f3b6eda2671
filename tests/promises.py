"""Each promise with the tests that hold it: `python -m tests.promises > docs/testing.md`."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from tests.drawing import runs_of

ROOT: Final = Path(__file__).parents[1]
PROMISED: Final = Path(__file__).with_name("promised.txt")
_SOURCES: Final = re.compile(r"\s*\((?:[^()]*`(?:gateway|api|tests)/[^()]*|decisions? [\d, ]+)\)")
"""References of a promise to its code, tests and decisions."""
_NEXT_SENTENCE: Final = re.compile(r"(?<=[.:;]) +(?=[A-Z`])")
_SHOWN: Final = 110
_HEAD = """\
# Tests

    make test     # format, style, types, dependency rules and the quick tests: a few minutes
    make seeds    # a thousand seeds of the fault simulator for each family: a few minutes
    make prove    # the long tests: every seed, every kill, every page in a browser, the installation
    make bench    # measurements, each beside its yardstick; no test asserts a time

Tests run in virtual time wherever that is possible; ptys, sockets, files, processes and browsers are real
where the product meets them. They stand below `tests/` in the folders of what they test. A test or a module
with the mark `prove` is left to `make prove`. Where a test has many seeds, `make test` runs those that the
checked-out commit draws (`tests/drawing.py`), and `make prove` the others: 60 of 1,000 for the fault
simulator, all of which `make seeds` runs, too. To run one file with all its seeds:

    .venv/bin/pytest tests/fault_simulator

## Sentences

`tests/test_sentences.py` holds docstrings and descriptions to the rules that it lists, each with a sentence
that breaks it and a better one. `tests/sentences_left.txt` counts what is left; the numbers only fall.

## Faults of the gateway itself

`tests/gateway/test_drawn_faults.py` counts which functions of the gateway a story calls, draws one call of
each, and lets it raise an exception that the code does not foresee; no test names a function. The
promises have to hold nevertheless. `make test` strikes some of them, and `make prove` each in two of the
stories that call it; the end of the run tells how many they were.

## Where the time goes

    .venv/bin/pytest -n 0 -p tests.processor_time tests/simulation

prints the processor seconds of each file and of each test, programs that it has started and that have ended
included; on a busy machine the wall clock tells little.

## What holds each promise

`make documents` writes this table from [the promises](promises.md), sentence by sentence,
`tests/promised.txt`, which names the tests of each, and the marks of the tests. A sentence without a test
fails `make test`.

| Promise | Tests | Run by |
|---|---|---|
"""
_RUNS = {
    frozenset({"test"}): "`make test`",
    frozenset({"prove"}): "`make prove`",
    frozenset({"test", "prove"}): "both",
}


class Promise(NamedTuple):
    """A sentence of the promises, or a row of a table in them."""

    section: str
    text: str


class Held(NamedTuple):
    """The tests, files or functions of them, that hold the promise which begins so."""

    beginning: str
    tests: tuple[str, ...]


def promises() -> Iterator[Promise]:
    """Every sentence of the promises, in their order."""
    sections = re.split(r"^## ", (ROOT / "docs" / "promises.md").read_text("utf-8"), flags=re.MULTILINE)
    for section in sections[1:]:
        title, _, text = section.partition("\n")
        for paragraph in text.strip().split("\n\n"):
            yield from (Promise(title, sentence) for sentence in _sentences(paragraph))


def _sentences(paragraph: str) -> list[str]:
    if paragraph.startswith("|"):
        return paragraph.splitlines()[2:]
    plain = _SOURCES.sub("", " ".join(paragraph.replace("**", "").split()))
    return [sentence for sentence in _NEXT_SENTENCE.split(plain) if re.search(r"\w", sentence)]


def held() -> list[Held]:
    """Promises and their tests, from the list."""
    _, _, text = PROMISED.read_text("utf-8").partition("\n\n")
    found: list[Held] = []
    for line in filter(None, text.splitlines()):
        if line.startswith(" "):
            last = found.pop()
            found.append(last._replace(tests=(*last.tests, line.strip())))
        else:
            found.append(Held(line, ()))
    return found


def run_by(test: str) -> str:
    """The target of the Makefile that runs a test: a function, a file or a folder."""
    file, _, name = test.partition("::")
    path = ROOT / file
    files = sorted(path.rglob("test_*.py")) if path.is_dir() else [path]
    runs = frozenset[str]().union(*(runs_of(file.read_text("utf-8")) for file in files))
    return _RUNS[_runs_of_function(path, name) if name and runs != {"prove"} else runs]


def _runs_of_function(file: Path, name: str) -> frozenset[str]:
    """The targets that run a test by its own marks."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name == name:
            marks = [ast.unparse(mark) for mark in node.decorator_list]
            return frozenset({"prove"} if "pytest.mark.prove" in marks else runs_of("\n".join(marks)))
    raise LookupError(f"{file.relative_to(ROOT)} has no {name}")


def page() -> str:
    """Write the page."""
    rows: list[str] = []
    section = ""
    for promise, found in zip(promises(), held(), strict=True):
        if promise.section != section:
            section = promise.section
            rows.append(f"| **{section}** | | |")
        tests = "<br>".join(f"`{test.replace('::', ' ')}`" for test in found.tests)
        rows.append(f"| {_short(promise.text)} | {tests} | {'<br>'.join(map(run_by, found.tests))} |")
    return _HEAD + "\n".join([*rows, ""])


def _short(text: str) -> str:
    plain = re.sub(r"\]\([^)]*\)|[*\[\]]", "", text).strip("| ").replace(" | ", ": ")
    return plain if len(plain) <= _SHOWN else plain[:_SHOWN].rpartition(" ")[0] + " …"


if __name__ == "__main__":
    sys.stdout.write(page())
