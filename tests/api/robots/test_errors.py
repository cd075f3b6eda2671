"""What is wrong with a robot is told as what it is, in both languages, and when that was looked at."""

import asyncio

import pytest

from simulator.fics.alarms import driver_error, system_error
from simulator.fics.axes import Sensor
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell

JAPANESE = {"Accept-Language": "ja"}


@pytest.mark.parametrize("mode", [2, 3])
def test_a_driver_alarm_names_its_axis_and_its_code(mode: int) -> None:
    @in_cell(mode=mode)
    async def story(cell: Cell) -> None:
        alarm = driver_error(2, "Z", 0x41, Sensor.PLUS_LIMIT)
        cell.rig.touch(lambda fics, now: fics.raise_alarm(alarm, now))
        (error,) = (await cell.get("/robots/r1/errors?fresh=true")).json()["errors"]
        told = (error["kind"], error["unit"], error["axis"], error["driver_error"])
        assert told == ("driver", 2, "Z", 0x41)
        assert error["en"].startswith("The driver of axis Z of unit 2 reports error 41")
        assert error["ja"].startswith("ユニット2のZ軸のドライバでエラー 41")
        (event,) = cell.rig.events("robot.error")
        assert (event.data["en"], event.data["ja"]) == (error["en"], error["ja"])

    story()


@in_cell()
async def test_a_program_that_stopped_is_told_with_its_step_and_forbids_motion_in_both_languages(
    cell: Cell,
) -> None:
    cell.rig.touch(lambda fics, now: fics.raise_alarm(system_error(205, 12, 34), now))
    (error,) = (await cell.get("/robots/r1/errors?fresh=true")).json()["errors"]
    assert (error["code"], error["program"], error["step"]) == ("205", 12, 34)
    english = (await cell.post(f"{UNIT}/moves", HOME)).json()
    assert english["type"].endswith(":error-stands")
    assert "program 12, step 34" in english["detail"]
    answer = await cell.post(f"{UNIT}/moves", HOME, **JAPANESE)
    japanese = answer.json()
    assert (answer.status_code, japanese["code"]) == (409, "205")
    assert "プログラム 12、ステップ 34" in japanese["detail"]
    assert answer.headers["Content-Language"] == "ja"


@in_cell()
async def test_the_errors_say_when_the_robot_was_asked_last(cell: Cell) -> None:
    before = (await cell.get("/robots/r1/errors")).json()["looked_at"]
    asked = len(cell.rig.heard("ERR"))
    assert (await cell.get("/robots/r1/errors")).json()["looked_at"] == before
    assert len(cell.rig.heard("ERR")) == asked
    await asyncio.sleep(1)
    assert (await cell.get("/robots/r1/errors?fresh=true")).json()["looked_at"] > before
    assert len(cell.rig.heard("ERR")) == asked + 1
