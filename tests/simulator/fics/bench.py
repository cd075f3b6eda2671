"""A test bench: a Fics at its line, and a clock turned by hand."""

from simulator.fics.axes import Motor
from simulator.fics.layout import Layout
from simulator.fics.line import LineSettings, SimulatedFics, build_line
from simulator.fics.robot import Robot

LONGEST_MOTION_S = 600.0


class Bench:
    """One unit of X Y Z that is a miniSCARA, in Ver.3 mode, unless told otherwise."""

    def __init__(
        self, layout: Layout | None = None, *, mode: int = 3, settings: LineSettings | None = None
    ) -> None:
        self.now = 0.0
        self.line: SimulatedFics = build_line(layout or Layout(), settings=settings)
        if mode == 3:
            assert self.ask("MOD 3") == ["MOD"]

    @property
    def robot(self) -> Robot:
        return self.line.robot

    def motor(self, name: str, unit: int = 1) -> Motor:
        (motor,) = [motor for motor in self.robot.units[unit].motors if motor.name == name]
        return motor

    def ask(self, text: str) -> list[str]:
        """Send a command; what is answered at once."""
        self.line.receive(text.encode() + b"\r", self.now)
        return self.heard()

    def asked(self, *texts: str) -> None:
        """Commands that are done at once, all of them."""
        for text in texts:
            assert self.ask(text) == [text[:3]], text

    def wait(self, seconds: float) -> list[str]:
        """Let time pass; what is said meanwhile."""
        self.now += seconds
        return self.heard()

    def finish(self) -> list[str]:
        """Let time pass until nothing moves; what is said meanwhile."""
        heard = []
        end = self.now + LONGEST_MOTION_S
        while (wake := self.line.wake_at()) is not None:
            assert wake < end
            self.now = max(wake, self.now)
            heard += self.heard()
        return heard

    def do(self, text: str) -> list[str]:
        """A command and everything said until nothing moves."""
        return self.ask(text) + self.finish()

    def home(self) -> None:
        assert self.do("ORG") == ["ORG"]

    def heard(self) -> list[str]:
        *lines, rest = self.line.take_output(self.now).decode("ascii").split("\r")
        assert rest == ""
        return lines


def cartesian(units: int = 1) -> Layout:
    """Axes that are not converted: Z, theta and one in pulses."""
    return Layout(units=units, axes="Z@W")
