"""What a controller keeps of a user program: instructions in their room, memories (RC-420 manual 15.2)."""

import re
from functools import lru_cache
from math import floor

from protocols.rorze.commands import COMMANDS
from protocols.rorze.programs import LAST_ADDRESS, STEPS

INSTRUCTION_STEPS = {
    **dict.fromkeys(("DEC", "EED", "END", "INC", "RET"), 1),
    **dict.fromkeys(("BST", "RSL", "RSR", "RST", "SDD", "SET", "WAT"), 2),
    **dict.fromkeys(("ADD", "AND", "CAL", "CTS", "DIV", "JER", "JMG", "JMP", "JOF", "JON"), 3),
    **dict.fromkeys(("LD", "MUL", "OR", "SDC", "SUB", "TMS"), 3),
    "JBT": 4,
    "JCP": 5,
}
"""The room each instruction takes (RC-420 manual 20)."""

SHORT_LOAD, SHORT_LOAD_STEPS = re.compile("LD(?!D[0-9IXY]+,(?:[DC][0-9IXY]+|[-+]?[0-9]+|H[0-9A-F]+)$)"), 2
"""The other forms of LD, which the manual counts as extensions."""

COMMAND_STEPS = 3
"""An assumption, for labels too: the manual counts instructions only, and calls this the average (15.2.4)."""

MOST_LABELS = 500

TICK_S = 0.1
"""The unit of a timer."""


@lru_cache(maxsize=STEPS)
def steps_of(instruction: str) -> int | None:
    """The steps an instruction takes; None if there is none of this code, or it is not for programs."""
    if instruction.startswith("*"):
        return COMMAND_STEPS
    if SHORT_LOAD.match(instruction):
        return SHORT_LOAD_STEPS
    for length in (3, 2):
        if (steps := INSTRUCTION_STEPS.get(instruction[:length])) is not None:
            return steps
    row = COMMANDS.get(instruction[:3])
    return COMMAND_STEPS if row is not None and row.program else None


def free_steps(program: tuple[str, ...]) -> int:
    """The steps left beside a program."""
    return STEPS - sum(steps_of(instruction) or 0 for instruction in program)


def fits(program: tuple[str, ...], instruction: str) -> bool:
    """Whether there is room for one more instruction."""
    labels = sum(stored.startswith("*") for stored in (*program, instruction))
    in_room = free_steps(program) >= (steps_of(instruction) or 0)
    return in_room and len(program) <= LAST_ADDRESS and labels <= MOST_LABELS


class Memories:
    """Data memories, counters and timers; all are 0 when the power comes, an assumption."""

    def __init__(self) -> None:
        self._values: dict[str, int] = {}
        self._set_at: dict[str, float] = {}

    def get(self, memory: str, now: float) -> int:
        """What a memory holds; a timer counts down to 0 however it was set, an assumption."""
        value = self._values.get(memory, 0)
        if memory.startswith("T"):
            return max(0, value - floor((now - self._set_at.get(memory, now)) / TICK_S))
        return value

    def set(self, memory: str, value: int, now: float) -> None:
        """Store a value."""
        self._values[memory], self._set_at[memory] = value, now
