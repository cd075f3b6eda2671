"""JSON of which nothing is guessed, rounded, overwritten or silently dropped."""

import json
import math
import re
from typing import Final

from gateway.core.aside import aside
from gateway.core.records import RequestModel

_SURROGATE = re.compile("[\ud800-\udfff]")

MAX_DEPTH = 16
"""Most levels of arrays and objects in a request; the deepest command has three."""

MAX_KEYS = 100
"""Most keys in an object of a request; the largest has as many as a robot has settings."""

MAX_ITEMS = 2_048
"""Items of an array or table of a request, at most: as many positions as a body has."""

INLINE_BYTES = 4_096
"""A longer body is read beside the event loop: that may take milliseconds."""

MAX_DIGITS = 1000
"""Most digits in a whole number of a request; reading one takes the longer the more it has."""


MOST_EXACT = 2**53
"""Up to here no whole number with a point is rounded when it is read."""


class NoContent(RequestModel):
    """The content of a request to a route that takes none."""


class NotStrict(ValueError):
    """JSON by its grammar, but not to be trusted."""


def parse(data: bytes) -> object:
    """Read a JSON text.

    :raises NotStrict: a key stands twice, a number is not finite, text is not Unicode, or it is too large.
    :raises ValueError: it is no JSON, or not UTF-8.
    """
    try:
        value: object = _DECODER.decode(data.decode("utf-8"))
    except RecursionError:
        raise NotStrict(f"arrays and objects are nested more than {MAX_DEPTH} deep") from None
    _check(value, MAX_DEPTH, "")
    return value


def _integer(digits: str) -> float:
    return int(digits) if len(digits) <= MAX_DIGITS else math.inf


def _number(text: str) -> float:
    """Take 5000.0 for the whole number it is: JSON has one kind of number."""
    value = float(text)
    return int(value) if abs(value) <= MOST_EXACT and value.is_integer() else value


def _object(pairs: list[tuple[str, object]]) -> dict[str, object]:
    if len(pairs) > MAX_KEYS:
        raise NotStrict(f"an object has more than {MAX_KEYS} keys")
    result = dict(pairs)
    if len(result) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise NotStrict(f"the key {twice!a} stands there more than once")
    return result


_DECODER: Final = json.JSONDecoder(
    object_pairs_hook=_object, parse_constant=float, parse_int=_integer, parse_float=_number
)


def _check(value: object, levels: int, place: str) -> None:
    """Refuse what is no number, lone surrogates, which no answer could repeat, and bottomless nesting."""
    if isinstance(value, float):
        if not math.isfinite(value):
            raise NotStrict(f"{place[-100:] or 'it'} is not a number, or too large a number")
    elif isinstance(value, str):
        if not value.isascii() and _SURROGATE.search(value):
            raise NotStrict("text holds half of a surrogate pair")
    elif isinstance(value, dict | list):
        if levels == 0:
            raise NotStrict(f"arrays and objects are nested more than {MAX_DEPTH} deep")
        if len(value) > MAX_ITEMS:
            raise NotStrict(f"an array has more than {MAX_ITEMS} items")
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            _check(key, levels - 1, place)
            _check(item, levels - 1, f"{place}.{key}" if place else str(key))


async def read(data: bytes) -> object:
    """Read a JSON text, a long one beside the event loop; errors as of `parse`."""
    return parse(data) if len(data) <= INLINE_BYTES else await aside(parse, data)
