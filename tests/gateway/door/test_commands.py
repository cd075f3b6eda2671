"""The one door: what becomes of a command is decided by its effect, and no motion goes past it."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from gateway.core.errors import BodyBusy, GatewayError, InvalidRequest, NotAllowed, NotFound
from gateway.core.exchange import Lane
from gateway.core.origin import Origin, current
from gateway.core.targets import BegunMoves, CommandReplies, MemberAnswers, Opened, Stopped
from gateway.door.doing import do, read_text
from gateway.rorze.session import Answered
from protocols.fics import jog, moves, stops
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetSpeedPercent
from protocols.rorze.link_master import IdentifyControllers
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.origin import SetOverrunFactor
from protocols.rorze.position import GetPosition
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetStartSpeed
from protocols.rorze.stops import ChangeSpeed, StopDecelerating, StopImmediately
from tests.fics_plants import fics_rig
from tests.plants import Rig, in_virtual_time, rig

ME = Origin("test", "r-1")
FAR = MoveClockwise(distance=50_000)
ENDLESS = MoveClockwise(distance="endless")
BODY, GROUP, UNIT = "/bodies/3F", "/groups/80", "/robots/r1/units/1"


# what becomes of a command


@in_virtual_time
async def test_a_motion_makes_a_move_with_its_record_and_its_end_can_be_waited_for() -> None:
    async with rig() as it:
        begun = await do(it.plant, ME, BODY, FAR, 60.0)
        assert isinstance(begun, BegunMoves)
        assert (begun.path, begun.group_id) == ("/bodies/line1.3F", None)
        assert [move.status for move in begun.moves] == ["succeeded"]
        assert it.plant.moves.get(begun.moves[0].id) == begun.moves[0]


@in_virtual_time
async def test_a_motion_of_a_group_makes_a_move_for_each_member() -> None:
    async with rig() as it:
        begun = await do(it.plant, ME, GROUP, FAR, 60.0)
        assert isinstance(begun, BegunMoves)
        assert [move.body_id for move in begun.moves] == ["line1.00", "line1.01"]
        assert begun.group_id == "line1.80"


@pytest.mark.parametrize(("command", "code"), [(StopDecelerating(), "5SS"), (StopImmediately(), "5IS")])
@in_virtual_time
async def test_a_stop_is_seen_through_to_standstill(command: RorzeCommand[Any], code: str) -> None:
    async with rig() as it:
        await do(it.plant, ME, BODY, FAR)
        stopped = await do(it.plant, ME, BODY, command)
        assert isinstance(stopped, Stopped)
        assert stopped.confirmed
        assert f"&3F{code}" in it.wire.frames()
        assert not it.axis().motor.moving


@in_virtual_time
async def test_all_else_is_asked() -> None:
    async with rig() as it:
        place = await do(it.plant, ME, BODY, GetPosition())
        assert isinstance(place, CommandReplies)
        assert place.replies[0].written() == "+000000000"
        each = await do(it.plant, ME, GROUP, SetStartSpeed(speed=700))
        assert isinstance(each, MemberAnswers)
        assert list(each.members) == ["line1.00", "line1.01"]
        await do(it.plant, ME, "/lines/line1", IdentifyControllers())
        with pytest.raises(GatewayError):  # at standstill there is no speed to change
            await do(it.plant, ME, BODY, ChangeSpeed(speed=900))
        assert it.plant.moves.log.of(it.body().address) == []


@in_virtual_time
async def test_an_operation_acts_for_its_caller() -> None:
    async with rig() as it:
        seen: list[Origin] = []
        it.plant.line("line1").gate.add(lambda _exchange, _now: seen.append(current()))
        await do(it.plant, ME, BODY, SetOverrunFactor(factor=2))
        assert seen == [ME]
        assert current() == Origin("gateway")


@pytest.mark.parametrize("path", ["/bodies/40", "/bodies", "/lines/x", "/robots/r9", "/things/1", ""])
@in_virtual_time
async def test_what_is_not_there_is_commanded_nothing(path: str) -> None:
    async with rig() as it:
        with pytest.raises(NotFound):
            await do(it.plant, ME, path, GetPosition())


@in_virtual_time
async def test_jogs_and_moves_of_units_are_begun_by_their_rows() -> None:
    async with fics_rig() as it:
        opened = await do(it.plant, ME, UNIT, jog.StartJog(axis="Z", direction="+"))
        assert isinstance(opened, Opened)
        assert opened.path.startswith("/robots/r1/jogs/")
        ended = await do(it.plant, ME, UNIT, jog.StopJog(axis="Z"))
        assert isinstance(ended, CommandReplies)
        begun = await do(it.plant, ME, UNIT, jog.StepAxis(axis="Z", steps=5), 30.0)
        assert isinstance(begun, BegunMoves)
        assert begun.moves[0].status == "succeeded"
        asked = await do(it.plant, ME, UNIT, GetSpeedPercent())
        assert isinstance(asked, CommandReplies)
        stopped = await do(it.plant, ME, UNIT, stops.StopAllDecelerating())
        assert isinstance(stopped, Stopped)
        assert stopped.confirmed


# plain text


@in_virtual_time
async def test_plain_text_needs_its_switch_in_the_configuration() -> None:
    async with rig() as it:
        with pytest.raises(NotAllowed, match="switched off"):
            read_text(it.plant, BODY, "1+M500")


# nobody goes past it

Way = Callable[[Rig, RorzeCommand[Any]], Awaitable[object]]


async def _by_a_group(it: Rig, command: RorzeCommand[Any]) -> object:
    return await it.plant.group("80").ask(command)


def _by_the_line(lane: Lane) -> Way:
    async def submit(it: Rig, command: RorzeCommand[Any]) -> object:
        outcome = await it.plant.line("line1").submit(0x3F, command, lane)
        if isinstance(outcome, Answered):
            return outcome
        assert isinstance(outcome, GatewayError)
        raise outcome

    return submit


WAYS: list[Way] = [lambda it, command: it.body().ask(command), _by_a_group, *map(_by_the_line, Lane)]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("command", [FAR, ENDLESS])
@in_virtual_time
async def test_a_motion_without_a_move_is_not_written(way: Way, command: RorzeCommand[Any]) -> None:
    async with rig() as it:
        with pytest.raises(InvalidRequest, match="has no record of it"):
            await way(it, command)
        assert not [frame for frame in it.wire.frames() if "1+M" in frame]


@in_virtual_time
async def test_another_motion_than_that_of_the_move_is_not_written() -> None:
    async with rig(baud=9600) as it:
        starting = asyncio.create_task(do(it.plant, ME, BODY, FAR))
        await asyncio.sleep(0)
        with pytest.raises((InvalidRequest, BodyBusy)):
            await it.body().ask(MoveClockwise(distance=1))
        await starting
        assert "&3F1+M1" not in it.wire.frames()


@in_virtual_time
async def test_a_stop_that_nobody_would_see_through_is_not_sent() -> None:
    async with rig() as it:
        for ask in (it.body().ask, it.plant.group("80").ask):
            with pytest.raises(InvalidRequest, match="nobody would see to its standstill"):
                await ask(StopDecelerating())


@in_virtual_time
async def test_a_move_without_an_end_needs_its_permission_on_every_way() -> None:
    async with rig(server="") as it:
        for start in (
            lambda: do(it.plant, ME, BODY, ENDLESS),
            lambda: it.plant.moves.start(it.body(), ENDLESS),
            lambda: it.plant.target(BODY).plan(ENDLESS),
        ):
            with pytest.raises(NotAllowed, match="Moves without an end are switched off"):
                await start()
        assert "&3F1+MZ" not in it.wire.frames()
        assert it.plant.moves.log.of(it.body().address) == []


MOTIONS: list[FicsCommand[Any]] = [
    moves.MoveRelative(coordinates=[1.0]),
    jog.StartJog(axis="Z", direction="+"),
    jog.StopJog(axis="Z"),
    stops.StopAllImmediately(),
]


@pytest.mark.parametrize("command", MOTIONS)
@in_virtual_time
async def test_robots_are_not_asked_to_move_or_stop(command: FicsCommand[Any]) -> None:
    async with fics_rig() as it:
        heard = len(it.heard(""))
        for ask in (it.robot.ask, it.robot.ask_all, it.robot.read, it.robot.change):
            with pytest.raises(InvalidRequest, match=r"nothing was sent"):
                await ask(command, 1)
        assert not [text for text in it.heard("")[heard:] if text.startswith(command.wire_name())]


@in_virtual_time
async def test_a_line_writes_no_motion_of_a_robot_that_is_not_proved() -> None:
    async with fics_rig() as it:
        line, command = it.robot.line, moves.MoveRelative(coordinates=[1.0])
        for lane in Lane:
            outcome = await line.submit(line.exchange(command, lane))
            assert isinstance(outcome, InvalidRequest)
        assert not it.heard(command.wire_name())
