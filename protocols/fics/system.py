"""Selection of a unit, mode of the answers, and identity of the system (C-HOST manual 2-1, 2-36, 2-37)."""

from enum import IntEnum
from typing import Annotated, ClassVar

from pydantic import Field

from protocols.fics.notation import FicsDigits, FicsWhole, Token, Unit, Within
from protocols.fics.row import Query, RobotAction
from protocols.members import at_hand
from protocols.table import Effect, Reply, Retry, Wire

FOLDER_WIDTH = 14


class UnitNumbers(Reply, args="{host_unit},{fics_unit}"):
    """The present units."""

    host_unit: Unit = Field(description="The unit the host has selected.")
    fics_unit: Unit = Field(description="The unit the system itself shows.")


class GetUnit(Query[UnitNumbers], code="UNT", blocked="abd", example=("UNT", "UNT 2,1")):
    """ユニットの問い合わせ: get the present units."""


class SelectUnit(
    RobotAction,
    code="UNT",
    args="{unit}",
    blocked="abd",
    retry=Retry.CONDITIONAL,
    effect=Effect.SETTING,
    example=("UNT 2", "UNT"),
):
    """ユニットの切り替え: select the unit that later commands speak to.

    The selection holds for moves, settings and positions alike; it is not repeated in any answer.
    """

    for_questions: ClassVar[bool] = True

    unit: Unit = Field(description="Number of the unit, from 1.")


@at_hand
class HostMode(IntEnum):
    """Mode of the answers to the host (C-HOST manual 1-1-1)."""

    VER_2 = 2
    """The mode of power-on: most commands are silent."""
    VER_3 = 3
    """Every command is answered."""


Mode = Annotated[int, Within(2, 3), FicsWhole()]


class CommunicationMode(Reply, args="{mode}"):
    """The present communication mode."""

    mode: Mode = Field(description="2: most commands are silent; 3: every command is answered.")


class GetCommunicationMode(Query[CommunicationMode], code="MOD", blocked="c", example=("MOD", "MOD 3")):
    """通信モードの問い合わせ: get the communication mode; it is 2 after power-on."""


class SetCommunicationMode(
    RobotAction,
    code="MOD",
    args="{mode}",
    blocked="c",
    ranged=True,
    retry=Retry.CONDITIONAL,
    effect=Effect.MAINTENANCE,
    example=("MOD 3", "MOD"),
):
    """通信モードの切り替え: set the communication mode.

    The new mode decides if the command is answered. That is an assumption: the manual is silent.
    """

    mode: Mode = Field(description="2: most commands are silent; 3: every command is answered.")


class Padded(Wire):
    """Text filled with blanks up to its width."""

    pattern = rf"[ -~]{{{FOLDER_WIDTH}}}"

    def encode(self, value: str) -> str:
        """Fill with blanks."""
        return value.ljust(FOLDER_WIDTH)

    def decode(self, text: str) -> str:
        """Cut the blanks."""
        return text.rstrip(" ")


Date = Annotated[str, Field(pattern="^[0-9]{6}$"), Token(r"[0-9]{6}")]


class SystemVersion(Reply, args="{project_id}{version}{built}{project_folder}{saved}R{revision}<H{c_host}>"):
    """Identity of the system; dates are year, month and day of two digits each."""

    project_id: Annotated[str, Field(pattern="^[ -~]{8}$"), Token("[ -~]{8}")]
    version: Annotated[str, Field(pattern="^[0-9]{4}$"), Token(r"[0-9]{4}")] = Field(
        description="`0310` is version 3.10."
    )
    built: Date = Field(description="Date on which the system was built.")
    project_folder: Annotated[str, Field(pattern=f"^([ -~]{{0,{FOLDER_WIDTH - 1}}}[!-~])?$"), Padded()]
    saved: Date = Field(description="Date on which the project was saved.")
    revision: Annotated[int, Field(ge=0, le=99), FicsDigits(2)]
    c_host: Annotated[int, Field(ge=0, le=99), FicsDigits(2)] | None = Field(
        None, description="Version of C-HOST; absent in Ver.2 mode."
    )


class GetSystemVersion(
    Query[SystemVersion],
    code="VER",
    example=(
        "VER",
        "VER DYNAX0010310041112PROJECT1      041215R01H30",
        "VER",
        "VER DYNAX0010310041112PROJECT1      041215R01",
    ),
):
    """バージョンNO.要求: get the versions of the system."""
