"""Groups, scans, places and power of bodies, without HTTP."""

import pytest

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.origin import Origin
from gateway.rorze.door.bodies import PositionToCall
from gateway.rorze.door.groups import GroupDefinition
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time, rig
from tests.through_the_door import ask

ME = Origin("test")


@in_virtual_time
async def test_a_place_is_called_by_another_number_in_the_units_of_the_body() -> None:
    async with rig(body_options='units = {unit = "mm", pulses_per_unit = 100.0}') as it:
        place = await ask(it.plant, "setPosition", body_id="3F", request=PositionToCall(value=1.5, unit="mm"))
        assert place.pulses == 150
        assert "&3F6PS150" in it.wire.frames()


@in_virtual_time
async def test_a_group_is_defined_by_an_address_in_any_case() -> None:
    async with rig(bodies=(0, 1, 0x3F)) as it:
        wanted = GroupDefinition(members=["00", "3f"], name="pair")
        group = await ask(it.plant, "defineGroup", group_id="LINE1.8a", request=wanted)
        assert (group.group_id, group.name) == ("line1.8A", "pair")


@in_virtual_time
async def test_a_scan_finds_who_answers_and_belongs_to_its_line() -> None:
    async with rig(lines=("left", "right"), present=(0x3F,)) as it:
        scan = await ask(it.plant, "startScan", line_id="left")
        over = await ask(it.plant, "getScan", line_id="left", scan_id=scan.id, wait=120.0)
        assert (over.status, [found.body_id for found in over.found]) == ("finished", ["left.3F"])
        with pytest.raises(NotFound, match="right has no scan"):
            await ask(it.plant, "getScan", line_id="right", scan_id=scan.id)


@in_virtual_time
async def test_a_line_with_a_robot_has_nobody_to_scan_for() -> None:
    async with fics_rig() as it:
        with pytest.raises(InvalidRequest, match="leads to a robot and has no bodies"):
            await ask(it.plant, "startScan", line_id="cell")


@in_virtual_time
async def test_a_power_cycle_is_acknowledged() -> None:
    async with rig() as it:
        it.body().power.lost(certain=True)
        await ask(it.plant, "acknowledgeBodyPowerCycle", body_id="3F")
        assert not it.body().power.cycled
