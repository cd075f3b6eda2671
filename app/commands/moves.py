"""Commands and moves from the command line, through a running gateway: `send` and `move`.

The tables of commands are loaded where a command is read: half a second that a move does not wait for.
"""

import re
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, get_args

import typer

from app.client import LOCAL, Client, KeyFile, Seconds, Url, exit_of_moves, exit_of_stop, going_on_after
from app.exits import Misuse
from app.output import ProgressLine, json_text
from app.targets import NamedTarget, addresses, find

if TYPE_CHECKING:
    from protocols.table import Command

CommonKind = Literal["relative", "absolute", "position", "home"]
ScaraKind = Literal["line", "path", "offset", "extend", "retract", "rotate", "finger", "align"]
MoveKind = Literal[CommonKind, ScaraKind]

Whose = Annotated[
    str,
    typer.Argument(
        help="Address or name: 3F, LINE.3F, a group's 80, r1, r1/units/1, lift.", autocompletion=addresses
    ),
]


def send(
    address: Whose,
    command: Annotated[
        str, typer.Argument(help="Code and parameters as in the manual: 6PD, 1+MA[12],50000; for robots APS.")
    ],
    url: Url = LOCAL,
    key_file: KeyFile = None,
    wait: Seconds = 0,
) -> None:
    """Send one command of the manuals through a running gateway, and print the answer as JSON."""
    client = Client.at(url, key_file)
    target = find(client, address)
    row, path = _of_robot(target, command) if target.kind == "robots" else _of_body(target, command)
    path, content = f"{path}/commands/{row.name()}", row.model_dump(mode="json", exclude_none=True)
    if row.starts_motion:
        _move(client, path, content, wait)
    with going_on_after("the command"):
        answer = client.request("POST", path, content)
    typer.echo(json_text(answer))
    if "confirmed" in answer:
        raise typer.Exit(exit_of_stop(answer))


def move(
    address: Whose,
    kind: Annotated[MoveKind, typer.Argument(help="What kind of move.")],
    values: Annotated[
        list[str] | None,
        typer.Argument(
            help="How far, or where to: 500, -12.5; for robots by axis: X=10 Z=-5.5; for SCARA robots X=10 "
            "Y=5, R=150 A=90, or a number alone; or a stored position: 5."
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            help="pulse, mm, um, deg, mdeg; for robots mm, pulse, degree. Left out: pulse, the axis's, mm."
        ),
    ] = None,
    pattern: Annotated[int | None, typer.Option(help="Acceleration pattern of RC-420s, 0-29.")] = None,
    wait: Seconds = 0,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Move a body, a group, a unit of a robot or a SCARA robot, and print the move as JSON."""
    client = Client.at(url, key_file)
    target = find(client, address)
    if target.kind == "robots":
        path = target.unit_path()
        content = robot_move(client, path, kind, values or [], unit)
    elif target.kind == "scaras":
        path, content = target.path, scara_move(kind, values or [], unit)
    else:
        path, content = target.path, body_move(kind, values or [], unit or "pulse")
    _move(client, f"{path}/moves", content | ({} if pattern is None else {"pattern": pattern}), wait)


def _move(client: Client, path: str, content: object, wait_s: float) -> None:
    """Start what moves, print it when it is over or the time is up, and end."""
    with ProgressLine() as progress:
        moves = client.begin(path, content, wait_s, progress)
    typer.echo(json_text(moves[0] if len(moves) == 1 else {"moves": moves}))
    raise typer.Exit(exit_of_moves(moves, awaited=wait_s > 0))


# commands as the manuals write them


def _of_body(target: NamedTarget, text: str) -> "tuple[Command[Any], str]":
    """Read a command of the RC-420; case and blanks matter only where a parameter is a text."""
    from protocols.rorze.commands import COMMANDS
    from protocols.table import SyntaxFault, WireFault

    code, parameters = text.strip()[:3].upper(), text.strip()[3:]
    row = COMMANDS.get(code)
    if row is None:
        raise Misuse(
            f"There is no command {code!r} of RC-420 bodies; `GET /commands?family=rorze` lists theirs"
        )
    try:
        try:
            return row.read(parameters), target.path
        except SyntaxFault:
            return row.read(parameters.replace(" ", "").upper()), target.path
    except WireFault as error:
        raise Misuse(f"{code}: {error}") from None


def _of_robot(target: NamedTarget, text: str) -> "tuple[Command[Any], str]":
    """Read a command of C-HOST, and find the unit it is for, or the robot as a whole."""
    from protocols.fics.commands import of_the_robot, read
    from protocols.fics.jog import StartJog
    from protocols.fics.row import NAME_LENGTH
    from protocols.table import WireFault

    written = text.strip().upper()
    name, arguments = written[:NAME_LENGTH], written[NAME_LENGTH:].strip()
    try:
        command = read(name, arguments)
    except WireFault as error:
        raise Misuse(f"{name}: {error}") from None
    if isinstance(command, StartJog):
        raise Misuse(
            "A JOG goes on only as long as heartbeats come, and `send` sends none; see POST /robots/ID/jogs"
        )
    if of_the_robot(type(command)):
        return command, f"/robots/{target.address}"
    return command, target.unit_path()


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
