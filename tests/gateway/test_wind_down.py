"""The end of the gateway: nothing begins, what would never end is stopped, what still moves is named."""

import asyncio
from typing import Literal

import pytest

from gateway.core.errors import GatewayEnding, GatewayError
from gateway.core.family import ENDS_ITSELF, NOT_OURS
from gateway.core.jogs import JogOver
from gateway.core.move_record import MoveStatus
from gateway.core.move_runs import OUT_OF_REACH_S
from gateway.fics.errors import UploadBrokenOff
from gateway.texts import text
from gateway.wind_down import HURRY_S, WIND_DOWN_S
from protocols.fics.homing import HomeRobot
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import SetSpeedPercent
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.speeds import SetStartSpeed
from simulator.faults import Direction, Fault, Switch
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time, lose, rig, start
from tests.tested_plant import TestedPlant

_UNCONFIRMED = text("stops.unconfirmed").en

ENDLESS = MoveClockwise(distance="endless")
LONG = MoveClockwise(distance=500_000)
SLOW = SetSpeedPercent(percents=[5, 5, 5])
UP = MoveRelative(coordinates=[None, None, -100])
BOTH_MODES = pytest.mark.parametrize("mode", [2, 3])


def now() -> float:
    return asyncio.get_running_loop().time()


def on_exit(plant: TestedPlant, what: Literal["leave", "stop"]) -> None:
    """Configure what becomes of motors when the gateway ends."""
    plant._end._on_exit = what


# bodies


@in_virtual_time
async def test_a_move_without_an_end_is_stopped_and_seen_to_stand_still() -> None:
    async with rig() as it:
        move = await start(it, ENDLESS)
        other = await start(it, LONG, "00")
        await it.plant.wind_down()
        assert not it.axis().motor.moving
        assert (move.status, move.end_cause) == (MoveStatus.STOPPED, "stop_command")
        stops = [entry for entry in it.plant.history.recorders["line1"].entries() if b"5SS" in entry.data]
        assert {entry.caller for entry in stops if entry.kind == "tx"} == {"gateway: shutdown"}
        # A bounded move goes on, and is named before the streams end.
        assert it.axis(0x00).motor.moving
        [left] = it.events("body.left_moving")
        assert (left.subject, left.data) == (
            "/bodies/line1.00",
            {"move_id": other.id, "detail": ENDS_ITSELF},
        )
        types = it.types()
        assert types.index("gateway.shutting_down") < types.index("body.stop.requested")
        assert types[-1] == "body.left_moving"
        sent = len(it.wire.sent)
        await it.plant.close()
        assert "5SS" not in "".join(it.wire.frames(sent))


@in_virtual_time
async def test_a_move_without_an_end_that_was_lost_from_sight_is_stopped_too() -> None:
    async with rig() as it:
        move = await start(it, ENDLESS)
        lose(it, Direction.REPLIES, 100_000)
        await it.plant.moves.wait(move.id, 2 * OUT_OF_REACH_S)
        assert move.status is MoveStatus.UNKNOWN
        it.machine.faults.clear()
        await it.plant.wind_down()
        assert not it.axis().motor.moving
        assert not it.types("body.left_moving")


@in_virtual_time
async def test_all_members_of_a_group_on_a_move_without_an_end_are_stopped() -> None:
    async with rig() as it:
        moves = await it.plant.moves.start(it.plant.group("80"), ENDLESS)
        await it.plant.wind_down()
        assert [move.status for move in moves] == [MoveStatus.STOPPED] * 2
        assert not it.types("body.left_moving")


@in_virtual_time
async def test_where_the_configuration_says_so_every_motor_is_stopped() -> None:
    async with rig() as it:
        on_exit(it.plant, "stop")
        move = await start(it, LONG)
        it.axis(0x00).execute("2+M900000", now())  # by somebody else
        it.machine.look_after(0x00)
        it.body("00").life.look_due.set()
        await asyncio.sleep(0.5)
        await it.plant.wind_down()
        assert move.status is MoveStatus.STOPPED
        assert not it.axis(0x00).motor.moving
        assert not it.types("body.left_moving")


@in_virtual_time
async def test_motion_of_somebody_else_is_left_alone_and_named() -> None:
    async with rig() as it:
        it.axis().execute("1+MZ", now())
        it.machine.look_after(0x3F)
        it.body().life.look_due.set()
        await asyncio.sleep(0.5)
        await it.plant.wind_down()
        assert it.axis().motor.moving
        [left] = it.events("body.left_moving")
        assert left.data == {"move_id": None, "detail": NOT_OURS}


@in_virtual_time
async def test_what_stands_still_needs_no_time() -> None:
    async with rig() as it:
        began_at, sent = now(), len(it.wire.sent)
        await it.plant.wind_down()
        assert now() == began_at
        assert it.wire.frames(sent) == []
        assert it.types("body.left_moving") == []


