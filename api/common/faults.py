"""The faults of a request: each with its place, what is expected there and what was given."""

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from inspect import isclass
from types import UnionType
from typing import Annotated, Any, Final, Literal, TypeGuard, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic_core import ErrorDetails
from typing_extensions import TypeAliasType

from protocols.wording import MOST_SHOWN, expectation, sentence, shown, unknown

MOST_FAULTS = 20
"""Number of places of a request that are told at once."""
MOST_ERRORS = 200
"""Number of errors that are looked at: there may be one for every few bytes of a request."""
_MUST_BE: Final = "must be "


class InvalidParts(Exception):
    """Parts of a request are not as their operation takes them; `shape` is the annotation of its body."""

    def __init__(self, errors: Sequence[Any], body: object, shape: object) -> None:
        super().__init__(errors)
        self.errors, self.body, self.shape = errors, body, shape


def faults_of(errors: Sequence[ErrorDetails], body: object, shape: object) -> dict[str, str]:
    """Say what is expected at each place of a request; `shape` is the annotation of its body.

    Unknown names come first: one of them may have been meant for a member that seems to be missing.
    """
    found: dict[str, list[ErrorDetails]] = {}
    for error in sorted(errors[:MOST_ERRORS], key=_is_known):
        found.setdefault(_place(error, body, shape), []).append(error)
    return {place: _said(found[place], shape) for place in _deepest(found)[:MOST_FAULTS]}


def _is_known(error: ErrorDetails) -> bool:
    return error["type"] != "extra_forbidden"


def _deepest(places: Mapping[str, object]) -> list[str]:
    """The places without those that hold another: what is wrong inside says more than that it has parts."""
    around = {place[:end] for place in places for end, letter in enumerate(place) if letter == "."}
    return [place for place in places if place not in around]


def _said(errors: list[ErrorDetails], shape: object) -> str:
    """Say what is expected at one place, where several forms may be possible."""
    if any(error["type"].startswith("float_") for error in errors):  # a whole number is one, too
        errors = [error for error in errors if not error["type"].startswith("int_")]
    *others, last = errors
    if errors[0]["type"] == "extra_forbidden":
        return _unknown_key(errors[0], shape)
    if errors[0]["type"] == "union_tag_not_found":
        return f"is required: {_tags_at(errors[0], shape)}{_meant_by(errors[0])}"
    forms = dict.fromkeys([expectation(error) for error in others] + [sentence(last)])
    first, *more = forms
    return " or ".join([first, *(form.removeprefix(_MUST_BE) for form in more)])


def _unknown_key(error: ErrorDetails, shape: object) -> str:
    *place, name = error["loc"][1:]
    known = dict.fromkeys(key for model in _models_at(shape, place) for key in model.model_fields)
    return f"{expectation(error)} ({unknown(str(name)[:MOST_SHOWN], known)})"


def _tags_at(error: ErrorDetails, shape: object) -> str:
    name = _discriminator(error)
    fields = (model.model_fields.get(name) for model in _models_at(shape, error["loc"][1:]))
    tags = dict.fromkeys(repr(tag) for field in fields if field for tag in _literals(field.annotation))
    return ", ".join(tags)


def _meant_by(error: ErrorDetails) -> str:
    """Name a key that was given and may be the one that is missing."""
    given = error["input"] if isinstance(error["input"], Mapping) else {}
    similar = get_close_matches(_discriminator(error), map(str, given), n=1)
    return f"; {similar[0]!a} is not known here" if similar else ""


def _discriminator(error: ErrorDetails) -> str:
    return str(error.get("ctx", {}).get("discriminator", "")).strip("'")


def _place(error: ErrorDetails, body: Any, shape: object) -> str:
    """Where in the request a fault is: its path, without the names of the members of unions."""
    location = error["loc"]
    if location[0] != "body":
        return _named(location[-1])
    parts: list[str] = []
    _, tags = _followed(shape, location[1:])
    for index, part in enumerate(location[1:], start=2):
        if index - 2 in tags:
            continue
        known = part in body if isinstance(body, dict) else isinstance(body, list) and isinstance(part, int)
        missing = isinstance(body, dict) and index == len(location)
        if known:
            body = body[part]
        if known or missing:
            parts.append(_named(part))
    if error["type"].startswith("union_tag"):
        parts.append(_discriminator(error))
    return ".".join(parts)


def _named(part: str | int) -> str:
    """A part of a place, short and printable."""
    return part if isinstance(part, str) and part.isidentifier() and len(part) < MOST_SHOWN else _quoted(part)


def _quoted(part: str | int) -> str:
    return str(part) if isinstance(part, int) else str(shown(part))


def _models_at(shape: object, location: Sequence[str | int]) -> list[type[BaseModel]]:
    """The models that may stand at a place of a request."""
    options, _ = _followed(shape, location)
    return [option for option in options if _is_model(option)]


def _followed(shape: object, location: Sequence[str | int]) -> tuple[list[Any], set[int]]:
    """The shapes that may stand at a place of a request, and its words that are tags of unions."""
    options, tags = list(kinds_of(shape)), set()
    for index, part in enumerate(location):
        inside = [found for option in options for found in _inside(option, part)]
        # The tag of one member of a union may be the name of a field, too.
        several = len([option for option in options if _is_model(option)]) > 1
        tagged = [option for option in options if _is_tagged(option, part)] if several else []
        if tagged:
            tags.add(index)
        options = tagged or inside or options
    return options, tags


def kinds_of(annotation: Any) -> Iterator[Any]:
    """The types that may stand for one."""
    origin = get_origin(annotation)
    if isinstance(annotation, TypeAliasType):
        yield from kinds_of(annotation.__value__)
    elif origin is Annotated:
        yield from kinds_of(get_args(annotation)[0])
    elif origin in (Union, UnionType):
        for member in get_args(annotation):
            yield from kinds_of(member)
    else:
        yield annotation


def _inside(option: Any, part: str | int) -> Iterator[Any]:
    if _is_model(option):
        field = option.model_fields.get(str(part))
        if field is not None:
            yield from kinds_of(field.annotation)
    elif get_origin(option) in (list, tuple, dict):
        yield from kinds_of(get_args(option)[-1 if get_origin(option) is dict else 0])


def _is_tagged(option: Any, part: str | int) -> bool:
    """Tell if a word of an error's place is the tag of a model."""
    return _is_model(option) and any(
        part in _literals(field.annotation) for field in option.model_fields.values()
    )


def _is_model(option: Any) -> TypeGuard[type[BaseModel]]:
    return isclass(option) and issubclass(option, BaseModel)


def _literals(annotation: Any) -> tuple[Any, ...]:
    return get_args(annotation) if get_origin(annotation) is Literal else ()
