"""Macros of the simulated Fics: small programs of C-HOST commands, built in or read from a TOML file."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from protocols.fics.macros import MOST_ARGUMENTS, RESERVED

PAUSE = "WAIT"
"""The one step that is not a command: seconds in which nothing happens."""

_NAME, _PAUSE = re.compile("[A-Z0-9]{3}"), re.compile(rf"{PAUSE} (\d{{1,4}}(?:\.\d{{1,3}})?)")


@dataclass(frozen=True, slots=True)
class Macro:
    """A program: each step is a C-HOST command or `WAIT seconds`, with the arguments as $1 to $4."""

    program: int
    """Its number in ERD, 1-999."""
    steps: tuple[str, ...]


MACROS: Mapping[str, Macro] = MappingProxyType(
    {
        "PCK": Macro(101, ("LMA $1,$2", "LMI ,,$3", "IOT 1-0:+", "WAIT 0.2", "LMI ,,-$3")),
        "PLC": Macro(102, ("LMA $1,$2", "LMI ,,$3", "IOT 1-0:-", "WAIT 0.2", "LMI ,,-$3")),
        "CYC": Macro(103, ("POM $1", "POM $2", "VAR V1=$3")),
    }
)
"""Built in: pick and place at X $1, Y $2, down by $3; a way over two positions."""


def pause_of(step: str) -> float | None:
    """The seconds of a pause; None for a command."""
    match = _PAUSE.fullmatch(step)
    return float(match[1]) if match else None


def filled_in(step: str, values: Mapping[int, float | None]) -> str:
    """A step with its arguments, those left out empty; two minus signs cancel out."""

    def written(match: re.Match[str]) -> str:
        sign, number = match[1], values.get(int(match[2]))
        if number is None:
            return ""
        return f"{-number + 0.0 if sign else number:.3f}".rstrip("0").rstrip(".")

    return re.sub(rf"(-?)\$([1-{MOST_ARGUMENTS}])", written, step)


def read_macros(path: Path) -> dict[str, Macro]:
    """Read `[macros.NAME]` tables with `program` and `steps`.

    :raises OSError: the file cannot be read.
    :raises ValueError: it says something else; the sentence tells where.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))["macros"]
        return {name: _macro(name, table) for name, table in tables.items()}
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, KeyError, AttributeError) as error:
        raise ValueError(f"{path} has no [macros.NAME] tables: {error}") from None


def _macro(name: str, table: object) -> Macro:
    if not _NAME.fullmatch(name) or name in RESERVED:
        raise ValueError(f"macro {name!r}: the name must be three capitals or digits, and no command's")
    match table:
        case {"program": int(program), "steps": list(steps), **rest} if (
            not rest and 1 <= program <= 999 and steps and all(isinstance(step, str) for step in steps)
        ):
            return Macro(program, tuple(steps))
    raise ValueError(f"macro {name}: give program = 1-999 and steps, a list of texts, and nothing else")
