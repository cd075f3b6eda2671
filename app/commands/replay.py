"""Playing a recording: to this gateway, as its controllers (`--lines`), or to its clients (`--serve`)."""

from pathlib import Path
from typing import Annotated

import typer

from app import exits
from app.commands.export import reading
from app.exits import Failure


def replay(
    recording: Annotated[Path, typer.Argument(help="A recording, such as plant.mgrec.")],
    lines: Annotated[
        bool, typer.Option("--lines", help="Have this gateway do it again, and tell the first difference.")
    ] = False,
    serve: Annotated[
        bool, typer.Option("--serve", help="Serve clients what they were served; no port is opened.")
    ] = False,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Listen on this port (--serve).")] = 8420,
    speed: Annotated[
        str | None, typer.Option(help="So many times as fast, or `max`: as fast as possible.")
    ] = None,
    as_test: Annotated[
        bool, typer.Option("--as-test", help="Write a dialogue beside the recording, for a test.")
    ] = False,
) -> None:
    """Play a recording; nothing is sent to a controller.

    Exit code 1 with the record, as lines/ID.jsonl:N, where this gateway writes something else.
    """
    if lines + serve + as_test != 1:
        raise typer.BadParameter("say --lines, --serve or --as-test")
    times = _times(speed, by_itself=1.0 if serve else None)
    with reading(recording, exits.REFUSED):
        if serve:
            _serve(recording, port, _FASTEST if times is None else times)
        elif as_test:
            _write_dialogue(recording)
        else:
            _compare(recording, times)


_FASTEST = 100.0
"""`max` for clients, who want to see something."""
_CONNECTIONS = 1000


def _times(text: str | None, by_itself: float | None) -> float | None:
    """Read a speed as a multiple of the recorded one; None: as fast as possible."""
    if text is None:
        return by_itself
    if text == "max":
        return None
    try:
        times = float(text)
    except ValueError:
        times = 0.0
    if not 0.01 <= times <= 1000:
        raise typer.BadParameter(f"--speed is a number from 0.01 to 1000, or max, not {text!r}")
    return times


def _serve(path: Path, port: int, speed: float) -> None:
    import asyncio

    with asyncio.Runner() as runner:
        runner.run(_serving(path, port, speed))


async def _serving(path: Path, port: int, speed: float) -> None:
    import asyncio

    import uvicorn

    from api.front.http_protocol import protocols
    from recordings.form import opened
    from recordings.serving import Playback, ReplayApp

    with opened(path) as recording:
        playback = Playback(recording, speed)
    config = uvicorn.Config(
        ReplayApp(playback),
        host="127.0.0.1",
        port=port,
        http=protocols(_CONNECTIONS),
        ws="none",
        lifespan="off",
        access_log=False,
        log_level="warning",
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    playing = asyncio.create_task(playback.run(), name="playback")
    typer.echo(f"{path} is replayed on http://127.0.0.1:{port}, {speed:g} times as fast.", err=True)
    try:
        await uvicorn.Server(config).serve()
    finally:
        playing.cancel()
        playback.plant.events.close()
        await asyncio.gather(playing, return_exceptions=True)


def _compare(path: Path, speed: float | None) -> None:
    from recordings.form import opened
    from recordings.replaying import Script
    from recordings.replaying import replay as play

    with opened(path) as recording:
        script = Script.of(recording)
    _quiet()
    replayed = play(script, speed)
    for question in replayed.unanswered:
        typer.echo(f"It was not asked then, and nothing answers it: {question}", err=True)
    if replayed.differences:
        raise Failure("\n".join(map(str, replayed.differences)), exits.REFUSED)
    typer.echo(
        f"No difference: {replayed.frames} records in {script.length_s:.1f} s, {replayed.requests} requests."
    )


def _write_dialogue(path: Path) -> None:
    from recordings.dialogue import dialogue_of
    from recordings.form import opened
    from recordings.replaying import Script

    with opened(path) as recording:
        script = Script.of(recording)
    _quiet()
    text, replayed = dialogue_of(script)
    if replayed.differences:
        raise Failure(f"There is no dialogue: {replayed.differences[0]}. Nothing was written.", exits.REFUSED)
    target = path.with_suffix(".dialogue")
    target.write_text(text, "utf-8")
    typer.echo(f"{target} was written. Put it into tests/recordings/dialogues to have it tested.")


def _quiet() -> None:
    """Keep the log of the gateway that is played away: what it tells is of then."""
    import logging

    logging.disable(logging.CRITICAL)
