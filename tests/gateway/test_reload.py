"""The configuration is read again: what did not change goes on, what moves is not cut off."""

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from gateway.access.errors import NotPermitted
from gateway.access.principal import EVERYBODY, Principal, asking
from gateway.access.roles import Role
from gateway.config_file import ConfigFile, LineChange
from gateway.core.errors import BodyBusy, GatewayError, InvalidRequest, NotAllowed, NotFound, NotSent
from gateway.core.origin import Origin
from gateway.core.targets import BegunMoves, CommandReplies
from gateway.door.doing import do
from gateway.rorze.door.groups import GroupDefinition
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from simulator.rorze.line import build_line
from tests.open_access import OPEN
from tests.plants import Wire, in_virtual_time
from tests.tested_plant import TestedPlant
from tests.through_the_door import add_bodies, add_line, ask, get, reload
from transports.base import Transport

ME = Origin("test", "r-1")
FAR = MoveClockwise(distance=50_000)
ARM = '[[lines]]\nid = "arm"\naddress = "tcp://127.0.0.1:1"\nbodies = [{ id = "00" }, { id = "3F" }]\n'
LEG = '[[lines]]\nid = "leg"\naddress = "tcp://127.0.0.1:2"\nbodies = [{ id = "10" }]\n'
CELL = {
    "id": "cell",
    "protocol": "fics",
    "address": "tcp://127.0.0.1:9",
    "robot": {"id": "r1", "units": [{"number": 1, "axes": ["X"]}]},
}


@dataclass
class Hall:
    """A plant whose configuration is a file."""

    plant: TestedPlant
    file: ConfigFile
    wires: dict[str, Wire]

    def write(self, *lines: str) -> None:
        self.file.path.write_text("".join(lines) + OPEN)

    async def where(self, body: str) -> int:
        answer = await do(self.plant, ME, f"/bodies/{body}", GetPosition())
        assert isinstance(answer, CommandReplies)
        return int(answer.replies[0].pulses)  # type: ignore[attr-defined]

    async def begin(self, body: str) -> str:
        begun = await do(self.plant, ME, f"/bodies/{body}", FAR)
        assert isinstance(begun, BegunMoves)
        return begun.moves[0].id

    def events(self, prefix: str) -> list[str]:
        hub = self.plant.events
        events = [hub.event(number) for number in range(hub.first, hub.last + 1)]
        return [it.type for it in events if it.type.startswith(prefix)]


@asynccontextmanager
async def hall(folder: Path, *lines: str) -> AsyncIterator[Hall]:
    file, wires = ConfigFile(folder / "gateway.toml"), dict[str, Wire]()

    def cable(address: str) -> Transport:
        before = wires.get(address)  # another cable to the same controllers
        wires[address] = Wire(before.machine if before else build_line((0x00, 0x10, 0x3F, 0x40), 0.0))
        return wires[address]

    file.path.write_text("".join(lines) + OPEN)
    with asking(EVERYBODY):
        plant = TestedPlant(file.load(), open_transport=cable, file=file)
        await plant.start()
        await asyncio.sleep(2)
        yield Hall(plant, file, wires)
        await plant.close()


@in_virtual_time
async def test_lines_that_did_not_change_go_on_and_so_do_moves_and_events(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM, LEG) as it:
        before = it.plant.line("arm"), it.plant.body("3F"), it.plant.events
        move = await it.begin("3F")
        it.write(ARM, LEG.replace('"10"', '"40"'))
        found = await reload(it.plant, ME, dry_run=False)
        assert found.lines == [LineChange(line_id="leg", change="changed", keys=["bodies.10", "bodies.40"])]
        assert (it.plant.line("arm"), it.plant.body("3F"), it.plant.events) == before
        assert (await get(it.plant, "/bodies/3F", move, 60.0)).status == "succeeded"
        assert await it.where("40") == 0
        with pytest.raises(NotFound):
            it.plant.body("10")
        assert it.events("gateway.reload") == ["gateway.reloaded"]
        assert it.wires["tcp://127.0.0.1:1"].machine.truth.of("power") == []


