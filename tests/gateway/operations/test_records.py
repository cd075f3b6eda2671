"""Records of long work are seen by viewers, and what is under way is cancelled by who may."""

from typing import Any

import pytest

from gateway.access.errors import NotPermitted
from gateway.access.principal import Principal, asking
from gateway.access.roles import Role
from gateway.core.errors import NotFound
from gateway.core.leases import Holder, LeaseRefused
from gateway.core.operation import names_in
from gateway.core.origin import Origin
from gateway.operations import backups
from gateway.operations.records import Records
from tests.plants import in_virtual_time, rig
from tests.through_the_door import OPERATIONS, ask

ME = Origin("test", "r-1")
BODY = "/bodies/3F"
SEEN_ONLY = [backups.BACKUPS]
CHANGING = [backups.COMPARISONS, backups.RESTORES]


@pytest.mark.parametrize("records", [*SEEN_ONLY, *CHANGING])
@in_virtual_time
async def test_who_does_not_see_a_body_learns_nothing_of_its_records(records: Records[Any]) -> None:
    async with rig() as it:
        with asking(Principal("somebody", Role.ADMIN, frozenset({"line1.00"}), "s1")):
            with pytest.raises(NotPermitted):
                await records.get(it.plant, BODY, "current", 0.0)
            with pytest.raises(NotPermitted):
                await records.cancel(it.plant, ME, BODY)


@pytest.mark.parametrize("records", [*SEEN_ONLY, *CHANGING])
@in_virtual_time
async def test_a_viewer_finds_records_and_cancels_what_changes_nothing(records: Records[Any]) -> None:
    async with rig() as it:
        with asking(Principal("somebody", Role.VIEWER, None, "s1")):
            with pytest.raises(NotFound):
                await records.get(it.plant, BODY, "current", 0.0)
            with pytest.raises(NotFound if records in SEEN_ONLY else NotPermitted):
                await records.cancel(it.plant, ME, BODY)


@pytest.mark.parametrize("records", CHANGING)
@in_virtual_time
async def test_what_stores_is_cancelled_by_the_holder_of_a_lease_and_what_compares_by_all(
    records: Records[Any],
) -> None:
    async with rig() as it:
        parts = it.plant.territory.parts("3F")
        await it.plant.leases.take("3F", "/bodies/line1.3F", parts, Holder("bert", "b"), 10.0, over=False)
        with pytest.raises(LeaseRefused if records.leased else NotFound):
            await records.cancel(it.plant, ME, BODY)


@pytest.mark.parametrize("what", ["BodyPositionReading", "BodyPositionUpload", "ProgramUpload"])
@in_virtual_time
async def test_records_of_rows_are_found_by_viewers_and_cancelled_by_who_may(what: str) -> None:
    _, record_id = names_in(OPERATIONS[f"get{what}"].path)
    present: dict[str, Any] = {"body_id": "3F", record_id: "current"}
    reads = what == "BodyPositionReading"
    async with rig() as it:
        with asking(Principal("somebody", Role.ADMIN, frozenset({"line1.00"}), "s1")):
            with pytest.raises(NotPermitted):
                await ask(it.plant, f"get{what}", **present)
            with pytest.raises(NotPermitted):
                await ask(it.plant, f"cancel{what}", body_id="3F")
        with asking(Principal("somebody", Role.VIEWER, None, "s1")):
            with pytest.raises(NotFound):
                await ask(it.plant, f"get{what}", **present)
            with pytest.raises(NotFound if reads else NotPermitted):
                await ask(it.plant, f"cancel{what}", body_id="3F")
        parts = it.plant.territory.parts("3F")
        await it.plant.leases.take("3F", "/bodies/line1.3F", parts, Holder("bert", "b"), 10.0, over=False)
        with pytest.raises(NotFound if reads else LeaseRefused):
            await ask(it.plant, f"cancel{what}", body_id="3F")
