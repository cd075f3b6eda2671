"""The tables of SCARA robots in the configuration file."""

import pytest

from gateway.config import parse
from gateway.core.toml_files import ConfigError
from gateway.rorze_scara.config import ScaraTable
from protocols.rorze.scara import BeltLinked, ThreeAxes
from tests.gateway.rorze_scara.cell import BELTS, SCARA

LINES = """
[[lines]]
id = "line1"
address = "tcp://127.0.0.1:1"
bodies = [{id = "02"}, {id = "03"}, {id = "04"}, {id = "05"}]
groups = [{id = "80", members = ["02", "03"]}]

[[lines]]
id = "cell"
protocol = "fics"
address = "tcp://127.0.0.1:2"
robot = {id = "r1", units = [{number = 1, axes = ["X"]}]}
"""


def robots(tables: str) -> list[ScaraTable]:
    return [it for it in parse(LINES + tables, "x").made()["scaras"] if isinstance(it, ScaraTable)]


def complaint(table: str, lines: str = LINES) -> str:
    with pytest.raises(ConfigError) as refused:
        parse(lines + table, "gateway.toml")
    return str(refused.value)


def test_three_axes_or_two_with_belts() -> None:
    [three] = robots(SCARA)
    assert three.robot == ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
    assert (three.group_number, three.own_path, three.on_fault) == (0x8A, 63, "decelerate")
    [two] = robots(BELTS)
    assert two.robot == BeltLinked(156_000, 208_000, (98_765.0, 99_000.0))


def test_a_group_of_the_same_members_may_be_configured_too() -> None:
    assert robots(BELTS.replace('"8A"', '"80"'))[0].group == "80"


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ('line = "line1"', 'line = "other"', "line: there is no line other of protocol rorze"),
        ('line = "line1"', 'line = "cell"', "line: there is no line cell of protocol rorze"),
        ('id = "wafer"', 'id = "line1"', "id: is the id of something else"),
        ('id = "wafer"', 'id = "r1"', "id: is the id of something else"),
        ('"04"]', '"06"]', "members[2]: 06 is no body of line line1"),
        ('"04"]', '"03"]', "members[2]: is the same as members[1]"),
        ('"03", "04"]', '"03"]', "pulses_per_turn: must have 2 numbers"),
        ('"03", "04"]', "]", "members: "),
        ("60000.0", "0.5", "pulses_per_turn[1]: "),
        ('group = "8A"', 'group = "80"', "group: is a group of other members, or in another order"),
        ('group = "8A"', 'group = "05"', "group: "),
        ("arm_um = 215000", "arm_um = 0", "arm_um: "),
        ("arm_um = 215000", "own_path = 64", "own_path: "),
        ("arm_um = 215000", 'on_fault = "go_on"', "on_fault: "),
    ],
)
def test_what_does_not_fit_is_told_with_its_place(old: str, new: str, why: str) -> None:
    assert SCARA.count(old) == 1
    assert f"scaras[0].{why}" in complaint(SCARA.replace(old, new))


def test_robots_share_neither_bodies_nor_groups_nor_ids() -> None:
    other = SCARA.replace("wafer", "other")
    assert "scaras[1].members: has a body or the group of another one" in complaint(SCARA + other)
    assert "scaras[1].id: is the id of something else" in complaint(SCARA + SCARA)


def test_its_group_is_none_that_the_gateway_keeps_for_sweeps_or_cannot_address() -> None:
    swept = LINES.replace(
        'address = "tcp://127.0.0.1:1"', 'address = "tcp://127.0.0.1:1"\nsweep_groups = ["8A", "8F"]'
    )
    assert "group: is among the line's sweep_groups" in complaint(SCARA, swept)
    old = LINES.replace('groups = [{id = "80", members = ["02", "03"]}]', 'introducer = "$"')
    assert "group: cannot be addressed after '$'" in complaint(SCARA, old)
