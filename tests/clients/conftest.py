"""The demo in a process of its own, as `make serve` starts it, and a cable to it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from tests.clients.proxy import Cable
from tests.e2e.conftest import no_program_outlives_its_tests, programs_words
from tests.e2e.processes import Program, until

__all__ = ["no_program_outlives_its_tests", "programs_words"]


@contextmanager
def running_demo(folder: Path) -> Iterator[str]:
    """Run the demo, and give its address as soon as its lines are up."""
    program = Program(folder / "demo.log", "serve", "--demo", "--port", "0")
    url = program.said(r"running on (http://[0-9.]+:\d+)")[1]
    until(lambda: httpx.get(f"{url}/readyz").is_success, "the demo is ready")
    yield url
    program.end()


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The demo that the clients share: none changes its settings."""
    with running_demo(tmp_path_factory.mktemp("demo")) as url:
        yield url


@pytest.fixture
def cable(demo: str) -> Iterator[Cable]:
    cable = Cable(demo)
    yield cable
    cable.close()
