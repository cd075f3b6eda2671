"""A peer that does not take what is due to it loses its connection."""

import asyncio


class Drain:
    """Aborts a transport that in a number of seconds got rid of nothing it had to send.

    A transport that is closed waits for ever until its peer has taken everything.
    """

    def __init__(self, transport: asyncio.Transport, seconds: float) -> None:
        self._transport = transport
        self._seconds = seconds
        self._timer: asyncio.TimerHandle | None = None
        self._left = 0

    def watch(self) -> None:
        """Begin to look; nothing changes where that has begun."""
        if self._timer is None:
            self._left = self._transport.get_write_buffer_size()
            self._timer = asyncio.get_running_loop().call_later(self._seconds, self._look)

    def stop(self) -> None:
        """Look no more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _look(self) -> None:
        self._timer = None
        left = self._transport.get_write_buffer_size()
        if left >= self._left and (left or self._transport.is_closing()):
            self._transport.abort()
        elif left or self._transport.is_closing():
            self.watch()
