"""Moves of SCARA robots in the words of clients, and the commands they come to."""

from typing import Any

import pytest
from pydantic import ValidationError

from gateway.rorze_scara.requests import Angle, Distance, MoveStart
from protocols.rorze.scara import ThreeAxes
from tests.gateway.rorze_scara.cell import START, deg, mm, read

ROBOT = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
HERE = MoveStart(START, ROBOT.pose(START), ROBOT.place(START), {}, 63)


@pytest.mark.parametrize(
    ("kind", "request_", "sent"),
    [
        (
            "line",
            {"x": mm(1.5), "y": mm(200)},
            ["HDSH[63]", "HDSH[63],0,X:1500,Y:200000,R:0", "HMSH[63]", "HMM"],
        ),
        ("offset", {"x": mm(-1), "pattern": 4}, ["HXSA[4],-1000", "HMM"]),
        ("offset", {"y": {"value": 7, "unit": "um"}}, ["HYS7", "HMM"]),
        (
            "offset",
            {"x": mm(1), "y": mm(2), "pattern": 3},
            ["HDSH[63]", "HDSH[63],0,X:1012,Y:117000,R:0", "HMSA[3],H[63]", "HMM"],
        ),
        ("path", {"path": 0, "pattern": 29}, ["HMSA[29],H[0]", "HMM"]),
        (
            "path",
            {"points": [{"x": mm(255), "y": mm(300), "radius": mm(120)}, {"x": mm(255), "y": mm(450)}]},
            [
                "HDSH[63]",
                "HDSH[63],0,X:255000,Y:300000,R:120000",
                "HDSH[63],1,X:255000,Y:450000,R:0",
                "HMSH[63]",
                "HMM",
            ],
        ),
        ("extend", {"distance": mm(0.001)}, ["H+S1", "HMM"]),
        ("retract", {"distance": mm(10)}, ["H-S10000", "HMM"]),
        ("rotate", {"radius": mm(0), "angle": deg(-90)}, ["HRSR:0,F:-90000", "HMM"]),
        ("finger", {"angle": deg(45.5), "pattern": 4}, ["HFMA[4],F:45500"]),
        ("align", {"x": mm(1), "y": mm(-2)}, ["HNMX:1000,Y:-2000"]),
        ("align", {"path": 3, "pattern": 1}, ["HNMA[1],H[3]"]),
    ],
)
def test_what_each_kind_comes_to(kind: str, request_: dict[str, Any], sent: list[str]) -> None:
    manoeuvre = read(kind, **request_).manoeuvre(HERE)
    commands = (*manoeuvre.preparation, manoeuvre.motion)
    assert [command.code + command.written() for command in commands] == sent


@pytest.mark.parametrize(
    ("amount", "thousandths"),
    [
        (Distance(value=1.5, unit="mm"), 1_500),
        (Distance(value=-7, unit="um"), -7),
        (Distance(value=0.0004, unit="mm"), 0),
        (Angle(value=0.0006, unit="deg"), 1),
        (Angle(value=-90_000, unit="mdeg"), -90_000),
    ],
)
def test_amounts_are_whole_thousandths_on_the_line(amount: Distance | Angle, thousandths: int) -> None:
    assert amount.thousandths == thousandths


@pytest.mark.parametrize(
    "amount", [mm(1e6), mm(-1e6), {"value": 1, "unit": "deg"}, {"value": True, "unit": "mm"}]
)
def test_what_has_no_place_on_the_line_is_no_distance(amount: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Distance.model_validate(amount)
