"""Backups on the command line: what controllers keep is written to a file, compared, brought back."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from app import exits, words
from app.client import LOCAL, STEP_S, Client, KeyFile, Url, going_on_after
from app.exits import Failure, Misuse
from app.output import ProgressLine
from app.targets import addresses, find, numbered

Whose = Annotated[
    str,
    typer.Argument(
        help="Address or name of a body or a robot, or a line's id: 3F, r1, arm.", autocompletion=addresses
    ),
]
Backup = Annotated[Path | None, typer.Argument(help="A backup; left out where --nightly says which.")]
Nightly = Annotated[str | None, typer.Option("--nightly", help=words.of("restoreLine", "nightly"))]
Without = Annotated[
    list[str] | None,
    typer.Option("--without", help=words.of("restoreLine", "without")),
]
FASTER_BAUD = 38400
From = Annotated[str | None, typer.Option("--from", help="Of a body: take what the backup has of this one.")]
Only = Annotated[list[str] | None, typer.Option("--body", help="Of a line: only this body; can be repeated.")]


class UnitsChoice(StrEnum):
    """How a backup of another scale comes to a body."""

    keep_pulses = "keep_pulses"
    convert = "convert"


UnitsOption = Annotated[
    UnitsChoice | None,
    typer.Option("--units", help=words.of("restoreLine", "units")),
]


def backup(
    target: Whose,
    file: Annotated[Path | None, typer.Argument(help="Where to write it. Left out: it is printed.")] = None,
    only: Only = None,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Read all that a body, a robot or the bodies of a line keep, as text that can be restored."""
    client = Client.at(url, key_file)
    text = _text(client, _path_of(client, target), only)
    if file is None:
        typer.echo(text, nl=False)
        return
    try:
        file.write_text(text, "utf-8")
    except OSError as error:
        raise Failure(f"{file} cannot be written: {error.strerror or error}.", exits.USAGE) from None


