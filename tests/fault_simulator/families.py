"""The differences between the families: their plants, the wishes of clients, and the truth of actions."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from random import Random
from typing import Any, ClassVar, NamedTuple

from gateway.config import Config, parse
from gateway.core.targets import AnyCommand
from protocols.fics.commands import read
from protocols.fics.homing import HomeRobot
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.moves import MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetSpeedPercent
from protocols.fics.status import GetUserPosition
from protocols.fics.variables import GetVariable, SetVariable
from protocols.rorze.commands import COMMANDS as RORZE_COMMANDS
from protocols.rorze.moves import MoveClockwise, MoveClockwiseSlowly, MoveCounterclockwiseSlowly, MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionEntry, SetPositionEntry
from protocols.rorze.speeds import SetMaximumSpeed
from protocols.rorze.status import GetControllerStatus
from protocols.table import Effect, WireFault
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_fics
from simulator.rorze.line import Rc400Line
from simulator.rorze.line import build_line as build_rc400
from simulator.truth import Fact
from tests.fault_simulator.world import Cable
from tests.fics_plants import CARTESIAN, SCARA
from tests.open_access import OPEN
from tests.plants import BODIES, GROUPS, configuration


class Wish(NamedTuple):
    """A command that a client sends to a target."""

    path: str
    command: AnyCommand


class Family(ABC):
    """A line with its machine."""

    name: ClassVar[str]
    topic: ClassVar[str]
    """Prefix of the types of its events."""
    reads_back: ClassVar[bool] = False
    """Settings are done where they are found so afterwards, whatever became of the command."""
    config: Config
    machine: Any
    targets: Sequence[str]
    """Targets that can be stopped."""

    @abstractmethod
    def wish(self, dice: Random) -> Wish:
        """Something that a client may want."""

    @abstractmethod
    def effect_of(self, frame: str) -> Effect:
        """The effect of a frame."""

    @abstractmethod
    def texts(self, written: str, /) -> Collection[str]:
        """The commands that bytes carry, as the machine tells them."""

    @abstractmethod
    def carries(self, frame: str, command: AnyCommand) -> bool:
        """Say whether a frame carries a command."""

    @abstractmethod
    def reach(self, path: str, /) -> frozenset[str]:
        """The motors that a target moves."""

    @abstractmethod
    def has_done(self, fact: Fact, command: AnyCommand) -> bool:
        """Say whether a fact is an action with the effect of a command."""

    @abstractmethod
    def was_taken(self, fact: Fact, /) -> bool:
        """Say whether a fact is a command that a controller took, to execute it."""

    @abstractmethod
    def moving(self, subject: str, /) -> bool:
        """Say whether the motor of an event's subject moves."""

    @abstractmethod
    def upset(self, cable: Cable, dice: Random, now: float) -> float:
        """Take the power from something; returns how long, in seconds, until it may be given back."""

    @abstractmethod
    def restore(self, cable: Cable, now: float) -> None:
        """Give all power back."""


class Rorze(Family):
    """Three bodies behind a link master, two of them in a group."""

    name = "rorze"
    topic = "body"
    BODIES: ClassVar[Sequence[int]] = BODIES
    GROUPS: ClassVar[Mapping[str, Sequence[str]]] = GROUPS

    def __init__(self, seed: int) -> None:
        self.config = parse(configuration(bodies=self.BODIES, groups=self.GROUPS), "test.toml")
        self.machine = build_rc400(self.BODIES, 0.0, seed=seed)
        bodies = [f"/bodies/{body:02X}" for body in self.BODIES]
        self.targets = (*bodies, *(f"/groups/{group}" for group in self.GROUPS))

    def wish(self, dice: Random) -> Wish:
        body = f"/bodies/{dice.choice(self.BODIES):02X}"
        kind = dice.choices(("read", "set", "move"), (5, 3, 4))[0]
        if kind == "read":
            entry = PositionReference(position=dice.randrange(4))
            return Wish(
                body,
                dice.choice((GetPosition(), GetControllerStatus(bit=0), GetPositionEntry(entry=entry))),
            )
        if kind == "set":
            entry = PositionReference(position=dice.randrange(4))
            return Wish(
                body,
                dice.choice(
                    (
                        SetPositionEntry(entry=entry, pulses=dice.randrange(100_000)),
                        SetMaximumSpeed(speed=dice.randrange(2_000, 9_000)),
                    )
                ),
            )
        path = "/groups/80" if self.GROUPS and dice.random() < 0.15 else body
        distance = dice.randint(1, 400)
        moves = (
            MoveClockwiseSlowly(distance=distance),
            MoveCounterclockwiseSlowly(distance=distance),
            MoveClockwise(distance=dice.randint(1, 3_000)),
            MoveTo(position=PositionReference(position=dice.randrange(4))) if path == body else None,
        )
        return Wish(path, dice.choice([move for move in moves if move is not None]))

    def effect_of(self, frame: str) -> Effect:
        row = RORZE_COMMANDS.get(self._said(frame)[:3])
        return Effect.READ if row is None else row.effect

    def texts(self, written: str) -> Collection[str]:
        return [self._said(frame) for frame in written.split("\r")]

    def carries(self, frame: str, command: AnyCommand) -> bool:
        return self._said(frame).rstrip("\r") == f"{command.code}{command.written()}"

    @staticmethod
    def _said(frame: str) -> str:
        """Give what stands behind the body, which has one digit behind `$` and `#`."""
        return frame[3 if frame.startswith("&") else 2 :]

    def reach(self, path: str) -> frozenset[str]:
        if path == "/groups/80":
            return frozenset({"/bodies/line1.00", "/bodies/line1.01"})
        return frozenset({path.replace("/bodies/", "/bodies/line1.")})

    def has_done(self, fact: Fact, command: AnyCommand) -> bool:
        return self.was_taken(fact) and fact.facts["text"] == f"{command.code}{command.written()}"

    def was_taken(self, fact: Fact) -> bool:
        return fact.kind == "command" and not str(fact.facts["reply"]).startswith("@")

    def moving(self, subject: str) -> bool:
        return bool(self.machine.axes[int(subject[-2:], 16)].motor.moving)

    def upset(self, cable: Cable, dice: Random, now: float) -> float:
        machine: Rc400Line = self.machine
        if dice.random() < 0.2:
            machine.power_off(now)
        else:
            machine.switch_body(dice.choice(self.BODIES), on=False, now=now)
        cable.turn()
        return dice.choice((0.05, 0.3, 2.0))

    def restore(self, cable: Cable, now: float) -> None:
        machine: Rc400Line = self.machine
        machine.power_on(now)
        for body in self.BODIES:
            machine.switch_body(body, on=True, now=now)
        cable.turn()


