"""Here a story says itself who asks."""

import pytest


@pytest.fixture(autouse=True)
def everybody() -> None:
    """Nobody."""
