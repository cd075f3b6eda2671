"""Event messages of one RC-420: what has changed since it was last looked at (RC-420 manual 13.11)."""

from typing import TYPE_CHECKING

from protocols.rorze.link import StatusChanged
from protocols.rorze.modes import STATUS_LETTERS, EventMask, EventReport, StatusKind

if TYPE_CHECKING:
    from simulator.rorze.controller import Rc420

NO_EVENTS = EventMask(controller=0, end_cause=0, sensors=0, inputs=0)
"""An assumption: the manual gives no mask for power-on, and its programs (17.2) expect no events."""

RISING_ONLY = ("controller", "end_cause")
"""Kinds of status that report a bit only when it rises, the others at both edges."""


class EventReporter:
    """The choice of causes (EMS) and contents (ESS), which no flash keeps, and the status last looked at."""

    def __init__(self, axis: "Rc420") -> None:
        self._axis = axis
        self.mask = NO_EVENTS
        self.kinds: list[StatusKind] = []
        self._seen = self._watched()

    def report(self, now: float) -> None:
        """Say that something has changed, if the mask lets it; called after every change."""
        before, self._seen = self._seen, self._watched()
        if before != self._seen and any(self._causes(kind, before[kind]) for kind in self._seen):
            values = self._values(now)
            fields = {STATUS_LETTERS[kind]: value for kind, value in values.items()}
            self._axis.say(StatusChanged(self._axis.body, fields), now)

    def content(self, now: float) -> EventReport:
        """The status an event message would carry (ERD)."""
        return EventReport.model_validate(self._values(now))

    def _watched(self) -> dict[str, int]:
        axis = self._axis
        return {
            "controller": axis.status_now(),
            "end_cause": axis.end_cause,
            "sensors": axis.io.sensors(),
            "inputs": axis.io.inputs(),
        }

    def _causes(self, kind: str, before: int) -> int:
        """The bits of one kind that have changed in a way that is reported."""
        after = self._seen[kind]
        changed = after & ~before if kind in RISING_ONLY else after ^ before
        mask: int = getattr(self.mask, kind)
        return changed & mask

    def _values(self, now: float) -> dict[str, int]:
        """The chosen kinds of status, in the order C, M, S, I, O, P."""
        values = self._watched()
        values |= {"outputs": self._axis.io.outputs.bits(), "position": self._axis.position(now)}
        return {kind: value for kind, value in values.items() if kind in self.kinds}
