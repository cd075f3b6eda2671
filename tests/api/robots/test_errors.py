"""Errors of a robot, told by name in both languages, with the time at which they were read."""

import asyncio

import pytest

from protocols.fics.status import MotionMode
from simulator.fics.alarms import driver_error, system_error
from simulator.fics.axes import Sensor
from simulator.fics.robot import Robot as SimulatedRobot
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm

JAPANESE = {"Accept-Language": "ja"}


@pytest.mark.parametrize("mode", [2, 3])
def test_a_driver_alarm_names_its_axis_and_its_code(mode: int) -> None:
    @in_cell(mode=mode)
    async def story(cell: Cell) -> None:
        alarm = driver_error(2, "Z", 0x41, Sensor.PLUS_LIMIT)
        cell.rig.touch(lambda fics, now: fics.raise_alarm(alarm, now))
        (error,) = (await cell.get("/robots/r1/errors?fresh=true")).json()["errors"]
        told = (error["kind"], error["unit"], error["axis"], error["driver_error"])
        assert told == ("driver", 2, "Z", "41h")
        assert error["en"].startswith("The driver of axis Z of unit 2 reports error 41h")
        assert error["ja"].startswith("ユニット2のZ軸のドライバでエラー 41h")
        (event,) = cell.rig.events("robot.error")
        assert (event.data["en"], event.data["ja"]) == (error["en"], error["ja"])

    story()


@in_cell()
async def test_one_error_of_a_driver_has_one_number_wherever_it_is_told(cell: Cell) -> None:
    def jam(fics: SimulatedRobot, now: float) -> None:
        fics.units[1].motors[0].driver_error = 0x31
        fics.raise_alarm(driver_error(1, "A", 0x31), now)

    cell.rig.touch(jam)
    (error,) = (await cell.get("/robots/r1/errors?fresh=true")).json()["errors"]
    status = (await cell.get(f"{UNIT}/status")).json()
    asked = (await cell.post(f"{UNIT}/commands/get-axis-status")).json()
    detail = (await cell.post("/robots/r1/commands/get-error-detail")).json()
    assert "reports error 31h." in error["en"]
    assert (error["driver_error"], status["axes"]["A"]["driver_error"]) == ("31h", "31h")
    assert [axis["driver_error"] for axis in asked["axes"]] == ["31h", "00h", "00h"]
    assert detail["driver_error"] == "31h"


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


BUSY = ("terminal", MotionMode.MACRO)
EDITING = ("editing", True)
UNIT_2 = "/robots/r1/units/2"
FORBIDDEN: list[tuple[str, str, object, str]] = [
    ("POST", f"{UNIT_2}/moves", HOME, "ORG"),
    ("POST", "/robots/r1/jogs", {"unit": 2, "axis": "X", "direction": "+"}, "JOG"),
    ("POST", "/robots/r1/macros/PCK/runs", {"unit": 2}, "PCK"),
    ("PATCH", f"{UNIT_2}/settings", {"speed_percent": {"X": 50}}, "VAO"),
    ("PUT", f"{UNIT_2}/positions", {"positions": [{"number": 1, "axes": mm(X=1, Y=1, Z=1)}]}, "POF"),
    ("PUT", f"{UNIT_2}/positions", {"positions": [{"number": 1}]}, "POF"),
    ("POST", f"{UNIT_2}/commands/clear-positions", {"first": 1}, "PCL"),
]


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize(("state", "value"), [BUSY, EDITING], ids=["busy", "editing"])
@pytest.mark.parametrize(("method", "path", "content", "command"), FORBIDDEN)
def test_where_the_terminal_keeps_a_unit_from_being_selected_the_refusal_names_the_command_of_the_request(
    method: str, path: str, content: object, command: str, state: str, value: object, mode: int
) -> None:
    @in_cell(mode=mode)
    async def story(cell: Cell) -> None:
        await cell.get(f"{UNIT}/status")
        cell.rig.touch(lambda fics, _: setattr(fics, state, value))
        answer = await cell.client.request(method, path, json=content)
        detail = answer.json()["detail"]
        assert answer.status_code == 409, answer.text
        assert detail.startswith(f"r1 refused UNT, which goes before {command}: ")
        assert f"{command} was not sent. Nothing moved because of it." in detail
        japanese = (await cell.client.request(method, path, json=content, headers=JAPANESE)).json()["detail"]
        assert japanese.startswith("UNT: ")
        assert f"{command}は送信していません。" in japanese

    story()
