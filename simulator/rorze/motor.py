"""The motor of one axis: the legs of the move under way, and every pulse it was ever given."""

from collections.abc import Callable, Generator
from typing import NamedTuple

from protocols.rorze.profile import Profile, SpeedParameters
from simulator.rorze.course import Course, PathTrain, Stretch
from simulator.rorze.motion import Direction, PulseTrain
from simulator.rorze.world import CCW_LIMIT, CW, CW_LIMIT
from simulator.truth import TruthLog

STALL_CAUSE, CW_LIMIT_CAUSE, CCW_LIMIT_CAUSE, EMS_CAUSE, STOP_CAUSE = (1 << bit for bit in range(5))
"""The end causes as 9MD tells them (RC-420 manual 13.8.3); 0 is a normal end."""

NORMAL_END = 0


class Edge(NamedTuple):
    """A change of a sensor to on or off."""

    sensor: int
    on: bool


class Leg(NamedTuple):
    """One stretch of a move: a curve in one direction, ended before its time where a sensor shows an edge.

    The edge ends it at that very pulse, or with `ramp` after decelerating to the start speed.
    """

    direction: Direction
    profile: Profile
    until: Edge | None = None
    ramp: bool = False

    def train(self, now: float) -> PulseTrain:
        """Its pulses, from now on."""
        return PulseTrain(self.profile, self.direction, now)


class PathLeg(NamedTuple):
    """One stretch of an interpolated move, on which the axis turns one way."""

    course: Course
    stretch: Stretch

    @property
    def direction(self) -> Direction:
        """The direction of the stretch."""
        return self.stretch.direction

    def train(self, _now: float) -> PathTrain:
        """Its pulses; the course has begun before."""
        return PathTrain(self.course, self.stretch)


class Pause(NamedTuple):
    """A stretch of a move without pulses, up to this moment."""

    until: float


class Halted(Exception):
    """Thrown into a move, or by it, when it cannot go on; `cause` is what 9MD is to tell."""

    def __init__(self, cause: int) -> None:
        super().__init__(f"end cause {cause:02X}")
        self.cause = cause


Task = Generator[Leg | PathLeg | Pause, float, None]
"""A move: it yields its legs, each answered with the moment it ended; Halted is thrown in at a limit."""


def limit_ahead(direction: Direction) -> int:
    """The limit sensor that stops moves in this direction."""
    return CW_LIMIT if direction == CW else CCW_LIMIT


def limit_cause(sensor: int) -> int:
    """The end cause of a move stopped by this limit sensor."""
    return CW_LIMIT_CAUSE if sensor == CW_LIMIT else CCW_LIMIT_CAUSE


