"""The common base of records that the gateway gives to its clients, and takes from them."""

from collections.abc import Mapping
from typing import Any, ClassVar, Final, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    ModelWrapValidatorHandler,
    PrivateAttr,
    TypeAdapter,
    model_validator,
)

from gateway.core.errors import InvalidRequest
from gateway.core.origin import current

_JSON: Final[TypeAdapter[JsonValue]] = TypeAdapter(JsonValue)


def _all_required(schema: dict[str, Any]) -> None:
    schema["required"] = list(schema["properties"])


def example(**members: object) -> dict[str, JsonValue]:
    """Make `json_schema_extra` for a class of requests, with an example that works on the demo."""
    return {"examples": [_JSON.validate_python(members)]}


def request_id_field(which: str = "the request that asked for it") -> Any:
    """The field of a record with the id of the request that it comes from."""
    return Field(default_factory=lambda: current().request_id, description=f"The X-Request-Id of {which}.")


class AnswerModel(BaseModel):
    """Data that the gateway tells; what writes it is made when it is first told."""

    model_config = ConfigDict(defer_build=True)


class Record(AnswerModel):
    """Something the gateway tells: every member is always there, be it null."""

    model_config = ConfigDict(extra="forbid", json_schema_extra=_all_required)


class RequestModel(BaseModel):
    """A client's request: nothing is converted, and unknown members are refused."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def require_same(told: Mapping[str, Any], present: BaseModel | None, place: str = "") -> None:
    """Refuse members that cannot be set and are not as told.

    :raises InvalidRequest: one is otherwise in the present document; nothing was sent.
    """
    held = {} if present is None else present.model_dump(mode="json", include=set(told))
    for name, value in told.items():
        if name not in held or held[name] != value:
            raise InvalidRequest(
                f"{place}{name}: it cannot be set, and is otherwise now; nothing was sent.",
                "Leave it out, or send it as it was read.",
            )


class SentBack(RequestModel):
    """A change that may be sent as GET gives it: members that cannot be set pass where they are unchanged."""

    read_only: ClassVar[frozenset[str]]
    """The members of the document that no request sets."""
    passing: ClassVar[frozenset[str]] = frozenset()
    """The members that tell of the reading alone, such as its time: they are never compared."""
    null_unset: ClassVar[frozenset[str]] = frozenset()
    """The members that are null where they were never set: null says so, and cannot unset them."""
    wrapped: ClassVar[str | None] = None
    """The member of the document that has the values, where they do not stand beside the others."""
    compared_whole: ClassVar[bool] = True
    """True if the whole document is read before the change, to compare it; else the operation compares."""
    _told: dict[str, Any] = PrivateAttr(default_factory=dict)

    @model_validator(mode="wrap")
    @classmethod
    def _part(cls, given: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Set aside what cannot be set."""
        if not isinstance(given, dict):
            return handler(given)
        told = {
            name: value
            for name, value in given.items()
            if name in cls.read_only and cls._is_told(name, value)
        }
        own = {name: value for name, value in given.items() if name not in told and name not in cls.passing}
        told |= {name: None for name in cls.null_unset & own.keys() if own[name] is None}
        if cls.wrapped is not None and isinstance(own.get(cls.wrapped), dict):
            own |= own.pop(cls.wrapped)
        parted = handler(own)
        parted._told = told  # noqa: SLF001  # its own class
        return parted

    @classmethod
    def _is_told(cls, name: str, value: object) -> bool:
        """Tell what a document says from a wish of the same name, such as `flash`."""
        return name not in cls.model_fields or not isinstance(value, bool)

    @property
    def told(self) -> dict[str, Any]:
        """The members that cannot be set, as they were sent."""
        return self._told

    def require_unchanged(self, present: BaseModel) -> None:
        """Refuse members that cannot be set and are otherwise than in the present document.

        :raises InvalidRequest: one is; nothing was sent.
        """
        require_same(self._told, present)
