"""The catalogue of faults as a page: `python -m tests.catalogue.page > docs/faults.md`."""

import sys

from tests.catalogue.rows import ROWS

_HEAD = """\
# What can go wrong

Each fault has a number, what the gateway does about it, and tests that prove it: `pytest -k S01` runs those
of one. S is the serial line, L the link master, C a controller, H a robot and its dual-port RAM, G the
process and its computer, A what comes over HTTP and WebSockets, J the disk and the journal.
`make documents` writes this page, and `make test` compares it.

| Number | Fault | What the gateway does | Tests |
|---|---|---|---|
"""


def page() -> str:
    """Write all rows."""
    lines = [
        f"| {number} | {row.fault} | {row.answer} | {'<br>'.join(f'`{test}`' for test in row.tests)} |"
        for number, row in ROWS.items()
    ]
    return _HEAD + "\n".join([*lines, ""])


if __name__ == "__main__":
    sys.stdout.write(page())