class Motor:
    """Gives pulses, leg after leg, and tells when a move has ended."""

    def __init__(
        self,
        body: int,
        truth: TruthLog,
        sees: Callable[[int], bool],
        ended: Callable[[str, int, float], None],
    ) -> None:
        self._body = body
        self._truth = truth
        self._sees = sees
        self._ended = ended
        self.train: PulseTrain | None = None
        self.pause: Pause | None = None
        self.code = ""
        self._given = 0
        self._task: Task | None = None
        self._leg: Leg | PathLeg | None = None
        self._stopping = False

    @property
    def moving(self) -> bool:
        """Tell whether a move is under way, its pauses included."""
        return self.train is not None or self.pause is not None

    @property
    def braking(self) -> bool:
        """Tell whether a decelerating stop is under way, or has ended the last move."""
        return self._stopping

    @property
    def interpolating(self) -> bool:
        """Tell whether the move is along a path."""
        return isinstance(self._leg, PathLeg)

    @property
    def searching(self) -> bool:
        """Tell whether the move is an origin search or a centring: codes beginning with zero."""
        return self.moving and self.code.startswith("0")

    def pulses(self, now: float) -> int:
        """All pulses given since the axis was built, CW positive."""
        return self._given if self.train is None else self._given + self.train.displacement(now)

    def start(self, code: str, task: Task, now: float) -> None:
        """Begin a move; `code` is the command it is reported with."""
        self.code, self._task, self._stopping = code, task, False
        self._go_on(lambda: next(task), now)

    def sensor_changed(self, edge: Edge, now: float) -> None:
        """End the leg, or the move, if this edge is what ends it."""
        if self._leg is None or self.train is None:
            return
        if isinstance(self._leg, Leg) and edge == self._leg.until and not self._stopping:
            self._reached(self.train, self._leg, now)
        elif edge == (limit_ahead(self.train.direction), True):
            self._halted(limit_cause(edge.sensor), now)

    def leg_over(self, now: float) -> None:
        """Go on after a leg's last pulse, or a pause; a leg that a stop command shortened ends the move."""
        stopped = self._stopping and (self.train is None or self.train.final)
        self._cut(now, "stop" if stopped else "done")
        if stopped:
            self._end(STOP_CAUSE, now)
        elif self._task is not None:
            task = self._task
            self._go_on(lambda: task.send(now), now)

    def stop(self, cause: int, now: float) -> None:
        """End the move at this pulse."""
        if self.moving:
            self._cut(now, "halt")
            self._end(cause, now)

    def decelerate(self, parameters: SpeedParameters | None, now: float) -> None:
        """End the move after a ramp (5SS); `parameters` of None are those of its own deceleration."""
        if self.pause is not None:
            self.stop(STOP_CAUSE, now)
        elif self.train is not None:
            self._stopping = True
            self.train.decelerate_to_stop(now, parameters)
            if not self.train.running(now):
                self.leg_over(now)

    def cut_power(self, now: float) -> None:
        """Stop where it is, without a report."""
        if self.moving:
            self._cut(now, "power")
            self._task = None

    def _reached(self, train: PulseTrain, leg: Leg, now: float) -> None:
        """A ramp that follows the edge is the rest of the leg; otherwise the leg is over."""
        if leg.ramp:
            self._leg = leg._replace(until=None)
            train.decelerate_to_stop(now)
        if not leg.ramp or not train.running(now):
            self.leg_over(now)

    def _halted(self, cause: int, now: float) -> None:
        """Stop at this pulse and let the move decide whether it can go on another way."""
        self._cut(now, "limit")
        task = self._task
        if self._stopping or task is None:
            self._end(cause, now)
        else:
            self._go_on(lambda: task.throw(Halted(cause)), now)

    def _go_on(self, resume: Callable[[], Leg | PathLeg | Pause], now: float) -> None:
        """Run the move to its next leg that takes time, or its next pause."""
        try:
            leg = resume()
        except StopIteration:
            self._end(NORMAL_END, now)
        except Halted as halted:
            self._end(halted.cause, now)
        else:
            if isinstance(leg, Pause):
                self.pause = leg
            else:
                self._begin(leg, now)

    def _begin(self, leg: Leg | PathLeg, now: float) -> None:
        """Start a leg; one that has nothing to do is over at once."""
        self._leg, self.train = leg, leg.train(now)
        self._truth.log(
            "pulses_start", now, self._body, code=self.code, at=self._given, direction=leg.direction
        )
        limit = limit_ahead(leg.direction)
        if isinstance(leg, Leg) and leg.until is not None and self._sees(leg.until.sensor) == leg.until.on:
            self.leg_over(now)
        elif self._sees(limit):
            self._halted(limit_cause(limit), now)
        elif not self.train.running(now):
            self.leg_over(now)

    def _cut(self, now: float, why: str) -> None:
        """Book the pulses of the leg that is over; a pause has none."""
        if self.pause is not None:
            self.pause = None
            return
        self._given = self.pulses(now)
        self.train = self._leg = None
        self._truth.log("pulses_stop", now, self._body, code=self.code, at=self._given, why=why)

    def _end(self, cause: int, now: float) -> None:
        """Report the end of the move."""
        if self._task is not None:
            self._task.close()
            self._task = None
        self._ended(self.code, cause, now)
