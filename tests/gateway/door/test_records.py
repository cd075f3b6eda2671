"""Records of long work are seen by viewers, and what is under way is cancelled by who may."""

from typing import Any

import pytest

from gateway.access.errors import NotPermitted
from gateway.access.principal import Principal, asking
from gateway.access.roles import Role
from gateway.core.errors import NotFound
from gateway.core.leases import Holder, LeaseRefused
from gateway.core.operation import names_in
from tests.plants import Rig, in_virtual_time, rig
from tests.through_the_door import OPERATIONS, ask

SEEN_ONLY = ["BodyBackup", "BodyPositionReading"]
COMPARING = ["BodyComparison", "BodyRestore"]
STORING = ["BodyPositionUpload", "ProgramUpload"]


def get(it: Rig, what: str) -> Any:
    name = next(name for name in (f"get{what}Record", f"get{what}") if name in OPERATIONS)
    _, record_id = names_in(OPERATIONS[name].path)
    present: dict[str, Any] = {"body_id": "3F", record_id: "current"}
    return ask(it.plant, name, **present)


def cancel(it: Rig, what: str) -> Any:
    return ask(it.plant, f"cancel{what}", body_id="3F")


@pytest.mark.parametrize("what", [*SEEN_ONLY, *COMPARING, *STORING])
@in_virtual_time
async def test_who_does_not_see_a_body_learns_nothing_of_its_records(what: str) -> None:
    async with rig() as it:
        with asking(Principal("somebody", Role.ADMIN, frozenset({"line1.00"}), "s1")):
            with pytest.raises(NotPermitted):
                await get(it, what)
            with pytest.raises(NotPermitted):
                await cancel(it, what)


@pytest.mark.parametrize("what", [*SEEN_ONLY, *COMPARING, *STORING])
@in_virtual_time
async def test_a_viewer_finds_records_and_cancels_what_changes_nothing(what: str) -> None:
    async with rig() as it:
        with asking(Principal("somebody", Role.VIEWER, None, "s1")):
            with pytest.raises(NotFound):
                await get(it, what)
            with pytest.raises(NotFound if what in SEEN_ONLY else NotPermitted):
                await cancel(it, what)


@pytest.mark.parametrize("what", [*COMPARING, *STORING])
@in_virtual_time
async def test_what_stores_is_cancelled_by_the_holder_of_a_lease_and_what_compares_by_all(what: str) -> None:
    async with rig() as it:
        parts = it.plant.access.territory.parts("3F")
        await it.plant.access.leases.take(
            "3F", "/bodies/line1.3F", parts, Holder("bert", "b"), 10.0, over=False
        )
        with pytest.raises(LeaseRefused if what in STORING else NotFound):
            await cancel(it, what)
