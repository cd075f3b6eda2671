from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.fics.exchange import RobotAnswered
from gateway.fics.upload_state import UploadState
from protocols.fics.alarms import TakeCurrentError
from protocols.fics.link import FicsRefusal
from protocols.fics.positions import BeginPositionUpload, EndPositionUpload, UploadPosition
from protocols.fics.row import FicsCommand
from protocols.fics.system import GetSystemVersion, GetUnit
from protocols.fics.variables import SetVariable

BEGIN, POSITION, END = BeginPositionUpload(first=1), UploadPosition(coordinates=[1.0]), EndPositionUpload()
COMMANDS = (BEGIN, POSITION, END, TakeCurrentError(), GetUnit(), GetSystemVersion())


def opened() -> UploadState:
    it = UploadState()
    it.note_written(BEGIN, 1, silent=False)
    return it


def refusal(error: str) -> FicsRefusal:
    return FicsRefusal("POF", error)


def test_an_upload_is_open_from_the_frame_that_begins_it_until_its_end_is_taken() -> None:
    it = UploadState()
    assert not it.may_be_open
    it.note_written(BEGIN, 1, silent=False)
    assert it.is_open
    it.note_outcome(POSITION, 2, RobotAnswered())
    assert it.is_open
    it.note_outcome(END, 3, RobotAnswered())
    assert not it.may_be_open


def test_an_end_in_mode_2_may_not_have_been_heard() -> None:
    it = UploadState()
    it.note_written(BEGIN, 1, silent=True)
    it.note_written(END, 2, silent=True)
    assert (it.is_open, it.may_be_open) == (False, True)
    it.note_outcome(GetUnit(), 3, RobotAnswered())
    assert not it.may_be_open


@pytest.mark.parametrize(
    ("command", "error", "is_open"),
    [(BEGIN, "E03", True), (BEGIN, "E05", False), (END, "E03", True), (END, "E08", False)],
)
def test_a_refusal_of_its_beginning_or_its_end_tells_whether_it_is_open(
    command: FicsCommand[Any], error: str, is_open: bool
) -> None:
    it = opened()
    it.note_outcome(command, 2, refusal(error))
    assert it.is_open is is_open


def test_only_what_was_written_after_its_beginning_proves_its_end() -> None:
    it = UploadState()
    it.note_written(BEGIN, 5, silent=False)
    it.note_outcome(GetUnit(), 4, RobotAnswered())
    assert it.is_open
    it.note_outcome(GetUnit(), 6, RobotAnswered())
    assert not it.is_open


@pytest.mark.parametrize(
    ("command", "error", "doubtful"),
    [
        (SetVariable(number=1, value=2.0), "E03", True),
        (SetVariable(number=1, value=2.0), "E01", False),
        (POSITION, "E03", False),
        (GetUnit(), "E03", False),  # the teaching terminal explains it
    ],
)
def test_a_refusal_that_nothing_else_explains_is_that_of_an_upload(
    command: FicsCommand[Any], error: str, doubtful: bool
) -> None:
    it = UploadState()
    assert it.note_outcome(command, 1, refusal(error)) is doubtful
    assert it.is_open is doubtful


def test_a_fence_in_doubt_is_preceded_by_the_end_of_an_upload_at_each_try() -> None:
    it = opened()
    it.begin_fence(in_doubt=True)
    assert [it.must_end_before(n, mode=3) for n in (0, 0, 1, 1, 2)] == [True, False, True, False, True]


@pytest.mark.parametrize(("mode", "tries"), [(3, [False, False]), (2, [False, True])])
def test_a_fence_without_a_doubt_ends_no_upload_before_it_fails(mode: int, tries: list[bool]) -> None:
    it = UploadState()
    it.begin_fence(in_doubt=False)
    assert [it.must_end_before(n, mode) for n in (0, 1)] == tries


def test_a_fence_ends_a_known_upload_in_any_case() -> None:
    it = opened()
    it.begin_fence(in_doubt=False)
    assert it.must_end_before(0, mode=3)


@given(
    st.lists(st.tuples(st.sampled_from(COMMANDS), st.booleans(), st.sampled_from(["", "E01", "E03", "E08"])))
)
def test_after_the_end_was_taken_no_upload_is_open(
    deeds: list[tuple[FicsCommand[Any], bool, str]],
) -> None:
    it = UploadState()
    for number, (command, silent, error) in enumerate(deeds, 1):
        it.note_written(command, number, silent=silent)
        it.note_outcome(command, number, refusal(error) if error else RobotAnswered())
        assert it.may_be_open or not it.is_open
    it.note_outcome(END, len(deeds) + 1, RobotAnswered())
    assert not it.may_be_open
