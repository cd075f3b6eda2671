"""The faults that pydantic finds, in this project's words: pydantic's own words never reach a user."""

import re
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from typing import Final, get_args

from pydantic_core import ErrorDetails
from pydantic_core.core_schema import ErrorType

MOST_SHOWN = 40
"""Characters of what was given that a sentence repeats."""
_PLAIN: Final = re.compile(rf"[\w./-]{{1,{MOST_SHOWN}}}", re.ASCII)
_SIMILAR: Final = 0.65
"""Least similarity of a word to the name it was meant for: `bodies` is 0.6 like `mode`, and was not."""

_WHOLE: Final = "must be a whole number"
_NUMBER: Final = "must be a number"
_FLAG: Final = "must be true or false"
_TEXT: Final = "must be text"
_TIME: Final = "must be a time such as 2026-01-31T12:00:00Z"
_LIST: Final = "must be an array"
_TABLE: Final = "must be an object"

_EXPECTED: Final[Mapping[str, str]] = {
    "missing": "is required",
    "extra_forbidden": "is not known here",
    "greater_than": "must be greater than {gt}",
    "greater_than_equal": "must be {ge} or more",
    "less_than": "must be less than {lt}",
    "less_than_equal": "must be {le} or less",
    "multiple_of": "must be a multiple of {multiple_of}",
    "finite_number": "must be a finite number",
    "literal_error": "must be {expected}",
    "enum": "must be {expected}",
    "union_tag_invalid": "must be {expected_tags}",
    "union_tag_not_found": "is required",
    "string_too_short": "must have {min_length} or more characters",
    "string_too_long": "must have {max_length} or fewer characters",
    "string_pattern_mismatch": "has characters, or an order of them, that are not allowed here",
    "string_unicode": "must be Unicode text",
    "string_type": _TEXT,
    "too_short": "must have {min_length} or more entries",
    "too_long": "must have {max_length} or fewer entries",
    "none_required": "must be null",
    **dict.fromkeys(("datetime_type", "datetime_parsing", "datetime_from_date_parsing"), _TIME),
    "timezone_aware": f"{_TIME}, with its zone",
    "path_type": "must be a path",
    **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), _WHOLE),
    "int_parsing_size": "must be a smaller whole number",
    **dict.fromkeys(("float_type", "float_parsing"), _NUMBER),
    **dict.fromkeys(("bool_type", "bool_parsing"), _FLAG),
    **dict.fromkeys(("list_type", "tuple_type", "set_type", "frozen_set_type", "iterable_type"), _LIST),
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type", "mapping_type"), _TABLE),
    **dict.fromkeys(("dataclass_type", "json_type"), _TABLE),
}
_NO_WORDS: Final = "is not what is expected here"
_KNOWN: Final = frozenset(get_args(ErrorType))


def sentence(fault: ErrorDetails, words: Mapping[str, str] | None = None) -> str:
    """Say what is expected, and what was given where that helps; `words` go before those of this module."""
    expected, given = expectation(fault, words), shown(fault["input"])
    if given is None or fault["type"] in _SAYS_ENOUGH:
        return expected + _meant_by(fault)
    if fault["type"] in _OWN_SENTENCES:
        return expected if given in expected else f"{expected} (given: {given})"
    return f"{expected}, not {given}{_meant_by(fault)}"


def _meant_by(fault: ErrorDetails) -> str:
    """Name the word, of those that are possible, which was meant by the one that was given."""
    context = fault.get("ctx", {})
    possible = re.findall("'([^']*)'", str(context.get("expected", context.get("expected_tags", ""))))
    similar = get_close_matches(str(context.get("tag", fault["input"]))[:MOST_SHOWN], possible, n=1)
    return f" (did you mean {similar[0]!r}?)" if similar else ""


_SAYS_ENOUGH: Final = frozenset({"missing", "extra_forbidden", "union_tag_not_found"})
_OWN_SENTENCES: Final = frozenset({"value_error", "assertion_error", "string_pattern_mismatch"})


def expectation(fault: ErrorDetails, words: Mapping[str, str] | None = None) -> str:
    """Say what is expected."""
    kind, context = fault["type"], fault.get("ctx", {})
    if isinstance(context.get("error"), ValueError | AssertionError):
        return str(context["error"])
    if kind not in _KNOWN and kind not in _EXPECTED:
        return fault["msg"]  # of a type of our own
    template = (words or {}).get(kind) or _EXPECTED.get(kind, _NO_WORDS)
    return template.format_map({name: _in_words(name, value) for name, value in context.items()})


def _in_words(name: str, value: object) -> object:
    """Write a whole number without a point, and alternatives as a sentence does."""
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if name != "expected_tags":
        return value
    *tags, last = str(value).split(", ")
    return " or ".join(filter(None, (", ".join(tags), last)))


def shown(given: object) -> str | None:
    """Write a value shortly, and so that it can be printed; None for what has parts."""
    if given is None or isinstance(given, bool):
        return {None: "null", True: "true", False: "false"}[given]
    if not isinstance(given, str | int | float):
        return None
    if isinstance(given, str) and len(given) > MOST_SHOWN:
        return repr(given[:MOST_SHOWN] + "...")
    text = repr(given)
    return text if isinstance(given, str) or len(text) <= MOST_SHOWN else text[:MOST_SHOWN] + "..."


def as_given(name: str) -> str:
    """Write an unknown name: in quotes where it is blank, or its end could not be seen."""
    return name if _PLAIN.fullmatch(name) else str(shown(name))


def joined(*words: str) -> str:
    """Join words as a sentence does."""
    return f"{', '.join(words[:-1])} and {words[-1]}"


def unknown(name: str, known: Collection[str], listed: Collection[str] | None = None) -> str:
    """Say which name an unknown one was meant to be, or which names there are: of very many, `listed`."""
    similar = get_close_matches(name, known, n=1, cutoff=_SIMILAR) or _another_number(name, known)
    if similar:
        return f"did you mean {similar[0]}?"
    return f"known are {', '.join(listed or known)}" if known else "it takes none"


def _another_number(name: str, known: Collection[str]) -> list[str]:
    """The name in the plural: body, bodies."""
    return [other for other in known if other in (f"{name}s", f"{name[:-1]}ies")]


def plain_number(value: float, decimals: int) -> str:
    """Write a number with up to `decimals` decimals, never with an exponent."""
    return f"{value:.{decimals}f}".rstrip("0").rstrip(".")
