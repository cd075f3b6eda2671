"""A toy axis homes, moves, jogs, stops until that is proved, keeps a setting, and raises an alarm."""

import asyncio
from pathlib import Path

import pytest

from gateway.core.move_runs import MoveRun
from protocols.table import Reply
from tests.own_faults import fail_once
from tests.third_family.rows import FRAME, ROWS, Frame, Frames, GetStatus, Go, Status
from tests.third_family.test_third_family import TOY, Bench, on_bench

HERE = Path(__file__).parent
MOST_LINES = 350
"""Lines of the family, without its simulator and its tests."""


def test_the_family_is_small() -> None:
    counted = [
        file for file in HERE.glob("*.py") if file.name != "machine.py" and not file.name.startswith("test_")
    ]
    assert sum(len(file.read_text("utf-8").splitlines()) for file in counted) <= MOST_LINES


def test_only_the_registry_names_it() -> None:
    packages = (HERE.parents[1] / name for name in ("gateway", "api", "app", "protocols", "transports"))
    files = [file for package in packages for file in package.rglob("*.py")]
    assert [file for file in files if "third_family" in file.read_text("utf-8")] == []


@pytest.mark.parametrize("row", ROWS, ids=lambda news: news.name())
def test_a_row_has_a_witness_in_bytes(row: type[GetStatus]) -> None:
    [frame] = row.example
    assert row.of_example().frame(7) == frame
    assert Frames().feed(frame) == [Frame(7, int(row.code, 16), FRAME.unpack_from(frame)[3])]


def test_a_frame_is_found_behind_noise_and_none_is_made_of_a_damaged_one() -> None:
    frame, damaged = Go(place=100).frame(9), bytearray(Go(place=-5).frame(8))
    damaged[7] ^= 1
    found = Frames().feed(b"\xa5\x00noise" + bytes(damaged) + frame)
    assert [frame for frame in found if isinstance(frame, Frame)] == [
        Frame(9, 0x11, Go(place=100).packed() + bytes(12))
    ]


def test_a_reply_has_all_that_an_axis_tells() -> None:
    told = Status(place=-3, speed=7, moves=True, stopped=False, alarm=2, newest=65_535, life=1)
    assert issubclass(Status, Reply)
    assert GetStatus().read_reply(told.packed() + bytes(2)) == told


async def the_move(bench: Bench, path: str, content: object = None) -> dict[str, object]:
    answer = await bench.post(f"{TOY}/commands/{path}", content)
    return dict((await bench.client.get(answer.headers["location"] + "?wait=60")).json())


def now() -> float:
    return asyncio.get_running_loop().time()


@on_bench
async def test_home_comes_before_a_move_to_a_place(bench: Bench) -> None:
    bench.machine.homed = False
    refused = await bench.post(f"{TOY}/commands/go", {"place": 100})
    assert (refused.status_code, refused.json()["type"].rpartition(":")[2]) == (409, "controller-refused")
    assert (await the_move(bench, "home"))["status"] == "succeeded"
    assert (await the_move(bench, "go", {"place": 100}))["status"] == "succeeded"
    assert bench.machine.place(now()) == 100


@on_bench
async def test_a_move_whose_answer_is_lost_is_judged_by_what_the_axis_names_as_its_newest(
    bench: Bench,
) -> None:
    bench.machine.unanswered = "go"
    moving = asyncio.create_task(the_move(bench, "go", {"place": 100}))
    await asyncio.sleep(0.6)
    bench.machine.unanswered = ""
    assert (await moving)["status"] == "succeeded"
    assert bench.machine.heard.count("go") == 1


def test_a_move_that_a_fault_of_our_own_met_as_it_was_written_is_not_told_as_unmoved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    @on_bench
    async def story(bench: Bench) -> None:
        fail_once(monkeypatch, (MoveRun, "sent"))
        move = await the_move(bench, "go", {"place": 100})
        assert move["status"] == "succeeded"
        assert bench.machine.heard.count("go") == 1

    story(monkeypatch)


@on_bench
async def test_a_move_that_is_cut_short_by_a_loss_of_power_is_lost(bench: Bench) -> None:
    moving = asyncio.create_task(the_move(bench, "go", {"place": 9_000}))
    await asyncio.sleep(2.0)
    bench.machine.power(now(), on=False)
    await asyncio.sleep(0.3)
    bench.machine.power(now(), on=True)
    move = await moving
    assert move["status"] == "lost"
    assert "has lost its power" in str(move["error"])


