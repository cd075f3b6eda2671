"""Event messages of one RC-420: what has changed since it was last looked at (RC-420 manual 13.11)."""

from protocols.rorze.modes import STATUS_LETTERS, EventMask, EventReport, StatusKind

NO_EVENTS = EventMask(controller=0, end_cause=0, sensors=0, inputs=0)
"""An assumption: the manual gives no mask for power-on, and its programs (17.2) expect no events."""

WATCHED: tuple[StatusKind, ...] = ("controller", "end_cause", "sensors", "inputs")
"""Kinds of status whose change can cause a message."""

RISING_ONLY = ("controller", "end_cause")
"""Kinds of status that report a bit only when it rises, the others at both edges."""

StatusValues = dict[StatusKind, int]
"""Every kind of status, in the order C, M, S, I, O, P."""


class EventReporter:
    """The choice of causes (EMS) and contents (ESS), which no flash keeps, and the status last looked at."""

    def __init__(self, values: StatusValues) -> None:
        self.mask = NO_EVENTS
        self.kinds: list[StatusKind] = []
        self._seen = values

    def notice(self, values: StatusValues) -> bool:
        """Look at the status after any change: whether the mask lets that change be reported."""
        before, self._seen = self._seen, values
        return any(self._causes(kind, before[kind]) for kind in WATCHED)

    def fields(self, values: StatusValues) -> dict[str, int]:
        """The content of an event message, by its letters."""
        return {STATUS_LETTERS[kind]: value for kind, value in self._chosen(values).items()}

    def content(self, values: StatusValues) -> EventReport:
        """The status an event message would carry (ERD)."""
        return EventReport.model_validate(self._chosen(values))

    def _causes(self, kind: StatusKind, before: int) -> int:
        """The bits of one kind that have changed in a way that is reported."""
        after = self._seen[kind]
        changed = after & ~before if kind in RISING_ONLY else after ^ before
        mask: int = getattr(self.mask, kind)
        return changed & mask

    def _chosen(self, values: StatusValues) -> StatusValues:
        return {kind: value for kind, value in values.items() if kind in self.kinds}
