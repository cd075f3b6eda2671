"""First contact with a real line: which assumptions hold there, and which settings follow: `commission`."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from app import exits
from app.client import LOCAL, STEP_S, Client, KeyFile, Url
from app.exits import Failure, Misuse
from app.output import ProgressLine, json_text

if TYPE_CHECKING:
    from commissioning.bench import Terms
    from commissioning.report import Report

LEVELS = ("settings", "motion")
ANSWERS = {"y": True, "yes": True, "": False, "n": False, "no": False}


def commission(
    line: Annotated[str, typer.Argument(metavar="LINE", help="A line, as the configuration names it.")],
    config: Annotated[
        Path | None, typer.Option(help="Speak to the line alone on its port; no gateway serves it meanwhile.")
    ] = None,
    allow: Annotated[
        list[str] | None,
        typer.Option(help="Besides questions: settings, motion. Each is asked for before it is done."),
    ] = None,
    yes: Annotated[
        list[str] | None,
        typer.Option(metavar="BODY", help="Agree to all that is allowed on this body or robot, unasked."),
    ] = None,
    between: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="A B", help="Two places of the axis that may move, in its own units."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write all results and frames to F.json, and F.md beside it.")
    ] = None,
    apply: Annotated[
        bool, typer.Option("--apply", help="Write the proposed settings into the configuration file.")
    ] = False,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Find out which assumptions about a line hold there, and which settings make the gateway right.

    Beside a running gateway only questions are sent, and the line is down for all else meanwhile. With
    --config the port is spoken to alone, and more may be allowed. Exit code 1: something differs or
    contradicts.
    """
    levels = _levels(allow or ())
    if report is not None and report.suffix != ".json":
        raise Misuse(f"{report} is no name of a report: it ends with .json")
    if config is None:
        _require_questions(levels)
        found = _beside(Client.at(url, key_file), line, apply=apply)
    else:
        with ProgressLine() as progress:
            found = _alone(line, config, _terms(levels, yes or (), between, progress), progress)
    _write(found, report)
    _tell(found)
    if config is None:
        _advise(found)
    else:
        _propose(found, config, _changes(found, report if apply else None), apply=apply)
    if found.lost is not None:
        raise Failure(f"{found.lost} The trials that are missing were not made.", exits.NOT_SENT)
    if not found.is_right():
        raise typer.Exit(exits.REFUSED)


def _levels(allow: Sequence[str]) -> frozenset[Any]:
    from commissioning.assumptions import Level

    for level in allow:
        if level not in LEVELS:
            raise Misuse(f"--allow takes {' or '.join(LEVELS)}, not {level!r}")
    return frozenset(map(Level, allow))


def _require_questions(levels: frozenset[Any]) -> None:
    """Refuse trials beyond questions beside a running gateway: they need a person, and the port alone."""
    if levels:
        raise Misuse(
            "--allow needs --config FILE: end the gateway, or take the line out of its file, and "
            "stand at the machine"
        )


def _beside(client: Client, line_id: str, *, apply: bool) -> "Report":
    """Have a running gateway commission one of its lines, and write what follows; Ctrl-C cancels that."""
    from commissioning.report import Report

    record = client.request("POST", "/commissionings", {"line_id": line_id})
    path = f"/commissionings/{record['id']}"
    with ProgressLine() as progress:
        try:
            while record["status"] == "running":
                progress.say(f"{record['done']} of {record['of']}: {record['doing']}")
                record = client.request("GET", path, wait_s=STEP_S)
        except KeyboardInterrupt:
            record = client.request("DELETE", path)
    if record["report"] is None:
        raise Failure(
            f"The commissioning of {line_id} was {record['status']}: {record['error']}", exits.REFUSED
        )
    found = Report.model_validate(record["report"])
    if apply and found.changes():
        client.request("POST", f"{path}/settings")
        typer.echo(f"It is written into the file of the gateway, which serves {line_id} so.", err=True)
    return found


def _advise(found: "Report") -> None:
    """Say which settings a gateway needs, whose file is not at hand."""
    for key, value in found.changes().items():
        typer.echo(f"Set {key} of line {found.line} to {value!r} in the configuration of the gateway.")


def _terms(
    levels: frozenset[Any], yes: Sequence[str], between: tuple[float, float] | None, progress: ProgressLine
) -> "Terms":
    from commissioning.bench import Places, Terms

    agreed = {address.upper() for address in yes}

    async def consent(subject: str, what: str) -> bool:
        return subject.upper() in agreed or await switch(subject, what)

    async def switch(_subject: str, what: str) -> bool:
        progress.clear()
        return await _confirm(what)

    return Terms(levels, consent, switch, None if between is None else Places(*between))


