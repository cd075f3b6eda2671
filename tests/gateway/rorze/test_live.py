"""Live values of bodies: read while there is a watcher, in a share of the line's time behind all others."""

import asyncio
from collections import Counter

from protocols.rorze.inputs_outputs import SetOutputs
from protocols.rorze.modes import SetOperatingMode
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.speeds import SetMaximumAcceleration, SetMaximumSpeed, SetStartSpeed
from tests.gateway.rorze.full_line import SWEEP_GROUPS, full_line
from tests.plants import in_virtual_time, rig, start
from tests.watching import watching

LIVE = "body.position"


@in_virtual_time
async def test_the_position_of_a_moving_body_comes_as_often_as_asked_for() -> None:
    async with rig(body_options='units = {unit = "mm", pulses_per_unit = 1000.0}') as running:
        await start(running, MoveClockwise(distance=400_000))
        async with watching(running.plant.events, bodies=["3F"], sample=10) as watcher:
            await asyncio.sleep(10)
        places = [it["data"] for it in watcher.of()]
        assert 97 <= len(places) <= 101
        assert {it["unit"] for it in places} == {"mm"}
        assert all(it["value"] == it["pulses"] / 1000 for it in places)
        way = [it["pulses"] for it in places]
        assert way == sorted(way)
        assert len(set(way)) > 90


@in_virtual_time
async def test_what_positions_are_counted_in_is_read_once() -> None:
    async with rig() as running:
        await running.body().ask(SetOperatingMode(mode="encoder"))
        sent = len(running.wire.sent)
        async with watching(running.plant.events, types=[LIVE], sample=10) as watcher:
            await asyncio.sleep(2)
        for number, counted in (("00", "pulses"), ("01", "pulses"), ("3F", "encoder_counts")):
            told = watcher.of(subject=f"/bodies/line1.{number}")
            assert {it["data"]["counted_in"] for it in told} == {counted}
        asked = Counter(it for it in running.wire.frames(sent) if it.endswith("EAD"))
        assert asked == {"&00EAD": 1, "&01EAD": 1, "&3FEAD": 1}


@in_virtual_time
async def test_nothing_is_asked_while_nobody_watches() -> None:
    async with rig() as running:
        async with watching(running.plant.events, bodies=["3F"], sample=10, types=["body.position"]):
            await asyncio.sleep(1)
        sent = len(running.wire.sent)
        await asyncio.sleep(0.4)
        assert not [frame for frame in running.wire.frames(sent) if frame.endswith("6PD")]
        assert "live" in running.plant.line("line1").load_percent()
        await asyncio.sleep(11)
        assert "live" not in running.plant.line("line1").load_percent()


@in_virtual_time
async def test_many_who_watch_cost_no_more_than_the_one_who_wants_most() -> None:
    async with rig() as running:
        async with (
            watching(running.plant.events, bodies=["3F"], types=[LIVE], sample=10) as one,
            watching(running.plant.events, bodies=["3F"], types=[LIVE], sample=10),
            watching(running.plant.events, types=[LIVE], sample=2) as slow,
        ):
            sent = len(running.wire.sent)
            await asyncio.sleep(10)
            asked = Counter(it for it in running.wire.frames(sent) if it.endswith("6PD"))
        assert 97 <= len(one.of()) <= 101
        assert asked["&3F6PD"] <= 105
        assert 19 <= len(slow.of()) <= 21
        assert 19 <= len(slow.of(subject="/bodies/line1.00")) <= 21
        assert asked["&006PD"] <= 25


@in_virtual_time
async def test_what_is_asked_anyway_is_not_asked_again() -> None:
    async with rig() as running:
        await start(running, MoveClockwise(distance=400_000))
        asked = []
        for hz in (None, 2.0):
            sent = len(running.wire.sent)
            async with watching(running.plant.events, bodies=["3F"], types=[LIVE], sample=hz) as watcher:
                await asyncio.sleep(4)
            asked.append(running.wire.frames(sent).count("&3F6PD"))
        assert asked[0] == asked[1]
        assert 7 <= len({it["data"]["pulses"] for it in watcher.of()}) <= 9


