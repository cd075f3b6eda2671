"""Plots from the command line, through a running gateway: `plot curve` and `plot move`."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final
from urllib.parse import quote, urlencode

import typer

from app import exits, words
from app.charts import FONTS, Panel, PlottedLine, Point, chart
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


@plot.command(cls=words.WordedCommand)
def curve(
    body: Annotated[str, typer.Argument(help="Address or name of a body: 3F, LINE.3F, lift.")],
    pattern: Annotated[int, typer.Argument(min=0, max=30, help=words.of("getCurve", "n"))],
    distance: Annotated[float, typer.Option(min=0, help=words.of("getCurve", "distance"))],
    output: Output,
    unit: Annotated[str, typer.Option(help=words.of("getCurve", "unit"))] = "pulse",
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


SHORTEST_S: Final = 0.04
"""Least seconds between two answers for a speed between them: each answer is some milliseconds old."""


@plot.command()
def move(
    move_id: Annotated[
        str, typer.Argument(help="The id of a move, such as `motion-gateway move` prints it.")
    ],
    output: Output,
    target: Annotated[
        str | None, typer.Option("--of", help="Whose move it is; left out, all are looked through.")
    ] = None,
    url: Url = LOCAL,
    key_file: KeyFile = None,
) -> None:
    """Draw the measured speed and position of a move over the planned ones."""
    require_drawable(output)
    client = Client.at(url, key_file)
    path = _path_of(client, move_id, target)
    told = _samples_of(client, path)
    panels = _panels_of(told)
    if not panels:
        raise Failure(f"The move {move_id} has too few samples to be drawn.", exits.REFUSED)
    if told.get("note"):
        typer.echo(f"No plan is drawn: {told['note']}", err=True)
    write(output, chart(f"{_whose(told)}, move {move_id}", panels))


def _samples_of(client: Client, path: str) -> dict[str, Any]:
    """Ask for the samples of a move; a SCARA robot's are those of its axes, each with its target."""
    if not path.startswith("/scaras/"):
        return client.request("GET", f"{path}/samples")
    move = client.request("GET", path)
    axes = [
        (axis, client.request("GET", f"/bodies/{axis['body_id']}/moves/{axis['move_id']}/samples"))
        for axis in move["axes"]
        if axis["move_id"] is not None
    ]
    return {"scara_id": move["scara_id"], "axes": axes}


def _panels_of(told: dict[str, Any]) -> list[Panel]:
    if "scara_id" in told:
        return panels_of_scara(told["axes"])
    return panels_of_body(told) if "body_id" in told else panels_of_unit(told)


def _whose(told: dict[str, Any]) -> str:
    return told.get("scara_id") or told.get("body_id") or f"{told['robot_id']}/units/{told['unit']}"


def panels_of_scara(axes: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> list[Panel]:
    """Speed and position of each axis, in its body's unit; its target is where the gateway calculated it."""
    panels = []
    for axis, told in axes:
        unit, per_unit = _unit_of(told)
        seen = [(sample["time_s"], sample["pulses"] / per_unit) for sample in told["samples"]]
        if speeds := speeds_of(seen):
            name, target = f"axis {axis['axis']}", axis["target_position"] / per_unit
            ends = [(seen[0][0], target), (seen[-1][0], target)]
            position = [PlottedLine("target", ends), PlottedLine("measured", seen)]
            panels += [
                Panel(f"Speed of {name} [{unit}/s]", [PlottedLine("measured", speeds)]),
                Panel(f"Position of {name} [{unit}]", position),
            ]
    return panels


def panels_of_body(told: dict[str, Any]) -> list[Panel]:
    """Speed and position, in the body's unit where it has one; none where too little was seen."""
    unit, per_unit = _unit_of(told)
    seen = [(sample["time_s"], sample["pulses"] / per_unit) for sample in told["samples"]]
    speeds = speeds_of(seen)
    if not speeds:
        return []
    planned = told["plan"] or []
    speed = [(point["time_s"], point["speed"] / per_unit) for point in planned]
    position = [(point["time_s"], point["pulses"] / per_unit) for point in planned]
    return [
        Panel(f"Speed [{unit}/s]", list(_over(speed, speeds))),
        Panel(f"Position [{unit}]", list(_over(position, seen))),
    ]


def _unit_of(told: dict[str, Any]) -> tuple[str, float]:
    """The unit of a body's positions, and how many pulses it has."""
    return (told["unit"], told["pulses_per_unit"]) if told["unit"] else ("pulses", 1.0)


def panels_of_unit(told: dict[str, Any]) -> list[Panel]:
    """Speed and position of the axes, those of one unit together; none where too little was seen."""
    panels = []
    for unit in dict.fromkeys(told["units"].values()):
        seen = {
            axis: [
                (sample["time_s"], sample["axes"][axis])
                for sample in told["samples"]
                if sample["axes"][axis] is not None
            ]
            for axis, counted_in in told["units"].items()
            if counted_in == unit
        }
        speeds = [PlottedLine(axis, found) for axis, points in seen.items() if (found := speeds_of(points))]
        if speeds:
            positions = [PlottedLine(axis, points) for axis, points in seen.items() if points]
            panels += [Panel(f"Speed [{unit}/s]", speeds), Panel(f"Position [{unit}]", positions)]
    return panels


def speeds_of(points: Sequence[Point]) -> list[Point]:
    """The mean speed between each two places that lie far enough apart, in the middle of the time between."""
    apart: list[Point] = []
    for point in points:
        if not apart or point[0] - apart[-1][0] >= SHORTEST_S:
            apart.append(point)
    return [
        ((sooner + later) / 2, (there - here) / (later - sooner))
        for (sooner, here), (later, there) in pairwise(apart)
    ]


def _over(planned: Sequence[Point], measured: Sequence[Point]) -> Iterator[PlottedLine]:
    if planned:
        yield PlottedLine("planned", planned)
    yield PlottedLine("measured", measured)


def _path_of(client: Client, move_id: str, target: str | None) -> str:
    """Find the path at which a move is served.

    :raises Failure: no target has such a move, or the gateway did not tell.
    """
    name = quote(move_id, safe="")
    if target is not None:
        found = find(client, target)
        return f"{found.unit_path() if found.kind == 'robots' else found.path}/moves/{name}"
    for place in _places(client):
        with suppress(Failure):
            client.request("GET", f"{place}/moves/{name}")
            return f"{place}/moves/{name}"
    raise Failure(
        f"No body, SCARA robot or unit has a move {move_id} that is kept: of those that are over the newest "
        "1,000 are.",
        exits.USAGE,
    )


def _places(client: Client) -> Iterator[str]:
    for body in client.request("GET", "/bodies")["bodies"]:
        yield f"/bodies/{body['body_id']}"
    for scara in client.made("scaras"):
        yield f"/scaras/{scara['scara_id']}"
    for robot in client.request("GET", "/robots")["robots"]:
        yield from (f"/robots/{robot['robot_id']}/units/{unit['number']}" for unit in robot["units"])