@in_virtual_time
async def test_nothing_new_begins_and_reads_and_stops_work_until_the_lines_are_closed() -> None:
    async with rig() as it:
        await start(it, LONG)
        await it.plant.wind_down()
        sent = len(it.wire.sent)
        for begin in (
            start(it, LONG, "00"),
            it.body("00").ask(SetStartSpeed(speed_set=1, speed=1000)),
            it.plant.group("80").ask(SetStartSpeed(speed_set=1, speed=1000)),
            it.plant.define_group("81", ["00", "01"]),
        ):
            with pytest.raises(GatewayEnding, match="nothing was sent"):
                await begin
        assert it.plant.moves.log.of(it.body("00").address) == []
        assert not [frame for frame in it.wire.frames(sent) if frame[3:6] in ("1+M", "OLS", "XVS")]
        await it.body("00").ask(GetPosition())
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "confirmed"


@in_virtual_time
async def test_a_move_that_still_asks_where_it_begins_is_never_sent() -> None:
    async with rig(baud=9600) as it:
        it.body().told.rest_in_doubt()
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F9CD")
        await it.plant.wind_down()
        with pytest.raises(GatewayEnding):
            await starting
        [move] = it.plant.moves.log.of(it.body().address)
        assert move.status is MoveStatus.CANCELLED
        assert move.error is not None
        assert (move.error.type, move.error.moved) == ("shutting-down", "no")
        assert not it.executed("1+M")
        assert not it.types("body.left_moving")


@in_virtual_time
async def test_a_move_that_waits_for_the_line_is_never_sent() -> None:
    async with rig(baud=9600) as it:
        await it.body().poll()
        setting = SetStartSpeed(speed_set=1, speed=1000)
        busy = [asyncio.create_task(it.body("00").ask(setting)) for _ in range(3)]
        starting = asyncio.create_task(start(it, ENDLESS))
        await it.wire.begun("&00OLSS[1],1000")
        assert it.plant.line("line1").waiting()["command"] > 1
        [move] = it.plant.moves.log.of(it.body().address)
        assert move.status is MoveStatus.QUEUED
        await it.plant.wind_down()
        with pytest.raises(GatewayEnding):
            await starting
        done, *refused = await asyncio.gather(*busy, return_exceptions=True)
        assert not isinstance(done, Exception)  # it was written before
        assert all(isinstance(it, GatewayEnding) for it in refused)
        assert not it.executed("1+M")
        assert "&3F5SS" not in it.wire.frames()  # nothing to stop


@in_virtual_time
async def test_who_waits_for_a_move_is_given_what_is_known() -> None:
    async with rig() as it:
        move = await start(it, LONG)
        waiting = asyncio.create_task(it.plant.moves.wait(move.id, 60.0))
        await asyncio.sleep(0.5)
        began_at = now()
        await it.plant.wind_down()
        assert (await waiting).status is MoveStatus.MOVING
        assert (await it.plant.moves.wait(move.id, 60.0)).status is MoveStatus.MOVING
        assert now() - began_at < 0.5


@in_virtual_time
async def test_a_stop_that_is_never_confirmed_ends_the_waiting_and_is_named() -> None:
    async with rig() as it:
        move = await start(it, ENDLESS)
        it.machine.switch_body(0x3F, on=False, now=now())
        began_at = now()
        await it.plant.wind_down()
        assert now() - began_at == pytest.approx(WIND_DOWN_S)
        assert "&3F5SS" in it.wire.frames()
        [left] = it.events("body.left_moving")
        assert (left.subject, left.data) == (
            "/bodies/line1.3F",
            {"move_id": move.id, "detail": _UNCONFIRMED},
        )


@in_virtual_time
async def test_behind_a_line_that_is_down_a_motor_is_named_that_nobody_can_stop() -> None:
    async with rig() as it:
        await start(it, ENDLESS)
        it.wire.unplug()
        began_at = now()
        await it.plant.close()
        assert now() - began_at < WIND_DOWN_S + 1.0
        assert [event.data["detail"] for event in it.events("body.left_moving")] == [_UNCONFIRMED]


@in_virtual_time
async def test_the_end_may_come_while_a_line_is_set_up() -> None:
    async with rig(baud=9600) as it:
        it.plant.line("line1").set_up_again("a test")
        await asyncio.sleep(0.01)
        began_at = now()
        await it.plant.close()
        assert now() - began_at < 1.0


@in_virtual_time
async def test_in_a_hurry_the_stop_is_written_and_not_waited_for() -> None:
    async with rig(baud=9600) as it:
        await start(it, ENDLESS)
        it.machine.faults.set(Switch(Fault.LOST, Direction.REPLIES, probability=1.0))
        began_at = now()
        ending = asyncio.create_task(it.plant.wind_down())
        await asyncio.sleep(0.01)
        it.plant.hurry()
        await ending
        assert now() - began_at == pytest.approx(0.01 + HURRY_S)
        assert "&3F5SS" in it.wire.frames()
        assert it.types("body.left_moving") == ["body.left_moving"]


@in_virtual_time
async def test_who_hurries_before_and_after_disturbs_nobody() -> None:
    async with rig() as it:
        it.plant.hurry()
        await it.plant.wind_down()
        it.plant.hurry()
        await it.plant.wind_down()
        assert it.types("gateway.") == ["gateway.shutting_down"]


