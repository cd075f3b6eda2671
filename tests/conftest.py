"""What every test shares: asyncio as the backend, checked events, property tests that bear a busy machine."""

import signal

import pytest
from hypothesis import HealthCheck, settings

from tests.catalogue.rows import ROWS
from tests.checked_events import CheckedHub

settings.register_profile("shared machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared machine")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # so in the background of a shell; programs inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)

pytest.MonkeyPatch().setattr("gateway.plant.EventHub", CheckedHub)


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let `-k S01` choose the tests of a fault in the catalogue."""
    numbers: dict[str, set[str]] = {}
    for number, row in ROWS.items():
        for test in row.tests:
            numbers.setdefault(test, set()).add(number)
    for item in items:
        file, *_, name = item.nodeid.partition("[")[0].split("::")
        item.extra_keyword_matches |= numbers.get(f"{file}::{name}", set())
