"""Admission of new work: none at the end of the gateway, and none that may be too old."""

from gateway.core.errors import GatewayEnding, HeldUp
from gateway.core.loop_watch import LoopWatch


class Admission:
    """Asked before whatever moves or changes something; reads and stops go without."""

    def __init__(self, watch: LoopWatch | None = None) -> None:
        self._watch = watch or LoopWatch()
        self._ended = False
        self.revise = self._watch.check
        """See that nothing is written that was admitted before a suspension."""
        self.held_s = self._watch.held_s
        """Seconds for which the event loop was held until now: in them no reply counts as late."""

    def require(self) -> None:
        """Refuse what comes too late.

        :raises ShuttingDown: the gateway ends.
        :raises HeldUp: it was suspended, and the request may have come meanwhile.
        """
        if self._ended:
            raise GatewayEnding
        if self._watch.in_doubt():
            raise HeldUp

    def end(self) -> None:
        """Let nothing begin any more."""
        self._ended = True