def diff(
    target: Whose,
    file: Backup = None,
    nightly: Nightly = None,
    without: Without = None,
    from_body: From = None,
    only: Only = None,
    units: UnitsOption = None,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Tell what differs from a backup, and change nothing. Exit code 1: something does."""
    client = Client.at(url, key_file)
    wanted = _wanted(file, nightly, without, from_body, only, units)
    plan = _plan(client, _path_of(client, target), wanted)
    _tell_scales(plan)
    _tell(plan["differences"])
    _sum_up(plan)
    raise typer.Exit(exits.REFUSED if plan["differences"] else exits.DONE)


def restore(
    target: Whose,
    file: Backup = None,
    nightly: Nightly = None,
    without: Without = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help=words.of("restoreLine", "dry_run"))] = False,
    flash: Annotated[bool, typer.Option("--flash", help=words.of("restoreLine", "flash"))] = False,
    power_cycle: Annotated[
        bool,
        typer.Option("--power-cycle", help=words.of("restoreLine", "power_cycle")),
    ] = False,
    from_body: From = None,
    only: Only = None,
    units: UnitsOption = None,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Bring a body, a robot or the bodies of a line back to a backup, and see that they hold it."""
    client = Client.at(url, key_file)
    path, wanted = _path_of(client, target), _wanted(file, nightly, without, from_body, only, units)
    if dry_run:
        plan = _plan(client, path, wanted)
        _tell_scales(plan)
        typer.echo("".join(f"{command}\n" for command in plan["commands"]), nl=False)
        _tell([difference for difference in plan["differences"] if not difference["restorable"]])
        _sum_up(plan)
        return
    wanted |= {"flash": flash, "power_cycle": power_cycle}
    with going_on_after("the restore"):
        record = client.request("POST", f"{path}/restores", wanted)
        record = _followed(client, record, "restores", _being_restored, exits.UNKNOWN)
    _end(record)


def _text(client: Client, path: str, only: list[str] | None) -> str:
    query = f"?bodies={','.join(only)}" if only else ""
    return str(_read(client, client.request("POST", f"{path}/backups{query}"), "backups")["text"])


def _plan(client: Client, path: str, wanted: dict[str, object]) -> dict[str, Any]:
    return _read(client, client.request("POST", f"{path}/comparisons", wanted), "comparisons")


def _read(client: Client, record: dict[str, Any], records: str) -> dict[str, Any]:
    """Follow a reading to its end; who interrupts it ends it at the gateway, too."""
    try:
        record = _followed(client, record, records, _being_read, exits.NOT_SENT)
    except KeyboardInterrupt:
        client.request("DELETE", f"{record['target']}/{records}/current")
        raise
    if record["error"] is not None:
        raise Failure(f"{record['error']['detail']} {record['error']['remedy']}", exits.REFUSED)
    return record


def _being_read(record: dict[str, Any]) -> str:
    of = "" if record["expected"] is None else f" of {record['expected']} at most"
    return f"reading {record['controller']}: {record['read']}{of}{_left(record)}"


def _being_restored(record: dict[str, Any]) -> str:
    written = f", {record['written']} of {record['commands']} written" if record["commands"] else ""
    return f"{record['phase'].replace('_', ' ')}: {record['read']} read{written}{_left(record)}"


def _left(record: dict[str, Any]) -> str:
    return "" if record["left_s"] is None else f", {_minutes(record['left_s'])} left"


def _minutes(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def _sum_up(plan: dict[str, Any]) -> None:
    """Say on standard error how much differs, how long a restore takes, and what makes it faster."""
    differing = plan["differing"]
    if not differing:
        return
    counts = ", ".join(
        f"{count} {kind if count > 1 else kind.removesuffix('s')}" for kind, count in differing.items()
    )
    told = f"Differs from the backup in {counts}."
    baud, restore_s = plan["baud"], plan["restore_s"]
    if restore_s is not None:
        told += f" A restore takes {_minutes(restore_s)}{f' at {baud} baud' if baud else ''}."
    if baud and baud < FASTER_BAUD:
        faster = f"At {FASTER_BAUD} baud it takes less than half of that"
        told += f" {faster}: set the link master, and `baud` of the line."
    typer.echo(told, err=True)


def _followed(
    client: Client, record: dict[str, Any], records: str, words: Callable[[dict[str, Any]], str], lost: int
) -> dict[str, Any]:
    """Wait for the end of a backup or a restore; `lost` is the exit code if its end is not seen."""
    with ProgressLine() as progress:
        while record["status"] == "running":
            progress.say(words(record))
            try:
                record = client.request("GET", f"{record['target']}/{records}/{record['id']}", wait_s=STEP_S)
            except Failure as failure:
                what = f"{records.removesuffix('s')} {record['id']}"
                raise Failure(f"The {what} was begun, and its end was not seen: {failure}", lost) from None
    return record


def _end(record: dict[str, Any]) -> None:
    """Say how a restore has ended, and end with its exit code."""
    differences, error = record["differences"], record["error"]
    _tell_scales(record)
    if error is not None:
        typer.echo(f"{error['detail']} {error['remedy']}", err=True)
    _tell(differences or [])
    if record["status"] == "verified":
        where = "flash memory and RAM hold" if record["saved"] else "RAM holds"
        typer.echo(f"{', '.join(record['controllers'])}: {where} the backup, read back.")
        return
    if differences is None:
        raise Failure(
            f"{record['status']}: nobody knows what {', '.join(record['controllers'])} holds.", exits.UNKNOWN
        )
    if differences:
        raise Failure(f"{record['status']}: {len(differences)} differences.", exits.REFUSED)
    unseen = ""
    if record["flash"]:
        what = "the power cycle" if record["saved"] else "the writing of flash memory"
        unseen = f", but the end of {what} was not seen"
    raise Failure(f"{record['status']}: nothing differs from the backup{unseen}.", exits.REFUSED)


def _tell_scales(told: dict[str, Any]) -> None:
    """Say on standard error how scales differ, and what was made of it."""
    for scale in told.get("scales", ()):
        made = "pulses are kept" if scale["units"] == UnitsChoice.keep_pulses else "lengths are converted"
        typer.echo(
            f"{scale['target']}: backup {scale['backup']}, body {scale['controller']}; {made}.", err=True
        )


def _tell(differences: list[dict[str, Any]]) -> None:
    for entry in differences:
        wanted, held = entry["wanted"] or "nothing", entry["held"] or "nothing"
        never = "" if entry["restorable"] else "; no command can change that"
        typer.echo(
            f"{entry['target']} {entry['section']}: {entry['name']}: backup {wanted}, holds {held}{never}"
        )


def _wanted(
    file: Path | None,
    nightly: str | None,
    without: list[str] | None,
    from_body: str | None,
    only: list[str] | None,
    units: UnitsChoice | None,
) -> dict[str, object]:
    """The backup in a file, or that of a night, and its target."""
    if (file is None) == (nightly is None):
        raise Misuse("give the file of a backup, or --nightly")
    chosen = {
        "backup": None if file is None else _read_file(file),
        "nightly": nightly,
        "without": without or None,
        "from_body": from_body,
        "bodies": only or None,
        "units": units,
    }
    return {name: value for name, value in chosen.items() if value is not None}


def _read_file(file: Path) -> str:
    try:
        return file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise Misuse(f"{file}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise Misuse(f"{file} is not UTF-8 text") from None


def _path_of(client: Client, word: str) -> str:
    """Where a body, a robot or a line is served."""
    if numbered(word) is None:
        lines = client.request("GET", "/lines")["lines"]
        if any(line["line_id"] == word and line["protocol"] == "rorze" for line in lines):
            return f"/lines/{word}"
    target = find(client, word)
    if target.kind == "groups" or target.unit is not None:
        raise Misuse(f"{word} has no backup of its own: say a body, a robot or a line")
    return target.path
