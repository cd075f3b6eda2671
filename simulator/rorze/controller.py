"""One RC-420: a pure state machine that takes commands and the time, and moves an imaginary motor."""

from dataclasses import dataclass
from enum import Enum, auto
from math import floor

from protocols.rorze.errors import ErrorKind, lookup
from protocols.rorze.interpolation import PathPoint
from protocols.rorze.link import MoveEnded, StatusChanged
from protocols.rorze.profile import SpeedChange
from protocols.table import Retry
from simulator.rorze.actions import Delayed, Order, Outcome, Refused, understand
from simulator.rorze.axis import Axis
from simulator.rorze.breakdowns import Breakdown
from simulator.rorze.course import Prepared
from simulator.rorze.events import EventReporter, StatusValues
from simulator.rorze.io import Ports
from simulator.rorze.motion import Direction
from simulator.rorze.motor import (
    CCW_LIMIT_CAUSE,
    CW_LIMIT_CAUSE,
    EMS_CAUSE,
    NORMAL_END,
    STALL_CAUSE,
    Edge,
    Motor,
    Task,
)
from simulator.rorze.program_memory import Memories
from simulator.rorze.program_run import ProgramRun
from simulator.rorze.settings import FARTHEST
from simulator.rorze.world import CW, EMS, STALL
from simulator.truth import TruthLog

(
    PULSES_RUNNING,
    LIMIT_ERROR,
    EMS_ERROR,
    COMMAND_ERROR,
    INITIALISATION_ERROR,
    RANGE_ERROR,
    STALL_ERROR,
    COMMUNICATION_ERROR,
) = (1 << bit for bit in range(8))
"""The controller status as 9CD tells it (RC-420 manual 13.8.2)."""

_ERROR_BITS = {ErrorKind.COMMAND: COMMAND_ERROR, ErrorKind.COMMUNICATION: COMMUNICATION_ERROR}
"""The effect of an error on the controller status; that a system error does nothing is an assumption."""

MOVING = 0x50

_END_ERRORS = {
    CW_LIMIT_CAUSE: (LIMIT_ERROR, "limit"),
    CCW_LIMIT_CAUSE: (LIMIT_ERROR, "limit"),
    EMS_CAUSE: (EMS_ERROR, "ems"),
    STALL_CAUSE: (STALL_ERROR, "stall"),
}
"""The effect of an end cause on the controller status, and the error output it drives (CES)."""


class StallFinder(Enum):
    """The finder of a motor that does not follow its pulses."""

    SENSOR = auto()
    ENCODER = auto()


@dataclass(frozen=True, slots=True)
class Response:
    """The answer to a command: what follows the code, and how long after the command it leaves."""

    payload: str
    delay_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Message:
    """Something the controller says unasked."""

    at: float
    frame: MoveEnded | StatusChanged


