"""Each promise with the tests that hold it: `python -m tests.promises > docs/testing.md`."""

import re
import sys
from pathlib import Path

from tests.drawing import runs_of

ROOT = Path(__file__).parents[1]

_HEAD = """\
# Tests

    make test     # format, style, types, dependency rules and the quick tests: a few minutes
    make prove    # the long tests: every seed, every kill, every page in a browser, the installation
    make bench    # measurements, each beside its yardstick; no test asserts a time

Tests run in virtual time wherever that is possible; ptys, sockets, files, processes and browsers are real
where the product meets them. They stand below `tests/` in the folders of what they test. A test or a module
with the mark `prove` is left to `make prove`. Where a test has many seeds, `make test` runs those that the
checked-out commit draws (`tests/drawing.py`), and `make prove` the others: 60 of 1,000 for the fault
simulator. To run one file with all its seeds:

    .venv/bin/pytest tests/fault_simulator

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

`make documents` writes this table from [the promises](promises.md) and the marks of the tests.

| Promise | Tests | Run by |
|---|---|---|
"""
_RUNS = {
    frozenset({"test"}): "`make test`",
    frozenset({"prove"}): "`make prove`",
    frozenset({"test", "prove"}): "both",
}


def named_tests() -> dict[str, list[str]]:
    """The tests that each section of the promises names."""
    sections = re.split(r"^## ", (ROOT / "docs" / "promises.md").read_text("utf-8"), flags=re.MULTILINE)
    named = {}
    for section in sections[1:]:
        title, _, text = section.partition("\n")
        named[title] = list(dict.fromkeys(re.findall(r"`(tests/[\w/]+(?:\.py)?)`", text)))
    return named


def run_by(test: str) -> str:
    """The target of the Makefile that runs a test, a file or a folder."""
    path = ROOT / test
    files = sorted(path.rglob("test_*.py")) if path.is_dir() else [path]
    return _RUNS[frozenset().union(*map(runs_of, files))]


def page() -> str:
    """Write the page."""
    rows = [
        f"| {title} | {'<br>'.join(f'`{it}`' for it in tests)} | {'<br>'.join(map(run_by, tests))} |"
        for title, tests in named_tests().items()
    ]
    return _HEAD + "\n".join([*rows, ""])


if __name__ == "__main__":
    sys.stdout.write(page())
