"""One line, gateway and broker for all tests that break none of them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.bridges.mqtt.stand import BODIES, Bridge, Broker, Client, Plant, at, bridging
from tests.e2e.conftest import no_program_outlives_its_tests, programs_words  # noqa: F401  # they hold here, too
from tests.e2e.processes import simulated_line


@pytest.fixture(scope="session")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    folder = tmp_path_factory.mktemp("plant")
    with simulated_line(folder, BODIES) as line:
        plant = Plant(folder, line)
        yield plant
        plant.end()


@pytest.fixture(scope="session")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    broker = Broker(tmp_path_factory.mktemp("broker"))
    yield broker
    broker.kill()


@pytest.fixture(scope="session")
def bridge(plant: Plant, broker: Broker, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bridge]:
    """A bridge that runs until the end of the module."""
    with bridging(tmp_path_factory.mktemp("bridge"), plant, broker, "positions = ['3F']") as bridge:
        yield bridge.wait_until_online()


@pytest.fixture
def client(broker: Broker, bridge: Bridge) -> Iterator[Client]:  # it has to run
    with at(broker) as client:
        yield client


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path
