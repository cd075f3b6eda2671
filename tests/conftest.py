"""The common part of all tests: asyncio as the backend, checked events, property tests for busy machines."""

import gc
import os
import signal
from itertools import islice
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.catalogue.rows import ROWS
from tests.checked_events import CheckedHub
from tests.drawing import may_choose
from tests.drawn_faults import STRUCK

SELDOM = (50_000, 20, 50)
"""Python's own thresholds cost a story in virtual time a sixth of its processor time."""

gc.disable()  # until the tests are collected: nothing of that is garbage

settings.register_profile("shared machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared machine")

# A shell's background ignores the one, nohup the other; programs inherit that.
for number, usual in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, usual)

os.environ["NO_PROXY"] = os.environ["no_proxy"] = "*"  # nothing is asked for outside of this machine

pytest.MonkeyPatch().setattr("gateway.plant.EventHub", CheckedHub)


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let `-k S01` choose the tests of a fault in the catalogue; begin with the long ones."""
    numbers: dict[str, set[str]] = {}
    for number, row in ROWS.items():
        for test in row.tests:
            numbers.setdefault(test, set()).add(number)
    for item in items:
        file, *_, name = item.nodeid.partition("[")[0].split("::")
        item.extra_keyword_matches |= numbers.get(f"{file}::{name}", set())
    items[:] = long_ones_first(items, getattr(config, "workerinput", {"workercount": 1})["workercount"])


def long_ones_first(items: list[pytest.Item], workers: int) -> list[pytest.Item]:
    """Deal out the long ones: the share that `--dist worksteal` gives each worker begins with some."""
    marked = [item for item in items if item.get_closest_marker("long")]
    others = iter([item for item in items if not item.get_closest_marker("long")])
    order: list[pytest.Item] = []
    for worker in range(workers):
        share = marked[worker::workers]
        order += [*share, *islice(others, max(0, (len(items) + worker) // workers - len(share)))]
    return [*order, *others]


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Pass over a file of which `-m prove`, or `-m "not prove"`, chooses nothing: to load it takes time."""
    is_one = collection_path.name.startswith("test_") and collection_path.suffix == ".py"
    return True if is_one and not may_choose(config.option.markexpr, collection_path) else None


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell how many functions drawn faults have struck."""
    properties = [
        noted for passed in terminalreporter.getreports("passed") for noted in passed.user_properties
    ]
    if struck := {place for name, places in properties if name == STRUCK for place in places}:
        terminalreporter.write_line(f"{len(struck):,} {STRUCK}")


def pytest_collection_finish() -> None:
    """Exclude all present objects from garbage collection, and collect new ones seldom."""
    gc.freeze()
    gc.set_threshold(*SELDOM)
    gc.enable()
