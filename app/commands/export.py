"""Writing a recording for other programs: `export`."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from app import exits
from app.exits import Failure


def export(
    recording: Annotated[Path, typer.Argument(help="A recording, such as plant.mgrec.")],
    pcapng: Annotated[
        Path | None,
        typer.Option(help="Write all records for Wireshark, and beside them its dissector (.lua)."),
    ] = None,
    samples: Annotated[
        Path | None, typer.Option(help="Write where motors were seen during moves, as CSV.")
    ] = None,
) -> None:
    """Write a recording for other programs; no gateway is asked."""
    if pcapng is None and samples is None:
        raise typer.BadParameter("say --pcapng, --samples, or both")
    with reading(recording):
        from recordings.form import SAMPLES, opened

        with opened(recording) as read:
            if pcapng is not None:
                from recordings.dissector import dissector
                from recordings.pcapng import write

                try:
                    with pcapng.open("wb") as file:
                        count = write(read, file)
                except BaseException:
                    pcapng.unlink(missing_ok=True)
                    raise
                script = pcapng.with_suffix(".lua")
                script.write_text(dissector(), "utf-8")
                typer.echo(
                    f"{count} records were written to {pcapng}. Show them with "
                    f"`wireshark -X lua_script:{script} {pcapng}`."
                )
            if samples is not None:
                samples.write_text(f"{read.text(SAMPLES)}\n", "utf-8")
                typer.echo(f"The samples were written to {samples}.")


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
