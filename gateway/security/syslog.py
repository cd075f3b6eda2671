"""A copy of the security log for a syslog server: RFC 5424 messages over TLS, framed as RFC 5425 has it.

A message is one entry as it stands in the file, so that the copy can be checked as the chain is.
"""

import logging
import os
import socket
import ssl
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from pydantic_core import from_json

log = logging.getLogger(__name__)

MOST_WAITING: Final = 10_000
"""Entries that wait for the server; beyond them the oldest are lost, and counted."""
TIMEOUT_S: Final = 10.0
"""The server is not waited for any longer at once."""
AGAIN_S: Final = (1.0, 60.0)
"""First and longest pause before a server that was not reached is called again; it doubles in between."""
CLOSED_WITHIN_S: Final = 2.0
_PRIORITY: Final = 13 * 8 + 5
"""Log audit, notice (RFC 5424, 6.2.1)."""


class SyslogSender:
    """Sends lines in a thread of its own, in their order; no caller waits for it."""

    def __init__(
        self,
        address: str,
        *,
        ca: Path | None = None,
        certificate: Path | None = None,
        key: Path | None = None,
    ) -> None:
        """Read the certificates.

        :raises OSError, ValueError: they cannot be used.
        """
        url = urlsplit(f"//{address}")
        self._host, self._port = url.hostname or "", url.port or 0
        self._context = ssl.create_default_context(cafile=None if ca is None else str(ca))
        if certificate is not None:
            self._context.load_cert_chain(certificate, key)
        self.on_lost: Callable[[int], None] = lambda _lost: None
        """Called in this object's thread with how many were lost, when the server is reached again."""
        self._waiting: deque[str] = deque()
        self._lost = 0
        self._turn = threading.Condition()
        self._ending = False
        self._thread = threading.Thread(target=self._run, name="syslog", daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    def send(self, lines: Sequence[str]) -> None:
        """Let these be sent; from any thread, and at once."""
        with self._turn:
            self._waiting.extend(lines)
            while len(self._waiting) > MOST_WAITING:
                self._waiting.popleft()
                self._lost += 1
            self._turn.notify()

    def close(self) -> None:
        """Send what waits, if that takes no longer than a moment."""
        with self._turn:
            self._ending = True
            self._turn.notify()
        self._thread.join(CLOSED_WITHIN_S)

    # the thread

    def _run(self) -> None:
        pause_s = AGAIN_S[0]
        while self._has_work():
            try:
                with self._connected() as connection:
                    pause_s = AGAIN_S[0]
                    self._send_all(connection)
            except OSError as error:
                log.warning("%s:%d does not take the security log: %s", self._host, self._port, error)
                if not self._rested(pause_s):
                    return
                pause_s = min(2 * pause_s, AGAIN_S[1])

    def _connected(self) -> ssl.SSLSocket:
        connection = socket.create_connection((self._host, self._port), TIMEOUT_S)
        try:
            return self._context.wrap_socket(connection, server_hostname=self._host)
        except BaseException:
            connection.close()
            raise

    def _send_all(self, connection: ssl.SSLSocket) -> None:
        while self._has_work():
            with self._turn:
                line, lost, self._lost = self._waiting[0], self._lost, 0
            if lost:
                self.on_lost(lost)
            _see_that_it_listens(connection)
            connection.sendall(_framed(line))
            with self._turn:
                if self._waiting and self._waiting[0] is line:
                    self._waiting.popleft()

    def _has_work(self) -> bool:
        """Wait for something to send; False at the end, when nothing waits."""
        with self._turn:
            self._turn.wait_for(lambda: self._waiting or self._ending)
            return bool(self._waiting)

    def _rested(self, pause_s: float) -> bool:
        """Wait before the next attempt; False where the gateway ends."""
        until = time.monotonic() + pause_s
        with self._turn:
            return not self._turn.wait_for(lambda: self._ending, until - time.monotonic())


def _see_that_it_listens(connection: ssl.SSLSocket) -> None:
    """Find a server that has hung up before it is written to: a write would succeed, and the entry be lost.

    :raises OSError: it has hung up.
    """
    connection.setblocking(False)
    try:
        if not connection.recv(1024):
            raise ConnectionResetError("it has hung up")
    except ssl.SSLWantReadError:
        pass  # nothing was said, which is what a syslog server says
    finally:
        connection.settimeout(TIMEOUT_S)


def _framed(line: str) -> bytes:
    """An entry as a message with its length before it (RFC 5425, 4.3)."""
    entry = from_json(line)
    head = f"<{_PRIORITY}>1 {entry['time']} {socket.gethostname()} motion-gateway {os.getpid()}"
    message = f"{head} {entry['type']} - {line.rstrip()}".encode()
    return b"%d %s" % (len(message), message)
