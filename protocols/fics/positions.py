"""The table of positions of a unit (C-HOST manual 2-17 to 2-20)."""

import re
from typing import Self

from pydantic import Field

from protocols.fics.notation import PLACES, Coordinates, PositionNumber, StoredCoordinates
from protocols.fics.row import Query, RobotAction
from protocols.table import Effect, RangeFault, Reply, Retry

LAST_POSITION = 1999
_POF = re.compile("([0-9]+)(?:,[0-9]+)?")


class BeginPositionUpload(
    RobotAction,
    code="POF",
    ranged=True,
    args="1<,{first}>",
    blocked="abc",
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("POF 1", "POF", "POF 1,100", "POF"),
):
    """ポジションデータ設定開始: begin to upload positions.

    Until the upload is ended nothing is taken but positions, ERR and its end: no stop either.
    """

    first: PositionNumber | None = Field(
        default=None, description="Number of the first position, 1-1999; left out, 1."
    )


class EndPositionUpload(
    RobotAction,
    code="POF",
    ranged=True,
    args="2",
    blocked="abc",
    during_upload=True,
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("POF 2", "POF"),
):
    """ポジションデータ設定終了: end the upload of positions."""

    @classmethod
    def read(cls, text: str) -> Self:
        """Decode the text after the code; a position's number counts with 1 only (C-HOST manual 2-17).

        :raises SyntaxFault: it has another form.
        :raises RangeFault: it begins with neither 1 nor 2.
        """
        match = _POF.fullmatch(text)
        if match is not None and int(match[1]) not in (1, 2):
            raise RangeFault(f"{text!r} begins with neither 1 nor 2")
        return super().read(match[1] if match else text)


class UploadPosition(
    RobotAction,
    code="POS",
    args="{coordinates}",
    blocked="abc",
    during_upload=True,
    retry=Retry.NEVER,
    effect=Effect.SETTING,
    example=("POS 100,,-30.5", "POS"),
):
    """ポジションデータ設定: upload the next position."""

    coordinates: Coordinates = Field(description=PLACES)


class StoredPosition(Reply, args="{coordinates}"):
    """One position of the table."""

    coordinates: StoredCoordinates = Field(
        description="Per axis, in mm, pulse or degree as it is set up; null where the position has none."
    )


class DownloadPositions(
    Query[StoredPosition],
    code="POR",
    ranged=True,
    args="<{first}><,{count}>",
    blocked="abc",
    answered_as="POS",
    ends_with="POE",
    example=("POR 5,1", "POS 100,20,-30.5", "POR", "POS 100,,-30.5", "POR ,1", "POS 0,0"),
):
    """ポジションデータ読み出し: download positions in turn.

    Each is an answer of its own, named POS; POE follows the last.
    """

    first: PositionNumber | None = Field(
        default=None, description="Number of the first position, 1-1999; left out, 1."
    )
    count: PositionNumber | None = Field(
        default=None, description="Number of positions, 1-1999; left out, all."
    )


class ClearPositions(
    RobotAction,
    code="PCL",
    ranged=True,
    args="<{first}><,{count}>",
    blocked="abc",
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("PCL", "PCL", "PCL 5", "PCL", "PCL 5,10", "PCL", "PCL ,10", "PCL"),
):
    """ポジションデータクリア: clear positions."""

    first: PositionNumber | None = Field(
        default=None, description="Number of the first position, 1-1999; left out, 1."
    )
    count: PositionNumber | None = Field(
        default=None, description="Number of positions, 1-1999; left out, all."
    )
