"""Commands to the RC-400 link master itself, at body 7F: code X (RC-420 manual 13.9-13.11, 17.2)."""

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from protocols.rorze.notation import Flag, Printable
from protocols.rorze.row import LinkMasterCommand
from protocols.table import Ack, Effect, R_co, Reply, Retry, Wire

MEMBER_PATTERN = r"[0-6][0-9A-F]|7[0-7]"
GROUP_PATTERN = r"8[0-9A-F]|9[0-9A-E]"

MOST_MEMBERS = 17
"""Members that fit in the 60 characters of a command (RC-420 manual 12)."""


class BodyNumbers(Wire):
    """Body numbers joined by commas."""

    pattern = r"[0-9A-F]{2}(?:,[0-9A-F]{2})*"

    def encode(self, value: Any) -> str:
        """Join the numbers."""
        return ",".join(value)

    def decode(self, text: str) -> list[str]:
        """Split at the commas."""
        return text.split(",")


def no_repeats(members: list[str]) -> list[str]:
    """Refuse to list a body twice."""
    if len(set(members)) != len(members):
        raise ValueError("a body is listed twice")
    return members


class LinkSetUp(LinkMasterCommand[R_co], program=False, retry=Retry.SETTING, effect=Effect.MAINTENANCE):
    """Base of the commands that set up the link."""


Member = Annotated[str, Field(pattern=rf"^(?:{MEMBER_PATTERN})$")]
Members = Annotated[
    list[Member], Field(min_length=1, max_length=MOST_MEMBERS), AfterValidator(no_repeats), BodyNumbers()
]


class ConnectedControllers(Reply, args="{text}"):
    """The link master's answer to XID; the RC-420 manual does not say in which form."""

    text: Annotated[str, Field(pattern=r"^[ -~]*$"), Printable(r"[ -~]*")]


class IdentifyControllers(
    LinkSetUp[ConnectedControllers],
    code="XID",
    # The manual prints the command only; the list in the reply is an assumption.
    example=("&7FXID", ">&7FXID00,02,3F"),
):
    """接続コントローラの確認: identify the connected controllers.

    From then on the link master passes on events and program messages (RC-420 manual 13.11).
    """


class SetReplyFormat(
    LinkSetUp[Ack],
    code="XRS",
    args="M{end_of_move}",
    errors=frozenset({0x4A}),
    example=("&7FXRSM1", ">&7FXRS"),
):
    """応答書式の設定: set the form of replies.

    M is the only known setting.
    """

    end_of_move: Flag = Field(
        description="1: a frame from body 7D tells the end of every move; 0: none does."
    )


class SetGroup(
    LinkSetUp[Ack],
    code="XVS",
    args="{group},{members}",
    errors=frozenset({0x4A}),
    example=("&7FXVS80,00,01,3F", ">&7FXVS"),
):
    """仮想ボディ・ナンバーの設定: set the members of a virtual body."""

    group: Annotated[str, Field(pattern=rf"^(?:{GROUP_PATTERN})$"), Printable("[0-9A-F]{2}")] = Field(
        description="Virtual body number, 80 to 9E hexadecimal."
    )
    members: Members = Field(description="Body numbers, 00 to 77 hexadecimal, in the order of the replies.")