@in_virtual_time
async def test_a_body_that_is_built_anew_has_still_lost_its_power(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM) as it:
        await asyncio.sleep(2.0)
        it.wires["tcp://127.0.0.1:1"].machine.brown_out(0x3F, 0.05, asyncio.get_running_loop().time())
        while not it.plant.body("arm.3F").power.cycled:  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        before = it.plant.body("arm.3F")
        it.write(ARM.replace('{ id = "3F" }', '{ id = "3F", name = "lift" }'))
        await reload(it.plant, ME, dry_run=False)
        assert it.plant.body("arm.3F") is not before
        assert it.plant.body("arm.3F").power.cycled


@in_virtual_time
async def test_a_dry_run_tells_the_same_and_changes_nothing(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM, LEG) as it:
        it.write(ARM)
        served, lines = it.plant.config, it.plant.ports()
        told = await reload(it.plant, ME, dry_run=True)
        assert (told.lines[0].change, told.applied) == ("removed", False)
        assert (it.plant.config, it.plant.ports()) == (served, lines)
        assert [line.state for line in lines.values()] == ["ready", "ready"]
        done = await reload(it.plant, ME, dry_run=False)
        assert (done.lines, done.applied) == (told.lines, True)
        assert list(it.plant.ports()) == ["arm"]
        assert (await reload(it.plant, ME, dry_run=True)).lines == []


@in_virtual_time
async def test_a_line_on_which_something_moves_is_not_closed(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM, LEG) as it:
        move = await it.begin("10")
        it.write(ARM)
        told = await reload(it.plant, ME, dry_run=True)
        assert (told.lines[0].line_id, told.busy, told.applied) == ("leg", ["leg.10"], False)
        with pytest.raises(BodyBusy, match=r"leg.10 moves or is at work; nothing was changed"):
            await reload(it.plant, ME, dry_run=False)
        assert (await get(it.plant, "/bodies/10", move, 60.0)).status == "succeeded"
        assert (await reload(it.plant, ME, dry_run=True)).busy == []
        assert (await reload(it.plant, ME, dry_run=False)).applied
        assert it.plant.moves.get(move).status == "succeeded", "its record stays"


@in_virtual_time
async def test_who_waits_on_a_line_that_is_closed_is_told_so(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM, LEG) as it:
        it.write(ARM, LEG + "reply_timeout_s = 0.6\n")
        asking_it = asyncio.create_task(it.where("10"))
        await asyncio.sleep(0)
        await reload(it.plant, ME, dry_run=False)
        with pytest.raises(GatewayError, match="it is configured anew"):
            await asking_it
        await asyncio.sleep(2)
        assert await it.where("10") == 0


@in_virtual_time
async def test_a_line_opened_anew_is_no_alarm_and_one_that_does_not_come_up_is(
    tmp_path: Path,
) -> None:
    async with hall(tmp_path, ARM, LEG) as it:
        it.write(ARM, LEG + "reply_timeout_s = 0.6\n")
        await reload(it.plant, ME, dry_run=False)
        await asyncio.sleep(10)
        assert it.events("line.down") == ["line.down"]
        assert it.plant.alarms.history() == []
        it.wires["tcp://127.0.0.1:2"].unplug()
        await asyncio.sleep(10)
        assert [alarm.cause for alarm in it.plant.alarms.standing()] == ["line.down"]


@in_virtual_time
async def test_a_file_that_is_wrong_changes_nothing(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM) as it:
        for text, words in (("[[lines]", "not valid TOML"), (ARM + "nme = 1\n", "unknown key")):
            it.file.path.write_text(text)
            with pytest.raises(InvalidRequest, match=words):
                await reload(it.plant, ME, dry_run=False)
        it.file.path.unlink()
        with pytest.raises(InvalidRequest, match="cannot be read"):
            await reload(it.plant, ME, dry_run=False)
        assert await it.where("3F") == 0


