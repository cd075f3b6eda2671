"""A test bench: one controller, a clock turned by hand, and the truth."""

from dataclasses import replace
from typing import Any

from protocols.rorze.commands import COMMANDS
from protocols.rorze.errors import ErrorKind, lookup
from protocols.rorze.link import MoveEnded
from protocols.rorze.row import OF_THE_FORM, RorzeCommand
from simulator.rorze.controller import Rc420
from simulator.rorze.world import Span
from simulator.truth import TruthLog

BODY = 0x3F
FOREVER_S = 1e7


def require_listed(code: str, error: int) -> None:
    """See that the row of a command lists a refusal that is not for its form."""
    if code in COMMANDS and error not in OF_THE_FORM and lookup(error).kind is ErrorKind.COMMAND:
        assert error in COMMANDS[code].errors, f"the row of {code} does not list {error:02X}"


class Bench:
    def __init__(self) -> None:
        self.now = 0.0
        self.truth = TruthLog()
        self.axis = Rc420(BODY, self.now, self.truth)

    def send(self, text: str) -> str:
        """A command, sent now; what follows the code in the reply."""
        written = text.replace(" ", "")
        payload = self.axis.execute(written, self.now).payload
        if payload.startswith("@"):
            require_listed(written[:3], int(payload[1:], 16))
        return payload

    def sent(self, *texts: str) -> None:
        """Commands that must all be accepted."""
        for text in texts:
            assert self.send(text) == "", text

    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.axis.advance(self.now)

    def until_end(self) -> tuple[str, int]:
        """Let time go on to the end of the move: its command and cause."""
        while (wake := self.axis.wake_at()) is not None and self.axis.motor.moving:
            assert wake < self.now + FOREVER_S
            self.axis.advance(wake)
            self.now = max(self.now, wake)
        (ended,) = self.ends()
        return ended.code, ended.cause

    def ends(self) -> list[MoveEnded]:
        frames = [message.frame for message in self.axis.take_messages()]
        return [frame for frame in frames if isinstance(frame, MoveEnded)]

    def position(self) -> int:
        return int(self.send("6PD"))

    def place(self, pulses: int) -> None:
        """Put the machine round the axis so that its shaft stands there; the counters do not notice."""
        world = self.axis.world
        moved = self.axis.motor.pulses(self.now) - pulses
        world.slipped = moved
        self.axis.sense(self.now)

    def shaft(self) -> int:
        return self.axis.world.shaft(self.axis.motor.pulses(self.now))

    def machine(self, origin: tuple[int, int], ccw: tuple[int, int], cw: tuple[int, int]) -> None:
        world = self.axis.world
        world.origin, world.ccw_limit, world.cw_limit = Span(*origin), Span(*ccw), Span(*cw)
        self.axis.sense(self.now)

    def settings(self, **values: Any) -> None:
        """Settings whose commands belong to other tests."""
        self.axis.settings = replace(self.axis.settings, **values)

    def force(self, sensor: int, on: bool) -> None:
        self.axis.world.forced[sensor] = on
        self.axis.sense(self.now)


def examples(row: type[RorzeCommand[Any]]) -> list[tuple[str, str]]:
    """The manual's exchanges for a row: command text, and what follows the code in the reply."""
    texts = [text.lstrip(">").removeprefix("&3F").replace(" ", "") for text in row.example]
    return [(text, reply[3:]) for text, reply in zip(texts[::2], texts[1::2], strict=True)]
