"""Moves of SCARA robots in the words of the command line."""

from collections.abc import Callable, Sequence
from typing import Any, Final

from app import exits
from app.exits import Failure

_NAMED: Final = {
    "line": {"X": "x", "Y": "y"},
    "offset": {"X": "x", "Y": "y"},
    "align": {"X": "x", "Y": "y"},
    "rotate": {"R": "radius", "A": "angle"},
}
"""What is written as X=10, by its name in the interface."""
_ALONE: Final = {"path": "path", "extend": "distance", "retract": "distance", "finger": "angle"}
"""What is written as a number alone."""


def scara_move(
    kind: str, values: Sequence[str], unit: str | None, number: Callable[[str], int | float]
) -> dict[str, Any]:
    """Put a move into the words of the interface: lengths in mm or `unit`, angles in degrees.

    :raises Failure: it is none of a SCARA robot, or its values are not understood.
    """
    if kind == "path" and any("," in value for value in values):
        return {"kind": kind, "points": [_point(value, unit, number) for value in values]}
    if kind in _ALONE:
        if len(values) != 1:
            raise _usage(f"`{kind}` takes one number, and {len(values)} were given")
        return {"kind": kind, _ALONE[kind]: _amount(_ALONE[kind], number(values[0]), unit)}
    names = _NAMED.get(kind)
    if names is None:
        raise _usage(f"A SCARA robot has no move `{kind}`; say {', '.join((*_NAMED, *_ALONE))}")
    request: dict[str, Any] = {"kind": kind}
    for value in values:
        name, _, written = value.partition("=")
        field = names.get(name.upper())
        if field is None or field in request:
            raise _usage(f"{value!r} is none of {' and '.join(names)} with its number, each once: say X=10")
        request[field] = _amount(field, number(written), unit)
    return request


def _point(written: str, unit: str | None, number: Callable[[str], int | float]) -> dict[str, Any]:
    """A point of a path, X,Y or X,Y,RADIUS."""
    values = written.split(",")
    if len(values) not in (2, 3):
        raise _usage(f"{written!r} is no point: say X,Y or X,Y,RADIUS")
    names = zip(("x", "y", "radius"), values, strict=False)
    return {name: _amount(name, number(value), unit) for name, value in names}


def _amount(field: str, number: float, unit: str | None) -> object:
    if field == "path":
        return number
    return {"value": number, "unit": "deg" if field == "angle" else unit or "mm"}


def _usage(sentence: str) -> Failure:
    return Failure(f"{sentence}. Nothing was sent.", exits.USAGE)
