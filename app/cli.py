"""The command line: start the gateway or a simulator, and talk to a running gateway from scripts."""

import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Annotated, Any, Final

import typer
from typer.main import get_command, get_group

from app import exits, words

COMMANDS: Final = {
    "serve": "serve:serve",
    "demo": "serve:demo",
    "init": "init:init",
    "check": "init:check",
    "status": "watch:status",
    "watch": "watch:watch",
    "scan": "scan:scan",
    "commission": "commission:commission",
    "trace": "trace:trace",
    "send": "moves:send",
    "move": "moves:move",
    "jog": "jog:jog",
    "stop": "stop:stop",
    "reload": "reload:reload",
    "security": "security:security",
    "backup": "backups:backup",
    "diff": "backups:diff",
    "restore": "backups:restore",
    "record": "record:record",
    "export": "export:export",
    "replay": "replay:replay",
    "journal": "journal:journal",
    "data": "data:data",
    "audit": "audit:audit",
    "keys": "keys:app",
    "bridge": "bridge:app",
    "sessions": "security:sessions",
    "alarms": "alarms:alarms",
    "lease": "lease:lease",
    "program": "program:program",
    "plot": "plot:plot",
    "plant": "plant:plant",
    "take-over": "take_over:take_over",
}
"""Modules of `app.commands`, and what in them is a command: each is loaded when it is called."""
_WITH_NUMBERS: Final = {"ignore_unknown_options": True}
"""Negative numbers look like options: `move 3F relative -500`."""


class _Commands(Mapping[str, Any]):
    """The commands of the table, and those that are there already."""

    def __init__(self, there: Mapping[str, Any]) -> None:
        self._loaded = dict(there)

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            self._loaded[name] = _load(name)
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*COMMANDS, *self._loaded)))

    def __len__(self) -> int:
        return len(list(iter(self)))


def _load(name: str) -> Any:
    module, _, attribute = COMMANDS[name].partition(":")
    made = getattr(import_module(f"app.commands.{module}"), attribute)
    if isinstance(made, typer.Typer):
        command: Any = get_group(made)
        command.name = name
        return command
    alone = typer.Typer(add_completion=False)
    settings = _WITH_NUMBERS if name in ("move", "jog") else None
    alone.command(name, cls=words.WordedCommand, context_settings=settings)(made)
    return get_command(alone)


class _CommandLine(exits.Commands):
    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.commands: Any = _Commands(self.commands)


app = typer.Typer(
    cls=_CommandLine,
    help="A network gateway for RORZE and DYNAX motion controllers. It is not a safety function.",
    epilog=exits.IN_WORDS,
    no_args_is_help=True,
)
app.add_typer(
    typer.Typer(help="Run fake controllers to develop and test against.", no_args_is_help=True),
    name="simulate",
)


@app.command()
def version() -> None:
    """Print the version."""
    from importlib.metadata import version as distribution_version

    typer.echo(distribution_version("motion-gateway"))


def _print_version(wanted: bool) -> None:
    if wanted:
        version()
        raise typer.Exit


@app.callback()
def motion_gateway(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Everything is a command of its own."""


def main() -> None:
    """Run the command line; `simulate` loads the simulator only when it is asked for."""
    if sys.argv[1:2] == ["simulate"]:
        from simulator.cli import app as simulator_app

        simulator_app(sys.argv[2:], prog_name="motion-gateway simulate")
    else:
        app()
