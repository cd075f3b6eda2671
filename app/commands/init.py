"""Making and checking a configuration from the command line: `init` and `check`."""

import asyncio
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from app import exits
from app.exits import Failure, Misuse
from app.output import ProgressLine

if TYPE_CHECKING:
    from gateway.config import Config
    from gateway.core.tables import LineTable
    from gateway.found import Found
    from gateway.membership import Engine


def check(file: Annotated[Path, typer.Argument(help="The configuration file (TOML).")]) -> None:
    """Read a configuration, say what it would serve, and every fault with its line. No port is opened."""
    from app.data_directory import untrusted
    from gateway.access.posture import weakened
    from gateway.config import load
    from gateway.core.toml_files import ConfigError
    from gateway.core.tried import untried

    try:
        if _is_of_plant(file):
            _check_plant(file)
            return
        config = load(file)
    except ConfigError as error:
        raise Failure(str(error), exits.CONFIG) from None
    if config.plant is not None:
        _check_engine(config.plant)
    typer.echo(f"{file} is in order. It serves on {config.server.host}, port {config.server.port}:")
    for line in config.lines:
        typer.echo(f"  {_served(line)}")
    for made in (table for those in config.made().values() for table in those):
        typer.echo(f"  {made.served()}")
    for found in (found for line in config.lines for found in untried(line)):
        named_ones = f" ({', '.join(found.assumptions)})" if found.assumptions else ""
        typer.echo(f"note: line {found.line_id}: {found.meaning}{named_ones}")
    weak = (f"{weakness.setting} = {weakness.value}: {weakness.meaning}" for weakness in weakened(config))
    for warning in (*weak, *_doubtful(config), *_left_set(file, config), *untrusted(file, config)):
        typer.echo(f"warning: {warning}", err=True)


def _is_of_plant(file: Path) -> bool:
    """True if a file is that of a plant process: it has servers, and no lines and no name."""
    import tomllib

    try:
        tables = tomllib.loads(file.read_text("utf-8-sig"))
    except (OSError, ValueError):
        return False
    plant = tables.get("plant")
    return isinstance(plant, dict) and "name" not in plant and "lines" not in tables


def _check_plant(file: Path) -> None:
    from fleet.settings import load_plant

    config = load_plant(file)
    _check_engine(config.plant)
    typer.echo(
        f"{file} is in order. The plant process serves on {config.server.host}, port {config.server.port}."
    )


def _check_engine(engine: "Engine") -> None:
    """Refuse servers of a plant that are set so that events could be lost."""
    from fleet.engine import EngineTrouble, Unfit, credentials_in
    from fleet.fitness import faults_of, require_fit_streams, unseen

    try:
        if engine.credentials is not None:
            credentials_in(engine.credentials)
        asyncio.run(require_fit_streams(engine, getattr(engine, "name", "plant")))
        faults = list(faults_of(engine))
    except Unfit as unfit:
        faults = [str(unfit)]
    except EngineTrouble as trouble:
        faults = [str(trouble)]
    if faults:
        raise Failure("\n".join(faults), exits.CONFIG)
    for warning in unseen(engine):
        typer.echo(f"warning: {warning}", err=True)


def _served(line: "LineTable") -> str:
    return f"line {line.id} at {line.address}, {line.served()}"


def _left_set(file: Path, config: "Config") -> Iterator[str]:
    """Say on which lines a commissioning that was killed has left something set."""
    from commissioning.debts import debts_file

    for line in config.lines:
        if (debts := debts_file(file, line.id)).exists():
            yield (
                f"line {line.id}: a commissioning that was killed has left something set ({debts}): "
                f"`motion-gateway commission {line.id} --config {file} --allow settings` sets it back"
            )


def _doubtful(config: "Config") -> Iterator[str]:
    """Say which lines and files are not there, and which lines lead where no request may add one."""
    from gateway.port_scans import foreign
    from transports.addresses import Address

    for line in config.lines:
        address = Address.parse(line.address)
        if address.scheme != "tcp" and not Path(address.path).exists():
            yield f"line {line.id}: there is no {address.path} on this machine now"
        elif why := foreign(line.address, config.server):
            yield f"line {line.id}: {why}"
    for file in (config.server.tls_certificate, config.server.tls_key):
        if file is not None and not file.exists():
            yield f"server: there is no {file} on this machine now"


