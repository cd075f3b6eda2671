"""The gateway was suspended, or its loop held: what waited is not sent late, and nothing is believed."""

import asyncio

import pytest

from gateway.core.admission import DOUBT_S, SUSPENDED_S
from gateway.core.errors import GatewayError, HeldUp
from gateway.core.jogs import JogOver
from gateway.core.move_record import MoveStatus
from gateway.fics.errors import UploadBrokenOff
from gateway.rorze.knowledge import MotorState
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import SetSpeedPercent
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.speeds import SetStartSpeed
from tests.fics_plants import fics_rig
from tests.plants import ended, in_virtual_time, rig, start
from tests.tested_plant import TestedPlant

LONG = MoveClockwise(distance=100_000)
SETTING = SetStartSpeed(speed_set=1, speed=1000)
UP = MoveRelative(coordinates=[None, None, -5.0])
SLOW = SetSpeedPercent(percents=[1, 1, 1])
BOTH_MODES = pytest.mark.parametrize("mode", [2, 3])
A_WHILE_S = SUSPENDED_S + 1.0


class Lid:
    """The lid of a laptop: while it is closed the loop's clock stands still, and the computer's does not."""

    def __init__(self, plant: TestedPlant) -> None:
        self._loop = asyncio.get_running_loop()
        self._closed_s = 0.0
        plant.admission.watch._clock = lambda: self._loop.time() + self._closed_s
        plant.admission.watch.start()

    def close_for(self, seconds: float = A_WHILE_S) -> None:
        self._closed_s += seconds


# bodies


@in_virtual_time
async def test_a_move_that_waits_for_the_line_does_not_begin_late() -> None:
    async with rig(baud=9600) as it:
        lid = Lid(it.plant)
        await it.body().poll()
        reading = [asyncio.create_task(it.body("00").ask(GetPosition())) for _ in range(2)]
        busy = [asyncio.create_task(it.body("00").ask(SETTING)) for _ in range(3)]
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&00OLSS[1],1000")
        sent = len(it.wire.sent)
        lid.close_for()
        with pytest.raises(HeldUp, match="nothing was sent"):
            await starting
        [move] = it.plant.moves.log.of(it.body().address)
        assert move.status is MoveStatus.CANCELLED
        done, *refused = await asyncio.gather(*busy, return_exceptions=True)
        assert not isinstance(done, Exception)  # it was written before
        assert all(isinstance(it, HeldUp) for it in refused)
        await asyncio.gather(*reading)  # reads go on
        await asyncio.sleep(1.0)
        assert not it.executed("1+M")
        # The first thing that is said is a question that no reply from before can answer.
        assert it.wire.frames(sent)[0][3:6] == "3ND"
        [held] = it.events("gateway.loop.held")
        assert held.data["seconds"] == pytest.approx(A_WHILE_S, abs=0.1)
        assert held.data["cancelled"] is True


@in_virtual_time
async def test_a_move_that_still_asks_where_it_begins_is_never_sent() -> None:
    async with rig(baud=9600) as it:
        lid = Lid(it.plant)
        it.body().told.rest_in_doubt()
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F9CD")
        lid.close_for()
        with pytest.raises(HeldUp):
            await starting
        assert not it.executed("1+M")


@in_virtual_time
async def test_a_request_that_was_read_after_it_is_refused_for_nobody_knows_its_age() -> None:
    async with rig() as it:
        lid = Lid(it.plant)
        lid.close_for()
        sent = len(it.wire.sent)
        for begin in (
            start(it, LONG),  # which comes before the next beat of the watch
            it.body("00").ask(SETTING),
            it.plant.moves.start(it.plant.group("80"), LONG),
            it.plant.define_group("81", ["00", "01"]),
        ):
            with pytest.raises(HeldUp):
                await begin
        assert not [frame for frame in it.wire.frames(sent) if frame[3:6] in ("1+M", "OLS", "XVS")]
        await it.body("00").ask(GetPosition())
        await asyncio.sleep(DOUBT_S)
        assert (await ended(it, await start(it, LONG))).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_stop_is_never_refused_because_of_it() -> None:
    async with rig() as it:
        lid = Lid(it.plant)
        await start(it, LONG)
        lid.close_for()
        sent = len(it.wire.sent)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "confirmed"
        assert it.wire.frames(sent)[0] == "&3F5IS"


