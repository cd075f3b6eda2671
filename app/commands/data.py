"""The whole data directory as one file: copied while a gateway runs, and brought back where none does."""

import gzip
import os
import tarfile
import zlib
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from shutil import copyfileobj, rmtree
from tempfile import TemporaryDirectory, mkdtemp, mkstemp
from typing import Annotated, BinaryIO, Final

import typer

from app import exits
from app.commands.journal import explained
from app.data_directory import Data, data_directory
from app.exits import Failure
from gateway.core.journal import files
from gateway.core.journal.disk import FILE, LOCK
from gateway.security import chain

data = typer.Typer(
    help="Copy all that a gateway keeps (keys, journal, nightly backups, recordings ..), or bring it back.",
    no_args_is_help=True,
)
_PRIVATE_FILE, _PRIVATE_FOLDER = 0o600, 0o700
_PIECE: Final = 1 << 20
_UNCHANGED: Final = "; nothing was changed"
_NOT_COPIED: Final = (FILE, f"{FILE}-wal", f"{FILE}-shm", LOCK, chain.FOLDER)
"""SQLite copies the journal, the security log is read at one moment, and locks are no part of a copy."""

Kept = Annotated[Path, typer.Argument(help="The file, such as gateway-data.tar.gz.")]


@data.command()
def backup(target: Kept, data: Data = None) -> None:
    """Copy a data directory into a file that does not exist yet, also while a gateway runs.

    The file holds what lets callers in: keep it as the directory itself.
    """
    directory = data or data_directory()
    with explained(_UNCHANGED):
        if not directory.is_dir():
            raise Failure(f"There is no directory {directory}; nothing was written.", exits.USAGE)
        if target.exists():
            raise Failure(f"{target} exists already; nothing was written.", exits.USAGE)
        handle, name = mkstemp(dir=target.absolute().parent, prefix=f".{target.name}-")
        aside = Path(name)
        try:
            with os.fdopen(handle, "wb") as file:
                _write(directory, file)
                file.flush()
                os.fsync(file.fileno())
            aside.replace(target)  # who is killed before leaves nothing that looks like a copy
        except BaseException:
            aside.unlink(missing_ok=True)
            raise
    typer.echo(f"{directory} was copied to {target}.")


def _write(directory: Path, file: BinaryIO) -> None:
    with (
        tarfile.open(fileobj=file, mode="w:gz") as archive,
        TemporaryDirectory(dir=directory.parent, prefix=".copy-") as aside,
    ):
        if (directory / FILE).exists():
            copy = Path(aside) / FILE
            files.backup(directory, copy)
            with copy.open("rb") as content:
                _add(archive, FILE, content, copy.stat().st_size)
        for path in sorted(directory.rglob("*")):
            within = path.relative_to(directory)
            if not path.is_symlink() and path.is_file() and within.parts[0] not in _NOT_COPIED:
                with suppress(FileNotFoundError), path.open("rb") as content:  # it was old enough
                    _add(archive, str(within), content, os.fstat(content.fileno()).st_size)
        for name, entries in chain.content(directory).items():
            _add(archive, f"{chain.FOLDER}/{name}", BytesIO(entries), len(entries))


def _add(archive: tarfile.TarFile, name: str, content: BinaryIO, size: int) -> None:
    member = tarfile.TarInfo(name)
    member.size, member.mode = size, _PRIVATE_FILE
    archive.addfile(member, content)


@data.command()
def restore(source: Kept, data: Data = None) -> None:
    """Bring a data directory back from a file of `data backup`; there must be none yet, or an empty one."""
    directory = (data or data_directory()).absolute()
    with explained(_UNCHANGED):
        if directory.exists() and any(directory.iterdir()):
            raise Failure(
                f"{directory} is not empty; nothing was changed. Stop its gateway, and move it away first.",
                exits.USAGE,
            )
        directory.parent.mkdir(parents=True, exist_ok=True)
        aside = Path(mkdtemp(dir=directory.parent, prefix=f".{directory.name}-"))
        try:
            _unpack(source, aside)
            aside.replace(directory)
        except BaseException:
            rmtree(aside, ignore_errors=True)
            raise
    typer.echo(
        f"{directory} is as it was when {source} was made. A key that was revoked since is good again: "
        "revoke it anew. What was under way then is followed, or told as unknown, at the next start."
    )


def _unpack(source: Path, folder: Path) -> None:
    """Write all that a file holds; what is no copy of a data directory, or was damaged, is refused."""
    try:
        with gzip.open(source) as whole, tarfile.open(fileobj=whole, mode="r:") as archive:
            for member in archive:
                _extract(archive, member, folder)
            while whole.read(_PIECE):  # its checksum stands at its end
                pass
    except (tarfile.TarError, EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise Failure(f"This is no copy of a data directory ({error}){_UNCHANGED}.", exits.USAGE) from None
    for path in (folder, *folder.rglob("*")):
        path.chmod(_PRIVATE_FOLDER if path.is_dir() else _PRIVATE_FILE)
    if not (folder / FILE).is_file():
        raise Failure(f"{source} is no copy of a data directory; nothing was changed.", exits.USAGE)
    for complaint in files.verify(folder):
        raise Failure(
            f"The journal in {source} is not sound: {complaint} Nothing was changed.", exits.REFUSED
        )


def _extract(archive: tarfile.TarFile, member: tarfile.TarInfo, folder: Path) -> None:
    """Write one member: the filters of `tarfile` came with Python 3.11.4, and Debian 12 has 3.11.2.

    :raises TarError: it is no file or folder, or lies elsewhere; nothing of it was written.
    """
    path = (folder / member.name).resolve()
    if not path.is_relative_to(folder.resolve()):
        raise tarfile.ExtractError(f"{member.name!r} would be extracted outside the destination")
    content = archive.extractfile(member) if member.isfile() else None
    if member.isdir():
        path.mkdir(parents=True, exist_ok=True)
    elif content is None:
        raise tarfile.ExtractError(f"{member.name!r} is neither a file nor a folder")
    else:
        path.parent.mkdir(parents=True, exist_ok=True)
        with content, path.open("wb") as file:
            copyfileobj(content, file)
