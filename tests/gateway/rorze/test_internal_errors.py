"""A controller with a fault inside: what it refuses is not called done, and silence is no answer."""

import asyncio
from typing import Any

import pytest

from gateway.core.errors import BodyOffline, CommandGarbled, ControllerRefused, GatewayError, PowerCycled
from gateway.core.move_record import MoveStatus
from gateway.rorze.bodies import Body
from protocols.rorze.flash import SaveSettings
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.position import GetPosition
from protocols.rorze.programs import GetProgramStatus
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetStartSpeed
from protocols.rorze.status import CONTROLLER_STATUS_BITS, ClearControllerStatus, names_of
from protocols.rorze.stops import StopImmediately
from simulator.rorze.breakdowns import INTERNAL_ERRORS, Breakdown
from simulator.rorze.settings import STANDARD
from tests.plants import Rig, finished, in_virtual_time, rig, start

CHECKSUM, RS485_SPEED, HARDWARE = 0x4B, 0x4D, 0x4E
MOVE, LONG = MoveClockwise(distance=500), MoveClockwise(distance=900_000)
NOTICED_S = 6.0
FOR_EVER = 1_000_000


def break_down(rig: Rig, error: int, commands: int = 1) -> None:
    """Let the next commands meet an error inside the controller."""
    rig.axis().breakdown = Breakdown(error, commands)


def frame_of(body: Body, command: RorzeCommand[Any]) -> str:
    return body.line.frame_of(body.number, command).removesuffix("\\r")


async def refused_move(rig: Rig, error: int) -> GatewayError:
    """Let a motion command itself, and nothing asked before it, meet an error."""
    starting = asyncio.create_task(start(rig, MOVE))
    await rig.wire.begun(frame_of(rig.body(), MOVE))
    break_down(rig, error)
    with pytest.raises(GatewayError) as caught:
        await starting
    return caught.value


def status_of(body: Body) -> list[str]:
    return names_of(body.told.status_bits or 0, CONTROLLER_STATUS_BITS)


@pytest.mark.parametrize("error", sorted(INTERNAL_ERRORS))
@in_virtual_time
async def test_a_move_that_meets_an_error_is_rejected_and_nothing_moves(error: int) -> None:
    async with rig() as it:
        refusal = await refused_move(it, error)
        assert isinstance(refusal, ControllerRefused)
        assert (refusal.error_code, refusal.moved) == (f"0x{error:02X}", "no")
        assert "Nothing moved" in refusal.detail
        [move] = it.plant.moves.log.of(it.body().address)
        assert (move.status, move.error is not None) == (MoveStatus.REJECTED, True)
        assert not it.truth.of("pulses_start")
        assert (await finished(it, MOVE)).status is MoveStatus.SUCCEEDED


@pytest.mark.parametrize(
    ("error", "retryable", "remedy"),
    [
        (CHECKSUM, True, "check the line"),
        (RS485_SPEED, False, "Check the RS-485 wiring"),
        *((error, False, "contact RORZE") for error in sorted(INTERNAL_ERRORS - {CHECKSUM, RS485_SPEED})),
    ],
)
@in_virtual_time
async def test_the_remedy_says_who_or_what_to_look_at(error: int, retryable: bool, remedy: str) -> None:
    async with rig() as it:
        for command in (GetPosition(), SetStartSpeed(speed=77)):
            break_down(it, error)
            with pytest.raises(ControllerRefused, match=command.code) as caught:
                await it.body().ask(command)
            assert (caught.value.moved, caught.value.retryable) == ("no", retryable)
            assert remedy in caught.value.remedy
            assert isinstance(caught.value, CommandGarbled) is (error == CHECKSUM)
        assert it.axis().settings.speeds[STANDARD].low != 77


@pytest.mark.parametrize("error", [CHECKSUM, RS485_SPEED])
@in_virtual_time
async def test_an_error_of_the_rs485_line_is_seen_in_the_status_until_it_is_cleared(error: int) -> None:
    async with rig() as it:
        break_down(it, error)
        await asyncio.sleep(NOTICED_S)
        assert status_of(it.body()) == ["communication_error"]
        await it.body().ask(ClearControllerStatus())
        await asyncio.sleep(NOTICED_S)
        assert status_of(it.body()) == []


@pytest.mark.parametrize("error", [CHECKSUM, HARDWARE])
@in_virtual_time
async def test_a_body_that_refuses_everything_is_unreadable_and_not_moved(error: int) -> None:
    async with rig() as it:
        break_down(it, error, FOR_EVER)
        await asyncio.sleep(NOTICED_S)
        assert "body.unreadable" in it.types()
        with pytest.raises(ControllerRefused) as caught:
            await start(it, MOVE)
        assert caught.value.moved == "no"
        assert not it.truth.of("pulses_start")
        break_down(it, error, 0)
        assert (await finished(it, MOVE)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_body_that_refuses_even_its_fence_is_not_said_to_be_without_power() -> None:
    async with rig() as it:
        await it.body().ask(SetStartSpeed(speed=77))
        break_down(it, HARDWARE, FOR_EVER)
        with pytest.raises(BodyOffline, match=r"refuses what it is asked \(error 4Eh\)") as caught:
            await it.body().ask(SetStartSpeed(speed=78))
        assert "contact RORZE" in caught.value.remedy
        assert "RORZE社へご相談ください" in caught.value.remedy_ja
        break_down(it, HARDWARE, 0)
        await asyncio.sleep(NOTICED_S)
        await it.body().ask(SetStartSpeed(speed=79))
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        await asyncio.sleep(NOTICED_S)
        with pytest.raises(BodyOffline, match="does not answer"):
            await it.body().ask(SetStartSpeed(speed=80))


@in_virtual_time
async def test_a_stop_that_a_controller_refuses_is_not_confirmed_before_it_is_done() -> None:
    async with rig() as it:
        await start(it, LONG)
        await asyncio.sleep(1.0)
        break_down(it, HARDWARE, FOR_EVER)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state != "confirmed"
        assert "hardware stop" in str(report.detail)
        assert it.axis().motor.moving
        break_down(it, HARDWARE, 0)
        [report] = await it.plant.stops.stop([it.body()], "immediate")
        assert report.state == "confirmed"
        assert not it.axis().motor.moving


@pytest.mark.parametrize("error", [CHECKSUM, HARDWARE])
@in_virtual_time
async def test_a_refused_question_for_the_program_does_not_say_that_none_runs(error: int) -> None:
    async with rig() as it:
        question = frame_of(it.body(), GetProgramStatus())
        stopping = it.plant.stops.stop([it.body()], "immediate")
        await it.wire.begun(question)
        break_down(it, error)
        [report] = await stopping
        assert report.state == "confirmed"
        assert it.wire.frames().count(question) == 2
        assert it.executed(StopImmediately.code)


@in_virtual_time
async def test_settings_found_wrong_at_power_on_show_in_the_status_and_nothing_goes_to_a_place() -> None:
    async with rig() as it:
        await finished(it, MoveTo(position=500))
        it.axis().flash.damaged = True
        it.machine.brown_out(0x3F, 0.05, asyncio.get_running_loop().time())
        it.wire.turn()
        await asyncio.sleep(NOTICED_S)
        body = it.body()
        assert status_of(body) == ["initialisation_error"]
        assert body.power.cycled
        with pytest.raises(PowerCycled):
            await start(it, MoveTo(position=500))
        await body.ask(ClearControllerStatus())
        await body.ask(SaveSettings())
        await asyncio.sleep(NOTICED_S)
        assert status_of(body) == []
