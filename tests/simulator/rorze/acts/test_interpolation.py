"""The settings of an interpolation, and the place of a SCARA robot's wafer (RC-420 manual 13.10, 14)."""

import pytest

from tests.simulator.rorze.bench import Bench

ROBOT = ("HTS0", "HAS215000", "HFS330000", "HZS0,121791.045", "HZS1,60000.0", "HZS2,100000.0")
"""Commands that set up the robot of 13.10.7."""


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def robot(bench: Bench) -> Bench:
    bench.sent(*ROBOT)
    return bench


QUESTIONS = ("HAD", "HCD", "HFD", "HTD", "HZD0", "HZD9", "HPD0", "HDDH[0],0")


def told(bench: Bench) -> list[str]:
    return [bench.send(text) for text in QUESTIONS]


AT_FIRST = ["+000000001", "0", "1", "1", "00000001.00", "00000001.00", "+000000000", "NoData"]


def test_settings_outlast_the_power_once_saved_but_paths_and_start_positions_do_not(bench: Bench) -> None:
    assert told(bench) == AT_FIRST
    bench.sent("HAS156000", "HCS2", "HFS208000", "HTS0", "HZS0,98765.4000", "HZS9,99000.5")
    bench.sent("FIS", "HPS0,83333", "HDSH[0],0,X:1,Y:-2,R:3")
    kept = ["+000156000", "2", "208000", "0", "00098765.4000", "00099000.5"]
    assert told(bench) == [*kept, "+000083333", "X:1,Y:-2,R:3"]
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert told(bench) == [*kept, "+000000000", "NoData"]


def test_the_points_of_a_path_are_set_one_by_one_and_cleared_together(bench: Bench) -> None:
    bench.sent("HDSH[63],0,X:200000,Y:150000,R:50000", "HDSH[63],15,CENTER", "HDSH[62],0,CENTER")
    points = ("HDDH[63],0", "HDDH[63],1", "HDDH[63],15", "HDDH[62],0")
    assert [bench.send(text) for text in points] == [
        "X:200000,Y:150000,R:50000",
        "NoData",
        "CENTER",
        "CENTER",
    ]
    bench.sent("HDSH[63]")
    assert [bench.send(text) for text in points] == ["NoData", "NoData", "NoData", "CENTER"]


def test_measures_may_stand_in_the_position_table(bench: Bench) -> None:
    bench.sent("3PSP[7],-1500", "3PSP[8],2500", "3PSP[9],40", "3IS7")
    bench.sent("HDSH[3],1,X:P[+],Y:P[+],R:P[9]", "HPS1,P[7]")
    assert bench.send("HDDH[3],1") == "X:-1500,Y:2500,R:40"
    assert bench.send("HPD1") == "-000001500"
    assert bench.send("3ID") == "0009"


def test_a_refused_point_leaves_the_index_alone(bench: Bench) -> None:
    bench.sent("3PSP[5],-1", "3IS5")
    assert bench.send("HDSH[3],1,X:P[+],Y:P[+],R:P[5]") == "@4A", "a negative radius"
    assert (bench.send("3ID"), bench.send("HDDH[3],1")) == ("0005", "NoData")


def test_none_of_it_in_a_move_or_in_encoder_mode(bench: Bench) -> None:
    bench.sent("1+MZ")
    assert [bench.send(text) for text in ("HAD", "HAS5", "HPS0,1", "HDSH[3]")] == ["@50"] * 4
    bench.sent("5IS", "EAS1")
    assert [bench.send(text) for text in ("HAD", "HAS5", "HLD")] == ["@61"] * 3


# Coordinates


def test_the_worked_example_of_the_manual(robot: Bench) -> None:
    """13.10.7; the manual prints the ideal coordinates, not those of the whole pulses."""
    assert robot.send("HLSX:0,Y:115000,F:90000") == "0:-000010149,1:-000010000,2:-000016666"
    robot.sent("HPS0,-10149", "HPS1,-10000", "HPS2,-16666")
    assert robot.send("HLD") == "X:+000000012,Y:+000115000,F:+000089998"
    assert robot.send("HLD0:-10149,1:-10000,2:-16666") == "X:+000000012,Y:+000115000,F:+000089998"


def test_at_zero_all_links_lie_over_each_other(robot: Bench) -> None:
    assert robot.send("HLD0:0,1:0,2:0") == "X:+000330000,Y:+000000000,F:+000000000"


@pytest.mark.parametrize(
    "place", [(0, 115_000, 90), (300_000, 200_000, 0), (-400_000, 5_000, 170), (0, -700_000, -90)]
)
def test_there_and_back_is_where_it_was(robot: Bench, place: tuple[int, int, int]) -> None:
    x, y, degrees = place
    positions = robot.send(f"HLSX:{x},Y:{y},F:{1000 * degrees}")
    back = robot.send(f"HLD{positions}")
    found = [int(part[2:]) for part in back.split(",")]
    assert found[:2] == pytest.approx([x, y], abs=100), "a pulse is less than 7 thousandths of a degree"
    assert (found[2] - 1000 * degrees + 180_000) % 360_000 == pytest.approx(180_000, abs=15)


def test_what_the_arm_cannot_reach_is_refused(robot: Bench) -> None:
    """Two links of 215 mm and a finger of 330 mm end 760 mm from the centre."""
    assert robot.send("HLSX:0,Y:760000,F:90000").startswith("0:")
    assert robot.send("HLSX:0,Y:760001,F:90000") == "@63"


def test_the_coordinates_of_a_robot_with_belts(bench: Bench) -> None:
    """That of 13.10.11: two axes, and no direction to choose."""
    bench.sent("HTS1", "HAS156000", "HFS208000", "HZS0,98765.0", "HZS1,99000.0")
    assert bench.send("HLD0:0,1:0") == "X:+000208000,Y:+000000000,F:+000000000"
    assert bench.send("HLSX:0,Y:364000") == "0:+000024691,1:+000008250"
    assert bench.send("HLSX:0,Y:364000,F:1") == "0:+000024691,1:+000008250", "F is not needed"
    assert bench.send("HLD0:24691,1:8250,2:5") == "X:+000000006,Y:+000364000,F:+000089999"
    bench.sent("HPS0,24691", "HPS1,8250")
    assert bench.send("HLD") == "X:+000000006,Y:+000364000,F:+000089999"
    assert bench.send("HLSX:0,Y:520001") == "@63"
    assert bench.send("HLD0:0,1:24751") == "@63"


def test_coordinates_of_positions_that_were_never_told(robot: Bench) -> None:
    robot.sent("HPS0,0", "HPS2,0")
    assert robot.send("HLD") == "@61"
    assert robot.send("HPD1") == "+000000000"
    robot.sent("HPS1,0")
    assert robot.send("HLD") == "X:+000330000,Y:+000000000,F:+000000000"


@pytest.mark.parametrize("text", ["HDSH[64],0,CENTER", "HPS0,1000000000", "HLSX:1000000000,Y:0,F:0"])
def test_what_is_out_of_range_is_refused_as_chapter_21_has_it(robot: Bench, text: str) -> None:
    assert robot.send(text) == "@5D"


@pytest.mark.parametrize("text", ["HLSX:0,Y:115000", "HLD0:1,1:2", "HZS10,5.0"])
def test_what_cannot_be_is_refused(robot: Bench, text: str) -> None:
    """An angle is missing, an axis, and numbers that there are not."""
    assert robot.send(text) == "@4A"
