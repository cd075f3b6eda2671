"""Taking a recording of a running gateway: `record`."""

import os
import re
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from app import exits, http
from app.client import ANSWER_S, LOCAL, STEP_S, Client, KeyFile, Url, why_not_reached
from app.exits import Failure
from app.output import ProgressLine

_UNITS: Final = {"s": 1, "m": 60, "h": 3600}
_SILENCE_S: Final = 30.0


def record(
    out: Annotated[Path, typer.Option("--out", help="The file to be made, such as plant.mgrec.")],
    last: Annotated[str | None, typer.Option(help="The time until now: 30s, 5m, 1h.")] = None,
    for_time: Annotated[str | None, typer.Option("--for", help="The time from now on.")] = None,
    line: Annotated[list[str] | None, typer.Option(help="Only this line; again for more.")] = None,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Record what goes over the lines, with events, journal and samples; nothing is sent to a controller.

    Ctrl-C ends a recording before its time, and keeps it.
    """
    wanted = {"last_s": _seconds(last, "--last"), "for_s": _seconds(for_time, "--for")}
    if not any(wanted.values()):
        raise typer.BadParameter("say --last, --for, or both")
    if out.exists():
        raise Failure(f"{out} exists already; nothing was recorded.", exits.USAGE)
    client = Client.at(url, key_file)
    begun = client.request("POST", "/recordings", {**wanted, **({"lines": line} if line else {})})
    path = f"/recordings/{begun['id']}"
    with ProgressLine() as told:
        taken = _taken(client, path, begun, told)
    if taken["status"] != "finished":
        raise Failure(f"Nothing was recorded: {taken['error']}", exits.REFUSED)
    _download(client, f"{path}/content", out)
    typer.echo(f"{taken['since']} to {taken['until']} was recorded in {out}.")


def _taken(client: Client, path: str, record: dict[str, Any], told: ProgressLine) -> dict[str, Any]:
    """Wait for the end of a recording; Ctrl-C makes it end."""
    try:
        while record["status"] == "running":
            told.say("recording; Ctrl-C ends it and keeps it")
            record = client.request("GET", path, wait_s=STEP_S)
    except KeyboardInterrupt:
        record = client.request("POST", f"{path}/finish", wait_s=STEP_S)
    return record


def _download(client: Client, path: str, out: Path) -> None:
    unfinished = out.with_name(f".{out.name}.part")
    try:
        with (
            os.fdopen(os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file,
            http.stream(
                *("GET", client.url + path),
                headers=client.headers(),
                timeout=ANSWER_S,
                silence=_SILENCE_S,
                trust_env=client.trust_environment,
            ) as answer,
        ):
            if not answer.is_success:
                raise Failure(f"The recording was refused: HTTP status {answer.status_code}.", exits.REFUSED)
            for piece in answer.iter_bytes():
                file.write(piece)
        unfinished.replace(out)
    except http.NotReached as error:
        raise Failure(why_not_reached(client.url, error), exits.NOT_SENT) from None
    except http.AnswerLost as error:
        raise Failure(
            f"The download broke off: {error}. The recording is kept: GET {path}.", exits.REFUSED
        ) from None
    except OSError as error:
        raise Failure(
            f"{out} cannot be written: {error.strerror or error}. The recording is kept: GET {path}.",
            exits.REFUSED,
        ) from None
    finally:
        unfinished.unlink(missing_ok=True)


def _seconds(text: str | None, option: str) -> float:
    if text is None:
        return 0.0
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([smh])", text)
    if match is None or not float(match[1]):
        raise typer.BadParameter(f"{option} is a time such as 30s, 5m or 1h, not {text!r}")
    return float(match[1]) * _UNITS[match[2]]