@in_virtual_time
async def test_a_move_that_runs_is_followed_to_its_end() -> None:
    async with rig() as it:
        lid = Lid(it.plant)
        move = await start(it, LONG)
        lid.close_for()
        assert (await ended(it, move)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_where_a_motor_rested_is_asked_again() -> None:
    async with rig() as it:
        lid = Lid(it.plant)
        await it.body().poll()
        assert it.body().told.rest == MotorState(0, 0)
        it.axis().execute("1+M300", asyncio.get_running_loop().time())
        it.machine.look_after(0x3F)
        await asyncio.sleep(0.3)
        lid.close_for()
        await asyncio.sleep(DOUBT_S + 0.2)
        move = await ended(it, await start(it, LONG))
        assert (move.start_position, move.status) == (300, MoveStatus.SUCCEEDED)


@in_virtual_time
async def test_a_loop_that_was_held_for_a_moment_is_told_and_nothing_is_cancelled(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with rig(baud=9600) as it:
        lid = Lid(it.plant)
        it.body().told.rest_in_doubt()
        starting = asyncio.create_task(start(it, LONG))
        await it.wire.begun("&3F9CD")
        lid.close_for(1.5)
        move = await starting
        assert (await ended(it, move)).status is MoveStatus.SUCCEEDED
        [held] = it.events("gateway.loop.held")
        assert held.data["cancelled"] is False
        assert "held up for 1.5 s" in caplog.text


@in_virtual_time
async def test_a_line_that_is_being_set_up_goes_on_with_that() -> None:
    async with rig(baud=9600) as it:
        lid = Lid(it.plant)
        it.plant.line("line1").set_up_again("a test")
        await it.wire.begun("&7FXID")
        lid.close_for()
        await asyncio.sleep(1.0)
        assert it.plant.line("line1").state == "ready"
        assert "&7FXVS80,00,01" in it.wire.frames()[-40:]


# robots


@BOTH_MODES
def test_an_axis_that_jogs_is_stopped_at_once_whatever_heartbeats_have_come_meanwhile(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as it:
            lid = Lid(it.plant)
            await it.move(HomeRobot())
            session = await it.robot.jogs.start(1, "Z", "-")
            await asyncio.sleep(0.2)
            sent = len(it.cable.written)
            lid.close_for()
            with pytest.raises(JogOver, match="lost"):
                it.robot.jogs.heartbeat(session.id)
            assert it.cable.frames(sent)[0] == "JOG Z"
            await asyncio.sleep(1.0)
            assert it.fics.job is None
            assert session.state == "lost"

    story()


@in_virtual_time
async def test_a_heartbeat_that_is_read_after_its_time_keeps_nothing_jogging() -> None:
    async with fics_rig() as it:
        await it.move(HomeRobot())
        session = await it.robot.jogs.start(1, "Z", "-")
        running = it.robot.jogs._sessions[session.id]
        running.let_go()  # as if the socket were read before it goes off
        await asyncio.sleep(0.6)
        with pytest.raises(JogOver, match="lost"):
            it.robot.jogs.heartbeat(session.id)
        await asyncio.sleep(0.5)
        assert it.fics.job is None


@BOTH_MODES
def test_a_move_of_a_robot_that_is_not_sent_yet_never_is(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, baud=19200) as it:
            lid = Lid(it.plant)
            starting = asyncio.create_task(it.start(UP))
            await it.cable.written_from("APS")
            lid.close_for()
            with pytest.raises(HeldUp):
                await starting
            assert not it.heard("LMI")
            [move] = it.plant.robot_moves.log.of(it.robot.unit(1).address)
            assert move.status is MoveStatus.CANCELLED
            await asyncio.sleep(DOUBT_S)
            assert (await it.move(UP)).status is MoveStatus.SUCCEEDED

    story()


@BOTH_MODES
def test_a_request_to_a_robot_that_was_read_after_it_is_refused(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as it:
            lid = Lid(it.plant)
            lid.close_for()
            for begin in (
                it.start(UP),
                it.robot.jogs.start(1, "Z", "-"),
                it.robot.ask(SLOW, 1),
                it.robot.upload_positions([(1, [1.0])]),
            ):
                with pytest.raises(HeldUp, match="nothing was sent"):
                    await begin
            await it.robot.unit(1).position()
            assert (await it.robot.stop("immediate")).state == "confirmed"

    story()


@BOTH_MODES
def test_a_move_of_a_robot_that_runs_is_followed_and_not_taken_for_stopped(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as it:
            lid = Lid(it.plant)
            await it.move(HomeRobot())
            await it.robot.ask(SLOW, 1)
            move = await it.start(UP)
            lid.close_for()
            assert (await it.plant.robot_moves.wait(move.id, 600.0)).status is MoveStatus.SUCCEEDED

    story()


@BOTH_MODES
def test_an_upload_is_broken_off_and_ended(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode, baud=19200) as it:
            lid = Lid(it.plant)
            positions = [(number, [float(number)]) for number in range(1, 1000)]
            uploading = asyncio.create_task(it.robot.upload_positions(positions))
            await it.cable.written_from("POS 5")
            lid.close_for()
            with pytest.raises(UploadBrokenOff):
                await uploading
            await asyncio.sleep(1.0)
            assert it.fics.upload is None

    story()


@in_virtual_time
async def test_a_robot_is_asked_for_its_unit_again() -> None:
    async with fics_rig(units=2) as it:
        lid = Lid(it.plant)
        await it.robot.unit(2).position()
        assert it.robot.known.unit.number == 2
        it.touch(lambda fics, _: setattr(fics, "host_unit", 1))  # by somebody else
        lid.close_for()
        sent = len(it.cable.written)
        await it.robot.unit(2).position()
        frames = it.cable.frames(sent)
        assert "UNT" in frames[: frames.index("APS")]


@in_virtual_time
async def test_after_a_suspension_a_robots_line_is_fenced_first() -> None:
    async with fics_rig() as it:
        lid = Lid(it.plant)
        sent = len(it.cable.written)
        lid.close_for()
        with pytest.raises(GatewayError):
            await it.start(UP)
        await asyncio.sleep(0.2)
        assert it.cable.frames(sent)[0].startswith("VAR V")
