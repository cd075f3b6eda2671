"""The results of a search, as a configuration with comments: a line for each body and each unit."""

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

from pydantic import BaseModel, ValidationError

from gateway.config import parse
from gateway.config_file import value_text
from gateway.fics.config import RobotTable, UnitTable
from gateway.found import Found
from gateway.rorze.config import BodyTable

HEAD = """\
# Written by `motion-gateway init`. Read it, then:
#   motion-gateway check FILE
#   motion-gateway serve --config FILE
# docs/configuration.md has every key.
"""
BROKEN_OFF = "# The search was ended before it was over: there may be more than this.\n"
SERVER = """
[server]
host = "127.0.0.1"
port = 8420
# raw_commands = false          # commands as plain text
# allow_endless_moves = false   # moves without an end
# on_exit = "leave"             # "stop": motors that move are stopped when the gateway ends
"""
_OF_BODIES: Final = """\
# A body may have name = "lift", units = { unit = "mm", pulses_per_unit = 100.0 }, in_position = true (INP of
# a servo drive is wired), position_tolerance = 10 (pulses, in encoder mode), inputs, outputs and more.
"""
_OF_UNITS: Final = """\
# A unit may have system = "mm", "pulse" or "degree", or a list with one of them for each axis, and
# motor_axes = ["A", "B", "Z", "@"] where the axes are converted.
"""
_SCALE: Final = re.compile(r"([\d.]+)\s*(?:pulses?)?\s*/?\s*(mm|um|deg|mdeg)")

Ask = Callable[[str], str]
"""Ask a person; the answer is empty where it is left out."""
Tell = Callable[[str], object]
Table = dict[str, Any]


def tables_of(found: Sequence[Found]) -> list[tuple[Found, Table]]:
    """Give a table of the configuration for each controller that was found."""
    taken: set[str] = set()
    return [(device, device.table(taken)) for device in sorted(found, key=lambda device: device.address)]


def ask_for_names(table: Table, ask: Ask, tell: Tell) -> None:
    """Let a person name the bodies or axes of a line, and say in what they are counted."""
    for body in table.get("bodies", ()):
        at = f"{table['id']}.{body['id']}"
        _ask(ask, tell, BodyTable, body, "name", f"{at}, name", str)
        _ask(ask, tell, BodyTable, body, "units", f"{at}, pulses per mm or deg, such as 100/mm", _scale)
    if robot := table.get("robot"):
        _ask(ask, tell, RobotTable, robot, "name", f"{robot['id']}, name", str)
        for unit in robot["units"]:
            at, axes = f"{robot['id']}/units/{unit['number']}", ",".join(unit["axes"])
            _ask(ask, tell, UnitTable, unit, "axes", f"{at}, axes [{axes}]", _words)
            counted = f"{at}, counted in mm, pulse or degree, or one of them for each axis"
            _ask(ask, tell, UnitTable, unit, "system", counted, _word_or_words)


def _ask(
    ask: Ask,
    tell: Tell,
    model: type[BaseModel],
    table: Table,
    key: str,
    question: str,
    read: Callable[[str], object],
) -> None:
    """Ask for a key of a table until the answer is a value for it, or is left out."""
    while text := ask(question).strip():
        try:
            value = read(text)
            model.model_validate({**table, key: value})
        except ValidationError as error:
            tell(f"{error.errors()[0]['msg'].removeprefix('Value error, ')}.")
        except ValueError as error:
            tell(f"{error}")
        else:
            table[key] = value
            return


def _scale(text: str) -> Table:
    if (told := _SCALE.fullmatch(text)) is None:
        raise ValueError("Say a number and a unit, such as 100/mm or 333.33/deg.")
    return {"unit": told[2], "pulses_per_unit": float(told[1])}


def _words(text: str) -> list[str]:
    return re.split(r"[\s,]+", text)


def _word_or_words(text: str) -> str | list[str]:
    words = _words(text)
    return words[0] if len(words) == 1 else words


def config_of(tables: Sequence[tuple[Found, Table]], *, finished: bool) -> str:
    """Write a configuration that serves all that was found.

    :raises ConfigError: never, for what `search` finds.
    """
    head = HEAD + ("" if finished else BROKEN_OFF) + SERVER
    text = "\n".join((head, *("\n".join((*_rows(device, table), "")) for device, table in tables)))
    parse(text, "the configuration")
    return text


def _rows(device: Found, table: Table) -> Iterator[str]:
    yield from (f"# {row}" for row in device.comment().splitlines())
    yield "[[lines]]"
    yield from (f"{key} = {value_text(value)}" for key, value in table.items() if isinstance(value, str))
    if "bodies" in table:
        yield '# stop_mode = "interject"      # "after_reply" for one that takes no command before its reply'
        yield from _array("bodies", table["bodies"], _OF_BODIES)
        return
    yield "# mode = 3                     # communication mode; in 2 most commands are silent"
    yield ""
    yield "[lines.robot]"
    robot = table["robot"]
    yield from (f"{key} = {value_text(value)}" for key, value in robot.items() if isinstance(value, str))
    yield from _array("units", robot["units"], _OF_UNITS)


def _array(key: str, tables: Sequence[Table], comment: str) -> Iterator[str]:
    yield from comment.splitlines()
    yield f"{key} = ["
    yield from (f"  {value_text(table)}," for table in tables)
    yield "]"
