"""What a body's flash memory holds of its settings, as far as the gateway has seen (RC-420 manual 18).

Nothing can ask a controller for it. But power-on loads the settings from flash memory, and FIS writes them
there: from then on a setting is the same in both until it is set.
"""

import re
from dataclasses import dataclass, field
from typing import Any, Final

from protocols.rorze.flash import EraseFlash, SaveSettings
from protocols.rorze.programs import RunProgram, StepProgram
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetFallingAccelerationShare, SetRisingAccelerationShare
from protocols.table import Effect, Reply

KEPT: Final = re.compile("0[BRS]|9V|C[CEFPS]|D[CIL]|E[ADP]|H[ACFTZ]|O[ABHLS]|P[ABEJKLST]|Q[IS]|SP|UA")
"""What FIS keeps, by the first two characters of the commands; but the position index (3I), which moves step,
and the outputs (CO), which pulses, interrupts and errors switch."""

SHARES: Final = (SetRisingAccelerationShare, SetFallingAccelerationShare)
"""Settings of which 0 is a value; in a set where they were never set they read as 0, too (OAD, OBD)."""

_UNSEEN: Final = frozenset((RunProgram, StepProgram, EraseFlash))
"""After these either memory may hold something else."""


@dataclass(eq=False)
class FlashState:
    """What is known of one body's flash memory. It asks nothing: the body notes it."""

    known: bool = False
    """Whether power-on or FIS was seen, and nothing since that could change settings unseen."""
    _set: set[str] = field(default_factory=set)
    """What was set since, by the first two characters of the commands."""
    _replies: dict[str, Reply] = field(default_factory=dict)
    """What questions were answered while both memories held the same, by their texts."""
    _shares: set[tuple[str, int | None]] = field(default_factory=set)
    """The shares that were set since the power came on, by their codes and sets."""

    def note_sent(self, command: RorzeCommand[Any], *, is_known: bool) -> None:
        """A command that is no mere read was queued, or its outcome is known."""
        if not is_known or type(command) in _UNSEEN:
            self.forget()
        elif command.effect is Effect.SETTING:
            self._set.add(command.code[:2])

    def note_read(self, question: RorzeCommand[Any], reply: Reply) -> None:
        """A question was answered."""
        if not self.known or question.effect is not Effect.READ:
            return
        kind = question.code[:2]
        if kind not in self._set and KEPT.fullmatch(kind):
            self._replies[_text(question)] = reply

    def note_done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """A command was executed, or without a reply may have been."""
        if type(command) is SaveSettings:
            self.forget()
            self.known = certain
        elif certain and isinstance(command, SHARES):
            self._shares.add((command.code, command.speed_set))

    def note_power_on(self, *, certain: bool) -> None:
        """The controller has been switched on: it has loaded its settings."""
        self.forget()
        self._shares.clear()
        self.known = certain

    def forget(self) -> None:
        """What flash memory holds is not known any more."""
        self.known = False
        self._set.clear()
        self._replies.clear()

    def may_be_unset(self, command: RorzeCommand[Any]) -> bool:
        """Whether reading back what a command sets proves nothing: 0 % of a set, perhaps never set.

        The standard set leaves the factory with 50 % (RC-420 manual 18).
        """
        return (
            isinstance(command, SHARES)
            and command.speed_set is not None
            and command.percent == 0
            and (command.code, command.speed_set) not in self._shares
        )

    def held(self, question: RorzeCommand[Any]) -> Reply | None:
        """What flash memory holds, as the answer to a question; None where that is not known."""
        return self._replies.get(_text(question))


def _text(question: RorzeCommand[Any]) -> str:
    return question.code + question.written()
