"""A gateway that is killed (kill -9) in the middle of things, and started again: nothing happens twice."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.processes import (
    SimulatedLine,
    simulated_line,
)

LONG = 90_000
"""Pulses of a move that takes 2.5 s at the speeds of a new controller."""


@pytest.fixture
def line(tmp_path: Path) -> Iterator[SimulatedLine]:
    with simulated_line(tmp_path) as it:
        yield it
