"""How commands are acted out: the table of actions, and what an action can answer besides its reply."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

from protocols.rorze.row import RorzeCommand
from protocols.table import Reply, SyntaxFault, WireFault

UNKNOWN_CODE, BAD_PARAMETER, OUT_OF_RANGE = 0x49, 0x4A, 0x5D

CODE_LENGTH = 3


class Refused(Exception):
    """The command is answered with an error code (RC-420 manual 21) and has had no effect."""

    def __init__(self, code: int) -> None:
        super().__init__(f"@{code:02X}")
        self.code = code


@dataclass(frozen=True, slots=True)
class Delayed:
    """A reply that comes later than at once."""

    reply: Reply | None
    delay_s: float


Outcome = Reply | Delayed | None
"""The result of an action; None is the bare echo of the code."""

M = TypeVar("M")
"""The machine that acts."""
C = TypeVar("C", bound=RorzeCommand[Any])
Action = Callable[[M, C, float], Outcome]


class Order(NamedTuple):
    """A command understood, with what it does."""

    command: RorzeCommand[Any]
    act: Action[Any, Any]


_TABLE: dict[str, tuple[type[RorzeCommand[Any]], Action[Any, Any]]] = {}


def acts_out(row: type[C]) -> Callable[[Action[M, C]], Action[M, C]]:
    """Enter the decorated function into the table as what the row's command does."""

    def enter(action: Action[M, C]) -> Action[M, C]:
        _TABLE[row.code] = row, action
        return action

    return enter


def codes_acted_out() -> frozenset[str]:
    """The codes of all commands that are acted out; every other one is refused with 49."""
    return frozenset(_TABLE)


def understand(text: str) -> Order:
    """Decode a code with its parameters.

    :raises Refused: 49 where the code is unknown, 4A or 5D where the parameters are wrong.
    """
    order = _decode(text)
    if isinstance(order, int):
        raise Refused(order)
    return order


def order_of(command: RorzeCommand[Any]) -> Order:
    """The order of a command that needs no decoding.

    :raises Refused: 49 where it is not acted out.
    """
    entry = _TABLE.get(command.code)
    if entry is None:
        raise Refused(UNKNOWN_CODE)
    return Order(command, entry[1])


@lru_cache(maxsize=4096)
def _decode(text: str) -> Order | int:
    entry = _TABLE.get(text[:CODE_LENGTH])
    if entry is None:
        return UNKNOWN_CODE
    row, action = entry
    try:
        return Order(row.read(text[CODE_LENGTH:]), action)
    except SyntaxFault:
        return BAD_PARAMETER
    except WireFault:
        return OUT_OF_RANGE if OUT_OF_RANGE in row.errors else BAD_PARAMETER
