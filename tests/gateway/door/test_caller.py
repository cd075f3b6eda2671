"""Rights, scopes and leases are asked for behind the door, whichever front end came through it."""

from collections.abc import Callable
from typing import Any

import pytest

from gateway.access.errors import NotAuthenticated, NotPermitted
from gateway.access.principal import Principal, asking
from gateway.access.roles import Role
from gateway.core.leases import Holder, LeaseRefused
from gateway.core.origin import Origin
from gateway.door import operations, stopping
from gateway.door.caller import address_of
from gateway.door.doing import do
from gateway.door.leases import LeaseRequest
from gateway.plant import Plant
from gateway.rorze.door.groups import GroupDefinition
from gateway.rorze.memories import MemoryChange
from gateway.rorze.units import Length
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.speeds import SetStartSpeed
from tests.plants import in_virtual_time, rig
from tests.through_the_door import ask, get

ME = Origin("test", "r-1")
FAR = MoveClockwise(distance=50_000)
ZERO = Length(value=0, unit="pulse")
ONE = MemoryChange(value=1)
MINE = LeaseRequest(scope="3F", ttl_s=1.0)
OVER = LeaseRequest(scope="3F", ttl_s=1.0, take_over=True)
PAIR = GroupDefinition(members=["3F", "00"])
LISTS = {"listAlarms", "listBodies", "listGroups", "listLeases", "listLines", "listRobots", "listScaras"}
"""Operations that show the part of a list in the caller's scope."""
OF_EVERYBODY = {"getIdentity", "getPosture", "issueTicket", "listCommands", "listNumbers", "listTranslations"}
ASKS_ITSELF = {
    "getAlarm",
    "resetAlarm",
    "getLease",
    "takeLease",
    "renewLease",
    "endLease",
    "listDeeds",
    "getShift",
    "downloadShift",
    "startRecording",
    "listRecordings",
    "getRecording",
    "finishRecording",
    "downloadRecording",
}
"""Operations that find the subject of the alarm, lease, action or recording before they ask for the right."""


def test_which_operations_pass_callers_of_any_scope_is_known() -> None:
    assert {row.name for row in operations() if row.any_scope} == LISTS | OF_EVERYBODY | ASKS_ITSELF


def somebody(role: Role = Role.ADMIN, *scope: str) -> Principal:
    return Principal("somebody", role, frozenset(scope) or None, "s1")


OPERATIONS: list[tuple[Callable[[Plant], Any], Role]] = [
    (lambda plant: do(plant, ME, "/bodies/3F", FAR), Role.OPERATOR),
    (lambda plant: do(plant, ME, "/bodies/3F", SetStartSpeed(speed=1000)), Role.SETUP),
    (lambda plant: do(plant, ME, "/bodies/3F", GetPosition()), Role.VIEWER),
    (
        lambda plant: ask(plant, "setPosition", body_id="3F", request=Length(value=0, unit="pulse")),
        Role.SETUP,
    ),
    (lambda plant: ask(plant, "acknowledgeBodyPowerCycle", body_id="3F"), Role.OPERATOR),
    (lambda plant: ask(plant, "defineGroup", group_id="85", request=PAIR), Role.SETUP),
    (lambda plant: ask(plant, "startScan", line_id="line1"), Role.SETUP),
    (lambda plant: ask(plant, "getScan", line_id="line1", scan_id="none"), Role.VIEWER),
    (lambda plant: get(plant, "/bodies/3F", "none"), Role.VIEWER),
    (lambda plant: ask(plant, "getProgram", body_id="3F"), Role.VIEWER),
    (
        lambda plant: ask(plant, "setMemory", body_id="3F", name="D0", request=MemoryChange(value=1)),
        Role.OPERATOR,
    ),
    (lambda plant: ask(plant, "takeLease", request=MINE), Role.OPERATOR),
    (lambda plant: ask(plant, "takeLease", request=OVER), Role.ADMIN),
]


@pytest.mark.parametrize(("operation", "role"), OPERATIONS)
@in_virtual_time
async def test_a_lower_role_or_another_scope_is_refused_and_nothing_is_written(
    operation: Callable[[Plant], Any], role: Role
) -> None:
    async with rig() as it:
        before = len(it.wire.sent)
        lower = [lower for lower in Role if list(Role).index(lower) < list(Role).index(role)]
        for who in (*map(somebody, lower), somebody(Role.ADMIN, "line1.00")):
            with asking(who), pytest.raises(NotPermitted):
                await operation(it.plant)
        assert len(it.wire.sent) == before


@in_virtual_time
async def test_nobody_is_not_everybody() -> None:
    async with rig() as it:
        with asking(None), pytest.raises(NotAuthenticated):  # type: ignore[arg-type]
            await do(it.plant, ME, "/bodies/3F", GetPosition())


@in_virtual_time
async def test_everybody_with_any_credential_stops_everything() -> None:
    async with rig() as it:
        with asking(somebody(Role.VIEWER, "nowhere")):
            assert (await stopping.stop(it.plant, ME, "/bodies/3F", "decelerate")).confirmed
            assert (await stopping.stop_all(it.plant, ME, "decelerate")).confirmed


@in_virtual_time
async def test_a_lease_holds_for_every_front_end() -> None:
    async with rig() as it:
        parts = it.plant.access.territory.parts("3F")
        await it.plant.access.leases.take(
            "3F", "/bodies/line1.3F", parts, Holder("bert", "b"), 10.0, over=False
        )
        with pytest.raises(LeaseRefused):
            await do(it.plant, ME, "/bodies/3F", FAR)
        await do(it.plant, ME, "/bodies/3F", GetPosition())


@pytest.mark.parametrize(
    ("target", "address"),
    [("/bodies/line1.3F", "line1.3F"), ("/robots/r1/units/1", "r1"), ("3F", "3F"), ("/bodies", "/bodies")],
)
def test_a_path_tells_the_address(target: str, address: str) -> None:
    assert address_of(target) == address
