"""What takes several commands to a robot, without HTTP: readings, signals, settings, positions, jogs."""

import asyncio

import pytest

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.origin import Origin
from gateway.core.targets import Opened
from gateway.fics.amounts import Amount
from gateway.fics.jogs import JogSession
from gateway.fics.settings import SettingsChange
from gateway.operations import jogs, positions, robots, settings
from gateway.operations.commands import do
from protocols.fics.inputs_outputs import GetInputChannel, SwitchOutput
from protocols.fics.jog import StartJog
from protocols.fics.variables import SetVariable
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

ME = Origin("test")


@in_virtual_time
async def test_where_a_unit_stands_and_why_axes_do_not_know_it() -> None:
    async with fics_rig() as it:
        places, reasons, _ = await robots.position(it.plant, ME, "r1", 1, "user")
        assert {name for name, place in places.items() if place is None} == set(reasons)
        condition = await robots.status(it.plant, ME, "r1", 1)
        assert not condition.moving
        assert condition.axes.keys() == condition.sensors.keys()


@in_virtual_time
async def test_signals_are_read_in_a_row_and_changes_are_read_back() -> None:
    async with fics_rig() as it:
        found = await robots.channels(it.plant, ME, "r1", GetInputChannel, 2, 3)
        assert list(found) == [2, 3, 4]
        with pytest.raises(InvalidRequest, match="channels are numbered up to"):
            await robots.channels(it.plant, ME, "r1", GetInputChannel, 8, 100)
        told = await robots.switch_output(it.plant, ME, "r1", SwitchOutput(channel=1, bit=2, on=True))
        assert told.bits & 4
        await robots.set_variable(it.plant, ME, "r1", SetVariable(number=9, value=12.5))
        assert (await robots.variables(it.plant, ME, "r1", 9, 1))[9].value == 12.5


@in_virtual_time
async def test_settings_are_changed_as_a_whole_and_read_back() -> None:
    async with fics_rig() as it:
        changed = await settings.change(it.plant, ME, "r1", 1, SettingsChange(speed_percent={"X": 50.0}))
        assert changed.speed_percent is not None
        assert changed.speed_percent["X"] == 50.0
        assert (await settings.read(it.plant, ME, "r1", 1)).speed_percent == changed.speed_percent
        with pytest.raises(InvalidRequest, match="No setting is named"):
            await settings.change(it.plant, ME, "r1", 1, SettingsChange())


@in_virtual_time
async def test_positions_are_stored_by_name_and_read_to_the_first_that_is_not_set() -> None:
    async with fics_rig() as it:
        axes = {"X": Amount(value=10.0, unit="mm"), "Z": Amount(value=1.0, unit="mm")}
        place = positions.in_order(it.plant, "r1", 1, "axes", axes)
        assert place == [10.0, None, 1.0]
        await positions.store(it.plant, ME, "r1", 1, [(5, [10.0, 2.0, 1.0])])
        stored = await positions.read(it.plant, ME, "r1", 1, 5, 9)
        assert stored == ([(5, [10.0, 2.0, 1.0])], 6)
        with pytest.raises(InvalidRequest, match="less than first"):
            await positions.read(it.plant, ME, "r1", 1, 5, 4)


@in_virtual_time
async def test_a_jog_lives_by_its_heartbeats_and_is_ended() -> None:
    async with fics_rig() as it:
        opened = await do(it.plant, ME, "/robots/r1/units/1", StartJog(axis="Z", direction="+"))
        assert isinstance(opened, Opened)
        assert isinstance(session := opened.session, JogSession)
        for _ in range(4):
            await asyncio.sleep(0.3)
            assert (await jogs.heartbeat(it.plant, ME, "r1", session.id)).state == "jogging"
        assert (await jogs.end(it.plant, ME, "r1", session.id)).state == "ended"
        with pytest.raises(NotFound):
            await jogs.heartbeat(it.plant, ME, "r1", "nobody's")


@in_virtual_time
async def test_a_power_cycle_is_acknowledged() -> None:
    async with fics_rig() as it:
        it.power_cycle()
        await asyncio.sleep(10.0)
        assert it.robot.power_cycled
        await robots.acknowledge_power_cycle(it.plant, ME, "r1")
        assert not it.robot.power_cycled
