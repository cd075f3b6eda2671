"""A move ends as what the robot itself says, and as nothing that only seems so."""

import asyncio
from contextlib import suppress

import pytest

from gateway.core.errors import Expired, GatewayError, QueueFull
from gateway.core.exchange import QUEUE_LIMIT
from gateway.core.move_record import LOST_AFTER_S, MoveStatus
from gateway.core.move_runs import OUT_OF_REACH_S
from gateway.fics import moves as moves_of_robots
from gateway.fics.robot import Robot
from protocols.fics.homing import HomeRobot
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.variables import GetVariable, SetVariable
from protocols.table import Ack
from simulator.faults import Direction, Fault
from simulator.fics.line import LineSettings
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

DOWN = MoveRelative(coordinates=[None, None, -5.0])
FAR_DOWN = MoveRelative(coordinates=[None, None, -100.0])
SLOWLY = SetSpeedPercent(percents=[2.0, 2.0, 2.0])


@in_virtual_time
async def test_a_copy_of_the_answer_before_does_not_end_the_next_move() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SLOWLY, 1)
        move = await rig.start(DOWN)
        rig.cable._deliver(b"LMI\r")  # of an earlier one, for all the gateway knows
        move = await rig.plant.robot_moves.wait(move.id, 60)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, {"X": 150.0, "Y": 150.0, "Z": -5.0})
        assert rig.fics.job is None


@in_virtual_time
async def test_between_two_equal_moves_a_number_proves_that_no_answer_is_on_its_way() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.fail(Fault.DOUBLED, Direction.REPLIES, 20, delay_s=0.05)
        sent = len(rig.cable.written)
        for _ in range(2):
            assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED
        assert rig.fics.units[1].at_rest()[2] == pytest.approx(-10.0)
        first, second = (n for n, text in enumerate(rig.cable.frames(sent)) if text.startswith("LMI"))
        assert any(text.startswith("VAR") for text in rig.cable.frames(sent)[first:second])


