"""The command line: start the gateway or a simulator, and talk to a running gateway from scripts."""

import sys
from importlib.metadata import version as distribution_version
from typing import Annotated

import typer

from app import exits
from app.commands import (
    alarms,
    audit,
    backups,
    init,
    jog,
    journal,
    keys,
    lease,
    moves,
    plot,
    plot_move,
    program,
    reload,
    scan,
    security,
    serve,
    stop,
    trace,
    watch,
)

app = typer.Typer(
    cls=exits.Commands,
    help="A network gateway for RORZE and DYNAX motion controllers. It is not a safety function.",
    epilog=exits.IN_WORDS,
    no_args_is_help=True,
)
simulate = typer.Typer(help="Run fake controllers to develop and test against.", no_args_is_help=True)

for command in (
    *(serve.serve, serve.demo, init.init, init.check),
    *(watch.status, watch.watch, scan.scan, trace.trace),
    moves.send,
    stop.stop,
    reload.reload,
    security.security,
    *(backups.backup, backups.diff, backups.restore),
):
    app.command()(command)
# Negative numbers look like options: `move 3F relative -500`.
app.command(context_settings={"ignore_unknown_options": True})(moves.move)
app.command(context_settings={"ignore_unknown_options": True})(jog.jog)
app.add_typer(simulate, name="simulate")
app.add_typer(journal.journal, name="journal")
app.add_typer(audit.audit, name="audit")
app.add_typer(keys.app, name="keys")
app.add_typer(security.sessions, name="sessions")
app.add_typer(alarms.alarms, name="alarms")
app.add_typer(lease.lease, name="lease")
app.add_typer(program.program, name="program")
plot.plot.command("move")(plot_move.move)
app.add_typer(plot.plot, name="plot")


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
