"""What a search has found, as a configuration with comments and in a sentence."""

from collections.abc import Iterator, Sequence
from itertools import count

from app.search import Found, FoundLine, FoundRobot
from gateway.config import parse

AXES = ("X", "Y", "Z", "@", "W", "U", "V", "R")
"""How the axes of a robot are called here, in their order; nobody can ask it for their names."""
TERMINAL_AXES = 3
"""Of a robot that has not told how many it has."""

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
    lines, robots = count(1), count(1)
    tables = [
        _line_table(it, f"line{next(lines)}") if isinstance(it, FoundLine) else _robot_table(it, next(robots))
        for it in sorted(found, key=lambda it: it.address)
    ]
    text = "\n".join((HEAD + ("" if finished else BROKEN_OFF) + SERVER, *tables))
    parse(text, "the configuration")
    return text


def _line_table(line: FoundLine, name: str) -> str:
    return "\n".join(
        (
            f"# An RC-400; to XID it answered {_plain(line.controllers) or 'nothing more'}.",
            "[[lines]]",
            f'id = "{name}"',
            f'address = "{line.address}"',
            '# stop_mode = "interject"      # "after_reply" for one that takes no command before its reply',
            *_bodies(line),
            "",
        )
    )


def _bodies(line: FoundLine) -> Iterator[str]:
    if not line.complete:
        yield "# Not all 120 body numbers were asked: `motion-gateway scan` finds the others."
    elif not line.bodies:
        yield "# None of its bodies answered: check their power, then `motion-gateway scan`."
    for body in line.bodies:
        yield ""
        yield "[[lines.bodies]]"
        yield f'id = "{body:02X}"'
        yield '# name = "lift"'
        yield '# units = { unit = "mm", pulses_per_unit = 100.0 }'
        yield "# position_tolerance = 0       # pulses, in encoder mode"
        yield "# in_position = true           # INP of a servo drive is wired"


def _robot_table(robot: FoundRobot, number: int) -> str:
    names = ", ".join(f'"{name}"' for name in AXES[: robot.axes or TERMINAL_AXES])
    return "\n".join(
        (
            f"# {in_words(robot)}",
            "[[lines]]",
            f'id = "cell{number}"',
            f'address = "{robot.address}"',
            'protocol = "fics"',
            "# mode = 3                     # communication mode; in 2 most commands are silent",
            f'terminator = "{robot.terminator}"',
            "",
            "[lines.robot]",
            f'id = "r{number}"',
            '# name = "cell"',
            "",
            "# A robot tells neither the names of its axes nor what they are counted in nor its units:",
            "# compare this with its set-up before anything moves. Each further unit is another such table.",
            "[[lines.robot.units]]",
            f"number = {robot.unit or 1}",
            f"axes = [{names}]",
            '# system = ["mm", "mm", "mm", "degree"]',
            '# motor_axes = ["A", "B", "Z", "@"]   # where the axes are converted',
            "",
        )
    )


def in_words(found: Found) -> str:
    """Say who was found."""
    if isinstance(found, FoundLine):
        bodies = ", ".join(f"{body:02X}" for body in found.bodies) or "none"
        return f"{found.address}: an RC-400 with bodies {bodies}."
    version = "" if found.version is None else f" of version {found.version.version}"
    mode = "" if found.mode is None else f", in communication mode {found.mode}"
    axes = (
        ", with a number of axes that it does not tell" if found.axes is None else f", with {found.axes} axes"
    )
    return f"{found.address}: a Fics{version}{mode}{axes}."


def _plain(text: str) -> str:
    """Text that fits in a comment."""
    return "".join(character for character in text if character.isprintable())[:100]
