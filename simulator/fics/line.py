"""A simulated Fics at its line: power, faults, replies that take their time."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from math import inf
from random import Random
from typing import Literal

from protocols.fics.link import LONGEST_LINE, TERMINATORS, FicsRequest, FicsRequestReader, Terminator
from simulator.faults import Faults
from simulator.fics import acts as acts
from simulator.fics.layout import Layout
from simulator.fics.robot import SYSTEM, Message, Robot
from simulator.fics.settings import RobotSettings
from simulator.truth import TruthLog
from simulator.wire import Wire

_WITH_BOTH = re.compile(rb"[^\n]*\r(?!\n)")
"""A line that ends with CR alone."""


@dataclass(frozen=True, slots=True)
class LineSettings:
    """Settings that the C-HOST manual leaves open about its line; each value is an assumption."""

    reply_delay_s: float = 0.0
    """Seconds from the end of a command, or of a motion, to the start of its reply."""
    terminator: Terminator = "cr"
    """Ends every line to the host."""
    boot_s: float = 0.0
    """Seconds from the return of the power until the system hears anything."""
    hears: Literal["either", "crlf"] = "either"
    """Ends of a line that are understood (1-2)."""
    half_commands: Literal["refused", "executed"] = "refused"
    """The fate of a command with `!` behind it: `!` is left out, or it is in a wrong form (2-12)."""
    echoes: bool = False
    """True if each line comes back, as with an adapter's local echo."""


class SimulatedFics:
    """Bytes and the time in, bytes out; nothing happens but in a call."""

    def __init__(
        self, robot: Robot, truth: TruthLog, faults: Faults, settings: LineSettings | None = None
    ) -> None:
        self.robot = robot
        self.truth = truth
        self.faults = faults
        self.settings = settings or LineSettings()
        self.powered = True
        self._wire = Wire(self._hear, truth, faults, SYSTEM, 2 * LONGEST_LINE)
        self._reader = FicsRequestReader()
        self._now = -inf
        self._boots_at = inf

    @property
    def requests(self) -> int:
        """The number of frames that the host has sent."""
        return self._wire.requests

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes from the host."""
        self._advance(now)
        if self.powered:
            if self.settings.echoes:
                self._wire.send(data, None, self._now)
            self._wire.receive(data, self._now)
            self._advance(now)

    def take_output(self, now: float) -> bytes:
        """Give the bytes that have left for the host by now."""
        self._advance(now)
        return self._wire.take_output()

    def wake_at(self) -> float | None:
        """The next moment at which something happens without a request."""
        at = self._next_at()
        return None if at == inf else at

    def power_off(self, now: float) -> None:
        """Cut the power: axes stop where they are."""
        self._advance(now)
        self._boots_at = inf
        if self.powered:
            self.robot.lose_power(self._now)
            self._wire.clear()
            self.powered = False
            self.truth.log("power", self._now, SYSTEM, on=False)

    def power_on(self, now: float) -> None:
        """Give it power again; it hears when it has booted."""
        self._advance(now)
        if not self.powered:
            self._boots_at = self._now + self.settings.boot_s
            self._advance(self._now)

    def brown_out(self, now: float, for_s: float) -> None:
        """Cut the power for a while."""
        self.power_off(now)
        self._boots_at = self._now + for_s + self.settings.boot_s

    def _boot(self) -> None:
        """Begin anew: Ver.2 mode, unit 1, full speed, nothing homed."""
        self._now, self._boots_at = self._boots_at, inf
        self._reader = FicsRequestReader()
        self.robot.boot()
        self.powered = True
        self.truth.log("power", self._now, SYSTEM, on=True)

    def look_after(self, now: float) -> None:
        """Follow up a change by hand: move on to `now`, look at the sensors, and pass on the messages."""
        self._advance(now)
        self.robot.sense(self._now)
        self._pass_on(self.robot.take_messages())

    def _next_at(self) -> float:
        return min(self._wire.next_at(), self.robot.next_at(), self._boots_at)

    def _advance(self, now: float) -> None:
        """Let everything happen that is due, in the order of time; a time gone by already counts as now."""
        while (at := self._next_at()) <= now:
            if self._boots_at <= at:
                self._boot()
            elif self.robot.next_at() <= at:
                self.robot.advance(at)
                self._pass_on(self.robot.take_messages())
            else:
                self._wire.step()
        self._now = max(self._now, now)

    def _hear(self, number: int | None, piece: bytes, now: float) -> None:
        if self.settings.half_commands == "executed":
            piece = piece.replace(b"!", b"")
        if self.settings.hears == "crlf":
            piece = _WITH_BOTH.sub(b"", piece)
        for request in self._reader.feed(piece):
            if isinstance(request, FicsRequest):
                self._obey(request, number, now)
            else:
                answers = self.robot.misheard(request.data)
                self._pass_on(Message(now, answer, number) for answer in answers)

    def _obey(self, request: FicsRequest, number: int | None, now: float) -> None:
        """Answer at once what is answered at once, then tell what has ended with it."""
        self.truth.request = number
        answers = self.robot.execute(request.name, request.arguments, now)
        self.truth.request = None
        self._pass_on(Message(now, answer, number) for answer in answers)
        self._pass_on(self.robot.take_messages())

    def _pass_on(self, messages: Iterable[Message]) -> None:
        for message in messages:
            frame = message.text.encode("ascii") + TERMINATORS[self.settings.terminator]
            leave = partial(self._wire.send, frame, message.request)
            self._wire.plan(message.at + self.settings.reply_delay_s, self._now, leave)


def build_line(
    layout: Layout,
    truth: TruthLog | None = None,
    settings: LineSettings | None = None,
    seed: int = 0,
    robot: RobotSettings | None = None,
) -> SimulatedFics:
    """Build a Fics that was just powered on; the seed is the faults'."""
    truth = truth or TruthLog()
    return SimulatedFics(Robot(layout, truth, robot), truth, Faults(Random(seed)), settings)  # noqa: S311  # dice of a simulation
