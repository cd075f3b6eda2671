"""Other values for keys of a line, in each form in which the file may have its tables."""

import tomllib
from collections.abc import Mapping
from typing import Any

import pytest

from gateway.config_file import changed, diff
from gateway.core.toml_files import ConfigError

INLINE = """\
[[lines]]
id = "line1"  # the lift
address = "serial:///dev/ttyUSB0"
bodies = [{ id = "00" }, { id = "0A", name = "a }[", power_comment = 3 }]  # two

[[lines]]
id = "cell1"
address = "serial:///dev/ttyUSB1"
protocol = "fics"
robot = { id = "r1", units = [
  { number = 1, axes = ["X", "Y", "Z"] },  # the first
] }
"""
CASES: tuple[tuple[str, Mapping[str, Any], str], ...] = (
    (
        "line1",
        {"bodies.00.power_comment": 0, "bodies.0A.power_comment": 0},
        'bodies = [{ power_comment = 0, id = "00" }, { id = "0A", name = "a }[", power_comment = 0 }]  # two',
    ),
    (
        "cell1",
        {"robot.status_bits": ["moving", "alarm", "origin_done", "servo_ready"]},
        'robot = { status_bits = ["moving", "alarm", "origin_done", "servo_ready"], id = "r1", units = [',
    ),
    ("line1", {"stop_mode": "after_reply"}, 'stop_mode = "after_reply"'),
)


@pytest.mark.parametrize(("line_id", "changes", "row"), CASES)
def test_a_key_is_set_where_its_table_is_inline(line_id: str, changes: Mapping[str, Any], row: str) -> None:
    text = changed(INLINE, line_id, changes, "gateway.toml")
    assert row in text.splitlines()
    assert [it for it in INLINE.splitlines() if "#" in it and "bodies" not in it] == [
        it for it in text.splitlines() if "#" in it and "bodies" not in it
    ]
    assert row in diff(INLINE, text, "gateway.toml")
    again = changed(text, line_id, changes, "gateway.toml")
    assert tomllib.loads(again) == tomllib.loads(text)


def test_a_form_that_is_not_understood_is_told_with_what_to_write() -> None:
    text = INLINE.replace("bodies = [{", "bodies = [ # one\n{").replace("bodies", '"bo\\u0064ies"')
    with pytest.raises(ConfigError, match="power_comment = 0"):
        changed(text, "line1", {"bodies.00.power_comment": 0}, "gateway.toml")
