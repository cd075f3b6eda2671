"""The results of benchmarks: figures beside their yardsticks and targets, and the table of them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from statistics import median
from typing import Literal


@dataclass(frozen=True, slots=True)
class Target:
    """A bound for a figure: `of` its ratio to the yardstick, or of the figure itself."""

    of: Literal["ratio", "figure"]
    sign: Literal[">=", "<="]
    bound: float

    def reached_by(self, value: float) -> bool:
        """Say whether the value is on the right side of the bound."""
        return value >= self.bound if self.sign == ">=" else value <= self.bound


@dataclass(frozen=True, slots=True)
class Figure:
    """One quantity, measured several times, each time next to its yardstick."""

    name: str
    unit: str
    measured: Sequence[float]
    yardstick: Sequence[float]
    target: Target

    @property
    def ratios(self) -> list[float]:
        """Each measurement over the yardstick of its own round; endless where the yardstick is zero."""
        return [
            mine / theirs if theirs else inf
            for mine, theirs in zip(self.measured, self.yardstick, strict=True)
        ]

    @property
    def reached(self) -> bool:
        """True if the median reaches the target."""
        return self.target.reached_by(median(self.ratios if self.target.of == "ratio" else self.measured))


HEADINGS = ("benchmark", "unit", "measured", "yardstick", "ratio", "target", "")


def table(figures: Iterable[Figure]) -> str:
    """Lay the figures out in columns: medians, with the lowest and the highest of several rounds."""
    rows = [HEADINGS, *map(_row, figures)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def _row(figure: Figure) -> tuple[str, ...]:
    target = figure.target
    return (
        figure.name,
        figure.unit,
        _spread(figure.measured),
        _spread(figure.yardstick),
        _spread(figure.ratios),
        f"{target.of} {target.sign} {target.bound:g}",
        "reached" if figure.reached else "MISSED",
    )


def _spread(values: Sequence[float]) -> str:
    if max(values) == min(values):
        return f"{values[0]:.4g}"
    return f"{median(values):.4g} ({min(values):.4g}-{max(values):.4g})"
