"""Stops on a line without answers: one alarm for all of them, and none is lost."""

import asyncio
import re
from collections import Counter

import pytest

from gateway.core.alarms import AlarmLasts
from protocols.rorze.moves import MoveClockwise
from tests.gateway.rorze.full_line import full_line
from tests.gateway.rorze.test_body_power import now
from tests.plants import Rig, in_virtual_time, rig, start

EVERYTHING = re.compile(rb"[^\r]*\r")
FIVE = range(5)


def causes(it: Rig) -> Counter[str]:
    return Counter(alarm.cause for alarm in it.plant.alarms.standing())


async def fall_silent(it: Rig, after_s: float) -> None:
    await asyncio.sleep(after_s)
    it.wire.deaf_to = EVERYTHING


@pytest.mark.parametrize("after_s", [0.0, 0.5, 1.0])
def test_where_a_whole_line_falls_silent_amid_a_stop_of_all_one_alarm_tells_their_number(
    after_s: float,
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with full_line() as it:
            asked_at = now()
            cut = asyncio.create_task(fall_silent(it, after_s))
            reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
            assert now() - asked_at < after_s + 3.5
            assert "confirmed" not in {report.state for report in reports}
            assert all("use the hardware stop" in (report.detail or "") for report in reports)
            told = causes(it)
            assert told["line.stops.unconfirmed"] == 1
            assert told.total() <= 2, "one stop may have been late before"
            alarm = it.plant.alarms.standing()[0]
            assert alarm.subject == "/lines/line1"
            assert "stops of 120 bodies are not confirmed" in alarm.en.happened
            assert it.types("body.stop.unconfirmed") == 120 * ["body.stop.unconfirmed"]
            with pytest.raises(AlarmLasts):
                it.plant.alarms.reset(alarm.id)
            await cut

    story()


@in_virtual_time
async def test_the_alarm_ends_with_the_last_stop_and_nobody_else_is_alarmed() -> None:
    async with full_line() as it:
        it.wire.deaf_to = EVERYTHING
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        it.wire.deaf_to = None
        await it.plant.stops.confirmed()
        await asyncio.sleep(1.0)
        [alarm] = it.plant.alarms.standing()
        assert (alarm.cause, alarm.ended_at is None) == ("line.stops.unconfirmed", False)


@in_virtual_time
async def test_a_stop_that_is_not_confirmed_when_the_line_answers_again_is_an_alarm_of_its_body() -> None:
    async with rig(bodies=FIVE, groups={}, baud=9600) as it:
        it.wire.deaf_to = EVERYTHING
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert causes(it) == {"line.stops.unconfirmed": 1}
        it.machine.switch_body(3, on=False, now=now())
        it.wire.deaf_to = None
        await asyncio.sleep(20.0)
        alarms = {alarm.cause: alarm for alarm in it.plant.alarms.standing()}
        assert alarms["body.stop.unconfirmed"].subject == "/bodies/line1.03"
        assert alarms["body.stop.unconfirmed"].ended_at is None
        assert alarms["line.stops.unconfirmed"].ended_at is not None


@in_virtual_time
async def test_a_body_that_is_silent_alone_is_an_alarm_of_its_own() -> None:
    async with full_line() as it:
        it.machine.switch_body(3, on=False, now=now())
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        [alarm] = [it for it in it.plant.alarms.standing() if it.cause != "body.offline"]
        assert (alarm.cause, alarm.subject) == ("body.stop.unconfirmed", "/bodies/line1.03")


@pytest.mark.parametrize("after_s", [0.05, 1.0])
@pytest.mark.parametrize("stop_mode", ["interject", "after_reply"])
@in_virtual_time
async def test_three_that_die_on_one_fuse_are_alarms_of_their_own_while_others_live(
    stop_mode: str, after_s: float
) -> None:
    async with rig(bodies=FIVE, groups={}, baud=9600, options=f'stop_mode = "{stop_mode}"') as it:
        for body in it.plant.bodies():
            await start(it, MoveClockwise(distance="endless"), body.address)
        await asyncio.sleep(0.5)
        stopping = it.plant.stops.stop(it.plant.bodies(), "immediate")
        await asyncio.sleep(after_s)
        for number in (2, 3, 4):
            it.machine.switch_body(number, on=False, now=now())
        await stopping
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        await asyncio.sleep(20.0)
        assert causes(it)["line.stops.unconfirmed"] == 0
        alarms = [one for one in it.plant.alarms.standing() if one.cause == "body.stop.unconfirmed"]
        assert {one.subject for one in alarms if one.ended_at is None} == {
            f"/bodies/line1.0{number}" for number in (2, 3, 4)
        }


@in_virtual_time
async def test_a_line_on_which_nobody_was_ever_heard_is_silent_since_the_first_stop() -> None:
    async with rig(bodies=FIVE, present=[], groups={}, beginning=True) as it:
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        [told] = it.events("line.stops.unconfirmed")
        assert (told.data["silent_s"], told.data["stops"]) == (2.0, len(FIVE))


@in_virtual_time
async def test_a_line_of_two_bodies_has_an_alarm_for_each() -> None:
    async with rig(bodies=range(2), groups={}) as it:
        it.wire.deaf_to = EVERYTHING
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert causes(it)["body.stop.unconfirmed"] == 2


@in_virtual_time
async def test_where_alarms_latch_each_body_has_its_own() -> None:
    async with rig(bodies=FIVE, groups={}, server="latch = true") as it:
        it.wire.deaf_to = EVERYTHING
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert causes(it)["body.stop.unconfirmed"] == len(FIVE)


@in_virtual_time
async def test_of_a_silent_line_only_those_who_were_asked_are_alarms_until_the_line_is_one() -> None:
    async with full_line("") as it:
        await start(it, MoveClockwise(distance=500_000), "00")
        it.wire.deaf_to = EVERYTHING
        await asyncio.sleep(30.0)
        told = causes(it)
        assert told["line.down"] == 1
        assert told["body.offline"] <= 3
        assert len(it.types("body.offline")) == 120
