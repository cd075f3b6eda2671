"""Commands and moves from the command line, through a running gateway: `send` and `move`.

The tables of commands are loaded where a command is read: half a second that a move does not wait for.
"""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from app.client import LOCAL, Client, KeyFile, Seconds, Url, exit_of_moves, exit_of_stop, going_on_after
from app.commands.move_requests import MoveKind, body_move, robot_move, scara_move
from app.completion import addresses
from app.exits import Misuse
from app.output import json_text
from app.progress import ProgressLine
from app.targets import NamedTarget, find

if TYPE_CHECKING:
    from protocols.table import Command

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
    if row.starts_motion():
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
