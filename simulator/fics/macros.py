"""Macros of the simulated Fics: small programs of C-HOST commands, built in or read from a TOML file."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from protocols.fics.axis_settings import AxisSetting
from protocols.fics.commands import read
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.jog import StepAxis
from protocols.fics.macros import MOST_ARGUMENTS, RESERVED
from protocols.fics.moves import AxesMove, MoveToPosition
from protocols.fics.row import NAME_LENGTH
from protocols.fics.variables import SetVariable
from protocols.table import WireFault

PAUSE = "WAIT"
"""The one step that is not a command: seconds in which nothing happens."""

STEPS = (AxesMove, MoveToPosition, StepAxis, SwitchOutput, SetVariable, AxisSetting)
"""The commands a macro can be made of."""

_NAME, _PAUSE = re.compile("[A-Z0-9]{3}"), re.compile(rf"{PAUSE} (\d{{1,4}}(?:\.\d{{1,3}})?)")


@dataclass(frozen=True, slots=True)
class Macro:
    """A program: each step is a C-HOST command or `WAIT seconds`, with the arguments as $1 to $4."""

    program: int
    """Number of the program in ERD, 1-999."""
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


def taken_apart(step: str) -> tuple[str, str]:
    """The name and the arguments of a step that is a command."""
    return step[:NAME_LENGTH], step[NAME_LENGTH:].replace(" ", "")


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

    :raises ValueError: the file cannot be read, or says something else; the sentence tells where.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8")).get("macros")
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is no TOML file: {error}") from None
    if not isinstance(tables, dict) or not tables:
        raise ValueError(f"{path} has no table [macros.NAME] for any macro")
    return {name: _macro(name, table) for name, table in tables.items()}


def _macro(name: str, table: object) -> Macro:
    if not _NAME.fullmatch(name) or name in RESERVED:
        raise ValueError(f"macro {name!r}: the name must be three capitals or digits, and no command's")
    match table:
        case {"program": int(program), "steps": list(steps), **rest} if (
            not rest
            and program is not True
            and 1 <= program <= 999
            and steps
            and all(isinstance(step, str) for step in steps)
        ):
            for number, step in enumerate(steps, start=1):
                _require_step(f"macro {name}, step {number}, {step!r}", step)
            return Macro(program, tuple(steps))
    raise ValueError(f"macro {name}: give program = 1-999 and steps, a list of texts, and nothing else")


def _require_step(where: str, step: str) -> None:
    """Check that a step can be done, if all its arguments are 1.

    :raises ValueError: it cannot.
    """
    if pause_of(step) is not None:
        return
    text = filled_in(step, dict.fromkeys(range(1, MOST_ARGUMENTS + 1), 1.0))
    try:
        command = read(*taken_apart(text))
    except WireFault as fault:
        raise ValueError(f"{where}: {fault}") from None
    possible = isinstance(command, STEPS)
    if not possible:
        raise ValueError(f"{where}: a macro can only move, wait, and set outputs, variables and axes")
