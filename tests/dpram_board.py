"""A simulated Fics on a board: its side of a dual-port RAM in a file, on the time of the running loop."""

import asyncio
import mmap
import os
import re
from collections import deque
from pathlib import Path

from simulator.fics.line import SimulatedFics

SIZE = 1024
HOST_FLAG, FROM_HOST, FICS_FLAG, TO_HOST = 257, slice(258, 512), 512, slice(513, 768)
"""C-HOST manual 1-4, as offsets."""
TURN_S = 0.001
_MESSAGE = re.compile(rb"[^\r]*\r")


class Board:
    """The Fics side, which looks at its flags a thousand times a second."""

    def __init__(self, path: Path, machine: SimulatedFics) -> None:
        self.path = path
        self.machine = machine
        self.stalled = False
        """While set, both flags stay as they are."""
        self.torn = False
        """While set, the second half of each message comes a turn behind its flag."""
        self._waiting: deque[bytes] = deque()
        self._rest: tuple[int, bytes] | None = None
        self.put_in()

    def put_in(self) -> None:
        """Be there, with an empty RAM."""
        self.path.write_bytes(bytes(SIZE))
        with self.path.open("r+b") as file:
            self.ram = mmap.mmap(file.fileno(), SIZE)

    def take_out(self) -> None:
        """Be gone, as a file is whose driver was removed."""
        self.path.unlink()

    def cut_short(self) -> None:
        """Lose the memory behind the mapping: whoever touches it now is killed by SIGBUS."""
        os.truncate(self.path, 0)

    async def run(self) -> None:
        """Serve the RAM until cancelled."""
        while True:
            if self.path.exists() and self.path.stat().st_size == SIZE:
                self._turn(asyncio.get_running_loop().time())
            await asyncio.sleep(TURN_S)

    def _turn(self, now: float) -> None:
        if self._rest is not None:
            (start, data), self._rest = self._rest, None
            self.ram[start : start + len(data)] = data
        if self.stalled:
            return
        if self.ram[HOST_FLAG] == 1:
            message = self.ram[FROM_HOST].rstrip(b"\0")
            self.ram[HOST_FLAG] = 0
            self.machine.receive(message, now)
        self._waiting += _MESSAGE.findall(self.machine.take_output(now))
        if self._waiting and self.ram[FICS_FLAG] == 0:
            self._give(self._waiting.popleft())

    def _give(self, message: bytes) -> None:
        data = message.ljust(TO_HOST.stop - TO_HOST.start, b"\0")
        half = len(message) // 2 if self.torn else len(data)
        self.ram[TO_HOST] = data[:half].ljust(len(data), b"\0")
        self.ram[FICS_FLAG] = 1
        if half < len(data):
            self._rest = TO_HOST.start + half, data[half:]
