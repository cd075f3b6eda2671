"""The command line: start the gateway or a simulator, and talk to a running gateway from scripts."""

import sys
from importlib.metadata import version as distribution_version
from typing import Annotated

import typer

from app import (
    alarming,
    backing_up,
    exits,
    jogging,
    journal,
    keys,
    leasing,
    moving,
    plot_move,
    plotting,
    program,
    reloading,
    scanning,
    serving,
    setting_up,
    stopping,
    tracing,
    watching,
)

app = typer.Typer(
    help="A network gateway for RORZE and DYNAX motion controllers. It is not a safety function.",
    epilog=exits.IN_WORDS,
    no_args_is_help=True,
)
simulate = typer.Typer(help="Run fake controllers to develop and test against.", no_args_is_help=True)

for command in (
    *(serving.serve, setting_up.init, setting_up.check),
    *(watching.status, watching.watch, scanning.scan, tracing.trace),
    moving.send,
    stopping.stop,
    reloading.reload,
    *(backing_up.backup, backing_up.diff, backing_up.restore),
):
    app.command()(command)
# Negative numbers look like options: `move 3F relative -500`.
app.command(context_settings={"ignore_unknown_options": True})(moving.move)
app.command(context_settings={"ignore_unknown_options": True})(jogging.jog)
app.add_typer(simulate, name="simulate")
app.add_typer(journal.journal, name="journal")
app.add_typer(keys.app, name="keys")
app.add_typer(alarming.alarms, name="alarms")
app.add_typer(leasing.lease, name="lease")
app.add_typer(program.program, name="program")
plotting.plot.command("move")(plot_move.move)
app.add_typer(plotting.plot, name="plot")


@app.command()
def version() -> None:
    """Print the version."""
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
