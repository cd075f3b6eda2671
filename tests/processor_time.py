"""Processor seconds of each test file, its programs included: `pytest -n 0 -p tests.processor_time FILES`."""

import resource
from collections import defaultdict
from collections.abc import Iterator

import pytest

_SHOWN = 40
_spent: defaultdict[str, float] = defaultdict(float)


def _processor_seconds() -> float:
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    before = _processor_seconds()
    try:
        return (yield)
    finally:
        _spent[item.nodeid] += _processor_seconds() - before


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    files: defaultdict[str, float] = defaultdict(float)
    for test, spent in _spent.items():
        files[test.partition("::")[0]] += spent
    for what, rows in (("files", files), ("tests", _spent)):
        terminalreporter.section(f"processor seconds of {what}")
        for name in sorted(rows, key=rows.__getitem__, reverse=True)[:_SHOWN]:
            terminalreporter.write_line(f"{rows[name]:8.2f}  {name}")
        terminalreporter.write_line(f"{sum(rows.values()):8.2f}  all")
