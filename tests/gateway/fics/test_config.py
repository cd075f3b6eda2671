"""What the configuration may say of robots."""

import pytest

from gateway.config import ConfigError, parse
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
    assert line.robot is not None
    assert (line.mode, line.robot.id, line.robot.name) == (2, "r1", "picker")
    assert [unit.system for unit in line.robot.units] == [AxisSystem.MILLIMETRE, AxisSystem.PULSE]


@pytest.mark.parametrize(
    ("right", "wrong", "sentence"),
    [
        ("mode = 2", "mode = 4", "x:6: lines[0].mode: must be 2 or 3, not 4"),
        ('id = "r1"', 'id = "R1"', "x:9: lines[0].robot.id: must be up to 32 lower-case letters"),
        ("number = 2", "number = 1", "units[1].number: is the same as units[0].number"),
        ("number = 2", "number = 0", "units[1].number: must be greater than or equal to 1, not 0"),
        ('"Y"', '"X"', "units[0].axes[1]: is the same as axes[0]"),
        ('["X"]', "[]", "units[1].axes: must name at least one axis"),
        ('system = "pulse"', 'sistem = "pulse"', "units[1].sistem: unknown key; did you mean system?"),
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
