"""Files that others could change or read: said by `check`, and links in the data directory refused."""

import os
from collections.abc import Iterator
from pathlib import Path
from stat import S_IROTH, S_ISVTX, S_IWGRP, S_IWOTH

from gateway.config import Config
from gateway.core.toml_files import ConfigError


def untrusted(file: Path, config: Config) -> Iterator[str]:
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
