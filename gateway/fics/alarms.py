"""The alarms of robots, in words for a technician (C-HOST manual 2-12 to 2-14)."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from gateway.core.alarms import (
    Cause,
    CauseKind,
    Facts,
    causes_of_moves,
    causes_of_restores,
    facts_of_power_loss,
    stopped,
    swapped,
)
from gateway.core.next_calls import ACKNOWLEDGE, STOP
from gateway.fics.calls import ERRORS, MOVE, RESET, ROBOT, STATUS
from gateway.fics.robot import Robot
from gateway.texts import Text


def _facts_of_error(record: Facts) -> Facts:
    error = Text(record["en"], record["ja"])
    return {**record, "error": error, "remedy": Text(record["remedy_en"], record["remedy_ja"])}


ROBOTS: Final[Sequence[CauseKind[Robot]]] = (
    CauseKind(
        "robot.offline",
        "C-HOST manual 1-1",
        (ROBOT, STOP),
        lambda robot: not robot.online,
    ),
    CauseKind(
        "robot.power_cycled",
        "C-HOST manual 1-1-1, 2-15",
        (ROBOT, ACKNOWLEDGE),
        lambda robot: robot.power_cycled,
        facts=facts_of_power_loss,
    ),
    swapped("robot", "C-HOST manual 1-1-1"),
    CauseKind(
        "robot.error",
        "C-HOST manual 2-12 to 2-14",
        (ERRORS, RESET),
        lambda robot: robot.latched_error is not None,
        facts=_facts_of_error,
    ),
    CauseKind(
        "robot.stop.unconfirmed",
        "C-HOST manual 2-7, 2-8",
        (ROBOT, STOP),
        lambda robot: robot.stops.unconfirmed is not None,
        disproved=lambda robot: robot.stops.was_proved,
    ),
    stopped("robot", "C-HOST manual 2-7, 2-8", (ROBOT,), lambda robot: robot.stops.unconfirmed is not None),
    CauseKind(
        "robot.motion.foreign",
        "C-HOST manual 2-10",
        (ROBOT, STOP),
        lambda robot: robot.moving is True and robot.known.motion.command is None,
    ),
    CauseKind(
        "robot.bits.mismatch",
        "C-HOST manual 2-10, 2-11",
        (ROBOT,),
        lambda robot: bool(robot.known.bits.mismatches),
    ),
    CauseKind(
        "robot.unit.missing",
        "C-HOST manual 2-1, 2-12",
        (ROBOT,),
        lambda robot: bool(robot.known.unit.missing),
    ),
    CauseKind(
        "robot.jog.not_stopped",
        "C-HOST manual 2-2",
        (ROBOT, STOP),
        lambda robot: robot.moving is True,
    ),
    CauseKind(
        "robot.move.overdue",
        "C-HOST manual 2-10",
        (ROBOT, STOP),
        lambda robot: robot.moving is True,
    ),
)


def causes(find: Callable[[str], Robot | None]) -> Iterator[Cause]:
    """The causes of robots, which are found by their ids; None for one that is configured no more."""
    for kind in ROBOTS:
        yield kind.among(find)
    yield from causes_of_restores("robot", "C-HOST manual 2-17")
    yield from causes_of_moves("robot", "C-HOST manual 2-12", (MOVE, STATUS, ERRORS))