async def _confirm(what: str) -> bool:
    """Ask at the terminal; without a terminal the answer is no. A thread that reads would outlast Ctrl-C."""
    if not sys.stdin.isatty():
        return False
    import asyncio

    loop, typed = asyncio.get_running_loop(), asyncio.Event()
    while True:
        typer.echo(f"{what} [y/N]: ", nl=False, err=True)
        typed.clear()
        loop.add_reader(sys.stdin, typed.set)
        try:
            await typed.wait()
        finally:
            loop.remove_reader(sys.stdin)
        answer = sys.stdin.readline().strip().lower()
        if answer in ANSWERS:
            return ANSWERS[answer]
        typer.echo("Answer y or n.", err=True)


def _alone(line_id: str, file: Path, terms: "Terms", progress: ProgressLine) -> "Report":
    """Commission a line of a file at its port."""
    import asyncio

    from commissioning.debts import Debts, DebtsUnreadable, debts_file
    from commissioning.run import commission as walk
    from gateway.config import load
    from gateway.core.toml_files import ConfigError
    from transports import TransportError

    try:
        lines = {configured.id: configured for configured in load(file).lines}
    except ConfigError as error:
        raise Failure(str(error), exits.CONFIG) from None
    if line_id not in lines:
        raise Misuse(f"{file} has no line {line_id}; it has {', '.join(lines)}")

    debts = Debts(debts_file(file, line_id))

    async def run(tell: Callable[[int, int, str], None]) -> "Report":
        return await walk(lines[line_id], terms, debts, tell=tell)

    try:
        return asyncio.run(run(lambda place, of, slug: progress.say(f"{place} of {of}: {slug}")))
    except DebtsUnreadable as error:
        raise Failure(
            f"{error}. It says what a commissioning that was killed has left set. Nothing was sent: look "
            "into it, and remove it when all is set back.",
            exits.NOT_SENT,
        ) from None
    except TransportError as error:
        raise Failure(f"{error} The line {line_id} was not commissioned.", exits.NOT_SENT) from None
    except KeyboardInterrupt:
        moving = "a motor that a trial had moved was stopped by software: look whether it stands. "
        owed = debts.file is not None and debts.file.exists()
        left = f"Not all that was set is set back ({debts.file})" if owed else "What was set was set back"
        raise Failure(
            f"It was broken off, and there is no report. {left}; {moving}Begin anew.",
            exits.REFUSED,
        ) from None


def _write(found: "Report", report: Path | None) -> None:
    if report is None:
        return
    try:
        report.write_text(json_text(found.model_dump(mode="json")) + "\n", "utf-8")
        report.with_suffix(".md").write_text(found.markdown(), "utf-8")
    except OSError as error:
        raise Failure(
            f"{report} cannot be written: {error.strerror}. The trials are over; nothing is left set.",
            exits.NOT_SENT,
        ) from None


def _tell(found: "Report") -> None:
    from commissioning.report import LEFT, NO_MOTION, next_step

    for outcome in found.results:
        follows = "" if outcome.result == "cannot_tell" else next_step(outcome)
        typer.echo(
            f"{outcome.result.replace('_', ' '):12} {outcome.assumption}: {outcome.seen} {follows}".rstrip()
        )
    if any(outcome.result == "contradicts" for outcome in found.results):
        typer.echo(NO_MOTION, err=True)
    if found.left:
        typer.echo(f"{LEFT}{'; '.join(found.left)}", err=True)


def _changes(found: "Report", report: Path | None) -> dict[str, Any]:
    """The settings that the file should have instead, with the place of the report."""
    return found.changes() | ({} if report is None else {"commissioned": str(report.absolute())})


def _propose(found: "Report", file: Path, changes: dict[str, Any], *, apply: bool) -> None:
    """Show the proposed change of the file, and make it where people ask for it."""
    from gateway.config_file import ConfigFile, changed, diff
    from gateway.core.errors import GatewayError
    from gateway.core.toml_files import ConfigError

    if not changes:
        return
    before = file.read_text("utf-8-sig")
    try:
        after = changed(before, found.line, changes, str(file))
    except ConfigError as error:
        raise Failure(f"{error}", exits.REFUSED) from None
    typer.echo(diff(before, after, str(file)), nl=False)
    if not apply:
        typer.echo("Nothing was changed: --apply writes this into the file.", err=True)
        return
    try:
        ConfigFile(file).write(after)
    except GatewayError as error:
        raise Failure(f"{error.detail} {error.remedy}", exits.REFUSED) from None
    typer.echo(f"{file} is written; `motion-gateway reload` lets a gateway read it again.", err=True)
