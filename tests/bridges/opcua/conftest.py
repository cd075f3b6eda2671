"""One line, gateway and bridge for all tests that break none of them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.bridges.opcua.stand import BODIES, Bridge, Client, Plant, client_of, node
from tests.e2e.conftest import no_program_outlives_its_tests, programs_words  # noqa: F401  # they hold here, too
from tests.e2e.processes import simulated_line


@pytest.fixture(scope="session")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    node()
    folder = tmp_path_factory.mktemp("plant")
    with simulated_line(folder, BODIES) as line:
        plant = Plant(folder, line)
        yield plant
        plant.end()


@pytest.fixture(scope="session")
def bridge(plant: Plant, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bridge]:
    """A bridge that no test ends."""
    bridge = Bridge(tmp_path_factory.mktemp("bridge"), plant)
    yield bridge
    bridge.program.end()


@pytest.fixture
def client(bridge: Bridge, tmp_path: Path) -> Iterator[Client]:
    """A trusted client that has not signed in yet."""
    with client_of(tmp_path, bridge.trusted) as client:
        yield client
