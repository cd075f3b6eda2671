"""Lines: their state, and who has them."""

import asyncio
from typing import Annotated, Any, Final, Literal, Union

from pydantic import Field
from typing_extensions import TypedDict

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.line_state import LineState
from gateway.core.operation import Rows
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.tables import Slug
from gateway.door.caller import sees
from gateway.door.names import LineId
from gateway.families import FAMILIES
from gateway.plant import Plant
from gateway.security import entries

ROWS: Final = Rows("lines")
TAKE_OVERS: Final = Rows("configuration")
WAIT_S: Final = 2.0
"""Frames of the old owner that are on their way have arrived by then."""
READY_S: Final = 20.0
_READY: Final = (LineState.READY, LineState.OUT_OF_STEP)


_INFOS: Any = Union[tuple(family.line_info for family in FAMILIES.values())]  # noqa: UP007
AnyLineInfo = Annotated[_INFOS, Field(discriminator="protocol")]


class LineList(TypedDict):
    """All lines of the configuration."""

    lines: list[AnyLineInfo]


@ROWS.get("/lines", any_scope=True)
async def list_lines(plant: Plant) -> LineList:
    """List all lines."""
    return {"lines": [plant.info(line_id) for line_id in plant.ports() if sees(plant.access, line_id)]}


@ROWS.get("/lines/{line_id}", result=AnyLineInfo)
async def get_line(plant: Plant, line_id: LineId) -> Any:
    """Tell the state of a line; nothing is sent."""
    return plant.info(line_id)


class TakeOverRequest(RequestModel, json_schema_extra=example(old="stocker1", has_cut=True)):
    """Confirmation that a line may be taken over from another gateway."""

    old: Slug = Field(description="Name of the gateway that has had the line.")
    has_cut: Literal[True] = Field(
        description="True if the old gateway is off, or cannot reach the terminal server: a person has made "
        "sure."
    )


@TAKE_OVERS.post("/lines/{line_id}/take-over", Right.SETUP, leased=False)
async def take_over_line(plant: Plant, line_id: LineId, take_over: TakeOverRequest) -> AnyLineInfo:
    """Take over a line that another gateway has had, because a person says so.

    The terminal server closes the old gateway's connection as this one connects; everything is proved as at
    each start. Moves that the old gateway began are followed as foreign, and are unknown until their
    positions are read.
    """
    await _take_over(plant, line_id, take_over.old)
    return plant.info(line_id)


async def _take_over(plant: Plant, line_id: str, old: str) -> None:
    """Take a line over, and wait until it is ready, or for as long as that may take.

    :raises NotFound: there is no such line.
    :raises InvalidRequest: it has no spare, is this gateway's already, or never was that of the old one.
    :raises NotSent: it cannot be written down; nothing has changed.
    """
    port = plant.port(line_id)
    owners = plant.peers.ownership.owners.get(line_id)
    if owners is None:
        raise InvalidRequest(
            f"Line {line_id} has no spare; nothing was changed.",
            'Name the gateways that may have it: owners = ["stocker1", "spare1"].',
        )
    if old not in owners or old == plant.peers.ownership.name:
        raise NotFound(
            f"No other gateway {old} may have line {line_id}; nothing was changed.",
            f"It may be had by {', '.join(owners)}.",
        )
    if port.state in _READY:
        raise InvalidRequest(
            f"Line {line_id} is this gateway's, and ready; nothing was changed.", "There is nothing to do."
        )
    plant.access.security.note(entries.LINE_TAKEN_OVER, line_id, old=old)
    await asyncio.sleep(WAIT_S)
    await plant.take_over(line_id, old)
    for _ in range(int(READY_S / 0.1)):
        if port.state in _READY:
            return
        await asyncio.sleep(0.1)