def init(
    out: Annotated[
        Path | None, typer.Option(help="Write to this new file; left out, to standard output.")
    ] = None,
    port: Annotated[
        list[str] | None,
        typer.Option(help="Search here, once or more: /dev/ttyUSB0, tcp://HOST:PORT, dpram:///dev/uio0."),
    ] = None,
    thorough: Annotated[
        bool,
        typer.Option(
            "--thorough", help="Ask all 120 body numbers, not only those that the link master names."
        ),
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Ask nothing: speak to all serial ports, and leave names out.")
    ] = False,
) -> None:
    """Find controllers at the ports of this machine, and write a configuration for them.

    Nothing is sent that moves or changes a motor. Ctrl-C ends the search and keeps what was found. At a
    terminal names and scales are asked for, too.
    """
    from app.found import config_of, tables_of
    from gateway.search import addresses_of

    if out is not None and out.exists():
        raise Misuse(f"{out} exists, and is left as it is. Name a new file")
    try:
        ports = [addresses_of(pattern) for pattern in port or _agreed_ports(yes=yes)]
    except ValueError as error:
        raise Misuse(f"{error}") from None
    found: list[Found] = []
    finished = asyncio.run(_search(ports, found, thorough=thorough))
    if not found:
        raise Failure(
            "Nobody was found. Check the power of the controllers and their cables; a link master that does "
            "not answer XID is not found: write its line by hand.",
            exits.REFUSED,
        )
    for device in found:
        typer.echo(device.in_words(), err=True)
    tables = tables_of(found)
    if finished and not yes and _is_asked():
        _ask_for_names([table for _, table in tables])
    _write(config_of(tables, finished=finished), out)
    if not finished:
        raise Failure(
            "The search was ended before it was over: only what was found until then is written.",
            exits.REFUSED,
        )
    if out is not None:
        typer.echo(f"{out} is written. Read it, then `motion-gateway check {out}`.", err=True)


def _agreed_ports(*, yes: bool) -> list[str]:
    """The serial ports of this machine, if people agree that all of them are spoken to."""
    from gateway import search

    devices = search.serial_devices()
    if not devices:
        raise Failure(
            "This machine has no serial port. Name one with --port. Nothing was sent.", exits.REFUSED
        )
    if yes:
        return devices
    listed = "\n".join(f"  {device}" for device in devices)
    typer.echo(
        f"These ports would be spoken to, at several baud rates:\n{listed}\n"
        "Something else than a controller at one of them would hear bytes that it does not know.",
        err=True,
    )
    if not _is_asked():
        raise Misuse("Say --yes, or name ports with --port")
    if not typer.confirm("Speak to all of them?", err=True):
        raise Misuse("Name ports with --port")
    return devices


def _is_asked() -> bool:
    """True if a person at a terminal can answer questions."""
    return sys.stdin.isatty()


def _ask_for_names(tables: list[dict[str, Any]]) -> None:
    """Ask a person for names and scales; Ctrl-C or Ctrl-D leaves out all that were not asked for yet."""
    from app.found import ask_for_names

    typer.echo("Names and scales, where you know them: Enter leaves one out, Ctrl-D all others.", err=True)
    try:
        for table in tables:
            ask_for_names(table, _prompt, partial(typer.echo, err=True))
    except typer.Abort:
        typer.echo("", err=True)


def _prompt(question: str) -> str:
    return str(typer.prompt(question, default="", show_default=False, err=True))


async def _search(ports: list[list[str]], found: list["Found"], *, thorough: bool) -> bool:
    """Search the ports; False if Ctrl-C cut the search short."""
    from gateway.search import search

    doing: dict[str, str] = {}
    with ProgressLine() as progress:

        def tell(address: str, what: str) -> None:
            doing[address.partition("?")[0]] = f"{address}: {what}"
            progress.say("; ".join(doing.values()))

        try:
            await search(ports, found, tell, note=progress.note, thorough=thorough)
        except asyncio.CancelledError:
            return False
    return True


def _write(text: str, out: Path | None) -> None:
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        with out.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        typer.echo(text, nl=False)
        raise Failure(
            f"{out} cannot be written: {error.strerror}. It is printed instead.", exits.REFUSED
        ) from None
