"""Jogs of all families: a motor moves only while a heartbeat comes twice a second."""

import secrets
from typing import Final, Literal

from pydantic import Field, PrivateAttr

from gateway.core.errors import GatewayError, NotFound
from gateway.core.records import Record
from protocols.wording import as_given

HEARTBEAT_S: Final = 0.5
"""The longest time between two heartbeats; after it the motor is stopped."""
START_WITHIN_S: Final = 2.0
KEPT: Final = 100
"""Ended sessions that are remembered, to tell why they have ended."""

JogEnd = Literal["ended", "lost", "stopped"]


class Jog(Record):
    """A motor that jogs, or has jogged."""

    id: str = Field(default_factory=lambda: secrets.token_hex(8))
    state: Literal["jogging", "stopping", JogEnd] = Field(
        "jogging",
        description="stopping: it is told to stop, and may still move. The others mean that it was seen to "
        "stand still: ended by request or because it stood still, as at its limit; lost for want of a "
        "heartbeat; stopped with all that moves there, or at the end of the gateway.",
    )
    ends_as: JogEnd | None = Field(
        default=None, description="The state that follows when it stands still; null while it jogs."
    )
    heartbeat_within_ms: int = Field(
        default=int(HEARTBEAT_S * 1000), description="The next heartbeat has to come within this."
    )
    _why_ended: str | None = PrivateAttr(None)

    @property
    def why_ended(self) -> str | None:
        """How it ended without a request: a sentence without subject and full stop; None where it did not."""
        return self._why_ended

    def note_end(self, why: str) -> None:
        """Its motor stands still though nobody has stopped it."""
        self._why_ended = why


class JogOutOfReach(GatewayError):
    """A heartbeat came for what is out of reach: it may move, and nobody can stop it."""

    kind = "jog-out-of-reach"
    moved = "unknown"
    retryable = True

    def __init__(self, who: str, what: str) -> None:
        super().__init__(
            f"{who} is out of reach: {what} may go on moving, and no software can stop it until it answers "
            "again.",
            "Use the hardware stop.",
        )


class JogOver(GatewayError):
    """The JOG session goes on no more: its motor is being stopped, or stands still."""

    kind = "jog-over"
    moved = "yes"

    def __init__(self, what: str, jog: Jog) -> None:
        if jog.state == "stopping":
            super().__init__(
                f"The JOG of {what} is being stopped ({jog.ends_as}); the axis may still move.",
                "Wait until it stands still; start a new JOG then if it is still wanted.",
            )
        else:
            why = "" if jog.why_ended is None else f": it {jog.why_ended}"
            super().__init__(
                f"The JOG of {what} is over ({jog.state}){why}; the axis stands still.",
                "Start a new JOG if it is still wanted.",
            )


def no_such_jog(jog_id: str) -> NotFound:
    """The error where nobody remembers a session."""
    return NotFound(
        f"There is no JOG session {as_given(jog_id)}; nothing was sent.",
        "Read the status: what it moved may stand still.",
    )
