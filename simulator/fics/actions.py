"""How commands are acted out: at once by an action, or by a plan that moves axes and takes its time."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from typing import Any, TypeVar

from protocols.fics.commands import COMMANDS, read
from protocols.fics.row import FicsCommand
from protocols.fics.status import MotionMode
from protocols.table import Reply, SyntaxFault, WireFault
from simulator.fics.alarms import Alarm
from simulator.fics.course import Course


class Code(IntEnum):
    """Errors of communication, Enn (C-HOST manual 2-12)."""

    NONE = 0
    BUSY = 1
    ALARM = 2
    WRONG_STATE = 3
    STOPPING = 4
    RANGE = 5
    FORMAT = 6
    SOFT_LIMIT = 7
    NO_UPLOAD = 8
    NO_POSITION = 9
    IMPOSSIBLE = 10
    TOO_MANY = 11
    NO_MACRO = 12
    LINE = 99


class Refused(Exception):
    """The command is refused and has had no effect."""

    def __init__(self, code: Code) -> None:
        super().__init__(f"E{code:02d}")
        self.code = code


class Alarmed(Exception):
    """The command, or what it has begun, ends with an error of the system."""

    def __init__(self, alarm: Alarm) -> None:
        super().__init__(f"{alarm.code:03d}")
        self.alarm = alarm


@dataclass(frozen=True, slots=True)
class Later:
    """The command is answered when it is done, by the one who does it."""


LATER = Later()

Outcome = Reply | list[Reply] | str | Later | None
"""The result of an action; None is the bare name, a list is one answer each, text is an answer as written."""

Wait = tuple[Course, ...] | float
"""The awaited end of a task: of motion, or a moment."""

Task = Generator[Wait, float, float]
"""Something that takes time: sent the moments at which its waits were over, it returns the last of them."""

M = TypeVar("M")
"""The machine that acts."""
C = TypeVar("C", bound=FicsCommand[Any])
Action = Callable[[M, C, float], Outcome]
Plan = Callable[[M, C, float], Task]

_ACTIONS: dict[type[FicsCommand[Any]], Action[Any, Any]] = {}
_PLANS: dict[type[FicsCommand[Any]], tuple[MotionMode, Plan[Any, Any]]] = {}


def acts_out(*rows: type[C]) -> Callable[[Action[M, C]], Action[M, C]]:
    """Enter the decorated function as what commands of these rows do at once."""

    def enter(action: Action[M, C]) -> Action[M, C]:
        _ACTIONS.update(dict.fromkeys(rows, action))
        return action

    return enter


def plans(mode: MotionMode, *rows: type[C]) -> Callable[[Plan[M, C]], Plan[M, C]]:
    """Enter the decorated function: it checks a command of these rows, then returns what takes time."""

    def enter(plan: Plan[M, C]) -> Plan[M, C]:
        _PLANS.update(dict.fromkeys(rows, (mode, plan)))
        return plan

    return enter


def action_of(command: FicsCommand[Any]) -> Action[Any, Any] | None:
    """The action of a command that is done at once; None if it takes time."""
    return _ACTIONS.get(type(command))


def plan_of(command: FicsCommand[Any]) -> tuple[MotionMode, Plan[Any, Any]]:
    """How a command moves axes, and what ACD calls that."""
    return _PLANS[type(command)]


def rows_acted_out() -> frozenset[type[FicsCommand[Any]]]:
    """The rows that can be acted out, either way."""
    return frozenset([*_ACTIONS, *_PLANS])


def understand(name: str, arguments: str) -> FicsCommand[Any]:
    """Read a command.

    :raises Refused: E06 or E05 where the arguments are wrong.
    """
    command = _read(name, arguments)
    if isinstance(command, Code):
        raise Refused(command)
    return command


@lru_cache(maxsize=4096)
def _read(name: str, arguments: str) -> FicsCommand[Any] | Code:
    try:
        return read(name, arguments)
    except SyntaxFault:
        return Code.FORMAT
    except WireFault:
        return Code.RANGE


def is_command(name: str) -> bool:
    """Tell whether a name is a command's, not a macro's."""
    return name in COMMANDS
