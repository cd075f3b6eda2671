"""The state of all parts, every other second, which a replay of a recording serves to clients."""

import asyncio
from collections.abc import Mapping
from typing import Final

from pydantic import BaseModel
from pydantic_core import to_json

from gateway.access.principal import EVERYBODY, asking
from gateway.core.aside import aside
from gateway.core.origin import POLL, acting
from gateway.core.supervisor import supervise
from gateway.door.calls import carry_out
from gateway.door.names import COLLECTIONS
from gateway.door.table import Operation, operations
from gateway.plant import Plant
from gateway.recordings import STATES_REACH_S
from transports.recorder import clocks

STATES_S: Final = 2.0
LISTS: Final = ("/lines", *COLLECTIONS, "/alarms")
"""Lists that are noted in a recording: none of them asks a controller."""


async def note_states(plant: Plant) -> None:
    """Note what has changed, until it is cancelled."""
    with asking(EVERYBODY), acting(POLL):
        await supervise("the notes of states", lambda: _note(plant))


async def _note(plant: Plant) -> None:
    rows = {
        operation.path: operation
        for operation in operations()
        if operation.verb == "GET" and operation.path in LISTS
    }
    told: dict[str, tuple[bytes, int]] = {}
    while True:
        for path, operation in rows.items():
            await _note_one(plant, path, operation, told)
        await asyncio.sleep(STATES_S)


async def _note_one(
    plant: Plant, path: str, operation: Operation, told: dict[str, tuple[bytes, int]]
) -> None:
    state = await carry_out(plant, operation, {})
    text = await aside(_written, state)
    at_ns, monotonic_ns = clocks()
    last, last_ns = told.get(path, (b"", 0))
    if text != last or monotonic_ns - last_ns > STATES_REACH_S / 2 * 1e9:
        told[path] = text, monotonic_ns
        plant.history.states.append((at_ns, monotonic_ns, f'{{"path":"{path}","state":{text.decode()}}}'))


def _written(state: BaseModel | Mapping[str, object]) -> bytes:
    return to_json(state)
