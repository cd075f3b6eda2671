"""Charts over time as SVG: panels one below the other, lines over each other in each."""

from collections.abc import Iterator, Sequence
from math import ceil, floor, log10
from typing import Final, NamedTuple
from xml.sax.saxutils import escape, quoteattr

WIDTH, PANEL_HEIGHT = 960, 240
LEFT, RIGHT, TOP, GAP, BOTTOM = 96, 24, 48, 32, 48
COLOURS: Final = ("#0b62a4", "#c2410c", "#15803d", "#7e22ce")
FONTS: Final = "DejaVu Sans, Liberation Sans, Noto Sans, Arial, sans-serif"
MOST_TICKS: Final = 8
SMALLEST: Final = 1e-9
"""Spread of values at or below which they are drawn as constant."""

Point = tuple[float, float]


class PlottedLine(NamedTuple):
    """Values over time."""

    label: str
    points: Sequence[Point]


class Panel(NamedTuple):
    """Lines that share one scale."""

    title: str
    lines: Sequence[PlottedLine]


class _Scale(NamedTuple):
    """Values on a stretch of the picture."""

    ticks: Sequence[float]
    start: float
    end: float
    """The places of the first tick and the last one."""

    def at(self, value: float) -> float:
        first, last = self.ticks[0], self.ticks[-1]
        return self.start + (value - first) / (last - first) * (self.end - self.start)


def chart(title: str, panels: Sequence[Panel]) -> str:
    """Draw panels over one time axis."""
    times = [time for panel in panels for line in panel.lines for time, _ in line.points]
    across = _Scale(ticks_of(times), LEFT, WIDTH - RIGHT)
    height = TOP + len(panels) * (PANEL_HEIGHT + GAP) + BOTTOM
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" '
        f'height="{height}" font-family="{FONTS}" font-size="12">',
        f"<title>{escape(title)}</title>",
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
        _text(LEFT, 24, title, "start", 'font-size="16"'),
    ]
    for index, panel in enumerate(panels):
        top = TOP + index * (PANEL_HEIGHT + GAP)
        parts += _panel(panel, across, top)
    parts.append(_text((LEFT + WIDTH - RIGHT) / 2, height - 16, "Time [s]", "middle"))
    return "\n".join([*parts, "</svg>", ""])


def ticks_of(values: Sequence[float]) -> list[float]:
    """Round numbers, evenly spread, that enclose the values: steps of 1, 2 or 5 times a power of ten."""
    least, most = min(values), max(values)
    span = most - least if most - least > 1e-9 * abs(most) else abs(most)
    rough = (span if span > SMALLEST else 1.0) / (MOST_TICKS - 2)
    power = 10.0 ** floor(log10(rough))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough)
    first, last = floor(least / step), ceil(most / step)
    return [index * step for index in range(first, max(last, first + 1) + 1)]


def _panel(panel: Panel, across: _Scale, top: float) -> Iterator[str]:
    values = [value for line in panel.lines for _, value in line.points]
    up = _Scale(ticks_of(values), top + PANEL_HEIGHT, top + GAP / 2)
    for value in up.ticks:
        colour = "#6b7280" if value == 0 else "#e5e7eb"
        yield _stroke(LEFT, up.at(value), WIDTH - RIGHT, up.at(value), colour)
        yield _text(LEFT - 8, up.at(value) + 4, _number(value), "end")
    for time in across.ticks:
        yield _stroke(across.at(time), up.start, across.at(time), up.end, "#e5e7eb")
        yield _text(across.at(time), up.start + 16, _number(time), "middle")
    yield _text(LEFT, top + 8, panel.title, "start", 'font-weight="bold"')
    for index, line in enumerate(panel.lines):
        colour = COLOURS[index % len(COLOURS)]
        places = " ".join(f"{across.at(time):.2f},{up.at(value):.2f}" for time, value in line.points)
        yield f'<polyline fill="none" stroke="{colour}" stroke-width="1.5" points={quoteattr(places)}/>'
        if len(panel.lines) > 1:
            right = WIDTH - RIGHT - 120 * (len(panel.lines) - 1 - index)
            yield _text(right, top + 8, line.label, "end", f'fill="{colour}"')


def _stroke(x1: float, y1: float, x2: float, y2: float, colour: str) -> str:
    return f'<line x1="{x1:.2f}" y1="{y1:.2f}" x2="{x2:.2f}" y2="{y2:.2f}" stroke="{colour}"/>'


def _text(x: float, y: float, text: str, anchor: str, extra: str = "") -> str:
    return f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" {extra}>{escape(text)}</text>'


def _number(value: float) -> str:
    return f"{value:,.10g}"
