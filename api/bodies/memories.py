"""Data memories, counters and timers of user programs over HTTP."""

from typing import Annotated

from fastapi import Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.common.requests import BodyId, json_response, new_router, origin_of, plant_of
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.operations import programs
from gateway.rorze.family import Rorze

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


class MemoryChange(RequestModel, json_schema_extra=example(value=12)):
    """What a memory shall hold."""

    value: int = Field(
        description="A data memory holds -999999999 to 999999999, a counter or timer 0 to 9999999."
    )


@router.get("/bodies/{body_id}/memories", Right.VIEW, response_model=MemoryList)
async def get_memories(request: Request, body_id: BodyId, first: First = "D0", count: Count = 1) -> Response:
    """Read memories of the user program, one by one (UDD)."""
    found = await programs.read_memories(plant_of(request), origin_of(request), body_id, first, count)
    address = plant_of(request).family(Rorze).body(body_id).address
    memories = [Memory(name=name, value=value) for name, value in found]
    return json_response(MemoryList(body_id=address, memories=memories))


@router.put("/bodies/{body_id}/memories/{name}", Right.OPERATE, response_model=Memory)
async def set_memory(request: Request, body_id: BodyId, name: MemoryName, change: MemoryChange) -> Response:
    """Set a memory (UDS), and tell what it holds then: a program that runs may change it at once."""
    held = await programs.write_memory(plant_of(request), origin_of(request), body_id, name, change.value)
    return json_response(Memory(name=held.name, value=held.value))
