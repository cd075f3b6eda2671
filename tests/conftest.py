"""What every test shares: asyncio as the backend, checked events, property tests that bear a busy machine."""

import pytest
from hypothesis import HealthCheck, settings

from tests.checked_events import CheckedHub

settings.register_profile("shared machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared machine")

pytest.MonkeyPatch().setattr("gateway.plant.EventHub", CheckedHub)


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"