class Rc420(Axis):
    """One axis. Times are seconds on one clock and never go back; nothing happens but in a call."""

    def __init__(self, body: int, now: float, truth: TruthLog) -> None:
        super().__init__(Motor(body, truth, self.sees, self._move_ended))
        self.body = body
        self.truth = truth
        self.powered = False
        self.breakdown = Breakdown()
        self.power_on(now)

    # Power

    def power_on(self, now: float) -> None:
        """Load flash into RAM; everything else starts from nothing (RC-420 manual 18)."""
        super().power_on(now)
        self.program = self.flash.program
        self.next_program_address = 0
        self.memories = Memories()
        self.run = ProgramRun(self, now)
        self._text: tuple[float, str] | None = None
        self.status = INITIALISATION_ERROR if self.flash.damaged else 0
        self.end_cause = 0
        self.stalls: set[StallFinder] = set()
        """The finders of a step-out that has not been cleared."""
        self.stop_speed_set: int | None = None
        self.search_travel = 0
        self.speed_changes: dict[int, dict[int, SpeedChange]] = {}
        self.stall_centre: int | None = None
        self.paths: dict[int, dict[int, PathPoint]] = {}
        self.start_positions: dict[int, int] = {}
        self.prepared: Prepared | None = None
        self._messages: list[Message] = []
        self._wake: float | None = None
        self.io = Ports(self, self.sensor_changed, now)
        self.events = EventReporter(self.status_values(now))
        self.powered = True
        if self.settings.autostart and self.program:
            self.run.start(self.program, 0, now)
        self._settle(now)

    def power_off(self, now: float) -> None:
        """Stop where it is; unsaved settings, positions and messages are lost."""
        self.advance(now)
        self.motor.cut_power(now)
        self.run.cut_power()
        self.powered = False
        self._text = None
        self._messages.clear()
        self._wake = None

    # Commands

    def execute(self, text: str, now: float) -> Response:
        """Do a command, given as its code and parameters without blanks."""
        self.advance(now)
        self.run.awake(now)
        response, changed = self._do(text, now)
        if changed:
            self._settle(now)
        self.truth.log("command", now, self.body, text=text, reply=response.payload)
        return response

    def _do(self, text: str, now: float) -> tuple[Response, bool]:
        """The response, and whether anything but reading was done."""
        try:
            self.breakdown.strike()
            order = understand(text)
            outcome = self.perform(order, now)
        except Refused as refusal:
            self.status |= _ERROR_BITS.get(lookup(refusal.code).kind, 0)
            return Response(f"@{refusal.code:02X}"), True
        changed = order.command.retry is not Retry.READ
        if outcome is None:
            return Response(""), changed
        if isinstance(outcome, Delayed):
            payload = outcome.reply.written() if outcome.reply else ""
            return Response(payload, outcome.delay_s), changed
        return Response(outcome.written()), changed

    def perform(self, order: Order, now: float) -> Outcome:
        """Do a command of the host or of the program.

        :raises Refused: it has had no effect, and leaves the settings.
        """
        settings = self.settings
        try:
            self._check(order)
            return order.act(self, order.command, now)
        except Refused:
            self.settings = settings
            raise

    def _check(self, order: Order) -> None:
        if str(self.settings.mode) not in order.command.modes:
            raise Refused(self.wrong_mode_error)
        if self.motor.moving and not order.command.moving:
            raise Refused(MOVING)

    # Time

    def wake_at(self) -> float | None:
        """The next moment at which something happens without a request."""
        moments = [at for at in (self._wake, self.run.next_at) if at is not None]
        return min(moments, default=None)

    def advance(self, now: float) -> None:
        """Let everything happen that is due, in the order of time."""
        while (at := self.wake_at()) is not None and at <= now:
            if at == self._wake:
                self._happen(at)
            elif self.run.step(at):
                self._settle(at)

    def sense(self, now: float) -> None:
        """Look at the mechanics and sensors again after a change by hand."""
        if self.powered:
            self.advance(now)
            self._look(now)
            self._settle(now)

    def take_messages(self) -> list[Message]:
        """The messages that the controller has sent unasked since the last call, in the order of time."""
        messages, self._messages = self._messages, []
        return messages

    def say(self, frame: MoveEnded | StatusChanged, now: float) -> None:
        """Add a message of the controller's own."""
        self._messages.append(Message(now, frame))

    def _happen(self, now: float) -> None:
        self._look(now)
        self.io.advance(now)
        self._go_on(now)
        self._settle(now)

    def _go_on(self, now: float) -> None:
        """Let the motor go on, if its leg or its pause is over."""
        train, pause = self.motor.train, self.motor.pause
        if (train is not None and not train.running(now)) or (pause is not None and pause.until <= now):
            self.motor.leg_over(now)

    def _look(self, now: float) -> None:
        """Show the ports what the sensors see, and watch stalling and range while moving."""
        pulses = self.motor.pulses(now)
        self.io.sense(self.world.levels(pulses), now)
        self._check_stall(pulses, now)
        self._check_range(pulses, now)

    def _settle(self, now: float) -> None:
        """After any change: report it, let the program see it, and find out when to wake next."""
        self._report(now)
        self.run.awake(now)
        moments = [at for at in (self._motor_wakes(now), self.io.wake_at()) if at is not None]
        self._wake = min(moments, default=None)

    def _report(self, now: float) -> None:
        """Send an event message, if the mask lets what has changed be reported."""
        values = self.status_values(now)
        if self.events.notice(values):
            self.say(StatusChanged(self.body, self.events.fields(values)), now)

    def _motor_wakes(self, now: float) -> float | None:
        """The end of the leg or pause, or the next pulse on the way at which there is something to see."""
        if self.motor.pause is not None:
            return self.motor.pause.until
        train = self.motor.train
        if train is None:
            return None
        here = self.motor.pulses(now)
        ahead = [abs(place - here) for place in self._places_ahead(here, train.direction)]
        emitted = train.emitted(now)
        seen_at = train.time_when(emitted + min(ahead)) if ahead else None
        return min((at for at in (seen_at, train.ends_at) if at is not None), default=None)

    def _places_ahead(self, here: int, direction: Direction) -> list[int]:
        """Pulse counts ahead at which a sensor changes, the range is left, or stalling may be found."""
        places = [self.world.next_edge(here, direction), *self._stall_checks(here)]
        places += [self._range_exit(direction), self._zero + direction * FARTHEST]
        places.append(self._step_out(here, direction))
        return [place for place in places if place is not None and (place - here) * direction > 0]

    def _range_exit(self, direction: Direction) -> int:
        """The first pulse count outside the movable range (EPS)."""
        bound = self.settings.movable_range[direction == CW]
        return self._zero + self.to_pulses(bound) + direction

    def _check_range(self, pulses: int, now: float) -> None:
        """A move may leave the movable range only without an end or in a search; the register's end stops it.

        That it is stopped there, and normally, is an assumption.
        """
        if self.motor.train is None:
            return
        direction = self.motor.train.direction
        if pulses == self._range_exit(direction):
            self.status |= RANGE_ERROR
        if pulses == self._zero + direction * FARTHEST:
            self.motor.stop(NORMAL_END, now)

    # The texts of a program

    def send_text(self, text: str, now: float) -> None:
        """Put a text (SDC, SDD) where the link master collects it; one that still waits there is lost."""
        self._text = now, text

    def text_waits(self) -> bool:
        """Tell whether a text has not been collected (JMG)."""
        return self._text is not None

    def text_since(self) -> float | None:
        """Since when a text waits to be collected."""
        return None if self._text is None else self._text[0]

    def take_text(self, now: float) -> str | None:
        """Collect the text that waits."""
        self.advance(now)
        if self._text is None:
            return None
        (_, text), self._text = self._text, None
        self._settle(now)
        return text

    # Sensors

    def sees(self, sensor: int) -> bool:
        """Tell whether a sensor is on, as CLD tells it."""
        return self.io.sensor(sensor)

    def sensor_changed(self, sensor: int, on: bool, now: float) -> None:
        """React to a sensor, once the ports have made up their mind about it."""
        if sensor == EMS and on:
            self.motor.stop(EMS_CAUSE, now)
        else:
            self.motor.sensor_changed(Edge(sensor, on), now)

    def _stall_checks(self, here: int) -> tuple[int, ...]:
        """Where the STALL sensor is compared: the middle of each covered and each open stretch (13.6.2)."""
        if not self.settings.stall_detection or self.stall_centre is None:
            return ()
        half = self.settings.stall_interval // 2
        before = here - (here - self.stall_centre) % half
        return before - half, before, before + half

    def _check_stall(self, pulses: int, now: float) -> None:
        """In a move, but in no origin search: for the encoder that is an assumption."""
        if self.motor.train is None or self.motor.searching:
            return
        if self._slit_missed(pulses):
            self.stalls.add(StallFinder.SENSOR)
            self.motor.stop(STALL_CAUSE, now)
        elif self.settings.encoder_stall_detection and self._stepped_out(self._lag(pulses)):
            self.stalls.add(StallFinder.ENCODER)
            self.motor.stop(STALL_CAUSE, now)

    def step_out(self, now: float) -> None:
        """Find the motor stepped out, by the encoder."""
        self.stalls.add(StallFinder.ENCODER)
        self.status |= STALL_ERROR
        self.motor.stop(STALL_CAUSE, now)

    def _slit_missed(self, pulses: int) -> bool:
        """Tell whether the STALL sensor is not as it should be where it is compared."""
        if self.stall_centre is None or pulses not in self._stall_checks(pulses):
            return False
        covered = (pulses - self.stall_centre) // (self.settings.stall_interval // 2) % 2 == 0
        return self.sees(STALL) != covered

    def _lag(self, pulses: int) -> float:
        """By how many pulses the encoder is behind (13.7.4).

        The two counters are compared as 6PS and 6ES have left them, the encoder's to a fraction of a count:
        assumptions.
        """
        return pulses - self._zero - self._counts(self.world.shaft(pulses)) * self.settings.encoder_ratio

    def _step_out(self, here: int, direction: Direction) -> int | None:
        """The first pulse count ahead at which the encoder is too far behind or ahead."""
        if not self.settings.encoder_stall_detection:
            return None
        lag = direction * self._lag(here)
        growth = 1 - self.settings.encoder_ratio / self._pulses_per_count
        if self._stepped_out(lag):
            return here + direction
        if growth == 0:
            return None
        left = self.settings.encoder_tolerance - (lag if growth > 0 else -lag)
        return here + direction * (floor(left / abs(growth)) + 1)

    def _stepped_out(self, lag: float) -> bool:
        return abs(lag) > self.settings.encoder_tolerance

    # Origin

    def set_origin(self, begun: int, centred: bool, now: float) -> None:
        """Call this place 0, found from `begun` pulses; `centred` says it is the middle of a slit (0QM)."""
        here = self.motor.pulses(now)
        self.search_travel = begun - here
        self.stall_centre = here if centred else None
        self.set_pulse_position(0, now)
        self.set_encoder(0, now)
        self.clear_stalls(*StallFinder)

    # Moves

    def start(self, code: str, task: Task, now: float) -> None:
        """Begin a move that has been found allowed."""
        self.end_cause = 0
        self.motor.start(code, task, now)

    def status_now(self) -> int:
        """The controller status with its live bit 0."""
        return self.status | (PULSES_RUNNING if self.motor.moving else 0)

    def status_values(self, now: float) -> StatusValues:
        """The state that event messages watch and tell."""
        return {
            "controller": self.status_now(),
            "end_cause": self.end_cause,
            "sensors": self.io.sensors(),
            "inputs": self.io.inputs(),
            "outputs": self.io.outputs.bits(),
            "position": self.position(now),
        }

    def clear_stalls(self, *finders: StallFinder) -> None:
        """End the STALL errors of these finders: after an origin search, or by QRS and PRS."""
        self.stalls.difference_update(finders)
        if not self.stalls:
            self.status &= ~STALL_ERROR

    def _move_ended(self, code: str, cause: int, now: float) -> None:
        self.end_cause = cause
        error, output = _END_ERRORS.get(cause, (0, ""))
        self.status |= error
        self.io.move_ended(cause, output, now)
        self.say(MoveEnded(self.body, code, cause), now)
