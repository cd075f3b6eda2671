"""The process of the server: messages to systemd (sd_notify(3)), collections of garbage, file descriptors.

A full collection of garbage takes 0.6 us for each object that it looks through, and the event loop waits for
it: 60,000 objects, as a crowd of clients leaves them, are 40 ms. So what survived one is not looked through
again. An object that is dropped later is freed by its count as before. A circle that was closed before it
survived and is dropped after it is not found any more, so a long-lived object that ends, such as a
connection, unties its circles itself.
"""

import gc
import logging
import os
import resource
import socket
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Final

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


THRESHOLDS: Final = (250, 10, 5)
"""A full collection comes after some 20,000 objects that were made and kept: 12 ms."""
FULL: Final = 2


@contextmanager
def short_collections() -> Iterator[None]:
    """Set aside what is there by now, and then what survives each full collection."""
    usual = gc.get_threshold()
    gc.collect()
    gc.freeze()
    gc.collect()  # Python puts a full one off for a quarter of what the last one left: nothing, now
    gc.set_threshold(*THRESHOLDS)
    gc.callbacks.append(_set_aside)
    gc.enable()
    try:
        yield
    finally:
        gc.callbacks.remove(_set_aside)
        gc.set_threshold(*usual)


def _set_aside(phase: str, info: dict[str, Any]) -> None:
    if phase == "stop" and info["generation"] == FULL:
        gc.freeze()


log = logging.getLogger(__name__)

KEPT_BACK = 192
"""Descriptors that are not for the connections within the limit: lines, files, and connections that stop."""


def connections_possible(wanted: int) -> int:
    """Raise the limit of open files for the `wanted` connections; give how many are possible."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = wanted + KEPT_BACK
    if soft != resource.RLIM_INFINITY and soft < needed:
        soft = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    if soft == resource.RLIM_INFINITY or soft >= needed:
        return wanted
    possible = max(1, soft - KEPT_BACK)
    log.warning(
        "The operating system allows %d open files (ulimit -n): connections are limited to %d, not %d.",
        *(soft, possible, wanted),
    )
    return possible
