"""A full line: 120 bodies at 9600 baud."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from tests.plants import Rig, rig

FULL = range(120)
SWEEP_GROUPS = 'sweep_groups = ["90", "9E"]'


@asynccontextmanager
async def full_line(options: str = SWEEP_GROUPS) -> AsyncIterator[Rig]:
    """Start one that is known throughout."""
    async with rig(bodies=FULL, groups={}, baud=9600, options=options) as running:
        yield running