@pytest.mark.parametrize("mode", [2, 3])
def test_a_doubled_command_whose_first_copy_was_executed_is_not_called_rejected(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            await rig.robot.ask(SLOWLY, 1)
            doubled = FAR_DOWN.text
            rig.cable.damaged[doubled] = f"{doubled}\r{doubled}"
            move = await rig.move(FAR_DOWN)
            assert (move.status, move.end_cause) == (MoveStatus.SUCCEEDED, "normal")
            assert rig.fics.units[1].at_rest()[2] == pytest.approx(-100.0)
            assert "refused LMI as in motion (E01), and had stood still" in " ".join(move.evidence)

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_nor_is_one_that_was_stopped_before_its_axes_could_tell(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            await rig.robot.ask(SLOWLY, 1)
            doubled = FAR_DOWN.text
            rig.cable.damaged[doubled] = f"{doubled}\r{doubled}"
            rig.cable.lost_answer = "ACD"
            moving = asyncio.create_task(rig.move(FAR_DOWN))
            await rig.cable.written_from("ACD")
            await asyncio.sleep(0.5)
            stopping = rig.robot.stop("immediate")
            await rig.cable.written_from("AES")
            rig.cable.lost_answer = ""
            assert (await stopping).state == "confirmed"
            move = await moving
            assert -100.0 < rig.fics.units[1].at_rest()[2] < 0.0
            assert move.status in (MoveStatus.UNKNOWN, MoveStatus.STOPPED)
            assert move.error is None or move.error.moved == "unknown"

    story()


@in_virtual_time
async def test_nor_is_a_short_one_that_was_over_before_its_axes_could_tell() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        doubled = DOWN.text
        rig.cable.damaged[doubled] = f"{doubled}\r{doubled}"
        rig.cable.lost_answer = "ACD"
        moving = asyncio.create_task(rig.move(DOWN))
        await rig.cable.written_from("ACD")
        await asyncio.sleep(1.0)
        assert rig.fics.job is None
        rig.cable.lost_answer = ""
        assert (await moving).status is MoveStatus.SUCCEEDED
        assert rig.fics.units[1].at_rest()[2] == pytest.approx(-5.0)


@pytest.mark.parametrize("unanswered", ["APS", "UNT", "MOD"])
def test_a_move_that_waits_for_its_preparations_expires_in_time_and_leaves_the_floor(unanswered: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot())
            rig.cable.lost_answer = unanswered
            asked_at = asyncio.get_running_loop().time()
            with pytest.raises(Expired, match="nothing was sent"):
                await rig.start(DOWN, start_within_s=0.7)
            assert asyncio.get_running_loop().time() == pytest.approx(asked_at + 0.7)
            rig.cable.lost_answer = ""
            assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED
            assert len(rig.heard("LMI")) == 1

    story()


@in_virtual_time
async def test_a_move_among_many_reads_is_followed_to_its_end() -> None:
    async with fics_rig(settings=LineSettings(reply_delay_s=0.02)) as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SLOWLY, 1)
        move = await rig.start(MoveAbsolute(coordinates=[None, None, 60.0]))

        async def read(number: int) -> None:
            while True:
                try:
                    await rig.robot.read(GetVariable(number=number))
                except QueueFull:
                    await asyncio.sleep(0.01)

        readers = [asyncio.create_task(read(number)) for number in range(2 * QUEUE_LIMIT)]
        move = await rig.plant.robot_moves.wait(move.id, 600)
        assert (move.status, move.end_cause) == (MoveStatus.SUCCEEDED, "normal")
        assert move.position is not None
        for reader in readers:
            reader.cancel()
        await asyncio.wait(readers)


@pytest.mark.parametrize("mode", [2, 3])
def test_a_move_to_an_unreachable_place_has_moved_nothing(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            move = await rig.move(MoveAbsolute(coordinates=[250.0, 250.0, None]))
            assert move.status is MoveStatus.FAILED
            assert move.end_cause == "error_183"
            assert move.position == move.start_position
            assert move.error is not None
            assert move.error.moved == "no"

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_homing_that_was_lost_on_its_way_is_not_called_done(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            rig.cable.lost_command = "ORG"
            move = await rig.move(HomeRobot())
            assert move.status is MoveStatus.UNKNOWN
            assert move.error is not None
            assert move.error.moved == "unknown"

    story()


@in_virtual_time
async def test_in_mode_2_homing_that_was_stopped_is_no_loss_of_power() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        move = await rig.start(HomeRobot())
        await asyncio.sleep(0.5)
        assert (await rig.robot.stop("decelerate")).state == "confirmed"
        move = await rig.plant.robot_moves.wait(move.id, 10)
        assert move.status is MoveStatus.STOPPED
        assert not rig.robot.power_cycled


@pytest.mark.parametrize("mode", [2, 3])
def test_a_move_to_a_stored_position_knows_its_target(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            await rig.robot.upload_positions([(7, [160.0, 140.0])])
            move = await rig.move(MoveToPosition(position=7))
            assert (move.status, move.target_position) == (MoveStatus.SUCCEEDED, {"X": 160.0, "Y": 140.0})
            again = await rig.move(MoveToPosition(position=7))
            assert again.status is MoveStatus.SUCCEEDED

    story()


@in_virtual_time
async def test_a_place_that_cannot_be_read_proves_nothing() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SLOWLY, 1)
        move = await rig.start(MoveAbsolute(coordinates=[160.0]))
        rig.cable.lost_answer = "APS"
        move = await rig.plant.robot_moves.wait(move.id, 60)
        assert (move.status, move.position) == (MoveStatus.UNKNOWN, None)


@in_virtual_time
async def test_a_move_that_could_not_be_written_in_time_is_never_written() -> None:
    async with fics_rig() as rig:
        await rig.move(DOWN)
        starting = asyncio.create_task(rig.start(DOWN, start_within_s=0.5))
        await rig.cable.written_from("MOD")
        await rig.cable.written_from("UNT")
        rig.cable.stuck = True
        with pytest.raises(Expired, match="nothing was sent"):
            await starting
        rig.cable.stuck = False
        await asyncio.sleep(5)
        assert len(rig.heard("LMI")) == 1


@in_virtual_time
async def test_positions_are_told_with_the_unit_of_each_axis() -> None:
    async with fics_rig() as rig:
        move = await rig.move(HomeRobot())
        assert move.units == dict.fromkeys("XYZ", "mm")


@in_virtual_time
async def test_who_starts_a_move_need_not_wait_while_the_robot_is_silent() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        asked_at = asyncio.get_running_loop().time()
        starting = asyncio.create_task(rig.start(DOWN))
        await rig.cable.written_from("LMI")
        rig.cable.lost_command = "ACD"
        rig.cable.lost_answer = "LMI"
        move = await starting
        assert asyncio.get_running_loop().time() - asked_at < 5
        assert move.status is MoveStatus.SENT


@in_virtual_time
async def test_a_move_that_is_lost_stays_lost() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SLOWLY, 1)
        move = await rig.start(DOWN)
        rig.machine.power_off(asyncio.get_running_loop().time())
        move = await rig.plant.robot_moves.wait(move.id, 120)
        assert move.status is MoveStatus.LOST
        rig.machine.power_on(asyncio.get_running_loop().time())
        await asyncio.sleep(60)
        assert move.status is MoveStatus.LOST
        assert move.position is None
        assert rig.types("robot.move.")[-1] == "robot.move.lost"
        assert rig.robot.known.motion.command is None


@in_virtual_time
async def test_in_mode_2_a_move_that_begins_a_little_late_is_not_called_lost_on_its_way() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        rig.fail(Fault.LATE, Direction.REQUESTS, 1, delay_s=0.05)
        assert (await rig.move(DOWN)).end_cause != "not_executed"


@pytest.mark.parametrize("mode", [2, 3])
def test_a_lost_move_too_short_to_be_told_from_its_roundings_is_not_called_done(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            rig.cable.lost_command = "LMI"
            move = await rig.move(MoveRelative(coordinates=[None, None, -0.01]))
            assert move.status is MoveStatus.UNKNOWN
            assert rig.heard("LMI") == []

    story()


@in_virtual_time
async def test_a_move_so_short_is_not_called_done_either_where_the_line_was_lost() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        rig.cable.lost_command = "LMI"
        moving = asyncio.create_task(rig.move(MoveRelative(coordinates=[None, None, -0.01])))
        await rig.cable.written_from("LMI")
        await asyncio.sleep(0)
        rig.cable.unplug()
        rig.cable.plugged_in = True
        move = await moving
        assert (move.status, move.completion) == (MoveStatus.UNKNOWN, "inferred")
        assert rig.heard("LMI") == []


@pytest.mark.parametrize("command", [DOWN, MoveToPosition(position=1)])
def test_a_move_begins_at_once_though_many_ask_for_other_things(command: FicsCommand[Ack]) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(baud=4800) as rig:
            await rig.move(HomeRobot())
            rig.fics.units[1].positions[1] = (None, None, -5.0)
            clients = [asyncio.create_task(_ask_on(rig.robot, number)) for number in range(QUEUE_LIMIT + 1)]
            await asyncio.sleep(1)
            asked_at = asyncio.get_running_loop().time()
            move = await rig.start(command)
            assert asyncio.get_running_loop().time() - asked_at < 1
            assert move.target_position == {"Z": -5.0}
            assert move.longest_s is not None
            for client in clients:
                client.cancel()

    story()


async def _ask_on(robot: Robot, number: int) -> None:
    """Ask for a variable again and again, as others who show values do."""
    while True:
        with suppress(QueueFull):
            await robot.ask(GetVariable(number=number))
        await asyncio.sleep(0.01)


@in_virtual_time
async def test_in_mode_2_a_move_whose_error_is_not_told_expires_in_time() -> None:
    async with fics_rig(mode=2) as rig:
        await rig.move(HomeRobot())
        rig.cable.lost_answer = "ERR"
        asked_at = asyncio.get_running_loop().time()
        with pytest.raises(Expired):
            await rig.start(DOWN, start_within_s=0.3)
        assert asyncio.get_running_loop().time() == pytest.approx(asked_at + 0.3)
        assert rig.heard("LMI") == []


# where no target tells


@in_virtual_time
async def test_in_mode_2_a_move_unhomed_that_lost_its_power_is_not_called_done() -> None:
    async with fics_rig(mode=2) as rig:
        move = await rig.start(FAR_DOWN)
        await asyncio.sleep(0.5)
        rig.power_cycle()
        move = await rig.plant.robot_moves.wait(move.id, 60)
        assert rig.stops()[-1].facts["why"] == "power"
        assert move.status in (MoveStatus.UNKNOWN, MoveStatus.LOST)
        assert move.error is not None
        assert "may have lost its power" in move.error.detail


@in_virtual_time
async def test_in_mode_2_what_was_left_unread_proves_that_a_move_unhomed_kept_its_power() -> None:
    async with fics_rig(mode=2) as rig:
        move = await rig.move(FAR_DOWN)
        assert (move.status, move.position) == (MoveStatus.SUCCEEDED, dict.fromkeys("XYZ"))
        assert "The refusal E01 was left unread, and no loss of power has cleared it." in move.evidence
        assert (await rig.move(DOWN)).status is MoveStatus.SUCCEEDED


@pytest.mark.parametrize("said", ["VAR V01=1", "VAR V1"])
def test_in_mode_2_a_refusal_that_somebody_has_read_or_left_since_proves_nothing(said: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=2) as rig:
            move = await rig.start(FAR_DOWN)
            await asyncio.sleep(0.3)
            if said == "VAR V01=1":
                await rig.robot.ask(SetVariable(number=1, value=1.0))
            else:
                rig.power_cycle()
                rig.cable.lost_command = "VAR"  # the fence leaves a refusal of its own
                with suppress(GatewayError):
                    await rig.robot.ask(GetVariable(number=1))
                rig.cable.lost_command = ""
            move = await rig.plant.robot_moves.wait(move.id, 60)
            assert move.status in (MoveStatus.UNKNOWN, MoveStatus.LOST)

    story()


@pytest.mark.parametrize("command", [HomeRobot(), RunMacro(macro="PCK", arguments=[150, 140, -5])])
def test_a_copy_of_an_earlier_answer_ends_nothing_that_never_ran(command: FicsCommand[Ack]) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            await rig.move(HomeRobot())
            rig.cable.lost_once = command.wire_name()
            moving = asyncio.create_task(rig.move(command))
            await rig.cable.written_from(command.wire_name())
            rig.cable._deliver(f"{command.wire_name()}\r".encode())
            move = await moving
            assert (move.status, move.completion) == (MoveStatus.UNKNOWN, "reply")
            assert move.error is not None
            assert "were not seen to move" in move.error.detail
            assert (await rig.move(command)).status is MoveStatus.SUCCEEDED

    story()


@in_virtual_time
async def test_an_answer_to_a_move_unhomed_that_lost_its_power_does_not_call_it_done() -> None:
    async with fics_rig() as rig:
        move = await rig.start(FAR_DOWN)
        await asyncio.sleep(0.5)
        rig.power_cycle()
        rig.cable._deliver(b"LMI\r")  # a copy of an earlier one
        move = await rig.plant.robot_moves.wait(move.id, 60)
        assert (move.status, move.end_cause) == (MoveStatus.LOST, "power_cycled")


@pytest.mark.parametrize("mode", [2, 3])
def test_homing_is_done_where_places_are_known_then(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            for _ in range(2):
                assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
            rig.power_cycle()
            await asyncio.sleep(6)
            rig.robot.known.power.acknowledge()
            move = await rig.start(HomeRobot())
            await asyncio.sleep(0.5)
            rig.power_cycle()
            move = await rig.plant.robot_moves.wait(move.id, 60)
            assert move.status in (MoveStatus.UNKNOWN, MoveStatus.LOST)

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_macro_of_a_homed_robot_is_done_where_its_axes_still_know_their_places(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            await rig.move(HomeRobot())
            move = await rig.move(RunMacro(macro="PCK", arguments=[150, 140, -5]))
            assert move.status is MoveStatus.SUCCEEDED

    story()


@in_virtual_time
async def test_where_a_refusal_might_outlast_the_power_it_proves_nothing() -> None:
    async with fics_rig(mode=2) as rig:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(moves_of_robots, "REFUSAL_SHOWS_POWER", False)
            sent = len(rig.cable.written)
            assert (await rig.move(FAR_DOWN)).status is MoveStatus.UNKNOWN
        assert "POF 2" not in rig.cable.frames(sent)


@in_virtual_time
async def test_a_port_that_is_gone_for_longer_than_a_silence_loses_no_move() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        await rig.robot.ask(SetSpeedPercent(percents=[1.0, 1.0, 1.0]), 1)
        move = await rig.start(MoveRelative(coordinates=[None, None, 20.0]))
        await asyncio.sleep(0.5)
        rig.cable.unplug()
        await asyncio.sleep(2 * LOST_AFTER_S)
        assert not move.status.final
        rig.cable.plugged_in = True
        await rig.plant.robot_moves.wait(move.id, 600.0)
        assert move.status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_port_that_stays_away_leaves_the_end_of_a_move_unknown() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        move = await rig.start(MoveRelative(coordinates=[None, None, 20.0]))
        rig.cable.unplug()
        await rig.plant.robot_moves.wait(move.id, 2 * OUT_OF_REACH_S)
        assert move.status is MoveStatus.UNKNOWN
        assert move.error is not None
        assert "could not be asked for 300 s" in move.error.detail


@in_virtual_time
async def test_a_robot_that_falls_silent_loses_its_move_within_half_a_minute() -> None:
    async with fics_rig() as rig:
        await rig.move(HomeRobot())
        move = await rig.start(MoveRelative(coordinates=[None, None, 20.0]))
        began_at = asyncio.get_running_loop().time()
        rig.lose_replies(100_000)
        await rig.plant.robot_moves.wait(move.id, 2 * OUT_OF_REACH_S)
        assert move.status is MoveStatus.LOST
        assert asyncio.get_running_loop().time() - began_at < LOST_AFTER_S + 10.0
