"""Here a story says itself who asks."""

import pytest


@pytest.fixture(autouse=True)
def everybody() -> None:
    """Leave out the caller that tests of operations have."""
