"""The simulated toy axis, at a line whose faults and truth are those of the other simulators."""

from math import inf
from random import Random

from simulator.faults import Faults
from simulator.truth import TruthLog
from simulator.wire import Wire
from tests.third_family.rows import REFUSED, ROWS, SIZE, Frame, Frames, Go, Halt, Home, Jog, SetSpeed, Status

AXIS = 0
FAR = 90_000
"""Place where a jog comes to rest by itself."""
BY_BYTE = {int(row.code, 16): row for row in ROWS}
TAKEN_ONCE = (Home, Go, Jog)


class ToyMachine:
    """An axis that moves evenly, and takes a motion only with a number newer than that of the last."""

    def __init__(self, seed: int = 0) -> None:
        self.truth, self.faults = TruthLog(), Faults(Random(seed))
        self._wire = Wire(self._hear, self.truth, self.faults, AXIS, 3 * SIZE, _whole)
        self.heard: list[str] = []
        self.mute = False
        """True while it hears without answering."""
        self.unanswered = ""
        """The command that it carries out without answering."""
        self.deaf = False
        """True while it hears nothing."""
        self.alarm, self.powered = 0, True
        self.homed = self._homing = self._stopped = False
        self._speed, self._newest, self._life = 100, 0, 1
        self._answer = b""
        """Answer to the newest motion, for copies of it."""
        self._from = self._to = 0
        self._began_at = self._ends_at = 0.0
        self._reader, self._now = Frames(), 0.0

    @property
    def requests(self) -> int:
        return self._wire.requests

    def place(self, now: float) -> int:
        """Where the axis is."""
        if now >= self._ends_at:
            return self._to
        share = (now - self._began_at) / (self._ends_at - self._began_at)
        return round(self._from + share * (self._to - self._from))

    def moves(self, now: float) -> bool:
        """Say whether the axis moves, in truth."""
        return now < self._ends_at

    def power(self, now: float, *, on: bool) -> None:
        """Take its power, or give it back: it stands where it is, and does not know where that is."""
        self._advance(now)
        if self.powered and not on:
            self._stand(now)
            self._wire.clear()
            self.homed = self._stopped = False
            self._reader = Frames()
        self._life += on and not self.powered
        self.powered = on

    def trip(self, alarm: int, now: float) -> None:
        """Something is wrong with it: it stands still, and says so."""
        self.alarm = alarm
        self._stand(now)

    def _stand(self, now: float) -> None:
        self._from = self._to = self.place(now)
        self._ends_at = now

    # the line

    def receive(self, data: bytes, now: float) -> None:
        self._advance(now)
        if self.powered and not self.deaf:
            self._wire.receive(data, self._now)

    def take_output(self, now: float) -> bytes:
        self._advance(now)
        return self._wire.take_output()

    def wake_at(self) -> float | None:
        at = self._wire.next_at()
        return None if at == inf else at

    def _advance(self, now: float) -> None:
        while self._wire.next_at() <= now:
            self._now = max(self._now, self._wire.next_at())
            self._wire.step()
        self._now = max(self._now, now)

    def _hear(self, request: int | None, piece: bytes, now: float) -> None:
        for frame in self._reader.feed(piece):
            row = BY_BYTE.get(frame.code) if isinstance(frame, Frame) else None
            if not isinstance(frame, Frame) or row is None:
                continue
            self.heard.append(row.name())
            command = row.unpack(frame.data)
            self.truth.request = request
            answer = self._obey(command, frame.number, now)
            refused = not isinstance(answer, bytes)
            self.truth.log("command", now, AXIS, text=frame.packed(), what=command, refused=refused)
            self.truth.request = None
            told = Frame(frame.number, REFUSED if refused else frame.code, answer or b"")
            if not self.mute and row.name() != self.unanswered:
                self._wire.send(told.packed(), request, now)

    def _obey(self, command: object, number: int, now: float) -> bytes | None:
        """The data of its answer; None where it refuses."""
        if isinstance(command, TAKEN_ONCE):
            return self._start(command, number, now)
        if isinstance(command, SetSpeed):
            self._speed = command.speed
        elif isinstance(command, Halt):
            self.homed = self.homed and not (self._homing and self.moves(now))
            self._stopped = self._stopped or self.moves(now)
            self._stand(now)
        else:
            return self._status(now).packed()
        return b""

    def _start(self, command: object, number: int, now: float) -> bytes | None:
        if 0 < (self._newest - number) % 0x10000 < 0x8000 or number == self._newest:
            return b"" if number == self._newest else None
        if self.moves(now) or self.alarm or (isinstance(command, Go) and not self.homed):
            return None
        self._newest, self._stopped, here = number, False, self.place(now)
        self._homing = isinstance(command, Home)
        self.homed = self.homed or self._homing
        to = command.place if isinstance(command, Go) else 0
        if isinstance(command, Jog):
            to = FAR if command.up else -FAR
        self._from, self._to, self._began_at = here, to, now
        self._ends_at = now + abs(to - here) / self._speed
        return b""

    def _status(self, now: float) -> Status:
        return Status(
            place=self.place(now),
            speed=self._speed,
            moves=self.moves(now),
            stopped=self._stopped,
            alarm=self.alarm,
            newest=self._newest,
            life=self._life,
        )


def _whole(data: bytes) -> tuple[list[bytes], bytes]:
    """Cut behind each whole frame; what was cut off before stays with the next."""
    size, begun, at, found = SIZE, 0, 0, []
    while at + size <= len(data):
        if _is_frame(data[at : at + size]):
            found.append(data[begun : at + size])
            begun = at = at + size
        else:
            at += 1
    return found, data[begun:]


def _is_frame(data: bytes) -> bool:
    return any(isinstance(found, Frame) for found in Frames().feed(data))
