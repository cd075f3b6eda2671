"""Serial ports: how the gateway opens, shares, paces and closes one."""

import asyncio
import contextlib
import errno
import os
import select
import termios
from collections.abc import Callable
from time import monotonic

import serial
import serial_asyncio
from typing_extensions import Buffer

from transports.addresses import Address
from transports.base import TransportUnavailable
from transports.nudge import Nudge
from transports.stream import Session, StreamTransport

# The RC-400's rotary switch position 2, as delivered.
DEFAULT_BAUD = 9600
# From the slowest to the fastest speed pyserial names; speeds between them are tried as they are.
BAUD_RANGE = (50, 4_000_000)
# Start bit, eight data bits, no parity, one stop bit.
BITS_PER_BYTE = 10

_IN_USE = "another program is using it; close that program"
_REASONS = {
    errno.ENOENT: "there is no such device; check the adapter and the name",
    errno.EACCES: "permission was denied; add this user to the group that owns the device, usually dialout",
    errno.EAGAIN: _IN_USE,
    errno.EBUSY: _IN_USE,
}


class SerialPort(StreamTransport):
    """`serial:///dev/ttyUSB0?baud=9600`: 8 data bits, no parity, 1 stop bit, no flow control, locked."""

    def __init__(self, address: Address) -> None:
        super().__init__(address.text)
        if address.host or address.port is not None or address.path in ("", "/"):
            raise ValueError(
                f"address {address.text!r} must name a device after three slashes: serial:///dev/ttyUSB0"
            )
        address.expect_options("baud")
        self._device = address.path
        self._baud = address.integer("baud", DEFAULT_BAUD, *BAUD_RANGE)
        self.byte_time_s = BITS_PER_BYTE / self._baud
        self._port: _Port | None = None

    def write(self, data: bytes) -> None:
        """Write straight to the port; its channel sends only what the port does not take now."""
        channel = self._live_channel()
        if channel is not None and self._port is not None and channel.get_write_buffer_size() == 0:
            # A frame that waits for the channel's next turn lets the line stand idle meanwhile.
            data = data[self._port.write(data) :]
            if not data:
                return
        super().write(data)

    async def close(self) -> None:
        """Close at once, even when the far end takes no bytes."""
        if self._live_channel() is not None and self._port is not None:
            # Closing a port waits for its unsent bytes; thrown away, they cannot hold up the event loop.
            with contextlib.suppress(OSError, termios.error):
                self._port.reset_output_buffer()
        await super().close()

    async def _connect(self) -> tuple[asyncio.Transport, Session]:
        try:
            # An adapter may take hundreds of milliseconds to open: not on the event loop.
            self._port = await asyncio.to_thread(_open, self._device, self._baud)
            return await self._serve(self._port)
        except (OSError, ValueError, termios.error) as error:
            reason = _REASONS.get(getattr(error, "errno", None) or 0, str(error))
            raise TransportUnavailable(
                f"{self.address} was not opened: {reason}. Nothing was sent."
            ) from error

    async def _serve(self, port: "_Port") -> tuple[asyncio.Transport, Session]:
        """Give a port to the event loop; one that has gone in the meantime is closed."""
        loop, session = asyncio.get_running_loop(), Session(self.address)
        try:
            # Suspends nowhere, so that no byte arrives before the port's opener has heard that it is open.
            channel, _ = await serial_asyncio.connection_for_serial(loop, lambda: session, port)
        except Exception:
            port.close()
            raise
        port.nudge = Nudge(loop)
        port.on_write_error = lambda error: loop.call_soon(session.fail, channel, error)
        return channel, session

    def _held_by_system(self, _channel: asyncio.Transport) -> int:
        try:
            return self._port.out_waiting if self._port is not None else 0
        except OSError:
            return 0  # this driver does not tell


class _Port(serial.Serial):
    """A port that never waits: pyserial's read fails above descriptor 1023, and its write may spin."""

    on_write_error: Callable[[OSError], object]
    nudge: Nudge | None = None
    _heard_at = 0.0

    def read(self, size: int = 1, /) -> bytes:
        try:
            data = os.read(self.fileno(), size)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise serial.SerialException(str(error)) from error
        if not data and self._is_readable():
            raise serial.SerialException("the device has gone")
        self._heard_at = monotonic()
        return data

    def write(self, data: Buffer, /) -> int:
        try:
            written = os.write(self.fileno(), data)
        except BlockingIOError:
            return 0
        except OSError as error:
            # Raised, it would be logged as a fault of the program; a port that goes away is none.
            self.on_write_error(error)
            return memoryview(data).nbytes
        if self.nudge is not None:
            self.nudge.wrote(bytes(data), self._heard_at)
        return written

    def close(self) -> None:
        super().close()
        if self.nudge is not None:
            self.nudge.close()

    def _is_readable(self) -> bool:
        """Say whether the device claims to have bytes, which it does for ever once it is unplugged."""
        poll = select.poll()
        poll.register(self.fileno(), select.POLLIN)
        return bool(poll.poll(0))


def _open(device: str, baud: int) -> _Port:
    port = _Port(device, baud, timeout=0, write_timeout=0, exclusive=True)
    # FTDI adapters hold received bytes back for 16 ms otherwise; other drivers do not know the setting.
    with contextlib.suppress(ValueError, OSError, NotImplementedError):
        port.set_low_latency_mode(True)
    return port
