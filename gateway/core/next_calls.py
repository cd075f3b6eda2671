"""The calls that remedy something: errors and alarms name them, so that nobody has to look for them."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, JsonValue, model_validator

from gateway.core.rights import Right


class NextCall(BaseModel):
    """A request to this gateway that helps."""

    model_config = ConfigDict(extra="forbid")

    method: Literal["GET", "POST", "PUT"]
    path: str
    right: Right = Field(description="What its sender has to be allowed; that of its route.")
    body: dict[str, JsonValue] | None = Field(
        default=None,
        exclude_if=lambda value: value is None,
        description="What it takes; left out for nothing, or where only the sender can know.",
    )
    en: str = Field(description="What it does, in English.")
    ja: str = Field(description="What it does, in Japanese.")

    @model_validator(mode="before")
    @classmethod
    def _with_right(cls, data: object) -> object:
        """Read a call of an earlier version's journal, where calls have no right."""
        return {"right": Right.OPERATE, **data} if isinstance(data, dict) else data

    def at(self, names: Mapping[str, object]) -> Self:
        """The same call with the names in its path filled in.

        :raises KeyError: one of them is not known.
        """
        return self.model_copy(update={"path": self.path.format_map(names)})


def get(path: str, en: str, ja: str, right: Right = Right.VIEW) -> NextCall:
    """A call that only looks."""
    return NextCall(method="GET", path=path, right=right, en=en, ja=ja)


def post(path: str, right: Right, en: str, ja: str, **body: JsonValue) -> NextCall:
    """A call that does something."""
    return NextCall(method="POST", path=path, right=right, body=body or None, en=en, ja=ja)


LINE_STATE = get("/lines/{line}", "See the state of the line.", "回線の状態を確認します。")
STOP = post(
    "{subject}/stop", Right.STOP, "Stop it by software.", "ソフトウェア停止をします。", mode="immediate"
)
ACKNOWLEDGE = post(
    "{subject}/power-cycle/acknowledge",
    Right.OPERATE,
    "Acknowledge the power cycle.",
    "電源再投入を確認済みにします。",
)
ALARMS = get("/alarms", "See the alarms that stand.", "発生中のアラームを確認します。")
READY = get(
    "/readyz",
    "See whether lines and journal can be used.",
    "回線とジャーナルの状態を確認します。",
    Right.OPEN,
)


def filled_in(calls: Iterable[NextCall], names: Mapping[str, object]) -> list[NextCall]:
    """The calls whose paths can be filled in with what is known."""
    known = {name: value for name, value in names.items() if value is not None}
    found: list[NextCall] = []
    for call in calls:
        with suppress(KeyError):
            found.append(call.at(known))
    return found
