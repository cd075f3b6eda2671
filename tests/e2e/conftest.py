"""A simulated line and a gateway for tests that break nothing, and each program's log where a test fails."""

from collections.abc import Iterator

import pytest

from tests.e2e.processes import (
    PATIENT_S,
    RUNNING,
    Gateway,
    SimulatedLine,
    gateway_at,
    group_of,
    simulated_line,
)


@pytest.fixture(autouse=True)
def programs_words() -> Iterator[None]:
    """Print what the programs have said; pytest shows it only where a test has failed."""
    yield
    for program in RUNNING:
        print(f"\n---- {program.log}\n{program.words()[-4000:]}")


@pytest.fixture(scope="session", autouse=True)
def no_program_outlives_its_tests() -> Iterator[None]:
    """A start that has failed half-way leaves something behind."""
    yield
    for program in list(RUNNING):
        program.kill()


@pytest.fixture(scope="session")
def shared_line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedLine]:
    with simulated_line(tmp_path_factory.mktemp("line")) as line:
        yield line


@pytest.fixture(scope="session")
def gateway(shared_line: SimulatedLine) -> Iterator[Gateway]:
    with gateway_at(shared_line, groups=group_of("00", "3F"), reply_timeout_s=PATIENT_S) as gateway:
        yield gateway.wait_until_ready()


@pytest.fixture
def line(shared_line: SimulatedLine) -> SimulatedLine:
    """The simulated line, which tells each test only what happens in it."""
    shared_line.begin_anew()
    return shared_line
