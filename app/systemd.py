"""Messages to systemd: that the gateway is ready, that it ends, and that its lines work (sd_notify(3))."""

import os
import socket
import time
from collections.abc import Callable, Iterable

FEED_S = 1.0
"""A busy line works hundreds of times in a second; the service manager is told this often at most."""


def notify(*states: str) -> None:
    """Tell the service manager, if there is one that listens: `READY=1`, `STOPPING=1`, `WATCHDOG=1`.

    One that cannot be reached is no reason to stop serving motors.
    """
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address.startswith(("/", "@")):
        return
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as datagram:
            datagram.sendto("\n".join(states).encode("ascii"), address.replace("@", "\0", 1))
    except OSError:
        return


def expect_long_start(longest_s: float, why: str) -> None:
    """Let the service manager wait longer for READY=1 than its TimeoutStartSec says, and show why."""
    notify(f"EXTEND_TIMEOUT_USEC={longest_s * 1e6:.0f}", f"STATUS={why}")


def watchdog_wanted() -> bool:
    """True if the service manager waits for signs of life from this very process."""
    return bool(os.environ.get("WATCHDOG_USEC")) and os.environ.get("WATCHDOG_PID") in (
        None,
        str(os.getpid()),
    )


class Watchdog:
    """Feeds the service manager's watchdog each time that every line has worked since the last time.

    A line works when it writes a frame, tries its port or looks after its bodies, which each does within
    seconds whatever is at its far end. No timer feeds it: one would beat on while the lines stand still.
    """

    def __init__(
        self,
        lines: Iterable[str],
        tell: Callable[[str], None] = notify,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._lines = frozenset(lines)
        self._tell, self._clock = tell, clock
        self._due = set(self._lines)
        self._fed_at = clock()

    def worked(self, line: str) -> None:
        """A line has done some of its work."""
        now = self._clock()
        if now < self._fed_at + FEED_S:
            return
        self._due.discard(line)
        if not self._due:
            self._due.update(self._lines)
            self._fed_at = now
            self._tell("WATCHDOG=1")
