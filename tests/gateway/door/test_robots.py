"""Operations of several commands to a robot, without HTTP: readings, signals, settings, positions, jogs."""

import asyncio

import pytest

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.origin import Origin
from gateway.core.targets import Opened
from gateway.door.doing import do
from gateway.fics import settings
from gateway.fics.amounts import Amount, numbers
from gateway.fics.door.positions import read, store
from gateway.fics.jogs import JogSession
from gateway.fics.settings import SettingsChange
from gateway.fics.signals import OutputState, VariableSetting
from protocols.fics.jog import StartJog
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time
from tests.through_the_door import ask

ME = Origin("test")


@in_virtual_time
async def test_where_a_unit_stands_and_why_axes_do_not_know_it() -> None:
    async with fics_rig() as it:
        place = await ask(it.plant, "getUnitPosition", robot_id="r1", unit=1)
        assert [axis.value is None for axis in place.axes.values()] == [
            axis.reason is not None for axis in place.axes.values()
        ]
        status = await ask(it.plant, "getUnitStatus", robot_id="r1", unit=1)
        assert not status.moving
        assert status.axes


@in_virtual_time
async def test_signals_are_read_in_a_row_and_changes_are_read_back() -> None:
    async with fics_rig() as it:
        found = await ask(it.plant, "getInputs", robot_id="r1", first=2, count=3)
        assert [channel.channel for channel in found.channels] == [2, 3, 4]
        with pytest.raises(InvalidRequest, match="channels are numbered up to"):
            await ask(it.plant, "getInputs", robot_id="r1", first=8, count=100)
        switched = OutputState(on=True)
        told = await ask(it.plant, "switchOutput", robot_id="r1", channel=1, bit=2, request=switched)
        assert told.channels[0].bits[2]
        wanted = VariableSetting(value=12.5)
        await ask(it.plant, "setVariable", robot_id="r1", number=9, request=wanted)
        held = await ask(it.plant, "getVariables", robot_id="r1", first=9, count=1)
        assert held.variables[0].value == 12.5


@in_virtual_time
async def test_settings_are_changed_as_a_whole_and_read_back() -> None:
    async with fics_rig() as it:
        axes = it.robot.unit(1)
        changed = await settings.change(axes, SettingsChange(speed_percent={"X": 50.0}))
        assert changed.speed_percent is not None
        assert changed.speed_percent["X"] == 50.0
        assert (await settings.read(axes)).speed_percent == changed.speed_percent
        with pytest.raises(InvalidRequest, match="No setting is named"):
            await settings.change(axes, SettingsChange())


@in_virtual_time
async def test_positions_are_stored_by_name_and_read_to_the_first_that_is_not_set() -> None:
    async with fics_rig() as it:
        axes = {"X": Amount(value=10.0, unit="mm"), "Z": Amount(value=1.0, unit="mm")}
        unit = it.robot.unit(1)
        assert numbers("axes", unit, unit.axes, axes) == [10.0, None, 1.0]
        await store(it.plant, it.robot, unit, [(5, [10.0, 2.0, 1.0])])
        assert await read(it.robot, 1, 5, 9) == ([(5, [10.0, 2.0, 1.0])], 6)
        with pytest.raises(InvalidRequest, match="less than first"):
            await read(it.robot, 1, 5, 4)


@in_virtual_time
async def test_a_jog_lives_by_its_heartbeats_and_is_ended() -> None:
    async with fics_rig() as it:
        opened = await do(it.plant, ME, "/robots/r1/units/1", StartJog(axis="Z", direction="+"))
        assert isinstance(opened, Opened)
        assert isinstance(session := opened.session, JogSession)
        for _ in range(4):
            await asyncio.sleep(0.3)
            assert (await ask(it.plant, "keepJogging", robot_id="r1", jog_id=session.id)).state == "jogging"
        assert (await ask(it.plant, "endJog", robot_id="r1", jog_id=session.id)).state == "ended"
        with pytest.raises(NotFound):
            await ask(it.plant, "keepJogging", robot_id="r1", jog_id="nobody's")


@in_virtual_time
async def test_a_power_cycle_is_acknowledged() -> None:
    async with fics_rig() as it:
        it.power_cycle()
        await asyncio.sleep(10.0)
        assert it.robot.power_cycled
        await ask(it.plant, "acknowledgePowerCycle", robot_id="r1")
        assert not it.robot.power_cycled
