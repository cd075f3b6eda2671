"""A plant over restarts: what it has told and moved is there again, and nothing is sent a second time."""

import asyncio
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from gateway.core.errors import NotFound, NotSent, PowerCycled
from gateway.core.journal.journal import JournalUnavailable
from gateway.core.move_record import Move, MoveStatus
from gateway.fics.move_record import RobotMove
from gateway.rorze.move_requests import BodyJogRequest
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute, MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.rorze.flash import SaveSettings
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.origin import Home
from protocols.rorze.speeds import SetMaximumSpeed, SetStartSpeed
from tests.fics_plants import Cable
from tests.plants import Wire, in_virtual_time
from tests.tested_plant import TestedPlant
from tests.world import DISK_S, World

SHORT = MoveClockwise(distance=500)
LONG = MoveClockwise(distance=20_000)


@pytest.fixture
def world(tmp_path: Path) -> World:
    return World(tmp_path / "data")


async def moved(plant: TestedPlant, command: Any = SHORT, address: str = "3F") -> Move:
    [move] = await plant.moves.start(plant.body(address), command)
    return move


async def over(plant: TestedPlant, move_id: str) -> Move:
    return await plant.moves.wait(move_id, 60.0)


async def ready(plant: TestedPlant) -> None:
    while plant.line("line1").state != "ready":  # noqa: ASYNC110
        await asyncio.sleep(0.1)


