"""The line between a host and a simulated machine: frames travel both ways in given time, faults included."""

import heapq
import re
from collections.abc import Callable, Mapping
from functools import partial
from math import inf
from typing import NamedTuple

from protocols.lines import CR
from simulator.faults import Direction, Fault, Faults
from simulator.truth import TruthLog

_PART = re.compile(rb"[^\r]*\r[\r\n]*|[^\r]+")


def up_to_each_cr(data: bytes) -> tuple[list[bytes], bytes]:
    """Cut data into frames and a rest; more CR and LF that come with a frame's CR belong to it."""
    frames = _PART.findall(data)
    rest = frames.pop() if frames and CR not in frames[-1] else b""
    return frames, rest


class _Due(NamedTuple):
    """Something that will happen; what is due at the same time happens in the order it was planned."""

    at: float
    order: int
    happen: Callable[[float], None]


class Wire:
    """Carries the host's frames to `hear`, with their running number, and the machine's to the output.

    The host's frames are counted from 1, in the order of their ends; `cut` knows where these are.
    """

    def __init__(
        self,
        hear: Callable[[int | None, bytes, float], None],
        truth: TruthLog,
        faults: Faults,
        logged_as: int,
        longest: int,
        cut: Callable[[bytes], tuple[list[bytes], bytes]] = up_to_each_cr,
    ) -> None:
        self._cut = cut
        self.requests = 0
        """Number of frames that the host has sent."""
        self._hear = hear
        self._truth = truth
        self._faults = faults
        self._logged_as = logged_as
        self._longest = longest
        self._planned = 0
        self.clear()

    def clear(self) -> None:
        """Lose everything that is on its way."""
        self._arriving = b""
        self._agenda: list[_Due] = []
        self._free_at = dict.fromkeys(Direction, -inf)
        self._output = bytearray()

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes from the host; without an end for too long, what has come goes on as it is."""
        frames, self._arriving = self._cut(self._arriving + data)
        if len(self._arriving) > self._longest:
            frames.append(self._arriving)
            self._arriving = b""
        for frame in frames:
            self.requests += 1
            self._travel(frame, Direction.REQUESTS, self.requests, now)

    def send(self, frame: bytes, request: int | None, now: float) -> None:
        """Send a frame to the host."""
        self._travel(frame, Direction.REPLIES, request, now)

    def take_output(self) -> bytes:
        """Give the bytes that have left for the host."""
        output = bytes(self._output)
        self._output.clear()
        return output

    def next_at(self) -> float:
        """The next moment at which something happens without a request."""
        return self._agenda[0].at if self._agenda else inf

    def step(self) -> None:
        """Let the next thing happen, at its time."""
        due = heapq.heappop(self._agenda)
        due.happen(due.at)

    def plan(self, at: float, now: float, happen: Callable[[float], None]) -> None:
        """Do something at its time, which may be now."""
        if at <= now:
            happen(now)
        else:
            self._planned += 1
            heapq.heappush(self._agenda, _Due(at, self._planned, happen))

    def _travel(self, frame: bytes, direction: Direction, request: int | None, now: float) -> None:
        flights, hits = self._faults.distort(frame, direction, now)
        self._log(frame, direction, request, now, hits)
        for flight in flights:
            arrive = partial(self._enter, direction, request, flight.pieces, flight.gap_s)
            self.plan(now + flight.delay_s, now, arrive)

    def _log(
        self, frame: bytes, direction: Direction, request: int | None, now: float, hits: Mapping[Fault, float]
    ) -> None:
        kind = "request" if direction is Direction.REQUESTS else "reply" if request else "message"
        self._truth.request = request
        facts: dict[str, object] = {"frame": frame.strip(b"\r\n").decode("ascii", "backslashreplace")}
        if hits:
            facts["faults"] = dict(hits)
        self._truth.log(kind, now, self._logged_as, **facts)
        self._truth.request = None

    def _enter(
        self, direction: Direction, request: int | None, pieces: tuple[bytes, ...], gap_s: float, now: float
    ) -> None:
        """Deliver the pieces; one frame never comes between the pieces of another."""
        deliver = self._hear if direction is Direction.REQUESTS else self._put_out
        start = max(now, self._free_at[direction])
        for place, piece in enumerate(pieces):
            at = start + place * gap_s
            self.plan(at, now, partial(deliver, request, piece))
            self._free_at[direction] = at

    def _put_out(self, _request: int | None, piece: bytes, _now: float) -> None:
        self._output += piece
