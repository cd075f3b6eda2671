"""The watch over a body: how soon a loss of power is told, and how much of the line that may take."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.rorze.probes import HEALTH_POLL_S, IDLE_POLL_S, MARK_POLL_S, is_prompt
from protocols.rorze.position import GetPosition
from simulator.faults import Direction
from tests.gateway.rorze.test_body_power import brown_out, now
from tests.plants import Rig, in_virtual_time, lose, rig

TOLD_S = 2.0


def cut(rig: Rig, number: int) -> None:
    rig.machine.switch_body(number, on=False, now=now())
    rig.wire.turn()


@pytest.mark.parametrize("moment_s", [0.0, 0.13, 0.31, 0.47, 0.58])
@in_virtual_time
async def test_an_idle_body_without_power_is_told_offline_within_two_seconds(moment_s: float) -> None:
    async with rig(bodies=range(8), groups={}, baud=9600) as it:
        await asyncio.sleep(15.0 + moment_s)
        cut(it, 5)
        cut_at = now()
        offline = it.plant.events.subscribe(types=["body.offline"])
        event = await anext(offline)
        assert event.subject == "/bodies/line1.05"
        assert now() - cut_at < TOLD_S
        assert not it.body("05").online


@in_virtual_time
async def test_two_lost_frames_on_a_bad_line_do_not_make_a_body_offline() -> None:
    async with rig() as it:
        it.plant.line("line1")._session.last_error_at = now()
        lose(it, Direction.REPLIES, frames=2)
        await it.body().ask(GetPosition())
        await asyncio.sleep(3.0)
        assert it.types("body.offline") == []


@in_virtual_time
async def test_a_body_that_was_told_offline_too_soon_is_online_as_soon_as_it_answers() -> None:
    async with rig() as it:
        await asyncio.sleep(15.0)
        lose(it, Direction.REPLIES, frames=2)
        await it.body().ask(GetPosition())
        assert it.types("body.o") == ["body.offline", "body.online"]
        assert it.body().online


@in_virtual_time
async def test_a_body_that_others_move_when_the_line_is_back_is_not_asked_flat_out() -> None:
    async with rig(baud=9600, body_options="power_comment = 0") as it:
        await asyncio.sleep(15.0)
        it.wire.unplug()
        it.axis().execute("1+MZ", now())
        it.wire.plugged_in = True
        await asyncio.sleep(5.0)
        sent = len(it.wire.sent)
        await asyncio.sleep(10.0)
        assert it.body().moving
        assert len(it.wire.sent) - sent < 3 * 10.0 / IDLE_POLL_S * 2


@in_virtual_time
async def test_a_body_that_was_told_offline_when_the_port_went_is_found_again() -> None:
    async with rig() as it:
        await asyncio.sleep(15.0)
        cut(it, 0x3F)
        await anext(it.plant.events.subscribe(types=["body.offline"]))
        it.wire.unplug()
        it.machine.switch_body(0x3F, on=True, now=now())
        it.wire.plugged_in = True
        await asyncio.sleep(10.0)
        assert it.types("body.o") == ["body.offline", "body.online"]
        assert it.body().online


def line_of(bodies: int, baud: int | None, offline: int = 0) -> Any:
    """As much of a line as the interval depends on."""
    byte_time_s = 10 / baud if baud else 0.0
    return SimpleNamespace(bodies=range(bodies), offline=set(range(offline)), byte_time_s=byte_time_s)


@pytest.mark.parametrize(
    ("bodies", "baud", "prompt"),
    [
        (8, 9600, True),
        (9, 9600, False),
        (39, 115_200, True),
        (40, 115_200, False),
        (8, None, True),
        (120, None, False),
    ],
)
def test_a_line_of_few_bodies_is_asked_promptly(bodies: int, baud: int | None, prompt: bool) -> None:
    assert is_prompt(line_of(bodies, baud)) is prompt
    assert is_prompt(line_of(bodies, baud, offline=bodies))


@in_virtual_time
async def test_a_line_without_time_is_asked_no_more_than_the_health_poll_asks() -> None:
    async with rig(bodies=range(70), groups={}, baud=9600) as it:
        await asyncio.sleep(MARK_POLL_S)
        sent = len(it.wire.sent)
        await asyncio.sleep(2 * HEALTH_POLL_S)
        frames = it.wire.frames(sent)
        assert frames.count("&009CD") <= 2
        assert frames.count("&009CD") == frames.count("&006PD")


@in_virtual_time
async def test_who_is_heard_anyway_is_not_asked_in_between() -> None:
    async with rig() as it:
        await asyncio.sleep(HEALTH_POLL_S)
        sent = len(it.wire.sent)
        for _ in range(40):
            await it.body().ask(GetPosition())
            await asyncio.sleep(0.1)
        assert it.wire.frames(sent).count("&3F9CD") <= 1
        assert it.wire.frames(sent).count("&009CD") > 4


@in_virtual_time
async def test_a_line_with_a_stop_that_is_not_confirmed_belongs_to_the_stop() -> None:
    async with rig() as it:
        cut(it, 0x3F)
        await it.plant.stops.stop([it.body()], "immediate")
        sent = len(it.wire.sent)
        await asyncio.sleep(HEALTH_POLL_S)
        assert it.wire.frames(sent).count("&009CD") <= 2


@in_virtual_time
async def test_a_loss_of_power_too_short_to_be_silent_is_found_in_the_background() -> None:
    async with rig() as it:
        brown_out(it)
        await asyncio.sleep(MARK_POLL_S + 1.0)
        assert it.types("body.o") == []
        assert it.types("body.power_cycled") == ["body.power_cycled"]
