import pytest

from protocols.fics.commands import read
from protocols.fics.link import Completion, Frame, QueryAnswer, Ver2Reader, Ver3Reader, credit
from protocols.fics.moves import MoveToPosition
from protocols.fics.positions import (
    BeginPositionUpload,
    ClearPositions,
    DownloadPositions,
    EndPositionUpload,
    StoredPosition,
    UploadPosition,
)
from protocols.table import RangeFault, SyntaxFault


def test_an_upload_is_begun_and_ended_by_the_same_name() -> None:
    assert read("POF", "1") == BeginPositionUpload()
    assert read("POF", "1,1999") == BeginPositionUpload(first=1999)
    assert read("POF", "2") == EndPositionUpload()
    for text in ("", "2,", "1,", "A", "2,A"):
        with pytest.raises(SyntaxFault):
            read("POF", text)


def test_what_pof_does_is_1_or_2_and_a_position_counts_with_1_only() -> None:
    """C-HOST manual 2-17."""
    for text in ("0", "3", "12", "3,5", "1,2000"):
        with pytest.raises(RangeFault):
            read("POF", text)
    assert read("POF", "2,5") == EndPositionUpload()


@pytest.mark.parametrize("row", [DownloadPositions, ClearPositions])
def test_a_stretch_of_positions_may_leave_out_either_end(
    row: type[DownloadPositions | ClearPositions],
) -> None:
    assert [row.read(text).written() for text in ("", "5", "5,10", ",10")] == ["", "5", "5,10", ",10"]
    for text in ("0", "2000", "1,0", ",2000"):
        with pytest.raises(RangeFault):
            row.read(text)


def test_positions_are_numbered_from_1_to_1999() -> None:
    assert [MoveToPosition.read(text).position for text in ("1", "1999")] == [1, 1999]
    for text in ("0", "2000"):
        with pytest.raises(RangeFault):
            MoveToPosition.read(text)


@pytest.mark.parametrize("reader", [Ver2Reader, Ver3Reader])
def test_a_download_is_one_answer_for_each_position_and_an_end(
    reader: type[Ver2Reader | Ver3Reader],
) -> None:
    asked = DownloadPositions(first=1, count=2)
    frames: list[Frame] = reader().feed(b"POS 100,20\rAPS 5\rPOS 100,,30\rPOE\r")
    assert [credit(asked, frame) for frame in frames] == [
        StoredPosition(coordinates=[100, 20]),
        None,
        StoredPosition(coordinates=[100, None, 30]),
        Completion("POE"),
    ]


def test_an_uploaded_position_is_not_mistaken_for_a_downloaded_one() -> None:
    uploading, downloading = UploadPosition(coordinates=[1]), DownloadPositions()
    assert credit(uploading, Completion("POS")) == Completion("POS")
    assert credit(downloading, Completion("POS")) is None
    assert credit(uploading, QueryAnswer("POS", "1,2")) is None
    assert credit(uploading, Completion("POE")) is None