@in_virtual_time
async def test_inputs_and_outputs_come_twice_a_second_at_most() -> None:
    async with rig(body_options='outputs = {3 = "brake"}') as running:
        await running.body().ask(SetOutputs(bits=0x0008))
        async with watching(running.plant.events, bodies=["3F"], types=["io"], sample=10) as watcher:
            await asyncio.sleep(10)
        signals = [it["data"] for it in watcher.of("io")]
        assert 19 <= len(signals) <= 21
        assert [it["number"] for it in signals[0]["inputs"]] == list(range(10))
        assert [it["number"] for it in signals[0]["outputs"]] == list(range(16))
        [on] = [it for it in signals[0]["outputs"] if it["on"]]
        assert (on["number"], on["name"]) == (3, "brake")


@in_virtual_time
async def test_live_values_take_their_share_of_a_slow_line_and_no_more() -> None:
    async with rig(baud=9600, options="live_share = 0.2") as running:
        async with watching(running.plant.events, types=[LIVE], sample=50) as watcher:
            await asyncio.sleep(12)
            load = running.plant.line("line1").load_percent()
        assert 18 <= load["live"] <= 20.5
        counts = [len(watcher.of(subject=f"/bodies/line1.{it}")) for it in ("00", "01", "3F")]
        assert min(counts) > 20
        assert max(counts) - min(counts) <= 1


@in_virtual_time
async def test_clients_go_first() -> None:
    async with rig(baud=9600, options="live_share = 1.0") as running:
        body = running.body("00")
        async with watching(running.plant.events, types=[LIVE], sample=50):
            for _ in range(40):
                began = asyncio.get_running_loop().time()
                await body.poll()
                # two exchanges, each behind one that is on the wire already
                assert asyncio.get_running_loop().time() - began < 0.12
                await asyncio.sleep(0.013)


@in_virtual_time
async def test_a_body_that_is_silent_does_not_keep_the_others_waiting() -> None:
    async with rig(present=(0x00, 0x3F)) as running:
        async with watching(running.plant.events, types=[LIVE], sample=10) as watcher:
            await asyncio.sleep(10)
        assert not watcher.of(subject="/bodies/line1.01")
        assert len(watcher.of()) > 85


@in_virtual_time
async def test_values_begin_again_with_the_line() -> None:
    async with rig() as running:
        async with watching(running.plant.events, types=[LIVE], sample=10) as watcher:
            await asyncio.sleep(1)
            running.wire.unplug()
            await asyncio.sleep(5)
            gone = len(watcher.of())
            running.wire.plugged_in = True
            await asyncio.sleep(15)
        assert gone <= 12
        assert len(watcher.of()) > gone + 50


@in_virtual_time
async def test_a_full_line_is_asked_in_groups() -> None:
    async with full_line() as running:
        async with watching(running.plant.events, types=[LIVE], sample=5) as watcher:
            sent = len(running.wire.sent)
            await asyncio.sleep(30)
            frames = running.wire.frames(sent)
        assert sum(it.endswith("6PD") and it[1] == "9" for it in frames) > 40
        counts = Counter(it["subject"] for write in watcher.writes for it in write)
        assert len(counts) == 120
        assert min(counts.values()) >= 5
        assert max(counts.values()) - min(counts.values()) <= 2


@in_virtual_time
async def test_moves_end_as_they_should_while_they_are_watched() -> None:
    async with rig(baud=9600) as running:
        body = running.body()
        for command in (SetStartSpeed(speed=1000), SetMaximumSpeed(speed=20_000)):
            await body.ask(command)
        await body.ask(SetMaximumAcceleration(acceleration=100_000))
        async with watching(running.plant.events, types=[LIVE], sample=50) as watcher:
            move = await start(running, MoveClockwise(distance=20_000))
            over = await running.plant.moves.wait(move.id, 10)
            assert over.status == "succeeded"
            await asyncio.sleep(0.5)
        assert watcher.of()[-1]["data"]["pulses"] == 20_000


@in_virtual_time
async def test_a_stop_is_as_fast_as_ever() -> None:
    async with full_line("live_share = 1.0\n" + SWEEP_GROUPS) as running:
        body = running.body("3F")
        async with watching(running.plant.events, types=[LIVE], sample=50):
            for _ in range(20):
                await asyncio.sleep(1.003)
                asked_at, sent = asyncio.get_running_loop().time(), len(running.wire.sent)
                stopping = asyncio.ensure_future(running.plant.stops.stop([body], "immediate"))
                await asyncio.sleep(0.05)
                first = next(it for it in running.wire.sent[sent:] if it.frame == "&3F5IS")
                # at the end of the frame that is being written
                assert first.at - asked_at < 0.01
                await stopping
