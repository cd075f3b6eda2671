"""Groups over HTTP: virtual bodies, by which one command reaches several bodies at once."""

from typing import Annotated

from fastapi import Request, Response
from pydantic import AfterValidator, BaseModel, Field

from api.common.requests import is_seen, json_response, new_router, origin, plant_of
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.tables import check_printable
from gateway.door.names import GroupId
from gateway.operations import bodies
from gateway.rorze.bodies import Group
from gateway.rorze.family import Rorze
from protocols.rorze.link_master import MOST_MEMBERS

router = new_router("groups")


class GroupInfo(BaseModel):
    """A group and its members."""

    group_id: str = Field(description="Its unique address, such as arm.80.")
    line_id: str
    name: str
    members: list[str] = Field(description="Addresses of the bodies, in the order of their replies.")


class GroupList(BaseModel):
    """All groups."""

    groups: list[GroupInfo]


def _check_name(name: str) -> str:
    return check_printable(name) if name else name


class GroupDefinition(RequestModel, json_schema_extra=example(members=["00", "3F"], name="pair")):
    """What a group shall be."""

    members: Annotated[list[str], Field(min_length=2, max_length=MOST_MEMBERS)] = Field(
        description="Addresses of bodies on one line, such as 02 or arm.02."
    )
    name: Annotated[str, Field(max_length=64), AfterValidator(_check_name)] = ""


@router.get("/groups", Right.VIEW, any_scope=True, response_model=GroupList)
async def list_groups(request: Request) -> Response:
    """List all groups."""
    groups = plant_of(request).family(Rorze).groups()
    seen = [_info(group) for group in groups if is_seen(request, group.address)]
    return json_response(GroupList(groups=seen))


@router.get("/groups/{group_id}", Right.VIEW, response_model=GroupInfo)
async def get_group(request: Request, group_id: GroupId) -> Response:
    """Tell who is in a group; nothing is sent."""
    return json_response(_info(plant_of(request).family(Rorze).group(group_id)))


@router.put("/groups/{group_id}", Right.SETUP, response_model=GroupInfo)
async def define_group(request: Request, group_id: GroupId, definition: GroupDefinition) -> Response:
    """Define a group at the link master (XVS), or define it anew; not while a member moves.

    It lasts until the gateway ends; groups of the configuration are defined at every start.
    """
    group = await bodies.define_group(
        plant_of(request), origin(), group_id, definition.members, definition.name
    )
    return json_response(_info(group))


def _info(group: Group) -> GroupInfo:
    return GroupInfo(
        group_id=group.address,
        line_id=group.line.id,
        name=group.name,
        members=[member.address for member in group.members],
    )