@in_virtual_time
async def test_a_body_that_a_scan_has_found_is_added_and_stands_in_the_file(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM, LEG) as it:
        before = it.file.path.read_text()
        bodies = [{"id": "40", "name": "grip"}]
        assert not (await add_bodies(it.plant, ME, "arm", bodies, dry_run=True)).applied
        assert it.file.path.read_text() == before
        found = await add_bodies(it.plant, ME, "arm", bodies, dry_run=False)
        assert found.lines == [LineChange(line_id="arm", change="changed", keys=["bodies.40"])]
        await asyncio.sleep(2)
        assert await it.where("40") == 0
        assert it.file.load().lines == it.plant.config.lines
        assert it.plant.access.territory.covers(Principal("a", Role.ADMIN, frozenset({"arm"})), "40")
        for wrong in ([{"id": "40"}], [{"id": "xx"}]):
            with pytest.raises(InvalidRequest):
                await add_bodies(it.plant, ME, "arm", wrong, dry_run=False)


@in_virtual_time
async def test_a_group_defined_anew_gives_nobody_more_after_a_reload(tmp_path: Path) -> None:
    arm = ARM.replace('{ id = "3F" }', '{ id = "3F" }, { id = "40" }')
    arm += 'groups = [{ id = "80", members = ["00", "3F"] }]\n'
    async with hall(tmp_path, arm, LEG) as it:
        key = Principal("a", Role.OPERATOR, frozenset({"80"}))
        wanted = GroupDefinition(members=["3F", "40"])
        await ask(it.plant, "defineGroup", group_id="arm.80", request=wanted)
        it.write(arm, LEG + "reply_timeout_s = 0.6\n")
        await reload(it.plant, ME, dry_run=False)
        covered = [
            it.plant.access.territory.covers(key, body) for body in ("arm.00", "arm.3F", "arm.40", "arm.80")
        ]
        assert covered == [True, True, False, False]


@in_virtual_time
async def test_nothing_is_written_into_the_file_while_its_line_is_at_work(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM) as it:
        before = it.file.path.read_text()
        await it.begin("3F")
        assert (await add_bodies(it.plant, ME, "arm", [{"id": "40"}], dry_run=True)).busy == ["arm.3F"]
        with pytest.raises(BodyBusy):
            await add_bodies(it.plant, ME, "arm", [{"id": "40"}], dry_run=False)
        assert it.file.path.read_text() == before


@in_virtual_time
async def test_a_robot_is_added_and_removed_while_the_plant_runs(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM) as it:
        move = await it.begin("3F")
        await add_line(it.plant, ME, CELL, dry_run=False)
        assert [robot.id for robot in it.plant.robots()] == ["r1"]
        it.write(ARM)
        await reload(it.plant, ME, dry_run=False)
        assert it.plant.robots() == []
        assert (await get(it.plant, "/bodies/3F", move, 60.0)).status == "succeeded"


@pytest.mark.parametrize("role", [Role.VIEWER, Role.OPERATOR, Role.SETUP])
@in_virtual_time
async def test_the_configuration_is_a_matter_of_admins(tmp_path: Path, role: Role) -> None:
    async with hall(tmp_path, ARM) as it:
        with asking(Principal("somebody", role)), pytest.raises(NotPermitted):
            await reload(it.plant, ME, dry_run=True)


@in_virtual_time
async def test_without_a_file_there_is_nothing_to_read(tmp_path: Path) -> None:
    async with hall(tmp_path, ARM) as it:
        it.plant.file = None
        with pytest.raises(NotAllowed, match="without a file"):
            await reload(it.plant, ME, dry_run=True)


@in_virtual_time
async def test_a_file_that_cannot_be_written_leaves_the_plant_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with hall(tmp_path, ARM) as it:

        def refuse(*_: object) -> Sequence[object]:
            raise OSError(30, "Read-only file system")

        monkeypatch.setattr("gateway.config_file.os.open", refuse)
        with pytest.raises(NotSent, match="Read-only"):
            await add_bodies(it.plant, ME, "arm", [{"id": "40"}], dry_run=False)
        monkeypatch.undo()
        with pytest.raises(NotFound):
            it.plant.body("40")
