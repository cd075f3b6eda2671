"""Changes of settings over a line that loses frames, and amid stops: what is told is what is so."""

import asyncio
from random import Random
from typing import Final

import pytest

from gateway.rorze.errors import PartlyDone
from gateway.rorze.settings import change_settings, read_settings
from gateway.rorze.settings_table import BodySettingsChange
from protocols.rorze.position import GetPosition
from simulator.faults import Direction, Fault, Switch
from tests.api.bodies.test_homing import axis_of
from tests.api.bodies.test_info import brown_out
from tests.api.bodies.test_speed_sets import set_by
from tests.api.stand import Stand, on_stand
from tests.plants import in_virtual_time, rig

STANDARD = "/bodies/3F/speed-sets/30"
WANTED = {"start_speed_pps": 100, "maximum_speed_pps": 20_000, "acceleration_pps_s": 50_000}


def lose_one(stand: Stand, direction: Direction) -> None:
    """Lose the second frame from now: the question passes, the setting does not."""
    stand.port.machine.faults.set(Switch(Fault.LOST, direction, next_frames=1, pass_frames=1))


@pytest.mark.parametrize(("lost", "sent"), [(Direction.REPLIES, 1), (Direction.REQUESTS, 2)])
def test_a_setting_whose_reply_is_lost_is_read_back_and_sent_again_only_if_it_was_not_done(
    lost: Direction, sent: int
) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        lose_one(stand, lost)
        answer = await stand.client.patch(STANDARD, json={"maximum_speed_pps": 20_000})
        assert (answer.status_code, answer.json()["maximum_speed_pps"]) == (200, 20_000), answer.text
        assert set_by(stand.frames()) == ["OHS20000"] * sent

    story()


@pytest.mark.parametrize("lost", [Direction.REPLIES, Direction.REQUESTS])
def test_zero_percent_that_reads_so_whether_it_was_set_or_not_is_sent_until_it_is_taken(
    lost: Direction,
) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        lose_one(stand, lost)
        answer = await stand.client.patch("/bodies/3F/speed-sets/9", json={"rising_percent": 0})
        assert answer.status_code == 200, answer.text
        assert set_by(stand.frames()) == ["OASS[9],0"] * 2

    story()


@on_stand()
async def test_a_change_that_is_broken_off_tells_what_was_done_and_what_was_not(stand: Stand) -> None:
    change = asyncio.create_task(stand.client.patch(STANDARD, json=WANTED))
    while not set_by(stand.frames())[1:]:  # noqa: ASYNC110  # no event tells it
        await asyncio.sleep(0)
    stand.port.machine.faults.set(Switch(Fault.LOST, Direction.REPLIES, probability=1.0))
    problem = (await change).json()
    assert problem["type"].endswith(":partly-done")
    assert "arm.3F took OLS100; then OHS20000 was not done" in problem["detail"]
    assert "OSS50000 was not sent." in problem["detail"]
    assert problem["moved"] == "no"


@on_stand()
async def test_a_stop_comes_between_two_settings_and_ends_the_change(stand: Stand) -> None:
    change = asyncio.create_task(stand.client.patch(STANDARD, json=WANTED))
    while not set_by(stand.frames()):  # noqa: ASYNC110  # no event tells it
        await asyncio.sleep(0)
    assert (await stand.post("/bodies/3F/stop")).status_code == 200
    problem = (await change).json()
    assert problem["status"] == 409
    assert "OSS50000" not in set_by(stand.frames())


@on_stand()
async def test_two_changes_do_not_mix(stand: Stand) -> None:
    one = stand.client.patch(STANDARD, json=WANTED)
    other = stand.client.patch(STANDARD, json={"start_speed_pps": 200, "maximum_speed_pps": 30_000})
    await asyncio.gather(one, other)
    frames = set_by(stand.frames())
    assert abs(frames.index("OLS200") - frames.index("OHS30000")) == 1
    assert frames.index("OSS50000") - frames.index("OLS100") == 2


