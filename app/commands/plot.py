"""Plots from the command line, through a running gateway: `plot curve`."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Final
from urllib.parse import urlencode

import typer

from app import exits
from app.charts import FONTS, Panel, PlottedLine, chart
from app.client import LOCAL, Client, KeyFile, Url
from app.exits import Failure, Misuse
from app.targets import find

SVG: Final = ".svg"
PNG: Final = ".png"
POINTS: Final = 600
_FRAME: Final = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9">{}</svg>'
_NOTHING: Final = _FRAME.format("")
_LETTER: Final = _FRAME.format(f'<text x="0" y="9" font-family="{FONTS}">M</text>')

plot = typer.Typer(help="Draw speeds as SVG or PNG.", no_args_is_help=True)

Output = Annotated[
    Path, typer.Option(help="The file to write: .svg, or .png where the extra `png` is installed.")
]


@plot.callback()
def plots() -> None:
    """Each plot is a command of its own."""


@plot.command()
def curve(
    body: Annotated[str, typer.Argument(help="Address or name of a body: 3F, LINE.3F, lift.")],
    pattern: Annotated[
        int, typer.Argument(min=0, max=30, help="Acceleration pattern; 30 is the standard one.")
    ],
    distance: Annotated[float, typer.Option(min=0, help="How far the move goes.")],
    output: Output,
    unit: Annotated[str, typer.Option(help="pulse, mm, um, deg or mdeg.")] = "pulse",
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Draw speed, position and acceleration of a move with a pattern, as the body is set now."""
    require_drawable(output)
    client = Client.at(url, key_file)
    query = urlencode({"distance": f"{distance:.12g}", "unit": unit, "points": POINTS})
    target = find(client, body)
    if target.kind != "bodies":
        raise Misuse(f"{body} is no body: only bodies have patterns")
    found = client.request("GET", f"{target.path}/patterns/{pattern}/curve?{query}")
    far, long = f"{found['pulses']:,} pulses", f"{found['total_time_s']:.3f} s"
    title = f"{found['body_id']}, pattern {pattern}: {far} in {long}"
    write(output, chart(title, panels_of(found)))


def panels_of(found: dict[str, Any]) -> list[Panel]:
    """The panels of a curve, in the body's unit where it has one."""
    unit, suffix = (found["unit"], "_in_unit") if found["unit"] else ("pulses", "")
    titles = {"speed": f"Speed [{unit}/s]", "position": f"Position [{unit}]"}
    titles["acceleration"] = f"Acceleration [{unit}/s²]"
    return [
        Panel(
            title, [PlottedLine(name, [(point["time_s"], point[name + suffix]) for point in found["points"]])]
        )
        for name, title in titles.items()
    ]


def require_drawable(output: Path) -> None:
    """End where a file of this kind cannot be written, before anything is asked."""
    kind = output.suffix.lower()
    if kind not in (SVG, PNG):
        raise Misuse(f"{output} is neither .svg nor .png")
    if kind == PNG and find_spec("resvg_py") is None:
        raise Misuse("PNG takes the extra `png`: pip install 'motion-gateway[png]'. SVG takes none")
    if kind == PNG and _png(_LETTER) == _png(_NOTHING):
        raise Misuse(f"PNG takes one of the fonts {FONTS}, and this machine has none")


def write(output: Path, svg: str) -> None:
    """Write a picture as the kind of file that its name says."""
    try:
        output.write_bytes(_png(svg) if output.suffix.lower() == PNG else svg.encode())
    except OSError as error:
        raise Failure(f"{output} was not written: {error.strerror or error}.", exits.USAGE) from None
    typer.echo(output)


def _png(svg: str) -> bytes:
    from resvg_py import svg_to_bytes  # an extra

    return bytes(svg_to_bytes(svg_string=svg))
