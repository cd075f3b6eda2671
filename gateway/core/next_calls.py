"""The calls that remedy something: errors and alarms name them, so that a user need not look for them."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, JsonValue, model_validator
from typing_extensions import TypeAliasType

from gateway.core.marks import DETAIL
from gateway.core.rights import Right
from gateway.texts import text

CallMethod = TypeAliasType("CallMethod", Literal["GET", "POST", "PUT"])


class NextCall(BaseModel):
    """A request to this gateway that helps."""

    model_config = ConfigDict(extra="forbid")

    method: CallMethod
    path: str
    right: Right = Field(description="The right that the caller needs.")
    body: dict[str, JsonValue] | None = Field(
        default=None,
        exclude_if=lambda value: value is None,
        json_schema_extra=DETAIL,
        description="Content of the request; left out if there is none, or if only the caller can know it.",
    )
    en: str = Field(description="Effect of the call, in English.")
    ja: str = Field(description="Effect of the call, in Japanese.")

    @model_validator(mode="before")
    @classmethod
    def _with_right(cls, data: object) -> object:
        """Read a call of an earlier version's journal, where calls have no right."""
        return {"right": Right.OPERATE, **data} if isinstance(data, dict) else data

    def at(self, names: Mapping[str, object]) -> Self:
        """Fill in the names in the call's path.

        :raises KeyError: one of them is not known.
        """
        return self.model_copy(update={"path": self.path.format_map(names)})


def get(path: str, key: str, right: Right = Right.VIEW) -> NextCall:
    """A call that only looks; `calls.KEY` of the catalogue says what it does."""
    said = text(f"calls.{key}")
    return NextCall(method="GET", path=path, right=right, en=said.en, ja=said.ja)


def post(path: str, right: Right, key: str, **body: JsonValue) -> NextCall:
    """A call that does something; `calls.KEY` of the catalogue says what."""
    said = text(f"calls.{key}")
    return NextCall(method="POST", path=path, right=right, body=body or None, en=said.en, ja=said.ja)


LINE_STATE = get("/lines/{line}", "line-state")
STOP = post("{subject}/stop", Right.STOP, "stop", mode="immediate")
ACKNOWLEDGE = post(
    "{subject}/power-cycle/acknowledge",
    Right.OPERATE,
    "acknowledge",
)
ALARMS = get("/alarms", "alarms")
READY = get(
    "/readyz",
    "ready",
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
