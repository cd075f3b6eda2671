"""The command line's part for user programs: checked, uploaded, read back, run."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app import exits, words
from app.client import LOCAL, Client, KeyFile, Url, going_on_after
from app.exits import Failure, Misuse
from app.output import json_text
from app.targets import addresses, find

if TYPE_CHECKING:
    from protocols.rorze.user_program.assembler import Assembled, ProgramFault

LAST_ADDRESS = 6038
"""Highest address of a user program, as in `protocols.rorze.programs`, which takes long to load."""
CHECK_S = 10
"""While an upload runs, its progress is printed at least this often."""
DOWNLOAD_S = 600
"""A full program takes minutes at 9600 baud."""

program = typer.Typer(help="Check user programs, upload them to bodies and run them.", no_args_is_help=True)

Source = Annotated[Path, typer.Argument(help="A program: one command a line, comments after `;`.")]
Body = Annotated[
    str, typer.Argument(help="Address or name of a body: 3F, LINE.3F, lift.", autocompletion=addresses)
]


@program.command(cls=words.WordedCommand)
def check(file: Source) -> None:
    """Tell what is wrong with a program, or how much room it takes; no gateway is needed."""
    _, assembled = _read(file)
    if (fault := assembled.missing_end()) is not None:
        raise Failure(_printed(file, fault), exits.REFUSED)
    labels = ", ".join(assembled.labels) or "none"
    typer.echo(f"{len(assembled.instructions)} instructions, {assembled.steps} of {LAST_ADDRESS + 1} steps.")
    typer.echo(f"Labels: {labels}.")


@program.command(cls=words.WordedCommand)
def upload(
    body: Body,
    file: Source,
    flash: Annotated[bool, typer.Option(help=words.of("uploadProgram", "flash"))] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Replace a body's program, and see that it holds the new one."""
    source, assembled = _read(file)
    if (fault := assembled.missing_end()) is not None:
        typer.echo(f"{_printed(file, fault)} It is uploaded nevertheless.", err=True)
    client = Client.at(url, key_file)
    path = _path(client, body)
    with going_on_after("the upload"):
        record = client.request("PUT", f"{path}?flash={str(flash).lower()}", {"source": source})
        while record["status"] == "running":
            typer.echo(
                f"{record['phase']}: {record['written']} of {record['instructions']} written", err=True
            )
            record = client.request("GET", f"{path}/uploads/{record['id']}", wait_s=CHECK_S)
    if (error := record["error"]) is not None:
        raise Failure(f"{error['detail']} {record['stored']} {error['remedy']}", exits.REFUSED)
    typer.echo(record["stored"])


@program.command(cls=words.WordedCommand)
def download(body: Body, url: Url = LOCAL, key_file: KeyFile = None) -> None:
    """Print the program that a body holds in RAM."""
    client = Client.at(url, key_file)
    program = client.request("GET", _path(client, body), wait_s=DOWNLOAD_S)
    typer.echo(program["source"], nl=False)


@program.command(cls=words.WordedCommand)
def run(
    body: Body,
    label: Annotated[str | None, typer.Option(help=words.of("runProgram", "label"))] = None,
    address: Annotated[int | None, typer.Option(min=0, max=LAST_ADDRESS, help="Begin at an address.")] = None,
    step: Annotated[bool, typer.Option(help=words.of("runProgram", "single_step"))] = False,
    wait: Annotated[float, typer.Option(min=0, max=60, help="Seconds to wait for its end.")] = 0,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Run a body's program, which may move the motor; a stop of the body ends it."""
    wanted = {"label": label, "address": address, "single_step": step}
    client = Client.at(url, key_file)
    path = f"{_path(client, body)}/runs"
    with going_on_after("the program"):
        begun = client.request("POST", path, wanted, wait_s=wait)
    typer.echo(json_text(begun))
    if begun["status"] == "unknown":
        raise typer.Exit(exits.UNKNOWN)
    if begun["status"] == "running" and wait:
        raise typer.Exit(exits.UNDER_WAY)
    if begun["status"] == "ended" and begun["end_cause"] not in ("normal", "single_step"):
        raise typer.Exit(exits.REFUSED)


def _path(client: Client, word: str) -> str:
    """Where the program of a body is served; a failure ends the command."""
    target = find(client, word)
    if target.kind != "bodies":
        raise Misuse(f"{word} is no body, and has no program")
    return f"{target.path}/program"


def _read(file: Path) -> "tuple[str, Assembled]":
    """Read and assemble a program; its faults are printed as compilers print them.

    No other command waits for the assembler to be loaded.
    """
    from protocols.rorze.user_program.assembler import Assembled, assemble

    try:
        source = file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise Failure(f"{file}: {error.strerror or error}.", exits.USAGE) from None
    except UnicodeDecodeError:
        raise Failure(f"{file} is not UTF-8 text.", exits.USAGE) from None
    assembled = assemble(source)
    if not isinstance(assembled, Assembled):
        raise Failure("\n".join(_printed(file, fault) for fault in assembled), exits.REFUSED)
    return source, assembled


def _printed(file: Path, fault: "ProgramFault") -> str:
    return f"{file}:{fault.line}:{fault.column}: {fault.reason}"
