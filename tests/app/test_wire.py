"""The traffic of a line, in words."""

from typing import Any

import pytest

from app.wire import folded, meaning


def record(kind: str, data: str, caller: str | None = None) -> dict[str, Any]:
    return {"at": "t", "kind": kind, "data": data + "\\r", "caller": caller}


@pytest.mark.parametrize(
    ("asked", "answered", "said"),
    [
        ("&3F9CD", ">&3F9CDH08", "get the controller status: command error"),
        ("&3F9CD", ">&3F9CDH00", "get the controller status: none"),
        ("&3F9MD", ">&3F9MDH0A", "get the cause of the end of the last move: cw limit, ems"),
        ("&3F6PD", ">&3F6PD+000012345", "get the present position: 12345"),
        ("&3F1+M500", ">&3F1+M", "relative move clockwise at high speed: accepted"),
        ("&3F5IS", None, "software stop, at once"),
        ("ACD", "ACD 2700", "get the status of the unit's motor axes; clears no error: 2700"),
        ("&3FQQQ", ">&3FQQQ7", "7"),
        ("???", None, ""),
        ("hello", "&&&", ""),
    ],
)
def test_a_frame_and_its_answer_have_a_meaning(asked: str, answered: str | None, said: str) -> None:
    told = meaning(record("tx", asked), None if answered is None else record("rx", answered))
    assert told == said


def test_a_refusal_is_told_with_its_reason() -> None:
    told = meaning(record("tx", "&3F9CD9"), record("rx", ">&3F@49"))
    assert told.startswith("get the controller status: refused: ")


def test_an_answer_that_comes_between_others_stands_alone() -> None:
    stop, poll, late, reply = (
        record("tx", "&3F5IS", "pat"),
        record("tx", "&009CD", "gateway: poll"),
        record("rx", ">&3F5IS"),
        record("rx", ">&009CDH00"),
    )
    assert list(folded([stop, poll, late, reply])) == [
        (stop, None),
        (poll, None),
        (late, None),
        (reply, None),
    ]
    assert list(folded([poll, reply, stop, late])) == [(poll, reply), (stop, late)]
