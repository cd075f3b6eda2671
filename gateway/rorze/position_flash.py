"""What a body's flash memory holds of its positions, as far as the gateway has seen (RC-420 manual 13.4).

Nothing can ask a controller for it. But FPS writes the whole table there, and FPD reads it back: from then on
a position is the same in both until it is set.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

from protocols.rorze.flash import EraseFlash, LoadPositions, SavePositions
from protocols.rorze.inputs_outputs import SetInterruptAction
from protocols.rorze.position_table import NumberedPositionEntry, SetPositionEntry
from protocols.rorze.programs import RunProgram, StepProgram
from protocols.rorze.row import RorzeCommand
from protocols.table import Effect, Reply

_PROGRAMS: Final = frozenset((RunProgram, StepProgram))


@dataclass(eq=False)
class PositionFlash:
    """What is known of the positions in one body's flash memory. It asks nothing: the body notes it."""

    _same: bool = False
    """Whether RAM holds the same, but for what was set since."""
    _set: set[int] = field(default_factory=set)
    _held: dict[int, int] = field(default_factory=dict)

    def held(self, number: int) -> int | None:
        """The pulses of a position in flash memory; None where that is not known."""
        return self._held.get(number)

    def held_of(self, numbers: Iterable[int]) -> dict[int, int]:
        """The pulses of positions in flash memory, as far as they are known."""
        return {number: self._held[number] for number in numbers if number in self._held}

    def note_sent(self, command: RorzeCommand[Any], *, is_known: bool) -> None:
        """A command that is no mere read was queued, or its outcome is known."""
        if not is_known or type(command) is EraseFlash:
            self.forget()
        elif type(command) in _PROGRAMS:  # they may set positions, and cannot save them
            self._same = False
        elif type(command) is SetPositionEntry and isinstance(command.entry.position, int):
            self._set.add(command.entry.position)
        elif type(command) is SetInterruptAction:
            self._set |= {it for it in (command.number,) if it is not None}
        elif command.effect is Effect.SETTING and command.code[0] == "3":
            self._same = False

    def note_read(self, reply: Reply) -> None:
        """A question was answered."""
        if type(reply) is NumberedPositionEntry and self._same and reply.position not in self._set:
            self._held[reply.position] = reply.pulses

    def note_done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """A command was executed, or without a reply may have been."""
        if type(command) is SavePositions:
            self.forget()
            self._same = certain
        elif type(command) is LoadPositions:
            self._set.clear()
            self._same = certain

    def note_power_on(self) -> None:
        """RAM holds what flash memory does, unless an autostarted program has changed it."""
        self._same = False

    def forget(self) -> None:
        """What flash memory holds is not known any more."""
        self._same = False
        self._set.clear()
        self._held.clear()
