"""A Fics behind its line: units, modes, errors, the one thing that moves; commands in, answers out."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple

from protocols.fics.alarms import ErrorDetail
from protocols.fics.jog import StartJog
from protocols.fics.link import LONGEST_LINE
from protocols.fics.row import Block, FicsCommand
from protocols.fics.status import MotionMode
from protocols.fics.stops import StopAllDecelerating
from protocols.fics.system import HostMode
from protocols.fics.variables import LAST_VARIABLE
from protocols.table import Reply
from simulator.fics.actions import (
    LATER,
    Alarmed,
    Code,
    Later,
    Outcome,
    Refused,
    Task,
    Wait,
    action_of,
    is_command,
    plan_of,
    understand,
)
from simulator.fics.alarms import (
    NO_ERROR,
    OVERRUN,
    Alarm,
    connection_lost,
    driver_error,
    emergency,
    timed_out,
)
from simulator.fics.course import Course, Overrun
from simulator.fics.homing import OriginNotFound
from simulator.fics.layout import Layout
from simulator.fics.settings import RobotSettings
from simulator.fics.units import Unit
from simulator.truth import TruthLog

SYSTEM = 0
"""Stands for the whole system where the truth log tells of a unit."""

UPLOAD_REFUSALS = {"E03": Code.WRONG_STATE, "E01": Code.BUSY}
JOG_MODES = {"jog": MotionMode.JOG, "move": MotionMode.MOVE, "standing": MotionMode.STANDING}
HOMING_PROGRAM = 999
"""The program that homes the mechanism (C-HOST manual 2-4)."""


class Message(NamedTuple):
    """Something for the host, with the running number of the request it answers."""

    at: float
    text: str
    request: int | None


@dataclass
class Job:
    """A motion of the host: there is one at a time."""

    name: str
    mode: MotionMode
    unit: int | None
    """Number of the unit that moves; None for all units."""
    request: int | None
    task: Task
    wait: Wait = ()
    answered: bool = False
    """True if its command has its answer, as JOG has from the beginning."""
    alarm: Alarm | None = None
    """The reason for which it brakes, and ends."""

    @property
    def courses(self) -> tuple[Course, ...]:
        """The motion under way."""
        return self.wait if isinstance(self.wait, tuple) else ()

    def next_at(self) -> float:
        """When something happens to it."""
        if not isinstance(self.wait, tuple):
            return self.wait
        return -inf if self.rests() else min(course.next_at() for course in self.wait)

    def rests(self) -> bool:
        """Tell whether nothing of it moves."""
        return all(course.ended for course in self.courses)


class Braking(NamedTuple):
    """A decelerating stop that is under way."""

    request: int | None


class Robot:
    """The system behind the line: a state machine on given time."""

    def __init__(self, layout: Layout, truth: TruthLog, settings: RobotSettings | None = None) -> None:
        self.layout = layout
        self.settings = settings or RobotSettings()
        self.truth = truth
        self.units: dict[int, Unit] = layout.build_units(truth)
        self.inputs = [0] * layout.channels
        self.outputs = [0] * layout.channels
        self.variables = [0.0] * (LAST_VARIABLE + 1)
        self.stop_input = False
        """The stop input of the system is active."""
        self._now = -inf
        self._messages: list[Message] = []
        self.refusal = Code.NONE
        """The last error of communication, until ERR has told it."""
        self._job_unit: int | None = None
        """The unit of the job that goes on: a macro keeps to it when the host selects another."""
        self.boot()

    # Power

    def boot(self) -> None:
        """Be as after power-on: Ver.2 mode, unit 1, nothing wrong."""
        self.mode: int = HostMode.VER_2
        self.host_unit = self.fics_unit = 1
        self.upload: int | None = None
        """The number the next POS gets, between POF 1 and POF 2."""
        self.terminal: MotionMode | None = None
        """The job of the teaching terminal; automatic operation runs a program, as a macro does."""
        self.editing = False
        """Data or parameters are being edited at the teaching terminal."""
        self.job: Job | None = None
        self.braking: Braking | None = None
        if self.settings.error_after_power == "gone":
            self.refusal = Code.NONE
        self.alarm: Alarm | None = None
        self.latest: ErrorDetail = NO_ERROR
        self.reset()

    def lose_power(self, now: float) -> None:
        """Stop where it is, unhomed; settings, positions and variables are kept, an assumption."""
        self.advance(now)
        if self.job is not None:
            self._halt(self.job, now)
            self._end(self.job, "power", now)
        for unit in self.units.values() if self.settings.positions_after_power == "unknown" else ():
            unit.lose_power()
        self.outputs = [0] * self.layout.channels
        self._messages.clear()

    # What the host says

    @property
    def unit(self) -> Unit:
        """The unit that commands are for: the host's, or within a macro the one it was begun in."""
        return self.units[self._job_unit or self.host_unit]

    def execute(self, name: str, arguments: str, now: float) -> list[str]:
        """Do a command; what is answered at once."""
        self.advance(now)
        try:
            answers = self._do(name, arguments, now)
        except Refused as refused:
            self.refusal = refused.code
            answers = [f"{name} {refused}"] if self.mode == HostMode.VER_3 else []
        except Alarmed as alarmed:
            self.raise_alarm(alarmed.alarm, now)
            answers = [f"{name} {alarmed}"] if self.mode == HostMode.VER_3 else []
        self.truth.log("command", now, self.host_unit, text=f"{name} {arguments}".rstrip(), answers=answers)
        return answers

    def misheard(self, data: bytes) -> list[str]:
        """Refuse what is no command: by E06 if it is plain text, else by E99. Ver.3 answers all (1-7)."""
        plain = len(data) <= LONGEST_LINE and data.isascii() and data.decode().isprintable()
        self.refusal = Code.FORMAT if plain else Code.LINE
        return [str(Refused(self.refusal))] if self.mode == HostMode.VER_3 else []

    def _do(self, name: str, arguments: str, now: float) -> list[str]:
        if not is_command(name) and name not in self.layout.macros:
            raise Refused(Code.NO_MACRO)
        command = understand(name, arguments)
        self._admit(command)
        before = self.mode
        outcome = self._act(command, now)
        return self._answers(
            command, outcome, before if self.settings.mode_change == "old_mode" else self.mode
        )

    def _act(self, command: FicsCommand[Any], now: float) -> Outcome:
        action = action_of(command)
        if action is not None:
            return action(self, command, now)
        mode, plan = plan_of(command)
        self.begin(command.wire_name(), mode, plan(self, command, now), now)
        return LATER

    def _admit(self, command: FicsCommand[Any]) -> None:
        """Refuse what the state of the system forbids (C-HOST manual 1-7).

        :raises Refused: E01, E02 or E03.
        """
        if self.upload is not None and not command.during_upload:
            raise Refused(UPLOAD_REFUSALS[self.settings.upload_refusal])
        blocks = command.blocked & self.blocks()
        if isinstance(command, StartJog) and self.jogging():
            blocks -= {Block.MOTION}
        if Block.TERMINAL_EDITS in blocks:
            raise Refused(Code.WRONG_STATE)
        if blocks:
            raise Refused(Code.BUSY)
        if command.starts_motion and self.alarm is not None:
            raise Refused(Code.ALARM)

    def blocks(self) -> frozenset[Block]:
        """The states (a) to (d) the system is in."""
        found: set[Block] = set()
        if self.terminal is not None:
            found.add(Block.TERMINAL_RUNS)
        if self.editing:
            found.add(Block.TERMINAL_EDITS)
        if self.job is not None:
            found.add(Block.MOTION)
            if self.job.mode is not MotionMode.MACRO and self.job.unit in (None, self.host_unit):
                found.add(Block.UNIT_MOTION)
        return frozenset(found)

    def jogging(self) -> bool:
        """Tell whether axes are jogging, and no stop has ended that."""
        return self.job is not None and self.job.mode is MotionMode.JOG and self.braking is None

    def _answers(self, command: FicsCommand[Any], outcome: Outcome, mode: int) -> list[str]:
        name = command.wire_name()
        if isinstance(outcome, Later):
            return []
        if isinstance(outcome, str):
            return [f"{name} {outcome}"]
        if isinstance(outcome, Reply):
            return [f"{command.answered_as or name} {outcome.written()}"]
        if isinstance(outcome, list):
            return [*(f"{command.answered_as} {item.written()}" for item in outcome), command.ends_with]
        return [name] if mode == HostMode.VER_3 else []

    # What takes time

    def begin(self, name: str, mode: MotionMode, task: Task, now: float, *, answered: bool = False) -> None:
        """Set something in motion; `answered` if its completion is not reported."""
        unit = None if mode is MotionMode.HOMING else self.host_unit
        self.job = job = Job(name, mode, unit, self.truth.request, task, answered=answered)
        self._log("motion_start", job, now)
        self._go_on(job, lambda: next(task), now)

    def advance(self, now: float) -> None:
        """Let everything happen that is due."""
        while self.job is not None and (at := self.job.next_at()) <= now:
            self._step(self.job, max(at, self._now))
        self._now = max(self._now, now)

    def next_at(self) -> float:
        """The next moment at which something happens without a request."""
        return inf if self.job is None else max(self.job.next_at(), self._now)

    def take_messages(self) -> list[Message]:
        """The messages since the last call."""
        messages, self._messages = self._messages, []
        return messages

    def brake(self, now: float) -> Outcome:
        """Ramp everything down and end it (ASS); what the terminal runs is imagined, and ends at once."""
        self.terminal = None
        if self.job is None:
            return None
        self._ramp_down(self.job, now)
        self.braking = Braking(self.truth.request)
        if not self.job.courses:
            self.job.wait = ()
        return LATER

    def sense(self, now: float) -> None:
        """Look at the sensors again after a person has changed them."""
        self.advance(now)
        for course in self.job.courses if self.job is not None else ():
            course.sense(now)
        self.advance(now)

    def _step(self, job: Job, now: float) -> None:
        try:
            self._advance_courses(job, now)
        except Alarmed as alarmed:
            self.raise_alarm(alarmed.alarm, now)
            return
        if job.rests():
            if job.alarm is not None:
                self._finish(job, "alarm", now, job.alarm)
            elif self.braking is not None:
                self._finish(job, "stop", now)
            else:
                self._go_on(job, lambda: job.task.send(now), now)

    def _advance_courses(self, job: Job, now: float) -> None:
        for course in job.courses:
            try:
                course.advance(now)
            except Overrun as overrun:
                overrun.motor.driver_error = OVERRUN
                unit, motor = self.error_unit(self._unit_of(course)), overrun.motor
                raise Alarmed(driver_error(unit, motor.name, OVERRUN, overrun.sensor)) from None
            except OriginNotFound:
                raise Alarmed(timed_out(HOMING_PROGRAM)) from None

    def _go_on(self, job: Job, resume: Callable[[], Wait], now: float) -> None:
        """Let the task say what it waits for next, or that it is done."""
        self._free(job)
        self._job_unit = job.unit
        try:
            job.wait = resume()
        except StopIteration:
            self._finish(job, "done", now)
        except Alarmed as alarmed:
            self.raise_alarm(alarmed.alarm, now)
        else:
            for course in job.courses:
                self._unit_of(course).course = course
        finally:
            self._job_unit = None

    def _finish(self, job: Job, why: str, now: float, alarm: Alarm | None = None) -> None:
        """Report the end; a stop is answered before what it has stopped."""
        self._end(job, why, now)
        if self.settings.homing == "lost_by_moves" and job.mode is MotionMode.MOVE:
            for course in job.courses:
                for motor in self._unit_of(course).motors:
                    motor.homed = False
        if self.braking is not None:
            self._say(StopAllDecelerating.code, self.braking.request, now)
            self.braking = None
        if not job.answered:
            self._say(job.name if alarm is None else f"{job.name} {alarm.code:03d}", job.request, now)

    def _end(self, job: Job, why: str, now: float) -> None:
        self.job = None
        self._free(job)
        job.task.close()
        self._log("motion_stop", job, now, why=why)

    def _free(self, job: Job) -> None:
        for course in job.courses:
            self._unit_of(course).course = None

    def _unit_of(self, course: Course) -> Unit:
        return self.units[course.mechanics.number]

    def _halt(self, job: Job, now: float) -> None:
        for course in job.courses:
            course.halt(now)

    def _say(self, text: str, request: int | None, now: float) -> None:
        if self.mode == HostMode.VER_3:
            self._messages.append(Message(now, text, request))

    def _log(self, kind: str, job: Job, now: float, **facts: object) -> None:
        units = [unit for unit in self.units.values() if job.unit in (None, unit.number)]
        places = {unit.number: unit.motor_places(now) for unit in units}
        self.truth.log(kind, now, job.unit or SYSTEM, name=job.name, places=places, **facts)

    # Errors

    def raise_alarm(self, alarm: Alarm, now: float) -> None:
        """Let an error of the system stand; it ends whatever moves."""
        self.alarm, self.latest = alarm, alarm.detail
        self.terminal = None
        self.truth.log("alarm", now, SYSTEM, code=alarm.code, detail=alarm.detail.written())
        job = self.job
        if job is None:
            return
        if alarm.is_emergency and self.settings.emergency_stop == "brakes" and not job.rests():
            self._ramp_down(job, now)
            job.alarm = alarm
        else:
            self._halt(job, now)
            self._finish(job, "alarm", now, alarm)

    def _ramp_down(self, job: Job, now: float) -> None:
        """Brake what moves, unless it does already."""
        if job.alarm is None and self.braking is None:
            for course in job.courses:
                course.brake(now)

    def reset(self) -> None:
        """Forget the errors of the system; what still has its cause stands (DRT)."""
        for unit in self.units.values():
            for motor in unit.motors:
                motor.driver_error = 0
        self.alarm = self._lasting_alarm()
        self.latest = NO_ERROR if self.alarm is None else self.alarm.detail

    def _lasting_alarm(self) -> Alarm | None:
        """The errors that stand after a reset."""
        if self.stop_input:
            return emergency()
        for unit in self.units.values():
            for motor in unit.motors:
                if motor.silent:
                    return connection_lost(self.error_unit(unit), motor.name)
        return None

    def error_unit(self, unit: Unit) -> int:
        """A unit's number in ERD: none in a system of a single unit (C-HOST manual 2-13)."""
        return unit.number if len(self.units) > 1 else 0

    # What it tells

    def hides_positions(self) -> bool:
        """Tell whether no position is told: one of the things goes on that may move any unit."""
        if self.settings.hidden_positions == "at_rest":
            return True
        if len(self.units) == 1 and self.settings.hidden_positions == "several_units":
            return False
        modes = {self.terminal, None if self.job is None else self.job.mode}
        return not modes.isdisjoint((MotionMode.HOMING, MotionMode.MACRO))

    def servos_on(self) -> bool:
        """Tell whether drivers may move: not in the state EMERGENCY."""
        return self.alarm is None or not self.alarm.is_emergency

    def motion_mode(self, unit: Unit) -> MotionMode:
        """The motion mode of the motors of a unit, as ACD tells it."""
        if not self.servos_on():
            return MotionMode.STOPPED
        if self.job is not None and self.job.unit in (None, unit.number):
            return JOG_MODES[self.settings.jog_mode] if self.job.mode is MotionMode.JOG else self.job.mode
        return self.terminal or MotionMode.STANDING
