"""Groups: virtual bodies, by which one command reaches several bodies at once."""

from typing import Annotated, Final

from pydantic import AfterValidator, Field

from gateway.core.errors import Ambiguous, NotFound
from gateway.core.operation import Rows
from gateway.core.parts import numbered_address
from gateway.core.records import AnswerModel, SentBack, example
from gateway.core.rights import Right
from gateway.core.tables import check_printable
from gateway.door.caller import require, sees
from gateway.plant import Plant
from gateway.rorze.bodies import Group
from gateway.rorze.family import GroupId, Rorze
from protocols.rorze.link_master import MOST_MEMBERS

ROWS: Final = Rows("groups")


class GroupInfo(AnswerModel):
    """A group and its members."""

    group_id: str = Field(description="Unique address, such as arm.80.")
    line_id: str
    name: str
    members: list[str] = Field(description="Addresses of the bodies, in the order of their replies.")


class GroupList(AnswerModel):
    """All groups."""

    groups: list[GroupInfo]


def _check_name(name: str) -> str:
    return check_printable(name) if name else name


class GroupDefinition(SentBack, json_schema_extra=example(members=["00", "3F"], name="pair")):
    """The definition of a group."""

    read_only = frozenset(("group_id", "line_id"))
    compared_whole = False

    members: Annotated[list[str], Field(min_length=2, max_length=MOST_MEMBERS)] = Field(
        description="Addresses of bodies on one line, such as 02 or arm.02."
    )
    name: Annotated[str, Field(max_length=64), AfterValidator(_check_name)] = ""


@ROWS.get("/groups", any_scope=True)
async def list_groups(plant: Plant) -> GroupList:
    """List all groups."""
    groups = plant.family(Rorze).groups()
    return GroupList(groups=[_info(group) for group in groups if sees(plant.access, group.address)])


@ROWS.get("/groups/{group_id}", later=True)
async def get_group(group: Group) -> GroupInfo:
    """Tell who is in a group; nothing is sent."""
    return _info(group)


@ROWS.put("/groups/{group_id}", Right.SETUP, later=True)
async def define_group(plant: Plant, group_id: GroupId, definition: GroupDefinition) -> GroupInfo:
    """Define a group at the link master (XVS), or define it anew; not while a member moves.

    It lasts until the gateway ends; groups of the configuration are defined at every start. One that is so
    already stays as it is, and nothing is sent.
    """
    rorze = plant.family(Rorze)
    address = numbered_address(group_id)
    home = address.rpartition(".")[0]
    reached = (f"{home}.{member}" if home and "." not in member else member for member in definition.members)
    require(plant.access, Right.SETUP, address, *reached)  # on all that it will reach
    present = _present(rorze, group_id)
    if present is not None:
        told = _info(present)
        definition.require_unchanged(told)
        if (definition.members, definition.name) == (told.members, told.name):
            return told
    return _info(await rorze.define_group(group_id, definition.members, definition.name))


def _present(rorze: Rorze, group_id: str) -> Group | None:
    try:
        return rorze.group(group_id)
    except (NotFound, Ambiguous):
        return None


def _info(group: Group) -> GroupInfo:
    return GroupInfo(
        group_id=group.address,
        line_id=group.line.id,
        name=group.name,
        members=[member.address for member in group.members],
    )
