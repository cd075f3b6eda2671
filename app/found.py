"""The results of a search, as a configuration with comments."""

from collections.abc import Iterator, Sequence

from gateway.config import parse
from gateway.found import Found, FoundLine, FoundRobot

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


def config_of(found: Sequence[Found], *, finished: bool) -> str:
    """Write a configuration that serves all that was found.

    :raises ConfigError: never, for what `search` finds.
    """
    taken: set[str] = set()
    tables = []
    for device in sorted(found, key=lambda device: device.address):
        rows = _line_rows(device, taken) if isinstance(device, FoundLine) else _robot_rows(device, taken)
        tables.append("\n".join((*(f"# {row}" for row in device.comment().splitlines()), *rows, "")))
    text = "\n".join((HEAD + ("" if finished else BROKEN_OFF) + SERVER, *tables))
    parse(text, "the configuration")
    return text


def _line_rows(line: FoundLine, taken: set[str]) -> Iterator[str]:
    table = line.table(taken)
    yield "[[lines]]"
    yield f'id = "{table["id"]}"'
    yield f'address = "{line.address}"'
    yield '# stop_mode = "interject"      # "after_reply" for one that takes no command before its reply'
    for body in table["bodies"]:
        yield ""
        yield "[[lines.bodies]]"
        yield f'id = "{body["id"]}"'
        yield '# name = "lift"'
        yield '# units = { unit = "mm", pulses_per_unit = 100.0 }'
        yield "# position_tolerance = 0       # pulses, in encoder mode"
        yield "# in_position = true           # INP of a servo drive is wired"


def _robot_rows(robot: FoundRobot, taken: set[str]) -> Iterator[str]:
    table = robot.table(taken)
    (unit,) = table["robot"]["units"]
    axes = ", ".join(f'"{name}"' for name in unit["axes"])
    yield "[[lines]]"
    yield f'id = "{table["id"]}"'
    yield f'address = "{robot.address}"'
    yield 'protocol = "fics"'
    yield "# mode = 3                     # communication mode; in 2 most commands are silent"
    yield f'terminator = "{robot.terminator}"'
    yield ""
    yield "[lines.robot]"
    yield f'id = "{table["robot"]["id"]}"'
    yield '# name = "cell"'
    yield ""
    yield "[[lines.robot.units]]"
    yield f"number = {unit['number']}"
    yield f"axes = [{axes}]"
    yield '# system = "mm"                # or "pulse" or "degree"; or a list with one of them for each axis'
    yield '# motor_axes = ["A", "B", "Z", "@"]   # where the axes are converted'
