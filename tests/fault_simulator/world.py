"""The machine, its cable and the disk, which outlive a gateway. Lives come and go, some of them killed."""

import asyncio
from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import Any, NamedTuple

from gateway.config import Config
from gateway.core.journal.opening import OpenedJournal, begin
from gateway.core.origin import ORIGIN
from tests.fault_simulator.model_disk import ModelDisk, VirtualJournal
from tests.simulated_line import SimulatedCable
from tests.tested_plant import TestedPlant
from transports.base import Receiver, Transport, TransportLost

MEANT_FOR_RECOVERY_S = (0.1, 4.0)
"""Seconds from a kill to the next start."""
CUT = 0.8
"""Probability that a kill of the gateway, or a pulled cable, cuts off the frame that is being written."""


class Written(NamedTuple):
    """Bytes that a gateway has handed to the cable."""

    at: float
    text: str
    life: int
    request_id: str | None
    """Id of the request that the bytes were written for; None where the gateway asks for itself."""


class Cable(SimulatedCable):
    """A cable whose far end keeps its order, and knows which request each frame was written for."""

    def __init__(self, machine: Any, baud: int, dice: Random) -> None:
        super().__init__(machine, baud)
        self._dice = dice
        self.machine: Any = machine
        self.history: list[Written] = []
        self.frame: dict[int, Written] = {}
        """Frames by the running number that the machine gives each."""
        self.pieces: deque[tuple[int | None, int]] = deque()
        """Pieces of what is delivered: the number of the frame that each answers, and its length."""
        self.coming: list[tuple[int | None, int]] = []
        """Pieces that the machine has not handed over yet, and loses with its power."""
        self.ends: Callable[[bytes], bool] = lambda piece: piece.endswith(b"\r")
        """Says whether a piece ends a reply."""
        self.answering: int | None = None
        """Number of the frame that is answered by the piece that is being delivered."""
        self.unended: frozenset[int] = frozenset()
        """Frames answered by what was delivered since the last CR, for a CR may be garbled."""
        self.tx_free_at = 0.0
        self.overlaps: list[str] = []
        self._on_the_way: deque[Written] = deque()
        self._cut: dict[Written, int] = {}
        """Bytes that arrive of each frame that was cut off."""

    def note(self, written: Written, length: int) -> None:
        """A frame begins; before the end of the last one it would be garbled by it."""
        if written.at < self.tx_free_at - 1e-9:
            self.overlaps.append(f"{written.text!r} began before the end of {self.history[-1].text!r}")
        self.tx_free_at = written.at + length * self.byte_time_s
        self.history.append(written)
        self._on_the_way.append(written)

    def turn(self) -> None:
        """Let the machine say what it has to say, after it was touched."""
        self._turn()

    def cut(self) -> None:
        """Cut off the frame that is being written, most times: the far end then has a part of it."""
        if self._on_the_way and self._dice.random() < CUT:
            written = self._on_the_way[-1]
            self._cut[written] = self._dice.randrange(len(written.text))

    def unplug(self) -> None:
        """Pull the cable."""
        super().unplug()
        self.cut()

    def plug_in(self) -> None:
        """Put the cable back."""
        self.plugged_in = True

    def _arrive(self, data: bytes) -> None:
        written, before = self._on_the_way.popleft(), self.machine.requests
        super()._arrive(data[: self._cut.pop(written, len(data))])
        for number in range(before + 1, self.machine.requests + 1):
            self.frame[number] = written

    def _deliver(self, data: bytes) -> None:
        while data:
            self.answering, length = self.pieces.popleft() if self.pieces else (None, len(data))
            piece, data = data[:length], data[length:]
            super()._deliver(piece)
            answered = frozenset() if self.answering is None else frozenset({self.answering})
            self.unended = frozenset() if self.ends(piece) else self.unended | answered
        self.answering = None


class Port(Transport):
    """One life's end of the cable: nothing passes it once that life was killed."""

    def __init__(self, cable: Cable, life: "Life") -> None:
        super().__init__("simulated://")
        self._cable, self._life = cable, life
        self.byte_time_s = cable.byte_time_s

    async def open(self, receiver: Receiver) -> None:
        if not self._life.killed.is_set():
            await self._cable.open(receiver)

    def write(self, data: bytes) -> None:
        if self._life.killed.is_set():
            raise TransportLost("the gateway was killed")
        self._life.moment("write")
        if self._life.killed.is_set():
            raise TransportLost("the gateway was killed")
        now, text = asyncio.get_running_loop().time(), data.decode("ascii", "backslashreplace")
        written = Written(now, text, self._life.number, ORIGIN.get().request_id)
        self._life.judge_write(written)
        self._cable.write(data)
        self._cable.note(written, len(data))
        self._life.moment("written")

    def unsent(self) -> int:
        return 0

    async def close(self) -> None:
        if not self._life.killed.is_set():
            await self._cable.close()


@dataclass(eq=False)
class Life:
    """One gateway, from its start to its end."""

    number: int
    disk: ModelDisk
    judge_write: Callable[[Written], None]
    on_killed: Callable[[], object]
    killed: asyncio.Event = field(default_factory=asyncio.Event)
    dies_at: dict[str, int] = field(default_factory=dict)
    """Moments at which the gateway is killed: the count of each kind after which it is."""
    plant: TestedPlant = field(init=False)
    journal: VirtualJournal = field(init=False)
    _passed: defaultdict[str, int] = field(default_factory=lambda: defaultdict(int))

    def begin(self, config: Config, cable: Cable, dice: Random, commit_s: Callable[[], float]) -> None:
        """Build the plant on what the lives before have left."""
        past = begin(self.disk)
        takes_s = self._seen("commit", commit_s)
        self.journal = VirtualJournal(self.disk, ran_s=past.ran_s, takes_s=takes_s)
        self.plant = TestedPlant(
            config,
            open_transport=lambda _: Port(cable, self),
            rng=dice,
            journal=OpenedJournal(self.journal, past),
        )
        self.plant.events.listeners.append(lambda event: self.moment(event.type))

    def _seen(self, moment: str, look: Callable[[], float]) -> Callable[[], float]:
        def seen() -> float:
            self.moment(moment)
            return look()

        return seen

    def moment(self, kind: str) -> None:
        """Something has just happened or is about to: a planned kill strikes here."""
        self._passed[kind] += 1
        if self.dies_at.get(kind) == self._passed[kind]:
            self.kill()

    def kill(self) -> None:
        """From here on it writes nothing, neither to the cable nor to the disk."""
        self.killed.set()
        self.on_killed()
        self.journal.kill()
