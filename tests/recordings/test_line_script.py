"""The course of a line: each reply is given to the frame that it answers."""

from collections.abc import Sequence
from datetime import UTC, datetime

import pytest

from recordings.dialects import DIALECTS
from recordings.line_script import script_of
from transports.trace import TraceEntry

MS = 1_000_000
TAUGHT_AND_READ = ("<POF 1,1", ">POF", "<POS 0,0,0", ">POS", "<POF 2", ">POF", "<UNT", ">UNT 2,2")
STORIES: Sequence[tuple[str, Sequence[str], Sequence[Sequence[str]]]] = (
    (
        "fics",
        (*TAUGHT_AND_READ, "<POR 1,2", ">POS 0,0,0", ">POE"),
        (["POF"], ["POS"], ["POF"], ["UNT 2,2"], ["POS 0,0,0", "POE"]),
    ),
    ("fics", ("<VER", "<POR 1,1", ">VER 1.0", ">POR E09"), (["VER 1.0"], ["POR E09"])),
    (
        "rorze",
        ("<&3F6PD", "<&3F9CD", ">>&3F6PD+000000000", ">>&3F9CDH00"),
        ([">&3F6PD+000000000"], [">&3F9CDH00"]),
    ),
)


def entries(words: Sequence[str]) -> list[tuple[int, TraceEntry]]:
    """Records of what was sent (`<`) and of what came (`>`), one each millisecond."""
    at = datetime(2026, 11, 28, tzinfo=UTC)
    return [
        (
            number,
            TraceEntry(
                at=at,
                monotonic_ns=number * MS,
                kind="tx" if word[0] == "<" else "rx",
                data=word[1:].encode() + b"\r",
            ),
        )
        for number, word in enumerate(words, 1)
    ]


@pytest.mark.parametrize(("family", "words", "heard"), STORIES)
def test_a_reply_belongs_to_the_newest_frame_that_it_may_answer(
    family: str, words: Sequence[str], heard: Sequence[Sequence[str]]
) -> None:
    script = script_of(entries(words), DIALECTS[family](), 0)
    assert [[frame.data.rstrip(b"\r").decode() for frame in one.heard] for one in script.exchanges] == list(
        heard
    )
