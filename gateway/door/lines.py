"""Lines: their state, and who has them."""

from typing import Annotated, Any, Final, Literal, Union

from pydantic import Field
from typing_extensions import TypedDict

from gateway.core.operation import Rows
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.tables import Slug
from gateway.door import taking_over
from gateway.door.caller import sees
from gateway.door.names import LineId
from gateway.families import FAMILIES
from gateway.plant import Plant

ROWS: Final = Rows("lines")
TAKE_OVERS: Final = Rows("configuration")


_INFOS: Any = Union[tuple(family.line_info for family in FAMILIES.values())]  # noqa: UP007
AnyLineInfo = Annotated[_INFOS, Field(discriminator="protocol")]


class LineList(TypedDict):
    """All lines of the configuration."""

    lines: list[AnyLineInfo]


@ROWS.get("/lines", any_scope=True)
async def list_lines(plant: Plant) -> LineList:
    """List all lines."""
    return {"lines": [plant.info(line_id) for line_id in plant.ports() if sees(plant, line_id)]}


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
    await taking_over.take_over(plant, line_id, take_over.old)
    return plant.info(line_id)