@in_virtual_time
async def test_moves_are_there_again(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        first = await over(plant, (await moved(plant)).id)
    async with world.gateway() as plant:
        assert plant.moves.get(first.id) == first
        assert plant.moves.log.of(plant.body("3F").address) == [first]
        assert not any(it == "gateway.crashed" for it in _types(plant))


@in_virtual_time
async def test_moves_go_on_in_their_order_where_the_clock_was_a_year_ahead(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        first = await over(plant, (await moved(plant)).id)
    ahead = f"{int(first.id, 16) + (365 * 86_400_000 << 32):020x}"
    with closing(sqlite3.connect(world.folder / "journal.db", isolation_level=None)) as journal:
        journal.execute("UPDATE moves SET id = ?, record = replace(record, ?, ?)", (ahead, first.id, ahead))
    async with world.gateway() as plant:
        await ready(plant)
        second = await over(plant, (await moved(plant)).id)
        assert second.id > ahead
        assert [move.id for move in plant.moves.log.of(plant.body("3F").address)] == [second.id, ahead]


async def marked(plant: TestedPlant) -> None:
    """Wait until the body is known to keep its power, and a look at it would tell a loss of it."""
    while not plant.body("3F").power.mark.text or plant.body("3F").told.rest is None:  # noqa: ASYNC110
        await asyncio.sleep(0.1)
    await asyncio.sleep(1.0)


def lose_power(world: World) -> None:
    assert isinstance(world.wire, Wire)
    world.wire.machine.brown_out(0x3F, 0.05, asyncio.get_running_loop().time())


@pytest.mark.parametrize("crash", [False, True])
@in_virtual_time
async def test_a_loss_of_power_that_nobody_has_acknowledged_is_remembered(crash: bool, world: World) -> None:
    async with world.gateway() as plant:
        await marked(plant)
        lose_power(world)
        while not plant.body("3F").power.cycled:  # noqa: ASYNC110
            await asyncio.sleep(0.1)
        await marked(plant)
        if crash:
            world.crash()
    async with world.gateway() as plant:
        await marked(plant)
        assert plant.body("3F").power.homed == "no"
        with pytest.raises(PowerCycled, match="1AM was not sent"):
            await moved(plant, MoveTo(position=5))
        await plant.body("3F").acknowledge_power_cycle()
    async with world.gateway() as plant:
        await marked(plant)
        assert (await over(plant, (await moved(plant, MoveTo(position=5))).id)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_loss_of_power_while_no_gateway_ran_is_seen(world: World) -> None:
    async with world.gateway() as plant:
        await marked(plant)
        await over(plant, (await moved(plant, Home())).id)
        assert plant.body("3F").power.homed == "yes"
    lose_power(world)
    await asyncio.sleep(1.0)
    async with world.gateway() as plant:
        await ready(plant)
        with pytest.raises(PowerCycled, match="1AM was not sent"):
            await moved(plant, MoveTo(position=5))
        assert plant.body("3F").power.homed == "no"


@in_virtual_time
async def test_a_body_that_has_kept_its_power_keeps_its_mark_and_is_still_homed(world: World) -> None:
    assert isinstance(world.wire, Wire)
    async with world.gateway() as plant:
        await marked(plant)
        await over(plant, (await moved(plant, Home())).id)
    before = len(world.wire.sent)
    async with world.gateway() as plant:
        assert plant.body("3F").power.homed == "unknown", "nobody has looked yet"
        await marked(plant)
        assert plant.body("3F").power.homed == "yes"
        assert (await over(plant, (await moved(plant, MoveTo(position=5))).id)).status is MoveStatus.SUCCEEDED
        assert not any("9VS" in frame for frame in world.wire.frames(before))


@in_virtual_time
async def test_a_mark_that_may_be_in_flash_memory_is_not_believed_in_another_life(
    world: World,
) -> None:
    async with world.gateway() as plant:
        await marked(plant)
        mark = plant.body("3F").power.mark.text
        saving = asyncio.create_task(plant.body("3F").ask(SaveSettings()))
        await asyncio.sleep(DISK_S + 0.001)
        world.crash()
        await saving
    async with world.gateway() as plant:
        assert plant.body("3F").power.mark.text is None
        await marked(plant)
        assert plant.body("3F").power.mark.text != mark


@in_virtual_time
async def test_cursors_go_on_without_a_gap(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        cursor = plant.events.cursor
        move = await over(plant, (await moved(plant)).id)
        last = plant.events.last
    async with world.gateway() as plant:
        page = await plant.events.since(cursor)
        assert [it.number for it in page.events] == list(range(int(cursor[9:]) + 1, plant.events.last + 1))
        assert page.events[0].data["id"] == move.id
        assert plant.events.last > last
        assert {it.epoch for it in page.events} == {cursor[:8]}


@in_virtual_time
async def test_a_cursor_from_before_a_crash_goes_on_where_the_journal_does(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        cursor = plant.events.cursor
        known = plant.events.last
        world.crash()
        await moved(plant)
        seen = plant.events.cursor
    async with world.gateway() as plant:
        assert plant.events.epoch != seen[:8]
        for old in (cursor, seen):
            page = await plant.events.since(old)
            assert page.events[0].type == "gateway.crashed"
            assert page.events[0].number == known + 1


@in_virtual_time
async def test_a_move_goes_on_in_its_own_record_after_a_crash(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        move = await moved(plant, LONG)
        await asyncio.sleep(0.3)
        world.crash()
    async with world.gateway() as plant:
        [crash] = [it for it in _events(plant) if it.type == "gateway.crashed"]
        assert (crash.data["moves"], crash.data["targets"]) == ([move.id], ["line1.3F"])
        assert plant.body("3F").move is plant.moves.get(move.id)
        end = await over(plant, move.id)
        assert (end.status, end.position, end.end_cause) == (MoveStatus.SUCCEEDED, 20_000, "normal")
        assert any("restarted" in sentence for sentence in end.evidence)
        assert "acknowledged before the gateway was restarted" in end.evidence[-1]
        assert [it["final"] for it in world.rows("moves")] == [1]
    assert len(world.sent("1+M")) == 1


@in_virtual_time
async def test_of_a_reply_that_may_have_come_before_a_crash_nothing_is_said(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        move = await moved(plant, LONG)
        world.crash()  # the reply has come, and is not in the journal yet
    async with world.gateway() as plant:
        end = await over(plant, move.id)
        assert end.status is MoveStatus.SUCCEEDED
        assert end.evidence[-1] == (
            "The motor runs, and had stood still; nobody knows whether a reply came before the gateway was "
            "restarted."
        )


@in_virtual_time
async def test_a_move_that_ended_while_nobody_looked_is_resolved_by_where_it_stands(
    world: World, caplog: pytest.LogCaptureFixture
) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        move = await moved(plant, LONG)
        world.crash()
    await asyncio.sleep(60.0)
    world.wire.machine.take_output(asyncio.get_running_loop().time())  # what is said to nobody is lost
    async with world.gateway() as plant:
        end = await over(plant, move.id)
        assert (end.status, end.position, end.completion) == (MoveStatus.SUCCEEDED, 20_000, "polling")
        assert end.evidence[1].startswith("The motor stands at the target; nobody knows whether a reply came")
        await asyncio.sleep(5.0)
        assert "announced" not in caplog.text
        assert plant.line("line1").counters["set_ups_again"] == 0
    assert len(world.sent("1+M")) == 1


@in_virtual_time
async def test_a_move_that_was_never_written_is_cancelled(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        asking = asyncio.create_task(moved(plant))
        await asyncio.sleep(0)
        world.crash()
        await asking
    before = len(world.wire.frames())
    async with world.gateway() as plant:
        [move] = plant.moves.log.of(plant.body("3F").address)
        assert move.status is MoveStatus.CANCELLED
        assert move.error is not None
        assert move.error.moved == "no"
        await ready(plant)
        await asyncio.sleep(5.0)
    assert not [it for it in world.wire.frames()[before:] if it[3:6] == "1+M"]


@in_virtual_time
async def test_an_intent_without_a_frame_proves_itself_not_executed(world: World) -> None:
    """The gateway is killed between the intent and the first byte."""
    async with world.gateway() as plant:
        await ready(plant)
        await over(plant, (await moved(plant)).id)
        asking = asyncio.create_task(moved(plant))
        while len(world.rows("intents")) < 2:  # noqa: ASYNC110
            await asyncio.sleep(DISK_S / 5)
        world.crash()
        plant.line("line1").gate.stop(0x3F)
        with pytest.raises(NotSent):
            await asking
    async with world.gateway() as plant:
        [move, _] = plant.moves.log.of(plant.body("3F").address)
        end = await over(plant, move.id)
        assert (end.status, end.end_cause) == (MoveStatus.FAILED, "not_executed")
        assert end.error is not None
        assert "may have been sent to line1.3F before the gateway was restarted" in end.error.detail
    assert len(world.sent("1+M")) == 1
    assert all(row["ended_at"] for row in world.rows("intents"))


@in_virtual_time
async def test_where_nothing_proves_anything_the_move_is_unknown(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        move = await moved(plant, LONG)
        await asyncio.sleep(0.3)
        world.crash()
        await plant.stops.stop([plant.body("3F")], "immediate")
    async with world.gateway() as plant:
        end = await over(plant, move.id)
        assert end.status is MoveStatus.UNKNOWN
        assert "proves nothing" in end.evidence[-1]


@in_virtual_time
async def test_a_move_without_an_end_is_stopped(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        move = await moved(plant, MoveClockwise(distance="endless"))
        world.crash()
        monkeypatch.setattr(plant.rorze, "end_motion", _leave_all)  # killed, it would end nothing
    async with world.gateway() as plant:
        end = await over(plant, move.id)
        assert (end.status, end.end_cause) == (MoveStatus.STOPPED, "stop_command")
    assert len(world.sent("1+M")) == 1


@in_virtual_time
async def test_a_jog_is_stopped(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        await plant.body("3F").ask(SetStartSpeed(speed=1_000))
        jog = await plant.rorze.jogs.start(plant.body("3F"), BodyJogRequest(direction="cw"))
        world.crash()
        monkeypatch.setattr(plant.rorze, "end_motion", _leave_all)  # killed, it would end nothing
    async with world.gateway() as plant:
        end = await over(plant, jog.id)
        assert (end.kind, end.status) == ("jog", MoveStatus.UNKNOWN)  # it stood when it was first asked
        assert len(world.sent("5SS")) == 1
        assert not (await plant.body("3F").poll()).runs
        with pytest.raises(NotFound):
            plant.rorze.jogs.heartbeat(jog.id, plant.body("3F"))


@in_virtual_time
async def test_a_setting_under_way_is_ended_as_unknown(world: World) -> None:
    async with world.gateway() as plant:
        await ready(plant)
        asking = asyncio.create_task(plant.body("3F").ask(SetMaximumSpeed(speed=1000)))
        while not world.rows("intents"):  # noqa: ASYNC110
            await asyncio.sleep(DISK_S / 5)
        world.crash()
        await asking
    async with world.gateway():
        [row] = world.rows("intents")
        assert (row["outcome"], row["command"]) == ("unknown", SetMaximumSpeed.name())


@in_virtual_time
async def test_without_a_directory_reads_and_stops_go_on(world: World) -> None:
    world.folder.write_text("in the way")
    async with world.gateway() as plant:
        assert "gateway.journal.trouble" in _types(plant)
        await ready(plant)
        assert await plant.body("3F").poll()
        [stopped] = await plant.stops.stop([plant.body("3F")], "immediate")
        assert stopped.state == "confirmed"
        with pytest.raises(JournalUnavailable):
            await moved(plant, MoveTo(position=500))
    assert world.sent("1AM") == []


@in_virtual_time
async def test_a_broken_journal_is_set_aside_and_that_is_told(world: World) -> None:
    world.folder.mkdir()
    (world.folder / "journal.db").write_bytes(b"no journal" * 1000)
    async with world.gateway() as plant:
        [told] = [it for it in _events(plant) if it.type == "gateway.journal.set_aside"]
        assert _beginning(told.data["file"]) == b"no journal"
        await ready(plant)
        assert (await over(plant, (await moved(plant)).id)).status is MoveStatus.SUCCEEDED


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE moves SET record = replace(record, 'evidence', 'eridence')",
        "UPDATE moves SET record = substr(record, 2)",
        "UPDATE moves SET record = CAST(x'7bff' AS TEXT)",
        "UPDATE alarms SET record = replace(record, 'cause', 'cauze')",
        "UPDATE meta SET value = 'yesterday' WHERE name = 'seen_at'",
    ],
)
def test_a_sound_file_that_makes_no_sense_is_set_aside_too(damage: str, world: World) -> None:
    @in_virtual_time
    async def story() -> None:
        async with world.gateway() as plant:
            await ready(plant)
            await over(plant, (await moved(plant)).id)
            plant.events.publish("gateway.reload_failed", "/gateway", {"reason": "line 2"})
            epoch = plant.events.epoch
        with closing(sqlite3.connect(world.folder / "journal.db", isolation_level=None)) as journal:
            assert journal.execute(damage).rowcount > 0
        async with world.gateway() as plant:
            assert "gateway.journal.set_aside" in _types(plant)
            assert plant.events.epoch != epoch
            await ready(plant)
            assert (await over(plant, (await moved(plant)).id)).status is MoveStatus.SUCCEEDED

    story()


def _leave_all(*, everything: bool) -> list[asyncio.Task[Any]]:
    assert not everything
    return []


def _beginning(file: str) -> bytes:
    return Path(file).read_bytes()[:10]


def _events(plant: TestedPlant) -> list[Any]:
    return [plant.events.event(number) for number in range(plant.events.first, plant.events.last + 1)]


def _types(plant: TestedPlant) -> list[str]:
    return [event.type for event in _events(plant)]


@pytest.mark.parametrize("units", [1, 2])
@pytest.mark.parametrize("mode", [2, 3])
def test_a_move_of_a_robot_goes_on_in_its_own_record(mode: int, units: int, tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World.of_robot(tmp_path / "data", mode, units=units)
        async with world.gateway() as plant:
            await asyncio.sleep(1.0)
            await _made(plant, HomeRobot())
            move = await _begun(plant, MoveAbsolute(coordinates=[None, None, 20.0]), units)
            world.crash()
        async with world.gateway() as plant:
            end = await plant.robot_moves.wait(move.id, 600.0)
            assert (end.status, end.end_cause) == (MoveStatus.SUCCEEDED, "normal")
            assert any("restarted" in sentence for sentence in end.evidence)
        assert len([it for it in world.wire.frames() if it.startswith("LMA")]) == 1

    story()


async def set_up(plant: TestedPlant) -> None:
    while plant.robot("r1").line.state != "ready":  # noqa: ASYNC110
        await asyncio.sleep(0.1)


@pytest.mark.parametrize("mode", [2, 3])
def test_a_loss_of_a_robots_power_while_no_gateway_ran_is_seen_and_its_speed_set_again(
    mode: int, tmp_path: Path
) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World.of_robot(tmp_path / "data", mode)
        async with world.gateway() as plant:
            await set_up(plant)
            await plant.robot("r1").ask(SetSpeedPercent(percents=[20.0]), 1)
            await asyncio.sleep(0.1)
        assert isinstance(world.wire, Cable)
        world.wire.machine.power_off(asyncio.get_running_loop().time())
        world.wire.machine.power_on(asyncio.get_running_loop().time())
        async with world.gateway() as plant:
            await set_up(plant)
            assert plant.robot("r1").power_cycled, "in mode 2 the speeds tell, at the first look"
            with pytest.raises(PowerCycled, match="switched off and on"):
                await _begun(plant, HomeRobot())
        async with world.gateway() as plant:
            await set_up(plant)
            assert plant.robot("r1").power_cycled, "nobody has acknowledged it yet"
            plant.robot("r1").known.power.acknowledge()
            await _made(plant, HomeRobot())
            told = await plant.robot("r1").ask(GetSpeedPercent(), 1)
            assert isinstance(told, SpeedPercents)
            assert told.percents[0] == 20.0

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_robot_that_has_kept_its_power_moves_in_the_next_life(mode: int, tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World.of_robot(tmp_path / "data", mode)
        async with world.gateway() as plant:
            await set_up(plant)
            await plant.robot("r1").ask(SetSpeedPercent(percents=[20.0]), 1)
            await _made(plant, HomeRobot())
        async with world.gateway() as plant:
            await set_up(plant)
            assert not plant.robot("r1").power_cycled
            await _made(plant, MoveAbsolute(coordinates=[None, None, 20.0]))

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_robot_that_moves_after_a_crash_is_stopped_and_seen_to_stand(mode: int, tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World.of_robot(tmp_path / "data", mode, units=2)
        async with world.gateway() as plant:
            await asyncio.sleep(1.0)
            await _made(plant, HomeRobot())
            move = await _begun(plant, MoveAbsolute(coordinates=[None, None, 20.0]), 2)
            world.crash()
        async with world.gateway() as plant:
            report = await plant.robot("r1").stop("decelerate")
            assert (report.state, report.units_unknown) == ("confirmed", [])
            assert (await plant.robot_moves.wait(move.id, 600.0)).status.final

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_move_that_was_being_prepared_knows_what_may_have_been_said(mode: int, tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        world = World.of_robot(tmp_path / "data", mode, units=2)
        async with world.gateway() as plant:
            await asyncio.sleep(1.0)
            asking = asyncio.create_task(_begun(plant, MoveRelative(coordinates=[20.0]), unit=2))
            assert isinstance(world.wire, Cable)
            await world.wire.written_from("UNT 2")
            world.crash()
            asking.cancel()
            assert world.wire.frames()[-1] == "UNT 2"
        async with world.gateway() as plant:
            [move] = plant.robot_moves.log.of(plant.robot("r1").unit(2).address)
            end = await plant.robot_moves.wait(move.id, 600.0)
            assert end.status is not MoveStatus.CANCELLED, "the journal does not tell that it was not sent"
            assert "To prepare it, UNT 2 may have been sent." in end.evidence
            assert all(row["ended_at"] for row in world.rows("intents"))

    story()


async def _begun(plant: TestedPlant, command: FicsCommand[Any], unit: int = 1) -> RobotMove:
    return await plant.robot_moves.start(plant.robot("r1"), plant.robot("r1").unit(unit), command)


async def _made(plant: TestedPlant, command: FicsCommand[Any]) -> RobotMove:
    return await plant.robot_moves.wait((await _begun(plant, command)).id, 600.0)
