"""SCARA robots come, change and go with their line, when the configuration is read again."""

from pathlib import Path

import pytest

from gateway.config_file import LineChange
from gateway.core.errors import BodyBusy, NotFound
from gateway.door.doing import do
from gateway.rorze_scara.extension import Scaras
from protocols.rorze.moves import MoveClockwise
from tests.gateway.test_reload import ARM, LEG, ME, hall
from tests.plants import in_virtual_time
from tests.through_the_door import reload

WAFER = """
[[scaras]]
id = "wafer"
line = "arm"
group = "90"
members = ["00", "3F"]
arm_um = 156_000
finger_um = 208_000
pulses_per_turn = [98_765.0, 99_000.0]
"""


@in_virtual_time
async def test_scara_robots_come_change_and_go_with_their_line_alone(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM, LEG) as it:
        arm, leg = it.plant.line("arm"), it.plant.line("leg")
        it.write(ARM, LEG, WAFER)
        found = await reload(it.plant, ME, dry_run=False)
        assert found.lines == [LineChange(line_id="arm", change="changed", keys=["scaras.wafer"])]
        assert found.needs_restart == []
        assert it.plant.family(Scaras).find("wafer").tolerance_pulses == 2
        assert (it.plant.line("arm") is arm, it.plant.line("leg") is leg) == (False, True)
        it.write(ARM, LEG, WAFER + "tolerance_pulses = 5\n")
        found = await reload(it.plant, ME, dry_run=False)
        assert found.lines[0].keys == ["scaras.wafer"]
        assert it.plant.family(Scaras).find("wafer").tolerance_pulses == 5
        assert (await reload(it.plant, ME, dry_run=False)).lines == []
        it.write(ARM, LEG)
        await reload(it.plant, ME, dry_run=False)
        with pytest.raises(NotFound):
            it.plant.family(Scaras).find("wafer")


@in_virtual_time
async def test_what_bodies_tell_goes_to_scara_robots_once_there_is_one_and_once(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM) as here:
        scaras = here.plant.family(Scaras)
        assert scaras.family.listeners == []
        for tables in ((ARM, WAFER), (ARM,), (ARM, WAFER)):
            here.write(*tables)
            await reload(here.plant, ME, dry_run=False)
            assert scaras.family.listeners == [scaras.moves]


@in_virtual_time
async def test_a_scara_robot_whose_body_moves_is_not_changed(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM, WAFER) as it:
        await do(it.plant, ME, "/bodies/3F", MoveClockwise(distance=50_000))
        it.write(ARM, WAFER + "tolerance_pulses = 5\n")
        with pytest.raises(BodyBusy, match=r"arm\.3F moves or is at work; nothing was changed"):
            await reload(it.plant, ME, dry_run=False)
        assert it.plant.family(Scaras).find("wafer").tolerance_pulses == 2
