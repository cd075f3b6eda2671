"""Writing a recording for other programs: `export`."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, BinaryIO

import typer

from app import exits
from app.exits import Failure

if TYPE_CHECKING:
    from recordings.form import Recording


def export(
    recording: Annotated[Path, typer.Argument(help="A recording, such as plant.mgrec.")],
    pcapng: Annotated[
        Path | None,
        typer.Option(help="Write all records for Wireshark, and beside them its dissector (.lua)."),
    ] = None,
    mcap: Annotated[
        Path | None,
        typer.Option(help="Write live values, traces, samples and events as MCAP, for Foxglove."),
    ] = None,
    samples: Annotated[
        Path | None, typer.Option(help="Write where motors were seen during moves, as CSV.")
    ] = None,
) -> None:
    """Write a recording for other programs; no gateway is asked."""
    if not (pcapng or mcap or samples):
        raise typer.BadParameter("say --pcapng, --mcap or --samples, or several")
    if mcap is not None and find_spec("mcap") is None:
        raise Failure(
            "MCAP takes the extra `mcap`: pip install 'motion-gateway[mcap]'. Nothing was written.",
            exits.USAGE,
        )
    with reading(recording):
        from recordings.form import SAMPLES, opened

        with opened(recording) as read:
            if pcapng is not None:
                from recordings.dissector import dissector
                from recordings.pcapng import write

                count = _written(write, read, pcapng)
                script = pcapng.with_suffix(".lua")
                script.write_text(dissector(), "utf-8")
                typer.echo(
                    f"{count} records were written to {pcapng}. Show them with "
                    f"`wireshark -X lua_script:{script} {pcapng}`."
                )
            if mcap is not None:
                from recordings import mcap_export

                count = _written(mcap_export.write, read, mcap)
                typer.echo(f"{count} messages were written to {mcap}, for Foxglove or PlotJuggler.")
            if samples is not None:
                samples.write_text(f"{read.text(SAMPLES)}\n", "utf-8")
                typer.echo(f"The samples were written to {samples}.")


def _written(write: "Callable[[Recording, BinaryIO], int]", recording: "Recording", path: Path) -> int:
    """Write a file, and leave none where that fails."""
    try:
        with path.open("wb") as file:
            return write(recording, file)
    except BaseException:
        path.unlink(missing_ok=True)
        raise


@contextmanager
def reading(path: Path, code: int = exits.USAGE) -> Iterator[None]:
    """Tell in one sentence why a recording could not be used; `code` is for what is damaged."""
    from recordings.form import NotARecording

    try:
        yield
    except NotARecording as error:
        raise Failure(str(error), code) from None
    except OSError as error:
        raise Failure(f"{error.filename or path}: {error.strerror or error}.", exits.USAGE) from None
