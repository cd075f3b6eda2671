"""The memory of a controller for its user program: room for it, and memories (RC-420 manual 15.2)."""

from math import floor

from protocols.rorze.programs import STEPS
from protocols.rorze.user_program.assembler import MOST_LABELS, steps_of
from protocols.rorze.user_program.instruction import Label, parse

TICK_S = 0.1
"""The unit of a timer."""


def free_steps(program: tuple[str, ...]) -> int:
    """The steps left beside a program."""
    return STEPS - steps_of(map(parse, program))


def fits(program: tuple[str, ...], instruction: str) -> bool:
    """Tell whether there is room for one more instruction."""
    if isinstance(parse(instruction), Label) and sum(map(_is_label, program)) >= MOST_LABELS:
        return False
    return free_steps(program) >= parse(instruction).steps


def _is_label(instruction: str) -> bool:
    return instruction.startswith("*")


class Memories:
    """Memories by name, such as D12, T3, M0, IX or RX; all are 0 when the power comes, an assumption."""

    def __init__(self) -> None:
        self._values: dict[str, int] = {}
        self._set_at: dict[str, float] = {}

    def get(self, memory: str, now: float) -> int:
        """The content of a memory; a timer counts down to 0 however it was set, an assumption."""
        value = self._values.get(memory, 0)
        if memory.startswith("T"):
            return max(0, value - floor((now - self._set_at.get(memory, now)) / TICK_S))
        return value

    def set(self, memory: str, value: int, now: float) -> None:
        """Store a value."""
        self._values[memory], self._set_at[memory] = value, now
