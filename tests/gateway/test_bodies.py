from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from gateway.bodies import Body, Group
from gateway.errors import BodyOffline, ControllerRefused, NoReply
from gateway.exchange import Lane
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition, SignedPulses
from protocols.table import Ack
from tests.gateway.far_end import FarEnd, running_line, virtual

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
        assert (caught.value.error, caught.value.moved) == (0x51, "no")
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
        with pytest.raises(BodyOffline):
            await one.ask(GetPosition())


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
        assert refusal.error == 0x51


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
