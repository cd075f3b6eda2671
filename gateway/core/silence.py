"""Silence of a body in the middle of a move, and the time for which it could not be asked at all."""

from gateway.core.move_record import LOST_AFTER_S

OUT_OF_REACH_S = 300.0
"""Seconds out of reach after which a move is followed no more, and its end is unknown."""


class Silence:
    """Counts the questions that were not answered, in seconds. It has no clock: times are given.

    Only what was written to a line that works counts as silence of the body. A line that is down, crowded or
    garbled, or a gateway that was held up, does not: that counts as being out of reach.
    """

    def __init__(self, now: float, longest_s: float) -> None:
        self._longest_s = longest_s
        """Longest time in seconds for which a question counts."""
        self._counted_until = now
        self.silent_s = 0.0
        self.out_of_reach_s = 0.0

    def answered(self, now: float) -> None:
        """The body has answered."""
        self._counted_until = now
        self.silent_s = self.out_of_reach_s = 0.0

    def unanswered(self, now: float, *, silent: bool) -> None:
        """Note that it has not answered: because it is silent, or because it could not be asked."""
        passed_s = min(now - self._counted_until, self._longest_s)
        self._counted_until = now
        if silent:
            self.silent_s += passed_s
        else:
            self.out_of_reach_s += passed_s

    @property
    def of_body(self) -> bool:
        """True if the body itself has been silent too long."""
        return self.silent_s >= LOST_AFTER_S

    @property
    def too_long(self) -> bool:
        """True if more questions are no use."""
        return self.of_body or self.out_of_reach_s >= OUT_OF_REACH_S

    @property
    def told(self) -> str:
        """Say for how long the body was not heard, as a sentence without its subject."""
        if self.of_body:
            return f"has not answered for {self.silent_s:.0f} s"
        return f"could not be asked for {self.out_of_reach_s:.0f} s"