@on_stand()
async def test_what_power_on_has_loaded_is_what_flash_memory_holds(stand: Stand) -> None:
    await stand.client.patch(STANDARD, json={"maximum_speed_pps": 20_000})
    await asyncio.sleep(40)  # until the mark by which a loss of power is certain stands
    brown_out(stand)
    await asyncio.sleep(40)
    found = (await stand.get(STANDARD)).json()
    assert (found["maximum_speed_pps"], found["flash"]["maximum_speed_pps"]) == (50_000, 50_000)


BROKEN: Final = (Fault.LOST, Fault.GARBLED, Fault.DOUBLED, Fault.LATE, Fault.MERGED)


@pytest.mark.parametrize("seed", range(24))
def test_over_a_line_with_faults_nothing_is_called_changed_that_is_not(seed: int) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        dice = Random(seed)
        for direction in Direction:
            fault = dice.choice(BROKEN)
            stand.port.machine.faults.set(Switch(fault, direction, probability=dice.uniform(0.02, 0.3)))
        wanted = {"origin_offset": 4_321, "homing_retries": 7, "input_logic": {"d3": "normally_closed"}}
        wanted |= {"stall_sensor_interval": 321, "noise_filters": {"d1": 5}, "start_speed_pps": 77}
        answer = await stand.client.patch("/bodies/3F/settings", json=wanted)
        held = axis_of(stand).settings
        truth = {
            "0SS4321": held.origin_offset == 4_321,
            "0RS7": held.search_retries == 7,
            "DIS3,1": held.input_logic == 1 << 3,
            "QIS321": held.stall_interval == 321,
            "DCS1,5": held.noise_counts[1] == 5,
            "OLS77": held.speeds[30].low == 77,
        }
        told = answer.json()
        if answer.status_code == 200:
            assert all(truth.values()), (truth, told)
        elif told["type"].endswith(":partly-done"):
            done = told["detail"].partition(" took ")[2].partition(";")[0].split(", ")
            assert done
            assert all(truth[command] for command in done), (truth, told)
        else:
            assert answer.status_code in (409, 422, 503), (
                told
            )  # a garbled command may be refused for its form

    story()


@on_stand()
async def test_what_clears_something_else_is_never_sent_twice(stand: Stand) -> None:
    wanted = {"interrupt_edges": {"8": "rising"}}
    change = asyncio.create_task(stand.client.patch("/bodies/3F/settings", json=wanted))
    while "&3FCPD8" not in stand.frames():  # noqa: ASYNC110  # no event tells it
        await asyncio.sleep(0)
    lose_one(stand, Direction.REQUESTS)
    problem = (await change).json()
    assert problem["type"].endswith(":no-reply")
    assert set_by(stand.frames()) == ["CPS8,2"]


ALL_INPUTS: Final = {f"d{number}": "normally_closed" for number in range(10)}
MANY: Final = {"input_logic": ALL_INPUTS, "noise_filters": {f"d{number}": 7 for number in range(8)}}


@in_virtual_time
async def test_beside_a_long_change_at_9600_baud_reads_and_a_stop_get_through() -> None:
    async with rig(baud=9600) as it:
        body, loop = it.body(), asyncio.get_running_loop()
        wanted = BodySettingsChange.model_validate(MANY)
        change = asyncio.create_task(change_settings(body, wanted, read_settings, None, flash=False))
        waits: list[float] = []
        while len(waits) < 20:
            asked_at = loop.time()
            await body.ask(GetPosition())
            waits.append(loop.time() - asked_at)
        assert not change.done()
        assert max(waits) < 0.25
        stopped_at = loop.time()
        await it.plant.stops.stop([body], "immediate")
        sent = next(frame for frame in it.wire.sent if frame.at >= stopped_at and "5IS" in frame.frame)
        assert sent.at - stopped_at < 0.05
        with pytest.raises(PartlyDone, match="DIS0,1"):
            await change
