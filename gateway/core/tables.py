"""Tables of the configuration: what those of all kinds of controllers have in common."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Protocol, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from gateway.core.toml_lines import KeyPath
from protocols.wording import unknown
from transports import create


class Fault(ValueError):
    """A fault at a place inside the table whose validator raises it."""

    def __init__(self, message: str, *path: str | int) -> None:
        super().__init__(message)
        self.path = path


class Weakness(NamedTuple):
    """A setting that protects less than its default."""

    setting: str
    """Name of the setting in the configuration."""
    value: object
    meaning: str
    """The risk of the setting, in one sentence."""


class Table(BaseModel):
    """A TOML table: read-only, with the keys of its fields and no others."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _know_every_key(cls, table: Any) -> Any:
        for key in table if isinstance(table, dict) else ():
            if key not in cls.model_fields:
                raise Fault(f"unknown key ({unknown(key, cls.model_fields)})", key)
        return table


def check_slug(text: str) -> str:
    """Refuse what is no short name in lower case."""
    if not re.fullmatch("[a-z][a-z0-9-]{0,31}", text):
        raise ValueError(
            f"must be up to 32 lower-case letters, digits and hyphens, a letter first, not {text!r}"
        )
    return text


def _check_address(text: str) -> str:
    create(text)
    return text


def check_printable(text: str) -> str:
    """Refuse what people cannot read."""
    if not text.isprintable() or not text.strip():
        raise ValueError("must be printable text")
    return text


def refuse_repeats(values: Iterable[object], array: str, *, key: str | None = None) -> None:
    """Refuse an array that says the same twice."""
    seen: list[object] = []
    for index, value in enumerate(values):
        if value in seen:
            place = f"{array}[{seen.index(value)}]" + (f".{key}" if key else "")
            raise Fault(f"is the same as {place}", array, index, *([key] if key else []))
        seen.append(value)


T = TypeVar("T")
Array = Annotated[tuple[T, ...], Field(strict=False)]
"""A TOML array; its elements stay strict."""

Slug = Annotated[str, AfterValidator(check_slug)]
Name = Annotated[str, Field(max_length=64), AfterValidator(check_printable)]


def named(id_: str, name: str | None) -> str:
    """An id with the name that people have given it."""
    return f"{id_} ({name})" if name else id_


class LineTable(Table):
    """A port; what is on it stands in the table of its protocol."""

    id: Slug
    address: Annotated[str, AfterValidator(_check_address)]
    protocol: str
    """Protocol of the line: the name of its family."""
    owners: Array[Slug] = ()
    """Gateways of the plant that may have it: the first opens it, the others may take it over."""
    reply_timeout_s: float = Field(0.5, gt=0, le=60)
    """Seconds from a command's last byte to the deadline of its reply; flash commands are given longer."""
    late_reply_s: float = Field(2.0, ge=0, le=60)
    """Seconds after its deadline for which a reply may still arrive."""
    poll_interval_s: float = Field(0.2, ge=0.01, le=60)
    """Seconds between the questions to a part that moves."""
    live_share: float = Field(0.5, ge=0.01, le=1)
    """Share of the line's time that watched values may take; all other work goes first."""
    commissioned: Annotated[Path, Field(strict=False)] | None = None
    """The report of its commissioning, which says what of it was tried."""
    trace_entries: int = Field(10_000, ge=0, le=1_000_000)
    """Records of the line's traffic that are kept in memory."""
    trace_file: Annotated[Path, Field(strict=False)] | None = None
    trace_file_bytes: int = Field(8_000_000, ge=4096)
    """Size of each file of the trace's ring."""
    trace_files: int = Field(4, ge=2, le=100)

    def served(self) -> str:
        """The controllers on it, in words."""
        return self.protocol

    def weakened(self) -> Iterable[Weakness]:
        """Defaults of the line that were weakened."""
        return ()

    def unique_ids(self) -> Mapping[KeyPath, str]:
        """The ids on this line that no other line may have, by where they stand."""
        return {}


class Made(Protocol):
    """A table of what an extension makes of things on a line."""

    @property
    def id(self) -> str:
        """Id, among those of all parts."""

    @property
    def line(self) -> str:
        """The line that it is on."""

    @classmethod
    def require_places(cls, made: Sequence[Any], lines: Mapping[str, Any]) -> None:
        """Refuse what is not on its line, or has there what another one has.

        :raises Fault: that is so; its path begins with the number of the table.
        """

    def served(self) -> str:
        """The thing and its family, in words."""

    def model_dump(self, *, mode: str = ..., exclude_unset: bool = ...) -> dict[str, Any]:
        """Give what was said."""
