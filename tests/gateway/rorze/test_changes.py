"""Changes of settings over a line that loses frames, and amid stops: what is told is what is so."""

import asyncio

import pytest

from simulator.faults import Direction, Fault, Switch
from tests.api.bodies.test_info import brown_out
from tests.api.bodies.test_speed_sets import set_by
from tests.api.stand import Stand, on_stand

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
