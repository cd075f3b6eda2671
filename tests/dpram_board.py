"""A simulated Fics on a board: its side of a dual-port RAM in a file, on the time of the running loop."""

import asyncio
import mmap
import os
import re
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import overload

from simulator.fics.line import SimulatedFics

SIZE = 1024
HOST_MODE, HOST_FLAG, FROM_HOST, FICS_FLAG, TO_HOST = 256, 257, slice(258, 512), 512, slice(513, 768)
"""C-HOST manual 1-4, as offsets."""
TURN_S = 0.001
_MESSAGE = re.compile(rb"[^\r]*\r")


@dataclass(frozen=True, slots=True)
class Wiring:
    """How a RAM lies in the memory a host maps, and how wide its accesses must be."""

    map: int = 0
    offset: int = 0
    stride: int = 1
    width: int = 8

    @property
    def options(self) -> str:
        """The end of its address."""
        return f"?map={self.map}&offset={self.offset:#x}&stride={self.stride}&width={self.width}"

    @property
    def length(self) -> int:
        """Length of a file that holds the RAM, in bytes."""
        return self.map * mmap.PAGESIZE + self.offset + SIZE * self.stride

    def places(self, where: slice) -> slice:
        """Where bytes of the RAM are in the file."""
        start = self.map * mmap.PAGESIZE + self.offset + where.start * self.stride
        return slice(start, start + (where.stop - where.start) * self.stride, self.stride)


WIRINGS = (
    Wiring(),
    Wiring(width=16),
    Wiring(width=32),
    Wiring(offset=0x400, stride=2, width=16),
    Wiring(map=1, offset=0x401, stride=2),
    Wiring(map=2, offset=8, stride=4, width=32),
    Wiring(stride=2, width=32),
    Wiring(offset=3, stride=8, width=32),
)


class Ram:
    """The bytes of a RAM, wherever its wiring puts them; what lies between them floats."""

    def __init__(self, path: Path, wiring: Wiring) -> None:
        self._wiring = wiring
        path.write_bytes(b"\xff" * wiring.length)
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), wiring.length)
        self[0:SIZE] = bytes(SIZE)

    @overload
    def __getitem__(self, where: int) -> int: ...
    @overload
    def __getitem__(self, where: slice) -> bytes: ...
    def __getitem__(self, where: int | slice) -> int | bytes:
        if isinstance(where, int):
            return self[where : where + 1][0]
        return self._memory[self._wiring.places(where)]

    @overload
    def __setitem__(self, where: int, value: int) -> None: ...
    @overload
    def __setitem__(self, where: slice, value: bytes) -> None: ...
    def __setitem__(self, where: int | slice, value: int | bytes) -> None:
        if isinstance(where, slice) and isinstance(value, bytes):
            self._memory[self._wiring.places(where)] = value
        elif isinstance(where, int) and isinstance(value, int):
            self[where : where + 1] = bytes([value])


class Board:
    """The Fics side, which looks at its flags a thousand times a second."""

    def __init__(self, path: Path, machine: SimulatedFics, wiring: Wiring = WIRINGS[0]) -> None:
        self.path = path
        self.machine = machine
        self.wiring = wiring
        self.bare = False
        """While set, messages carry no CR."""
        self.stalled = False
        """While set, both flags stay as they are."""
        self.torn = False
        """While set, the second half of each message comes a turn behind its flag."""
        self._waiting: deque[bytes] = deque()
        self._rest: tuple[int, bytes] | None = None
        self.put_in()

    def put_in(self) -> None:
        """Be there, with an empty RAM."""
        self.ram = Ram(self.path, self.wiring)

    def cycle_power(self) -> None:
        """Be switched off and on: the board then waits for its host to set the host mode."""
        now = asyncio.get_running_loop().time()
        self.machine.power_off(now)
        self.machine.power_on(now)
        self.ram[HOST_MODE] = 1

    def take_out(self) -> None:
        """Be gone, as a file is whose driver was removed."""
        self.path.unlink()

    def cut_short(self) -> None:
        """Lose the memory behind the mapping: who touches it now is killed by SIGBUS."""
        os.truncate(self.path, 0)

    async def run(self) -> None:
        """Serve the RAM until cancelled."""
        while True:
            if self.path.exists() and self.path.stat().st_size == self.wiring.length:
                self._turn(asyncio.get_running_loop().time())
            await asyncio.sleep(TURN_S)

    def _turn(self, now: float) -> None:
        if self._rest is not None:
            (start, data), self._rest = self._rest, None
            self.ram[start : start + len(data)] = data
        if self.stalled:
            return
        if self.ram[HOST_FLAG] == 1 and self.ram[HOST_MODE] == 0:
            message = self.ram[FROM_HOST].rstrip(b"\0")
            self.ram[HOST_FLAG] = 0
            self.machine.receive(message, now)
        self._waiting += _MESSAGE.findall(self.machine.take_output(now))
        if self._waiting and self.ram[FICS_FLAG] == 0:
            self._give(self._waiting.popleft())

    def _give(self, message: bytes) -> None:
        if self.bare:
            message = message.rstrip(b"\r")
        data = message.ljust(TO_HOST.stop - TO_HOST.start, b"\0")
        half = len(message) // 2 if self.torn else len(data)
        self.ram[TO_HOST] = data[:half].ljust(len(data), b"\0")
        self.ram[FICS_FLAG] = 1
        if half < len(data):
            self._rest = TO_HOST.start + half, data[half:]
