"""Bodies and groups: what they are asked, and what is noted of what they answer."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime

import pytest

from gateway.core.errors import BodyBusy, BodyOffline, ControllerRefused, NoReply
from gateway.core.exchange import Lane
from gateway.core.move_record import Move
from gateway.rorze.bodies import Body, Group
from gateway.rorze.knowledge import MotorState
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition, SetEncoderCount, SetPosition, SignedPulses
from protocols.rorze.programs import RunProgram, StepProgram
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetStartSpeed
from protocols.rorze.status import GetControllerStatus
from protocols.table import Ack
from tests.gateway.rorze.far_end import FarEnd, running_line, virtual

MOVE = MoveClockwise(distance=500)


@asynccontextmanager
async def plant(far: FarEnd) -> AsyncIterator[tuple[Group, Body, Body]]:
    async with running_line(far, groups={0x80: [2, 0x3F]}) as line:
        one, other = Body(line, 2), Body(line, 0x3F)
        yield Group(line, 0x80, [one, other]), one, other


@virtual
async def test_a_body_has_a_short_and_a_full_address() -> None:
    async with plant(FarEnd()) as (group, _, other):
        assert (other.short, other.address) == ("3F", "line1.3F")
        assert (group.short, group.address) == ("80", "line1.80")


@virtual
async def test_a_body_is_asked_and_gives_its_typed_reply() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        far.once("&026PD", (0.01, ">&026PD-000000007"))
        reply, answer = await one.ask(GetPosition())
        assert reply == SignedPulses(pulses=-7)
        assert not answer.late


@virtual
async def test_what_the_controller_refuses_is_raised_with_its_code_and_meaning() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        far.once("&021+M500", (0.01, ">&021+M@51"))
        with pytest.raises(ControllerRefused, match=r"line1\.02 refused 1\+M") as caught:
            await one.ask(MOVE)
        assert (caught.value.error_code, caught.value.moved) == ("0x51", "no")
        assert caught.value.remedy


@virtual
async def test_a_silent_body_is_not_online_until_it_is_found_again() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        assert one.online
        far.silent = {2}
        with pytest.raises(NoReply):
            await one.ask(MOVE)
        assert not one.online
        with pytest.raises(BodyOffline) as caught:
            await one.ask(GetPosition())
        assert "応答しません" in caught.value.detail_ja
        assert caught.value.remedy_ja == "電源とケーブルを確認してください。"


@virtual
async def test_a_read_may_be_asked_ahead_of_other_reads() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, other):
        blocking = other.line.submit(0x3F, GetPosition(), Lane.READ)
        waiting = other.line.submit(0x3F, GetPosition(), Lane.READ)
        await one.ask(GetPosition(), lane=Lane.COMMAND)
        await blocking
        await waiting
        assert far.frames == ["&3F6PD", "&026PD", "&3F6PD"]


@virtual
async def test_a_group_gives_one_reply_or_error_for_each_member() -> None:
    far = FarEnd()
    async with plant(far) as (group, one, other):
        far.once("&801+M500", (0.01, ">&801+M@[02:][3F:@51]"))
        results = await group.ask(MOVE)
        assert results[one] == Ack()
        refusal = results[other]
        assert isinstance(refusal, ControllerRefused)
        assert refusal.error_code == "0x51"


@virtual
async def test_nobody_knows_about_a_member_that_the_group_reply_does_not_mention() -> None:
    far = FarEnd()
    async with plant(far) as (group, one, other):
        far.once("&801+M500", (0.01, ">&801+M[3F:]"))
        results = await group.ask(MOVE)
        missing = results[one]
        assert isinstance(missing, NoReply)
        assert missing.moved == "unknown"
        assert "line1.02" in missing.detail
        assert results[other] == Ack()


@virtual
async def test_a_group_without_any_reply_raises() -> None:
    far = FarEnd()
    async with plant(far) as (group, _, _other):
        far.once("&801+M500")
        with pytest.raises(NoReply):
            await group.ask(MOVE)
        assert far.frames == ["&801+M500", "fence 02"]
        far.once("&801+M500", (0.01, ">&801+M@49"))
        with pytest.raises(ControllerRefused):
            await group.ask(MOVE)


# what is noted of what is heard


NEWS = list[tuple[str, dict[str, object]]]


def told_by(body: Body) -> NEWS:
    """The news of a body, from now on."""
    news: NEWS = []
    body.on_news = lambda kind, facts: news.append((kind, facts))
    return news


def a_move(body: Body) -> Move:
    """A move that is not over."""
    return Move(
        id="m1",
        body_id=body.address,
        kind="relative",
        command="1+M",
        frame="&021+M500\\r",
        created_at=datetime.now(UTC),
    )


@virtual
async def test_what_is_heard_for_anybody_is_known_of_the_body() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        news = told_by(one)
        far.once("&026PD", (0.01, ">&026PD-000000007"))
        far.once("&029CD", (0.01, ">&029CDH05"))
        far.once("&029CD0", (0.01, ">&029CD0"))
        await one.ask(GetPosition())
        await one.ask(GetControllerStatus())
        assert (one.told.position, one.told.status_bits, one.moving) == (-7, 5, True)
        await one.ask(GetControllerStatus(bit=0))
        assert (one.moving, one.told.place is not None) == (False, True)
        assert news == [
            ("body.status.changed", {"status": ["pulses_running", "ems_error"]}),
            ("body.motion.foreign", {}),
        ]


@virtual
async def test_a_body_that_was_looked_at_is_known_to_rest_until_it_is_told_something() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        assert await one.where_it_rests() == MotorState(0, 0)
        await one.where_it_rests()
        assert far.frames == ["&029CD", "&026PD"]
        await one.ask(SetStartSpeed(speed=500))
        await one.where_it_rests()
        await asyncio.sleep(1.0)
        await one.where_it_rests()
        assert far.frames == ["&029CD", "&026PD", "&02OLS500", *2 * ["&029CD", "&026PD"]]


@virtual
async def test_a_reading_that_was_asked_for_before_a_command_says_nothing_of_what_is_now() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        far.once("&026PD", (0.01, ">&026PD+000001500"))
        reading = asyncio.create_task(one.ask(GetPosition()))
        await asyncio.sleep(0)
        await one.ask(SetPosition(position=0))
        reply, _ = await reading
        assert reply.pulses == 1500
        assert (one.told.position, one.life.look_due.is_set()) == (None, True)


@virtual
async def test_a_setting_makes_nobody_forget_a_position_but_it_is_asked_again_before_a_move() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        looking = asyncio.create_task(one.poll())
        await asyncio.sleep(0)
        await one.ask(SetStartSpeed(speed=500))
        assert one.told.rest is None
        await looking
        assert (one.told.position, one.moving, one.told.rest) == (0, False, None)


@pytest.mark.parametrize("command", [SetPosition(position=0), SetEncoderCount(count=0)])
@virtual
async def test_the_place_that_proves_a_move_is_not_renamed_under_it(
    command: RorzeCommand[Ack],
) -> None:
    far = FarEnd()
    async with plant(far) as (group, one, _other):
        one.claim(a_move(one))
        for target in (one, group):
            with pytest.raises(BodyBusy, match=rf"has the move m1; {command.code} was not sent"):
                await target.ask(command)
        assert far.frames == []


@virtual
async def test_while_a_body_has_a_move_a_single_status_does_not_say_whether_it_moves() -> None:
    far = FarEnd()
    async with plant(far) as (_, one, _other):
        await one.poll()
        one.claim(a_move(one))
        one.was_set_going(MoveClockwise(distance=1))
        news = told_by(one)
        await one.poll()
        assert one.moving
        far.once("&029CD", (0.01, ">&029CDH03"))
        await one.poll()
        assert news == [("body.status.changed", {"status": ["pulses_running", "limit_error"]})]


@virtual
async def test_a_program_may_move_the_body_it_was_started_on() -> None:
    far = FarEnd()
    async with plant(far) as (group, one, other):
        await one.poll()
        await other.poll()
        for body in (one, other):
            body.life.look_due.clear()
        await one.ask(RunProgram())
        assert (one.moving, one.told.rest, one.life.look_due.is_set()) == (None, None, True)
        assert (other.moving, other.life.look_due.is_set()) == (False, False)
        far.once("&80USG", (0.01, ">&80USG[02:][3F:]"))
        await group.ask(StepProgram())
        assert (other.moving, other.life.look_due.is_set()) == (None, True)


@virtual
async def test_what_moved_when_it_fell_silent_counts_as_moving_and_what_stood_may_move() -> None:
    async with plant(FarEnd()) as (_, one, other):
        await one.poll()
        other.was_set_going(MoveClockwise(distance=1))
        for body in (one, other):
            body.fell_silent()
        assert [body.moving for body in (one, other)] == [None, True]
        assert [body.life.was_silent for body in (one, other)] == [True, True]
        assert (one.told.rest, other.told.rest) == (None, None)


@virtual
async def test_a_group_knows_what_its_members_have_told() -> None:
    far = FarEnd()
    async with plant(far) as (group, one, other):
        far.once("&809CD", (0.01, ">&809CD[02:H00][3F:H04]"))
        await group.ask(GetControllerStatus())
        assert [(body.moving, body.told.status_bits) for body in (one, other)] == [(False, 0), (False, 4)]


@virtual
async def test_a_group_tells_who_else_has_obeyed_it() -> None:
    far = FarEnd()
    async with plant(far) as (group, one, other):
        strangers: list[set[int]] = []
        group.on_strangers = strangers.append
        far.once("&801+M500", (0.01, ">&801+M[02:][3F:][05:]"))
        assert await group.ask(MOVE) == {one: Ack(), other: Ack()}
        assert strangers == [{5}]


@virtual
async def test_a_group_that_is_not_in_force_is_sent_nothing() -> None:
    far = FarEnd()
    async with plant(far) as (group, _one, _other):
        group.in_force = False
        with pytest.raises(BodyBusy, match=r"line1\.80 is being defined anew; nothing was sent"):
            await group.ask(MOVE)
        assert far.frames == []
