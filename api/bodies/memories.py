"""Data memories, counters and timers of user programs over HTTP."""

from collections.abc import Iterable
from typing import Annotated

from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.bodies.names import body_of
from api.common.requests import json_response, new_router, origin, plant_of
from gateway.core.records import RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.door.names import BodyId
from gateway.operations import programs

router = new_router("programs")

MOST = 200
"""As many as the largest bank has."""
MemoryName = Annotated[str, Path(description="D0-D199, C0-C29 or T0-T29.", examples=["D0"])]
First = Annotated[str, Query(description="D0-D199, C0-C29 or T0-T29.", max_length=8)]
Count = Annotated[int, Query(ge=1, le=MOST, description="How many of the same bank.")]


class Memory(BaseModel):
    """A memory of the user program."""

    name: str
    value: int | None = Field(description="A timer counts tenths of a second down.")


class MemoryList(BaseModel):
    """Memories of one bank."""

    body_id: str
    memories: list[Memory]


Value = Annotated[
    int,
    Field(description="A data memory holds -999999999 to 999999999, a counter or timer 0 to 9999999."),
]


class MemoryChange(RequestModel, json_schema_extra=example(value=12)):
    """What a memory shall hold."""

    value: Value


class NamedMemory(RequestModel):
    """A memory, and what it shall hold."""

    name: Annotated[str, Field(description="D0-D199, C0-C29 or T0-T29.", max_length=8)]
    value: Value


class MemoryChanges(SentBack, json_schema_extra=example(memories=[{"name": "D0", "value": 12}])):
    """What memories shall hold."""

    read_only = frozenset(("body_id",))

    memories: Annotated[list[NamedMemory], Field(min_length=1, max_length=MOST)]


@router.get("/bodies/{body_id}/memories", Right.VIEW, response_model=MemoryList)
async def get_memories(request: Request, body_id: BodyId, first: First = "D0", count: Count = 1) -> Response:
    """Read memories of the user program, one by one (UDD)."""
    found = await programs.read_memories(plant_of(request), origin(), body_id, first, count)
    return _told(request, body_id, found)


@router.put("/bodies/{body_id}/memories", Right.OPERATE, response_model=MemoryList)
async def set_memories(request: Request, body_id: BodyId, change: MemoryChanges) -> Response:
    """Set memories in order (UDS), and tell what they hold then: a program may change them at once."""
    change.require_unchanged(MemoryList(body_id=body_of(request, body_id).address, memories=[]))
    wanted = [(it.name, it.value) for it in change.memories]
    held = await programs.write_memories(plant_of(request), origin(), body_id, wanted)
    return _told(request, body_id, held)


@router.put("/bodies/{body_id}/memories/{name}", Right.OPERATE, response_model=Memory)
async def set_memory(request: Request, body_id: BodyId, name: MemoryName, change: MemoryChange) -> Response:
    """Set a memory (UDS), and tell what it holds then: a program that runs may change it at once."""
    wanted = [(name, change.value)]
    [held] = await programs.write_memories(plant_of(request), origin(), body_id, wanted)
    return json_response(Memory(name=held.name, value=held.value))


def _told(request: Request, body_id: str, found: Iterable[tuple[str, int | None]]) -> Response:
    address = body_of(request, body_id).address
    memories = [Memory(name=name, value=value) for name, value in found]
    return json_response(MemoryList(body_id=address, memories=memories))
