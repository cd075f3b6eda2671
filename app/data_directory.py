"""Where the gateway keeps what outlives it: its keys and its journal."""

import os
from pathlib import Path
from typing import Annotated

import typer


def data_directory() -> Path:
    """The usual place: /var/lib/motion-gateway for root, else below $XDG_STATE_HOME or ~/.local/state."""
    if os.geteuid() == 0:
        return Path("/var/lib/motion-gateway")
    given = Path(os.environ.get("XDG_STATE_HOME", ""))
    return (given if given.is_absolute() else Path.home() / ".local" / "state") / "motion-gateway"


Data = Annotated[
    Path | None,
    typer.Option(
        help="Where the gateway keeps its keys and its journal; left out, /var/lib/motion-gateway for root, "
        "otherwise motion-gateway in $XDG_STATE_HOME or ~/.local/state."
    ),
]