@in_virtual_time
async def test_a_scan_is_broken_off_and_says_so() -> None:
    async with rig() as it:
        scan = it.plant.scans.start(it.plant.line("line1"))
        waiting = asyncio.create_task(it.plant.scans.wait(scan, 60.0))
        await asyncio.sleep(0.5)
        await it.plant.wind_down()
        await waiting
        assert scan.status == "failed"
        assert "shutting down" in str(scan.error)


# robots


@BOTH_MODES
def test_an_axis_that_jogs_is_stopped_and_seen_to_stand_still(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as it:
            await it.move(HomeRobot())
            session = await it.robot.jogs.start(1, "Z", "-")
            await asyncio.sleep(0.3)
            await it.plant.wind_down()
            assert it.fics.job is None
            assert session.state == "stopped"
            assert it.types("robot.jog") == [
                f"robot.jog.{step}" for step in ("started", "stopping", "stopped")
            ]
            assert not it.types("robot.left_moving")
            with pytest.raises(JogOver, match="stopped"):
                it.robot.jogs.heartbeat(session.id)
            with pytest.raises(GatewayEnding):
                await it.robot.jogs.start(1, "Z", "-")

    story()


@in_virtual_time
async def test_an_axis_that_does_not_hear_the_end_of_its_jog_is_named() -> None:
    async with fics_rig() as it:
        await it.move(HomeRobot())
        await it.robot.jogs.start(1, "Z", "-")
        await asyncio.sleep(0.3)
        it.cable.unplug()
        began_at = now()
        await it.plant.close()
        assert now() - began_at < WIND_DOWN_S + 1.0
        [left] = it.events("robot.left_moving")
        assert (left.subject, left.data["detail"]) == ("/robots/r1", _UNCONFIRMED)


@BOTH_MODES
@pytest.mark.parametrize("what", ["leave", "stop"])
def test_a_robot_goes_on_with_its_move_or_is_stopped_as_the_configuration_says(
    mode: int, what: Literal["leave", "stop"]
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as it:
            on_exit(it.plant, what)
            await it.robot.ask(SLOW, 1)
            move = await it.start(UP)
            waiting = asyncio.create_task(it.plant.robot_moves.wait(move.id, 60.0))
            await it.plant.wind_down()
            assert (await waiting) is move
            if what == "leave":
                assert it.fics.job is not None
                [left] = it.events("robot.left_moving")
                assert left.data == {"move_id": move.id, "detail": ENDS_ITSELF}
            else:
                assert it.fics.job is None
                assert move.status is MoveStatus.STOPPED
                assert not it.types("robot.left_moving")

    story()


@BOTH_MODES
def test_a_move_of_a_robot_that_is_not_sent_yet_never_is(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, baud=19200) as it:
            starting = asyncio.create_task(it.start(UP))
            await it.cable.written_from("APS")
            await it.plant.wind_down()
            with pytest.raises(GatewayEnding):
                await starting
            assert not it.heard("LMI")
            assert not it.heard("ASS")
            for begin in (
                it.start(UP),
                it.start(RunMacro(macro="PCK")),
                it.robot.ask(SLOW, 1),
                it.robot.upload_positions([(1, [1.0])]),
                it.robot.conversation.reset_errors(),
            ):
                with pytest.raises(GatewayEnding):
                    await begin
            await it.robot.unit(1).position()
            assert (await it.robot.stop("immediate")).state == "confirmed"

    story()


@BOTH_MODES
def test_an_upload_is_broken_off_and_its_end_is_sent(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, baud=19200) as it:
            positions = [(number, [float(number)]) for number in range(1, 1000)]
            uploading = asyncio.create_task(it.robot.upload_positions(positions))
            await it.cable.written_from("POS 5")
            began_at = now()
            await it.plant.wind_down()
            assert now() - began_at < 1.0
            assert it.fics.upload is None
            # In Ver.2 the last line is in doubt, and that comes first.
            why = "the gateway is shutting down" if mode == 3 else "in Ver.2 nobody can tell"
            with pytest.raises(UploadBrokenOff, match=why) as broken:
                await uploading
            assert "nothing was sent" not in broken.value.detail

    story()


@in_virtual_time
async def test_a_stop_that_a_robot_refuses_does_not_keep_the_gateway_from_ending() -> None:
    async with fics_rig() as it:
        await it.robot.ask(SLOW, 1)
        await it.start(UP)
        it.edit(True)
        asking = it.robot.stop("immediate")
        began_at = now()
        await it.plant.close()
        assert now() - began_at < WIND_DOWN_S + 1.0
        assert (await asking).state != "confirmed"
        [left] = it.events("robot.left_moving")
        assert left.data["detail"] == _UNCONFIRMED


@in_virtual_time
async def test_whatever_is_asked_when_the_lines_are_closed_is_answered() -> None:
    async with fics_rig() as it:
        it.cable.lost_answer = "APS"
        asking = asyncio.create_task(it.robot.unit(1).position())
        await it.cable.written_from("APS")
        await it.plant.close()
        with pytest.raises(GatewayError):
            await asking
