"""The command line's part for user programs: checked, uploaded, read back, run."""

import json
import os
from pathlib import Path
from typing import Annotated, Any, NoReturn

import httpx
import typer

from app.client import Client
from protocols.rorze.programs import STEPS
from protocols.rorze.user_program.assembler import Assembled, assemble

EXIT_REFUSED = 1
EXIT_USAGE = 2
EXIT_NOT_SENT = 3
EXIT_UNKNOWN = 4
EXIT_UNDER_WAY = 5

LOOK_S = 10
"""While an upload runs, its progress is printed at least this often."""
DOWNLOAD_S = 600
"""A full program takes minutes at 9600 baud."""
TEXT = "text/plain"

program = typer.Typer(help="Check user programs, upload them to bodies and run them.", no_args_is_help=True)

Source = Annotated[Path, typer.Argument(help="A program: one command a line, comments after `;`.")]
Body = Annotated[str, typer.Argument(help="Address of a body: 3F, or LINE.3F.")]
Url = Annotated[str, typer.Option(help="Where the gateway listens.", envvar="MOTION_GATEWAY_URL")]
HERE = "http://127.0.0.1:8420"


@program.command()
def check(file: Source) -> None:
    """Tell what is wrong with a program, or how much room it takes; no gateway is needed."""
    _, assembled = _read(file)
    labels = ", ".join(assembled.labels) or "none"
    typer.echo(f"{len(assembled.instructions)} instructions, {assembled.steps} of {STEPS} steps.")
    typer.echo(f"Labels: {labels}.")


@program.command()
def upload(
    body: Body,
    file: Source,
    flash: Annotated[bool, typer.Option(help="Write it to flash memory too.")] = False,
    url: Url = HERE,
) -> None:
    """Replace a body's program, and see that it holds the new one."""
    source, _ = _read(file)
    path = f"{url}/bodies/{body}/program"
    sent = _ask("PUT", path, params={"flash": flash}, content=source.encode(), headers={"content-type": TEXT})
    record, location = sent.json(), sent.headers["location"]
    while record["status"] == "running":
        typer.echo(f"{record['phase']}: {record['written']} of {record['instructions']} written", err=True)
        record = _ask("GET", f"{url}{location}", params={"wait": LOOK_S}, timeout=3 * LOOK_S).json()
    if record["error"] is not None:
        error = record["error"]
        _fail(f"{error['detail']} {record['stored']} {error['remedy']}", EXIT_REFUSED)
    typer.echo(record["stored"])


@program.command()
def download(body: Body, url: Url = HERE) -> None:
    """Print the program that a body holds in RAM."""
    path = f"{url}/bodies/{body}/program"
    typer.echo(_ask("GET", path, headers={"accept": TEXT}, timeout=DOWNLOAD_S).text, nl=False)


@program.command()
def run(
    body: Body,
    label: Annotated[str | None, typer.Option(help="Begin at a label, written without its `*`.")] = None,
    address: Annotated[int | None, typer.Option(min=0, max=STEPS - 1, help="Begin at an address.")] = None,
    step: Annotated[bool, typer.Option(help="Execute one instruction only.")] = False,
    wait: Annotated[float, typer.Option(min=0, max=60, help="Seconds to wait for its end.")] = 0,
    url: Url = HERE,
) -> None:
    """Run a body's program, which may move the motor; a stop of the body ends it."""
    wanted = {"label": label, "address": address, "single_step": step}
    path = f"{url}/bodies/{body}/program/runs"
    begun = _ask("POST", path, params={"wait": wait}, json=wanted, timeout=wait + 10).json()
    typer.echo(json.dumps(begun, ensure_ascii=False, indent=2))
    if begun["status"] == "unknown":
        raise typer.Exit(EXIT_UNKNOWN)
    if begun["status"] == "running" and wait:
        raise typer.Exit(EXIT_UNDER_WAY)
    if begun["status"] == "ended" and begun["end_cause"] not in ("normal", "single_step"):
        raise typer.Exit(EXIT_REFUSED)


def _read(file: Path) -> tuple[str, Assembled]:
    """Read and assemble a program; its faults are printed as compilers print them."""
    try:
        source = file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        _fail(f"{file}: {error.strerror or error}.", EXIT_USAGE)
    except UnicodeDecodeError:
        _fail(f"{file} is not UTF-8 text.", EXIT_USAGE)
    assembled = assemble(source)
    if not isinstance(assembled, Assembled):
        _fail("\n".join(f"{file}:{it.line}:{it.column}: {it.reason}" for it in assembled), EXIT_REFUSED)
    return source, assembled


def _ask(method: str, url: str, **options: Any) -> httpx.Response:
    """Ask the gateway, and turn a problem into its sentence, the request's id and an exit code."""
    key_file = os.environ.get("MOTION_GATEWAY_KEY_FILE")
    known = Client.at(url, Path(key_file) if key_file else None).headers()
    request_id, headers = known["X-Request-Id"], {**known, **options.pop("headers", {})}
    try:
        answer = httpx.request(method, url, headers=headers, **{"timeout": 30.0, **options})
    except (httpx.ConnectError, httpx.ConnectTimeout, httpx.UnsupportedProtocol, httpx.InvalidURL) as error:
        _fail(f"No gateway answers at {url}: {error}. Nothing was sent.", EXIT_NOT_SENT)
    except httpx.HTTPError as error:
        _fail(
            f"The gateway at {url} was asked, and its answer was lost: {error}. It may have been carried out "
            f"(request {request_id}).",
            EXIT_UNKNOWN,
        )
    if not answer.is_success:
        _tell(answer, request_id)
    return answer


def _tell(answer: httpx.Response, request_id: str) -> NoReturn:
    """End with the sentence of a problem."""
    try:
        problem = dict(answer.json())
    except (TypeError, ValueError):
        _fail(f"The answer has status {answer.status_code}: it may come from no gateway.", EXIT_UNKNOWN)
    sentence = f"{problem.get('detail', '')} {problem.get('remedy', '')}".strip()
    _fail(f"{sentence} (request {request_id})", _exit_code(answer.status_code, problem))


def _exit_code(status: int, problem: dict[str, Any]) -> int:
    if problem.get("moved") == "unknown":
        return EXIT_UNKNOWN
    if status == httpx.codes.SERVICE_UNAVAILABLE:
        return EXIT_NOT_SENT
    return EXIT_REFUSED if status == httpx.codes.CONFLICT or problem.get("code") else EXIT_USAGE


def _fail(sentence: str, code: int) -> NoReturn:
    typer.echo(sentence, err=True)
    raise typer.Exit(code)
