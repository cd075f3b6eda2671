"""Live values of robots: of the unit it acts on, and behind all that others want."""

import asyncio
import json

from protocols.fics.homing import HomeRobot
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time
from tests.watching import watching

POSITION = "robot.position"
UNITS = "/robots/r1/units/1", "/robots/r1/units/2"


@in_virtual_time
async def test_only_the_unit_that_the_robot_acts_on_is_watched() -> None:
    async with fics_rig(units=2) as rig:
        move = await rig.start(HomeRobot(), 2)
        await rig.plant.robot_moves.wait(move.id, 60)
        selected = len(rig.heard("UNT "))
        async with watching(rig.plant.events, types=[POSITION], sample=5) as watcher:
            await asyncio.sleep(10)
        assert not watcher.of(POSITION, UNITS[0])
        assert 45 <= len(watcher.of(POSITION, UNITS[1])) <= 51
        assert len(rig.heard("UNT ")) == selected


@in_virtual_time
async def test_a_place_that_is_not_known_is_null() -> None:
    async with fics_rig() as rig:
        async with watching(rig.plant.events, types=[POSITION], sample=5) as watcher:
            await asyncio.sleep(2)
        axes = watcher.of(POSITION, UNITS[0])[0]["data"]["axes"]
        assert {axis["value"] for axis in axes.values()} == {None}


@in_virtual_time
async def test_nothing_is_asked_while_nobody_watches() -> None:
    async with fics_rig() as rig:
        async with watching(rig.plant.events, sample=10):
            await asyncio.sleep(2)
        asked = len(rig.heard("APS")), len(rig.heard("IDI"))
        await asyncio.sleep(20)
        assert (len(rig.heard("APS")), len(rig.heard("IDI"))) == asked


@in_virtual_time
async def test_a_command_waits_for_one_question_at_most() -> None:
    async with fics_rig(baud=9600) as rig, watching(rig.plant.events, sample=50):
        await asyncio.sleep(1)
        for _ in range(20):
            began = asyncio.get_running_loop().time()
            await rig.robot.unit(1).status()
            assert asyncio.get_running_loop().time() - began < 0.25
            await asyncio.sleep(0.017)


def input_edges(rig: FicsRig) -> list[tuple[int, bool]]:
    hub = rig.plant.events
    events = [hub.event(number) for number in range(hub.first, hub.last + 1)]
    told = [json.loads(it.json)["data"] for it in events if it.type == "robot.input.changed"]
    assert {it["channel"] for it in told} <= {1}
    return [(it["number"], it["on"]) for it in told]


@in_virtual_time
async def test_changes_of_inputs_are_events_as_often_as_the_configuration_asks() -> None:
    async with fics_rig(options="input_edges_per_s = 5") as rig:
        await asyncio.sleep(2)
        assert input_edges(rig) == []
        rig.fics.inputs[0] = 0b1000_0000
        await asyncio.sleep(0.5)
        assert input_edges(rig) == [(7, True)]
        outputs = len(rig.heard("IDO"))
        asked = len(rig.heard("IDI"))
        await asyncio.sleep(10)
        assert 45 <= len(rig.heard("IDI")) - asked <= 51
        assert len(rig.heard("IDO")) == outputs


@in_virtual_time
async def test_who_watches_inputs_gets_their_changes_as_events_too() -> None:
    async with fics_rig() as rig:
        async with watching(rig.plant.events, types=["io"], sample=10):
            await asyncio.sleep(2)
            rig.fics.inputs[0] ^= 1 << 3
            await asyncio.sleep(2)
        assert input_edges(rig) == [(3, True)]
