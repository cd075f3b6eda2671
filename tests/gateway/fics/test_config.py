"""The tables of robots in the configuration."""

import pytest

from gateway.config import parse
from gateway.core.toml_files import ConfigError
from gateway.fics.config import FicsLineTable
from protocols.fics.notation import AxisSystem

LINE = """
[[lines]]
id = "cell"
address = "dpram:///dev/uio0"
protocol = "fics"
mode = 2

[lines.robot]
id = "r1"
name = "picker"
units = [{number = 1, axes = ["X", "Y", "@"]}, {number = 2, axes = ["X"], system = "pulse"}]
"""


def test_a_robot_has_its_units() -> None:
    (line,) = parse(LINE, "x").lines
    assert isinstance(line, FicsLineTable)
    assert (line.mode, line.robot.id, line.robot.name) == (2, "r1", "picker")
    picker, turner = line.robot.units
    assert picker.systems == {"X": AxisSystem.MILLIMETRE, "Y": AxisSystem.MILLIMETRE, "@": AxisSystem.DEGREE}
    assert turner.systems == {"X": AxisSystem.PULSE}


SCARA = """
[[lines]]
id = "cell"
address = "dpram:///dev/uio0"
protocol = "fics"

[lines.robot]
id = "r1"

[[lines.robot.units]]
number = 1
axes         = ["X",      "Y",      "Z",  "@"]
system       = ["mm",     "mm",     "mm", "degree"]
motor_axes   = ["A",      "B",      "Z",  "@"]
motor_system = ["degree", "pulse",  "mm", "degree"]
"""


def systems(text: str) -> dict[str, str]:
    (line,) = parse(text, "x").lines
    assert isinstance(line, FicsLineTable)
    return {axis: system.value for axis, system in line.robot.units[0].systems.items()}


def test_each_axis_has_a_system_of_its_own() -> None:
    assert systems(SCARA) == {"X": "mm", "Y": "mm", "Z": "mm", "@": "degree", "A": "degree", "B": "pulse"}


def test_one_word_is_enough_for_axes_that_are_all_alike_theta_too() -> None:
    lines = [line for line in SCARA.splitlines() if not line.startswith("motor")]
    text = "\n".join(lines).replace('["mm",     "mm",     "mm", "degree"]', '"pulse"')
    assert systems(text) == dict.fromkeys("XYZ@", "pulse")


def test_left_out_theta_and_motors_behind_user_axes_turn_by_degrees() -> None:
    text = "\n".join(line for line in SCARA.splitlines() if "system" not in line)
    assert systems(text) == dict.fromkeys("XYZ", "mm") | dict.fromkeys("@AB", "degree")


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        (
            '"mm", "degree"]\nmotor_axes',
            '"mm"]\nmotor_axes',
            "x:13: lines[0].robot.units[0].system: must have one",
        ),
        (
            '"mm",     "mm",     "mm", ',
            '"mm",     "inch",     "mm", ',
            "x:13: lines[0].robot.units[0].system[1]: must",
        ),
        (
            '"degree", "pulse",  "mm", ',
            '"degree", 5,  "mm", ',
            "x:15: lines[0].robot.units[0].motor_system[1]: must",
        ),
        (
            '"degree", "pulse",  "mm", ',
            '"degree", "pulse",  "pulse", ',
            "motor_system: axis Z is one of axes too",
        ),
        (
            '["degree", "pulse",  "mm", "degree"]',
            "7",
            "x:15: lines[0].robot.units[0].motor_system: must be 'mm'",
        ),
        (
            "motor_axes   =",
            "#",
            "x:15: lines[0].robot.units[0].motor_system: has no meaning without motor_axes",
        ),
    ],
)
def test_a_system_that_cannot_be_is_refused_at_its_line(right: str, wrong: str, sentence: str) -> None:
    assert right in SCARA
    with pytest.raises(ConfigError) as refused:
        parse(SCARA.replace(right, wrong, 1), "x")
    assert sentence in str(refused.value)


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        ("mode = 2", "mode = 4", "x:6: lines[0].mode: must be 2 or 3, not 4"),
        ('id = "r1"', 'id = "R1"', "x:9: lines[0].robot.id: must be up to 32 lower-case letters"),
        ("number = 2", "number = 1", "units[1].number: is the same as units[0].number"),
        ("number = 2", "number = 0", "units[1].number: must be 1 or more, not 0"),
        ('"Y"', '"X"', "units[0].axes[1]: is the same as axes[0]"),
        ('["X"]', "[]", "units[1].axes: must name at least one axis"),
        ('system = "pulse"', 'sistem = "pulse"', "units[1].sistem: unknown key (did you mean system?)"),
        ('system = "pulse"', 'system = "inch"', "units[1].system: must be 'mm', 'pulse' or 'degree'"),
        ("mode = 2", 'introducer = "$"', "lines[0].introducer: has no meaning on a line of protocol fics"),
        ('protocol = "fics"', "", "lines[0].robot: has no meaning on a line of protocol rorze"),
        ("units =", "axes =", "lines[0].robot.axes: unknown key"),
    ],
)
def test_what_cannot_be_is_refused_at_its_place(right: str, wrong: str, sentence: str) -> None:
    assert right in LINE
    with pytest.raises(ConfigError) as refused:
        parse(LINE.replace(right, wrong, 1), "x")
    assert sentence in str(refused.value)


def test_a_line_of_a_robot_has_one_and_no_two_have_the_same() -> None:
    with pytest.raises(ConfigError, match="robot: is required"):
        parse(LINE[: LINE.index("[lines.robot]")], "x")
    second = LINE.replace('"cell"', '"cell-2"').replace("uio0", "uio1")
    with pytest.raises(ConfigError, match=r"lines\[1\].robot.id: another line has a robot of this id"):
        parse(LINE + second, "x")