class Fics(Family):
    """A robot of one unit, or of two, in one of the modes."""

    topic = "robot"
    reads_back = True

    def __init__(self, mode: int, units: int) -> None:
        self.name = f"fics-{mode}"  # type: ignore[misc]
        self._units = units
        tables = ", ".join([SCARA, CARTESIAN][:units])
        text = (
            f'[[lines]]\nid = "cell"\naddress = "tcp://127.0.0.1:1"\nprotocol = "fics"\nmode = {mode}\n'
            f'robot = {{id = "r1", units = [{tables}]}}\n{OPEN}'
        )
        self.config = parse(text, "test.toml")
        self.machine = build_fics(Layout(units=units))
        self.targets = ("/robots/r1",)

    def wish(self, dice: Random) -> Wish:
        unit = f"/robots/r1/units/{dice.randint(1, self._units)}"
        number = dice.randrange(100)
        return dice.choice(
            (
                Wish(unit, GetUserPosition()),
                Wish("/robots/r1", GetVariable(number=number)),
                Wish(unit, GetSpeedPercent()),
                Wish("/robots/r1", SetVariable(number=number, value=round(dice.uniform(0.0, 100.0), 1))),
                Wish("/robots/r1", SwitchOutput(channel=1, bit=dice.randrange(8), on=dice.random() < 0.5)),
                Wish(unit, MoveRelative(coordinates=[None, None, round(dice.uniform(-20.0, 20.0), 2)])),
                Wish(unit, MoveRelative(coordinates=[None, None, round(dice.uniform(-20.0, 20.0), 2)])),
                Wish("/robots/r1", HomeRobot()),
            )
        )

    def effect_of(self, frame: str) -> Effect:
        try:
            return read(*frame.rstrip("\r").partition(" ")[::2]).effect
        except WireFault:
            return Effect.READ

    def texts(self, written: str) -> Collection[str]:
        return written.split("\r")

    def carries(self, frame: str, command: AnyCommand) -> bool:
        return isinstance(command, FicsCommand) and frame.rstrip("\r") == command.text

    def reach(self, _path: str) -> frozenset[str]:
        return frozenset({"/robots/r1"})

    def has_done(self, fact: Fact, command: AnyCommand) -> bool:
        if command.starts_motion:
            return fact.kind == "motion_start"
        answers = " ".join(map(str, fact.facts.get("answers", ())))  # type: ignore[call-overload]
        text = command.text if isinstance(command, FicsCommand) else ""
        return fact.kind == "command" and fact.facts.get("text") == text and " E" not in answers

    def was_taken(self, fact: Fact) -> bool:
        """In Ver.2 it does not tell what it has refused: so it is what it could have executed."""
        try:
            return fact.kind == "command" and bool(read(*str(fact.facts["text"]).partition(" ")[::2]))
        except WireFault:
            return False

    def moving(self, _subject: str) -> bool:
        return self.machine.robot.job is not None

    def upset(self, cable: Cable, dice: Random, now: float) -> float:
        self.machine.power_off(now)
        cable.turn()
        return dice.choice((0.05, 0.3, 2.0))

    def restore(self, cable: Cable, now: float) -> None:
        self.machine.power_on(now)
        cable.turn()
