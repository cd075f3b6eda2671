"""Faults on the wire, which hit whole frames, either way, by chance or on demand."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf
from random import Random


class Fault(StrEnum):
    """The fate of a frame."""

    SILENCE = "silence"
    """Loss of the frame, and of all that follows within the delay."""
    LOST = "lost"
    GARBLED = "garbled"
    """One bit of one byte is flipped, the CR included."""
    MERGED = "merged"
    """Loss of the frame's CR: it runs into the next frame."""
    NOISE = "noise"
    """Up to 20 random bytes stand before it."""
    SPLIT = "split"
    """A frame in two pieces, with the delay between them."""
    LATE = "late"
    """A frame that comes after the delay; others may overtake it."""
    DOUBLED = "doubled"
    """A copy of the frame after the delay."""


class Direction(StrEnum):
    """The way of a frame on the line."""

    REQUESTS = "requests"
    """Frames from the host to the link master."""
    REPLIES = "replies"
    """Frames from the link master to the host, unsolicited ones included."""


MOST_NOISE = 20
"""Bytes of noise before a frame, at most."""


@dataclass(frozen=True, slots=True)
class Switch:
    """One fault, switched on."""

    fault: Fault
    direction: Direction
    probability: float = 0.0
    """The probability for each frame, 0 to 1."""
    next_frames: int = 0
    """The number of frames that are hit for certain."""
    pass_frames: int = 0
    """The number of frames that pass unharmed before."""
    delay_s: float = 0.1
    """Delay in seconds, of silence, split, late and doubled."""
    spread_s: float = 0.0
    """The delay is longer by a random part of this."""
    holds_up: bool = False
    """True if frames behind a late one wait for it."""


@dataclass(frozen=True, slots=True)
class Flight:
    """One way in which a frame arrives: after a delay, in one piece or in two with a gap between them."""

    delay_s: float
    pieces: tuple[bytes, ...]
    gap_s: float = 0.0


class Faults:
    """The switches and the random source. Equal seeds and equal frames give equal faults."""

    def __init__(self, dice: Random) -> None:
        self._dice = dice
        self._switches: dict[tuple[Direction, Fault], Switch] = {}
        self._in_order: dict[Direction, list[Switch]] = {}
        """The switches that meet a frame."""
        self._silent_until: dict[Direction, float] = {}
        self._held_until = dict.fromkeys(Direction, -inf)

    @property
    def switches(self) -> list[Switch]:
        """The switches that are on."""
        return list(self._switches.values())

    def set(self, switch: Switch) -> None:
        """Turn a fault on, or off if neither chance nor certainty is left."""
        key = (switch.direction, switch.fault)
        self._switches.pop(key, None)
        if switch.probability or switch.next_frames:
            self._switches[key] = switch
        self._in_order = {
            direction: [
                self._switches[direction, fault] for fault in Fault if (direction, fault) in self._switches
            ]
            for direction in Direction
        }

    def clear(self) -> None:
        """Turn all faults off; a silence ends at once."""
        self._switches.clear()
        self._in_order.clear()
        self._silent_until.clear()

    def distort(
        self, frame: bytes, direction: Direction, now: float
    ) -> tuple[list[Flight], dict[Fault, float]]:
        """Let a frame, CR included, meet its faults: how it arrives, and the faults with their delays."""
        if not self._switches and not self._silent_until:
            return [Flight(0.0, (frame,))], {}
        hits = dict(self._hits(direction))
        if Fault.SILENCE in hits:
            self._silent_until[direction] = now + hits[Fault.SILENCE]
        elif now < self._silent_until.get(direction, now):
            hits = {Fault.SILENCE: 0.0}
        if Fault.SILENCE in hits or Fault.LOST in hits:
            return [], hits
        return self._held(self._flights(self._bend(frame, hits), hits), direction, now), hits

    def _held(self, flights: list[Flight], direction: Direction, now: float) -> list[Flight]:
        """Let frames wait for a late one before them, where that holds them up."""
        late = self._switches.get((direction, Fault.LATE))
        if late is None or not late.holds_up:
            return flights
        held = [
            replace(flight, delay_s=max(flight.delay_s, self._held_until[direction] - now))
            for flight in flights
        ]
        self._held_until[direction] = now + max(flight.delay_s for flight in held)
        return held

    def _hits(self, direction: Direction) -> Iterable[tuple[Fault, float]]:
        for switch in self._in_order.get(direction, ()):
            if switch.pass_frames:
                self.set(replace(switch, pass_frames=switch.pass_frames - 1))
                continue
            if switch.next_frames:
                self.set(replace(switch, next_frames=switch.next_frames - 1))
            elif self._dice.random() >= switch.probability:
                continue
            yield switch.fault, switch.delay_s + self._dice.uniform(0.0, switch.spread_s)

    def _bend(self, frame: bytes, hits: dict[Fault, float]) -> bytes:
        if Fault.GARBLED in hits:
            place = self._dice.randrange(len(frame))
            flipped = frame[place] ^ (1 << self._dice.randrange(8))
            frame = frame[:place] + bytes([flipped]) + frame[place + 1 :]
        if Fault.MERGED in hits:
            frame = frame.rstrip(b"\r\n")
        if Fault.NOISE in hits:
            frame = self._dice.randbytes(self._dice.randint(1, MOST_NOISE)) + frame
        return frame

    def _flights(self, frame: bytes, hits: dict[Fault, float]) -> list[Flight]:
        late = hits.get(Fault.LATE, 0.0)
        whole = Flight(late, (frame,))
        if Fault.SPLIT in hits and len(frame) > 1:
            cut = self._dice.randrange(1, len(frame))
            whole = Flight(late, (frame[:cut], frame[cut:]), hits[Fault.SPLIT])
        again = [Flight(late + hits[Fault.DOUBLED], (frame,))] if Fault.DOUBLED in hits else []
        return [whole, *again]


def cut(faults: Faults) -> None:
    """Lose every frame, both ways, until the faults are cleared: a cable that is pulled."""
    for direction in Direction:
        faults.set(Switch(Fault.LOST, direction, probability=1.0))
