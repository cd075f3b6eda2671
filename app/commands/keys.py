"""The commands that make, list, rotate and revoke keys, and the key that other commands send."""

import re
import time
from datetime import UTC, datetime
from getpass import getuser
from pathlib import Path
from typing import Annotated, Final

import typer

from app import exits, words
from app.data_directory import Data, data_directory
from app.exits import Failure
from app.output import table
from gateway.access.keys import KeyFault, KeyStore, KeyWordFault
from gateway.access.roles import Role
from gateway.security.chain import Chain, draft
from gateway.security.entries import KEY_CHANGED, KEY_MADE, KEY_REVOKED, EntryType

app = typer.Typer(
    help="Make, list, rotate and revoke keys; a running gateway heeds it at once.", no_args_is_help=True
)

NEVER: Final = "never"
_SECONDS: Final = {"s": 1, "m": 60, "h": 3600, "d": 86_400}


@app.command(cls=words.WordedCommand)
def create(
    name: Annotated[str, typer.Argument(help=words.of("makeKey", "name"))],
    role: Annotated[Role, typer.Option(help=words.of("makeKey", "role"))],
    scope: Annotated[
        str | None, typer.Option(help="Lines, bodies, groups and robots, such as line1,r1; all if left out.")
    ] = None,
    expires: Annotated[
        str | None,
        typer.Option(
            help="When it ends, such as 12h or 90d, or never; left out: access.key_lifetime_d, a year."
        ),
    ] = None,
    data: Data = None,
) -> None:
    """Make a key and print it alone; it is shown this once."""
    try:
        addresses = None if scope is None else [part.strip() for part in scope.split(",")]
        store = _store(data)
        lasts_s = store.policy().lifetime_s if expires is None else None
        if expires not in (None, NEVER):
            lasts_s = seconds_of(expires)
        made = store.create(name, role, addresses, lasts_s)
    except KeyWordFault as fault:
        raise Failure(str(fault), exits.USAGE) from None
    except KeyFault as fault:
        raise Failure(str(fault), exits.REFUSED) from None
    _note(data, KEY_MADE, name, role=role.value, scope=addresses, expires_at=_ending(lasts_s))
    typer.echo(made)


@app.command()
def rotate(
    name: Annotated[str, typer.Argument(help="The name of the key; it stays.")],
    overlap: Annotated[
        str, typer.Option(help="How long the old key is good yet, such as 0s, 12h or 7d.")
    ] = "7d",
    data: Data = None,
) -> None:
    """Make a new key in the place of one, and print it alone; the old one is good for a while yet."""
    try:
        made = _existing_store(data).rotate(name, 0.0 if overlap == "0s" else seconds_of(overlap))
    except KeyWordFault as fault:
        raise Failure(str(fault), exits.USAGE) from None
    except KeyFault as fault:
        raise Failure(str(fault), exits.REFUSED) from None
    _note(data, KEY_CHANGED, name, overlap=overlap)
    typer.echo(made)


@app.command("list")
def list_keys(data: Data = None) -> None:
    """List the keys, without what is secret of them."""
    try:
        store = _existing_store(data)
        keys = store.infos()
    except KeyFault as fault:
        raise Failure(str(fault), exits.REFUSED) from None
    head = ("NAME", "ROLE", "SCOPE", "BEGINS", "STATE", "CREATED", "EXPIRES", "LAST USED")
    rows = [
        (
            key.name,
            key.role.value,
            "all" if key.scope is None else ",".join(key.scope),
            key.begins,
            key.state,
            _written(key.made_at),
            _written(key.expires_at),
            _written(key.used_at),
        )
        for key in keys
    ]
    typer.echo(table(head, rows))
    for key in keys:
        if key.ends_soon:
            typer.echo(
                f"warning: {key.name} ends at {_written(key.expires_at)}: "
                f"motion-gateway keys rotate {key.name}",
                err=True,
            )


@app.command()
def revoke(name: Annotated[str, typer.Argument()], data: Data = None) -> None:
    """Let a key never be used again."""
    try:
        store = _existing_store(data)
        store.revoke(name)
    except KeyFault as fault:
        raise Failure(str(fault), exits.REFUSED) from None
    revoked = next(key for key in reversed(store.all()) if key.name == name)
    scope = None if revoked.scope is None else list(revoked.scope)
    _note(data, KEY_REVOKED, name, role=revoked.role.value, scope=scope)


def _note(data: Path | None, type_: EntryType, name: str, **told: object) -> None:
    """Write it into the security log, in the name of the user of this machine; it is done already."""
    entry = draft(type_.name, name, caller=f"command line ({getuser()})", data=told)
    try:
        Chain(data or data_directory()).append([entry])
    except OSError as error:
        typer.echo(f"It is done, and the security log could not be written: {error.strerror}.", err=True)


def _ending(lasts_s: float | None) -> str | None:
    return None if lasts_s is None else datetime.fromtimestamp(time.time() + lasts_s, UTC).isoformat()


def seconds_of(text: str) -> float:
    """Read a time such as 30s, 10m, 12h or 90d.

    :raises KeyWordFault: it is none.
    """
    match = re.fullmatch("([1-9][0-9]{0,8})([smhd])", text)
    if not match:
        raise KeyWordFault(f"{text!r} is no time such as 30s, 10m, 12h or 90d.")
    return float(int(match[1]) * _SECONDS[match[2]])


def _store(data: Path | None) -> KeyStore:
    return KeyStore(data or data_directory())


def _existing_store(data: Path | None) -> KeyStore:
    """The keys of a directory that is there; only a new key makes one.

    :raises KeyFault: there is none.
    """
    directory = data or data_directory()
    if not directory.is_dir():
        raise KeyFault(f"There is no directory {directory}, so it has no keys.")
    return KeyStore(directory)


def _written(at: datetime | None) -> str:
    return "-" if at is None else at.astimezone().isoformat(" ", "minutes")
