"""Moves in the words of the command line, put into those of the interface."""

import re
from typing import Any, Final, Literal, get_args

from app.client import Client
from app.exits import Misuse

CommonKind = Literal["relative", "absolute", "position", "home"]
ScaraKind = Literal["line", "path", "offset", "extend", "retract", "rotate", "finger", "align"]
MoveKind = Literal[CommonKind, ScaraKind]

_NAMED: Final = {
    "line": {"X": "x", "Y": "y"},
    "offset": {"X": "x", "Y": "y"},
    "align": {"X": "x", "Y": "y"},
    "rotate": {"R": "radius", "A": "angle"},
}
"""Letters of arguments such as X=10, with the names that they have in the interface."""
_ALONE: Final = {"path": "path", "extend": "distance", "retract": "distance", "finger": "angle"}
"""Names in the interface of arguments that are a number alone."""


def body_move(kind: MoveKind, values: list[str], unit: str) -> dict[str, Any]:
    """Put a move of a body or a group into the words of the interface.

    :raises Misuse: it is none of theirs, or its value is not understood.
    """
    if (content := _common_move(kind, values)) is not None:
        return content
    _expect(1, values, f"`{kind}` takes one value, such as 500")
    number = _number(values[0])
    if kind == "absolute":
        return {"kind": "absolute", "position": {"value": number, "unit": unit}}
    direction = "ccw" if number < 0 else "cw"
    return {"kind": "relative", "direction": direction, "distance": {"value": abs(number), "unit": unit}}


def robot_move(
    client: Client, path: str, kind: MoveKind, values: list[str], unit: str | None
) -> dict[str, Any]:
    """Put a move of a robot's unit into the words of the interface; `path` is where the unit is served.

    :raises Failure: it is none of theirs, its values are not understood, or the gateway does not answer.
    """
    if (content := _common_move(kind, values)) is not None:
        return content
    axes: dict[str, Any] = {}
    for value in values:
        name, equals, number = value.partition("=")
        if not equals or name.upper() in axes:
            raise Misuse(f"{value!r} is no axis with a value, each axis once: say X=10")
        axes[name.upper()] = {"value": _number(number), "unit": unit}
    if not axes:
        raise Misuse(f"`{kind}` takes an axis with its value at least: say X=10")
    if unit is None:
        own = {axis["name"]: axis["unit"] for axis in client.request("GET", path)["axes"]}
        for name, amount in axes.items():
            amount["unit"] = own.get(name, "mm")  # of an axis it does not have the gateway tells
    return {"kind": kind, "axes": axes}


def scara_move(kind: MoveKind, values: list[str], unit: str | None) -> dict[str, Any]:
    """Put a move of a SCARA robot into those words: lengths in mm or `unit`, angles in degrees.

    :raises Misuse: it is none of a SCARA robot, or its values are not understood.
    """
    if kind == "path" and any("," in value for value in values):
        return {"kind": kind, "points": [_point(value, unit) for value in values]}
    if kind in _ALONE:
        _expect(1, values, f"`{kind}` takes one number")
        return {"kind": kind, _ALONE[kind]: _amount(_ALONE[kind], _number(values[0]), unit)}
    names = _NAMED.get(kind)
    if names is None:
        raise Misuse(f"A SCARA robot has no move `{kind}`; say {', '.join((*_NAMED, *_ALONE))}")
    request: dict[str, Any] = {"kind": kind}
    for value in values:
        name, _, written = value.partition("=")
        field = names.get(name.upper())
        if field is None or field in request:
            raise Misuse(f"{value!r} is none of {' and '.join(names)} with its number, each once: say X=10")
        request[field] = _amount(field, _number(written), unit)
    return request


def _point(written: str, unit: str | None) -> dict[str, Any]:
    """A point of a path, X,Y or X,Y,RADIUS."""
    values = written.split(",")
    if len(values) not in (2, 3):
        raise Misuse(f"{written!r} is no point: say X,Y or X,Y,RADIUS")
    names = zip(("x", "y", "radius"), values, strict=False)
    return {name: _amount(name, _number(value), unit) for name, value in names}


def _amount(field: str, number: float, unit: str | None) -> object:
    if field == "path":
        return number
    return {"value": number, "unit": "deg" if field == "angle" else unit or "mm"}


def _common_move(kind: MoveKind, values: list[str]) -> dict[str, Any] | None:
    """A move that bodies and robots take in the same words."""
    if kind in get_args(ScaraKind):
        raise Misuse(f"Only SCARA robots have moves `{kind}`")
    if kind == "home":
        _expect(0, values, "`home` takes no value")
        return {"kind": "home"}
    if kind == "position":
        _expect(1, values, "`position` takes one number, such as 5")
        return {"kind": "position", "position": _number(values[0])}
    return None


def _expect(count: int, values: list[str], sentence: str) -> None:
    if len(values) != count:
        raise Misuse(f"{sentence}, and {len(values)} were given")


def _number(text: str) -> int | float:
    if re.fullmatch(r"[+-]?\d{1,12}", text, re.ASCII):
        return int(text)
    if re.fullmatch(r"[+-]?\d{1,12}\.\d{1,12}", text, re.ASCII):
        return float(text)
    raise Misuse(f"{text!r} is no number")
