"""A transport that leads straight into a simulated machine, on the time of the running loop."""

import asyncio
from collections.abc import Callable
from typing import Protocol, TypeVar

from simulator.rorze.line import Rc400Line
from transports.base import Receiver, Transport, TransportLost, TransportUnavailable

T = TypeVar("T")


class Machine(Protocol):
    """The machine at the far end."""

    def receive(self, data: bytes, now: float) -> None: ...

    def take_output(self, now: float) -> bytes: ...

    def wake_at(self) -> float | None: ...


class SimulatedCable(Transport):
    """The wire between a gateway and a simulator in one process; timeless unless a baud rate is given."""

    machine: Machine

    def __init__(self, machine: Machine, baud: int | None = None) -> None:
        super().__init__("simulated://")
        self.machine = machine
        self.plugged_in = True
        self.written: list[bytes] = []
        self.echoes = False
        """Each frame comes back, too, as with an adapter's local echo."""
        self.is_looped = False
        """Nothing else comes back, and nothing arrives: the wires are joined."""
        self._byte_time_s = self.byte_time_s = 10 / baud if baud else 0.0
        self._free_at = 0.0
        self._receiver: Receiver | None = None
        self._timer: asyncio.TimerHandle | None = None

    async def open(self, receiver: Receiver) -> None:
        if not self.plugged_in:
            raise TransportUnavailable("the simulated cable is not plugged in")
        self._receiver = receiver
        self._turn()

    def write(self, data: bytes) -> None:
        if self._receiver is None:
            raise TransportLost("the simulated cable is not plugged in")
        self.written.append(data)
        loop = asyncio.get_running_loop()
        arrives_at = loop.time() + len(data) * self._byte_time_s
        if self.echoes or self.is_looped:
            loop.call_at(arrives_at, self._deliver, data)
        if not self.is_looped:
            loop.call_at(arrives_at, self._arrive, data)

    def unsent(self) -> int:
        return 0

    async def close(self) -> None:
        self._receiver = None
        if self._timer:
            self._timer.cancel()

    def touch(self, deed: Callable[[float], T]) -> T:
        """Do something to the machine now, other than through its line, and what follows from it."""
        result = deed(asyncio.get_running_loop().time())
        self._turn()
        return result

    def unplug(self) -> None:
        """Pull the cable."""
        self.plugged_in = False
        receiver, self._receiver = self._receiver, None
        if receiver:
            receiver.connection_lost(TransportLost("the simulated cable was pulled"))

    def _arrive(self, data: bytes) -> None:
        self.machine.receive(data, asyncio.get_running_loop().time())
        self._turn()

    def _turn(self) -> None:
        """Let the machine catch up, deliver what it says, and come back when it has more."""
        loop = asyncio.get_running_loop()
        output = self.machine.take_output(loop.time())
        if output:
            self._free_at = max(loop.time(), self._free_at) + len(output) * self._byte_time_s
            loop.call_at(self._free_at, self._deliver, output)
        if self._timer:
            self._timer.cancel()
        wake_at = self.machine.wake_at()
        if wake_at is not None:
            self._timer = loop.call_at(max(wake_at, loop.time()), self._turn)

    def _deliver(self, data: bytes) -> None:
        if self._receiver:
            self._receiver.data_received(data)


class SimulatedLine(SimulatedCable):
    """The wire to a simulated link master."""

    machine: Rc400Line

    def __init__(self, machine: Rc400Line, baud: int | None = None) -> None:
        super().__init__(machine, baud)


class Unplugged(Transport):
    """A port that cannot be opened."""

    async def open(self, _receiver: Receiver) -> None:
        raise TransportUnavailable(f"{self.address} was not opened: there is no such port.")

    def write(self, _data: bytes) -> None:
        raise TransportLost(f"{self.address} is not open")

    def unsent(self) -> int:
        return 0

    async def close(self) -> None:
        pass
