"""Where the gateway keeps what outlives it: its keys and its journal."""

import os
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Final

import typer

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
