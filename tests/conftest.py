"""What every test shares: asyncio as the backend of asynchronous tests."""

import pytest


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"
