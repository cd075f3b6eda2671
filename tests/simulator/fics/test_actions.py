"""Every row is acted out, and what cannot be read is refused with the right error."""

import pytest

from protocols.fics.commands import ROWS, read
from protocols.fics.moves import MoveAbsolute
from protocols.fics.status import MotionMode
from simulator.fics import acts as acts
from simulator.fics.actions import Code, Refused, action_of, plan_of, rows_acted_out, understand


def test_every_row_is_acted_out_and_nothing_else() -> None:
    assert rows_acted_out() == set(ROWS)


def test_a_command_is_done_at_once_or_takes_time() -> None:
    for row in ROWS:
        text = row.example[0]
        command = read(text[:3], text[4:])
        if action_of(command) is None:
            mode, _ = plan_of(command)
            assert mode is not MotionMode.STANDING
            assert row.starts_motion


def test_a_command_is_understood() -> None:
    assert understand("LMA", "1,,-2.5") == MoveAbsolute(coordinates=[1.0, None, -2.5])


@pytest.mark.parametrize(
    ("name", "arguments", "code"),
    [
        ("LMA", "1;2", Code.FORMAT),
        ("LMA", "", Code.FORMAT),
        ("LMA", "1e5", Code.FORMAT),
        ("LMA", "100000000", Code.RANGE),
        ("LMA", "1,2,3,4,5,6,7,8,9", Code.FORMAT),
        ("VAO", "0.05", Code.RANGE),
        ("APS", "1", Code.FORMAT),
        ("POM", "2000", Code.RANGE),
        ("XYZ", "A", Code.FORMAT),
    ],
)
def test_what_cannot_be_read_is_refused(name: str, arguments: str, code: Code) -> None:
    for _ in range(2):
        with pytest.raises(Refused) as refused:
            understand(name, arguments)
        assert refused.value.code is code
    assert str(refused.value) == f"E{code:02d}"