@on_bench
async def test_a_jog_lasts_as_long_as_its_heartbeats(bench: Bench) -> None:
    jog = (await bench.post(f"{TOY}/commands/jog", {"up": True})).json()
    for _ in range(4):
        await asyncio.sleep(0.4)
        kept = await bench.post(f"{TOY}/jogs/{jog['id']}/heartbeat")
        assert (kept.status_code, kept.json()["state"]) == (200, "jogging")
    assert (await bench.post(f"{TOY}/commands/go", {"place": 5})).status_code == 409
    await asyncio.sleep(1.0)
    assert not bench.machine.moves(now())
    over = await bench.post(f"{TOY}/jogs/{jog['id']}/heartbeat")
    assert (over.status_code, over.json()["type"].rpartition(":")[2]) == (409, "jog-over")
    assert [news for news in bench.types() if ".jog." in news] == [
        f"toy.jog.{news}" for news in ("started", "stopping", "lost")
    ]


@on_bench
async def test_a_jog_ends_by_request_and_with_a_stop(bench: Bench) -> None:
    jog = (await bench.post(f"{TOY}/commands/jog", {"up": False})).json()
    await asyncio.sleep(0.2)
    assert (await bench.post(f"{TOY}/jogs/{jog['id']}/stop")).json()["state"] == "ended"
    jog = (await bench.post(f"{TOY}/commands/jog", {"up": True})).json()
    assert (await bench.post("/stop")).json()["confirmed"]
    await asyncio.sleep(0.2)
    assert (await bench.post(f"{TOY}/jogs/{jog['id']}/stop")).json()["state"] == "stopped"


@on_bench
async def test_a_stop_is_repeated_until_standstill_is_proved(bench: Bench) -> None:
    await bench.post(f"{TOY}/commands/go", {"place": 9_000})
    await asyncio.sleep(0.5)
    bench.machine.deaf = True
    stop = (await bench.post(f"{TOY}/stop")).json()["toys"][0]
    assert stop["state"] != "confirmed"
    assert "hardware" in stop["detail"]
    assert bench.machine.moves(now())
    bench.machine.deaf = False
    await asyncio.sleep(3.0)
    assert not bench.machine.moves(now())
    assert bench.types().count("toy.stop.confirmed") == 1
    assert (await bench.post(f"{TOY}/stop")).json()["toys"][0]["state"] == "confirmed"


@on_bench
async def test_a_setting_is_set_read_back_and_kept(bench: Bench) -> None:
    setting = await bench.client.put(f"{TOY}/speed", json={"speed": 50})
    assert (setting.status_code, setting.json()) == (200, {"speed": 50})
    refused = await bench.client.put(f"{TOY}/speed", json={"speed": 1_000})
    assert refused.status_code == 422
    bench.machine.power(now(), on=False)
    bench.machine.power(now(), on=True)
    assert (await bench.client.get(f"{TOY}/speed")).json() == {"speed": 50}


@on_bench
async def test_an_alarm_of_the_axis_is_raised_and_its_move_fails(bench: Bench) -> None:
    moving = asyncio.create_task(the_move(bench, "go", {"place": 9_000}))
    await asyncio.sleep(0.5)
    bench.machine.trip(7, now())
    assert (await moving)["status"] == "failed"
    alarms = (await bench.client.get("/alarms")).json()["alarms"]
    (raised,) = (alarm for alarm in alarms if alarm["cause"] == "toy.alarm")
    assert raised["en"]["happened"] == "An axis tells the alarm 7."
    assert (await bench.post(f"/alarms/{raised['id']}/reset")).status_code == 409
    bench.machine.alarm = 0
    await asyncio.sleep(3.0)
    assert (await bench.post(f"/alarms/{raised['id']}/reset")).status_code == 200


@on_bench
async def test_a_silent_axis_is_told_and_comes_back(bench: Bench) -> None:
    bench.machine.mute = True
    await bench.post(f"{TOY}/commands/get-status")
    await asyncio.sleep(10.0)
    (line,) = (await bench.client.get("/lines")).json()["lines"]
    assert line["state"] == "silent"
    assert (await bench.post(f"{TOY}/commands/go", {"place": 1})).status_code == 503
    bench.machine.mute = False
    await asyncio.sleep(5.0)
    assert (await the_move(bench, "go", {"place": 1}))["status"] == "succeeded"
