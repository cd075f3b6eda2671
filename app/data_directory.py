"""The place of what outlives the gateway, its keys and its journal; and files that others could change."""

import os
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from stat import S_IROTH, S_ISVTX, S_IWGRP, S_IWOTH
from typing import TYPE_CHECKING, Annotated, Final

import typer

from gateway.core.toml_files import ConfigError

if TYPE_CHECKING:
    from gateway.config import Config

OWNER: Final = "configuration"
"""The file in a data directory that names the configuration which it belongs to."""
USUAL_CONFIG: Final = Path("/etc/motion-gateway/gateway.toml")
"""The usual directory without an owner belongs to this configuration, where there is one: docs/install.md."""


def data_directory() -> Path:
    """The usual place: /var/lib/motion-gateway for root, else below $XDG_STATE_HOME or ~/.local/state."""
    if os.geteuid() == 0:
        return Path("/var/lib/motion-gateway")
    given = Path(os.environ.get("XDG_STATE_HOME", ""))
    return (given if given.is_absolute() else Path.home() / ".local" / "state") / "motion-gateway"


def data_of(config: Path) -> Path:
    """The directory of the gateway with this configuration, where none is named.

    The first configuration of a machine has the usual place, and so finds what earlier versions have left
    there. Each other one has a place of its own beside it: two plants never share a memory.
    """
    usual, config = data_directory(), config.resolve()
    if _owner(usual) in (None, config):
        return usual
    return usual.with_name(f"{usual.name}-{config.stem}-{sha256(bytes(config)).hexdigest()[:8]}")


def take(data: Path, config: Path) -> None:
    """Note whose directory it is, where none has it; that it cannot be written is for the journal to tell."""
    if _owner(data) is not None or (data / OWNER).is_symlink():
        return
    try:
        data.mkdir(mode=0o700, parents=True, exist_ok=True)
        (data / OWNER).write_bytes(bytes(config.resolve()) + b"\n")
    except OSError:
        return


def _owner(data: Path) -> Path | None:
    """The configuration that a directory belongs to; None where there is none, or it is gone."""
    try:
        owner = Path(os.fsdecode((data / OWNER).read_bytes().rstrip(b"\n")))
    except OSError:
        owner = USUAL_CONFIG if data == data_directory() else Path()
    return owner if owner.is_file() else None


Data = Annotated[
    Path | None,
    typer.Option(
        help="Where the gateway keeps its keys and its journal; left out, /var/lib/motion-gateway for root, "
        "otherwise motion-gateway in $XDG_STATE_HOME or ~/.local/state; for `serve` with another "
        "configuration than the first of the machine, a directory of its own beside it."
    ),
]


def untrusted(file: Path, config: "Config") -> Iterator[str]:
    """Say which files of a configuration others than root and its user may change, or read a secret in."""
    server = config.server
    files = [file, *(file for file in (server.tls_certificate, server.tls_key) if file is not None)]
    for path in dict.fromkeys(path for file in files for path in (file, file.resolve().parent)):
        yield from _changed_by_others(path)
    if server.tls_key is not None and _mode_of(server.tls_key) & S_IROTH:
        yield f"everybody on this machine may read the key {server.tls_key}: chmod o-r it"


def _changed_by_others(path: Path) -> Iterator[str]:
    try:
        status = path.stat()
    except OSError:  # a file that is not there has a warning of its own
        return
    if status.st_uid not in (0, os.geteuid()):
        yield f"{path} belongs to user {status.st_uid}, who may change it: chown it to root"
    if status.st_mode & S_ISVTX:  # in such a directory others cannot replace a file
        return
    if status.st_mode & S_IWOTH:
        yield f"everybody on this machine may change {path}: chmod o-w it"
    elif status.st_mode & S_IWGRP:
        yield f"group {status.st_gid} may change {path}: chmod g-w it"


def _mode_of(path: Path) -> int:
    try:
        return path.stat().st_mode
    except OSError:
        return 0


def require_no_links(data: Path) -> None:
    """Refuse a data directory in which a link leads elsewhere: the gateway would read or write there.

    The directory itself may be a link.

    :raises ConfigError: there is one; nothing was read or written.
    """
    try:
        entries = sorted(data.iterdir())
    except OSError:  # one that is not there is made; that it cannot be read is for the journal to tell
        return
    for entry in entries:
        if entry.is_symlink():
            raise ConfigError(
                f"{entry} is a symbolic link, through which the gateway would read or write elsewhere: "
                f"put the file itself into {data}. No line was opened."
            )
