"""An echo is found where frames come back in order, and is over where one does not."""

from dataclasses import dataclass, field
from typing import Any

from gateway.core.false_replies import ECHOES, UNDER_WAY, Echo


@dataclass(eq=False)
class Said:
    """A frame, and whether no reply to it can equal it."""

    text: str
    shows: bool = True
    frame: bytes = field(init=False)

    def __post_init__(self) -> None:
        self.frame = f"{self.text}\r".encode()


class Line:
    """A line to which frames are written, and from which some come back."""

    def __init__(self) -> None:
        self.changes: list[bool] = []
        self.echo: Echo[Any] = Echo(lambda it: it.shows, self.changes.append)

    def write(self, text: str, *, shows: bool = True) -> Said:
        if self.echo.in_a_row:
            self.echo.passed_over()
        said = Said(text, shows)
        self.echo.written.append(said)
        return said

    def echoes(self, *texts: str) -> None:
        for text in texts:
            self.write(text)
            assert self.echo.heard(text.encode())


def test_frames_that_come_back_one_after_the_other_show_an_echo_once() -> None:
    line = Line()
    line.echoes(*map(str, range(ECHOES - 1)))
    assert not line.echo.found
    line.echoes(*map(str, range(10)))
    assert line.echo.found
    assert line.changes == [True]


def test_what_was_not_written_is_no_echo() -> None:
    line = Line()
    line.write("ACD")
    assert not line.echo.heard(b"ACD 0300")
    assert not line.echo.heard(b"")


def test_what_an_answer_may_equal_is_no_echo() -> None:
    line = Line()
    for _ in range(2 * ECHOES):
        line.write("ORG", shows=False)
        assert not line.echo.heard(b"ORG")
    assert not line.echo.found


def test_an_echo_here_and_there_is_noise() -> None:
    line = Line()
    for number in range(2 * ECHOES):
        line.echoes(f"first {number}")
        line.echo.answered(line.write(f"then {number}"))
    assert line.changes == []


def test_the_same_question_put_again_and_again_is_told_by_its_echoes() -> None:
    line = Line()
    for _ in range(20):
        line.write("ACD")
    line.echoes(*["ACD"] * ECHOES)
    assert line.changes == [True]


def test_it_is_over_with_an_answer_to_what_has_not_come_back() -> None:
    line = Line()
    line.echoes(*map(str, range(ECHOES)))
    echoed = Said("9")
    line.echo.answered(echoed)
    assert line.echo.found
    line.echo.answered(line.write("AES", shows=False))
    assert line.echo.found
    line.echo.answered(line.write("ACD"))
    assert line.changes == [True, False]


def test_it_is_over_where_frames_are_lost_without_a_trace() -> None:
    line = Line()
    line.echoes(*map(str, range(ECHOES)))
    for number in range(UNDER_WAY + 1):
        line.write(f"lost {number}")
    assert line.echo.found
    line.write("one more")
    assert line.changes == [True, False]


def test_a_frame_between_that_shows_no_echo_changes_nothing() -> None:
    line = Line()
    for number in range(ECHOES):
        line.write("AES", shows=False)
        line.echoes(str(number))
    assert line.changes == [True]
