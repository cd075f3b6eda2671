"""Power lost and back: seen by the mode or the origins, kept in mind, and the speeds set again."""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from pydantic import BaseModel

from gateway.core.errors import ControllerRefused, NoReply, NotSent, PowerCycled
from gateway.fics.axes import Coordinates, UnitAxes, unit_of
from gateway.fics.commander import Commander
from gateway.fics.errors import RobotBusy, SpeedsNotRestored
from gateway.fics.exchange import Outcome, Proof, RobotAnswered
from gateway.fics.motion_state import Tell
from gateway.fics.origins import Origins
from gateway.fics.questions import MODE, PLACES, STATUS
from gateway.fics.system_errors import SystemErrors
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.motor_axes import GetMotorPosition, GetMotorSpeedPercent, SetMotorSpeedPercent
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.fics.status import AxisStatuses, MotionMode
from protocols.fics.system import CommunicationMode, HostMode, SelectUnit
from protocols.table import Reply

FULL_SPEED: Final = 100.0
"""What every speed percentage is after power-on (C-HOST manual 2-15, 4-5)."""

ACKNOWLEDGE = "See that its speeds are right, acknowledge the power cycle, then home it."

Setter = type[SetSpeedPercent] | type[SetMotorSpeedPercent]
_ROWS: Final[Mapping[Coordinates, tuple[Setter, FicsCommand[Any]]]] = {
    "user": (SetSpeedPercent, GetSpeedPercent()),
    "motor": (SetMotorSpeedPercent, GetMotorSpeedPercent()),
}

Speeds = dict[str, float]
"""Percent by axis."""


class RobotMemory(BaseModel):
    """What a gateway has to remember of a robot over restarts."""

    mode: int
    """In which it was left: a robot that is in the mode of power-on afterwards has lost its power."""
    cycled: bool
    certain: bool
    due: set[int]
    speeds: dict[int, dict[Coordinates, Speeds]]


@dataclass(eq=False)
class RobotPower:
    """What a loss of power takes from a robot: its mode, its unit, its homing, its speed percentages."""

    _units: Sequence[UnitAxes]
    _commander: Commander
    _errors: SystemErrors
    _tell: Tell
    cycled: bool = False
    """Whether the robot has lost its power, and nobody has acknowledged that yet."""
    losses: int = 0
    """Counts the losses of power that were noticed."""
    _speeds: dict[int, dict[Coordinates, Speeds]] = field(default_factory=dict)
    """By unit, in user and in motor coordinates, which have a value each (C-HOST manual 2-15, 4-5).

    As last set, or as read before; an axis nobody spoke of is missing.
    """
    _due: set[int] = field(default_factory=set)
    """The units whose speeds have to be set again before any move."""
    _certain: bool = True
    """Whether the loss that nobody has acknowledged is certain."""
    _absences: int | None = None
    """What `FicsLine.absences` was when it was last seen whether the power was kept; None after a start."""
    on_memory: Callable[[], None] = lambda: None
    """Called when there may be something else to remember."""

    def __post_init__(self) -> None:
        self.origins = Origins(self._origins_lost)

    # over restarts

    def memory(self) -> str:
        """Give what is to be remembered."""
        mode, speeds = self._commander.line.mode, self._speeds
        kept = RobotMemory(mode=mode, cycled=self.cycled, certain=self._certain, due=self._due, speeds=speeds)
        return kept.model_dump_json()

    def recall(self, memory: str) -> None:
        """Go on from what was remembered, as far as its units and axes are configured.

        :raises ValueError: it cannot be read.
        """
        told = RobotMemory.model_validate_json(memory)
        if told.mode == self._commander.line.mode:
            self._commander.line.was_set_up()
        self.cycled, self._certain = told.cycled, told.certain
        for unit in self._units:
            for coordinates in _ROWS:
                speeds = told.speeds.get(unit.number, {}).get(coordinates, {})
                known = {axis: speeds[axis] for axis in unit.names(coordinates) if axis in speeds}
                self._speeds.setdefault(unit.number, {})[coordinates] = known
        self._due = told.due & {*self._speeds}

    def lost(self, *, certain: bool) -> None:
        """It was switched off and on, or seems to: keep it from moving until a person acknowledges that."""
        self.losses += 1
        self.settle_doubt(self._commander.line.absences)
        self._due = set(self._speeds)
        self.forget_origins()  # those of all units are gone, and that is told once
        if not self.cycled:
            self.cycled, self._certain = True, certain
            self._errors.forget()
            self._tell("robot.power_cycled", {"certain": certain, **self._speeds_told()})
        self.on_memory()

    def acknowledge(self) -> None:
        """Let the robot move again."""
        if self.cycled:
            self.cycled = False
            self._tell("robot.power_cycle.acknowledged", {})
            self.on_memory()

    def require_known(self, command: FicsCommand[Any]) -> None:
        """Refuse a motion until a person knows of the loss.

        :raises PowerCycled: nobody has acknowledged it.
        """
        if self.cycled:
            raise PowerCycled(
                f"{self.what_happened()}: nothing is homed then, and speeds the gateway does not know are "
                f"100 % again; {command.wire_name()} was not sent.",
                ACKNOWLEDGE,
            )

    @property
    def in_doubt(self) -> bool:
        """Whether it may have lost its power unseen: it was not asked since for what a loss would take."""
        return self._commander.line.absences != self._absences

    def settle_doubt(self, absences: int) -> None:
        """All that a loss would take was looked at since the line had been away so often."""
        self._absences = absences

    async def see_signs(self, unit: UnitAxes, *, speeds: bool = True) -> bool:
        """Whether the robot proves that it has kept its power; in Ver.2 by what a loss would take away.

        That are the origins of a unit, or `speeds` below 100 % where it has none. Call it with the sequence
        lock held and the unit selected.

        :raises PowerCycled: it has lost it.
        :raises GatewayError: it did not tell.
        """
        line = self._commander.line
        absences, homed = line.absences, self.origins.are_known(unit)
        await self.see()
        if line.mode != HostMode.VER_2:
            return True
        await self.see_origins(unit)
        kept = homed and self.origins.are_known(unit)
        if speeds and not homed:
            kept = any([await self._see_speeds(unit, it) for it in _ROWS])
        if self.cycled:
            self.refuse()
        if kept:
            self.settle_doubt(absences)
        return kept

    async def see(self, proof: Proof | None = None) -> None:
        """See that the robot has not been switched off: then it is in Ver.2.

        Where that is its own mode only `see_kept` can tell. Call it with the sequence lock held.

        :raises PowerCycled: it has.
        :raises NotSent: it did not tell.
        """
        line = self._commander.line
        if line.mode == HostMode.VER_2:
            return
        try:
            reply = await self._ask(MODE, self._commander.robot_id, proof)
        except ControllerRefused:
            return  # only Ver.3 refuses
        if isinstance(reply, CommunicationMode) and reply.mode != line.mode:
            line.power_was_lost(f"the robot is in mode {reply.mode}")
            self.refuse()

    def signs(self, command: FicsCommand[Any], unit: UnitAxes, *, joining: bool) -> list[FicsCommand[Any]]:
        """The questions that may prove before a motion that the power was kept.

        One that is `joining` others joins axes that jog.
        """
        if joining:
            return [STATUS]
        if self._commander.line.mode != HostMode.VER_2:
            return [MODE]
        coordinates = unit.coordinates_of(command)
        _, speeds = _ROWS[coordinates]
        return [speeds, PLACES]

    async def see_jogging(self, unit: UnitAxes, proof: Proof) -> None:
        """See that an axis of a unit jogs, which another is to join: MOD and UNT are refused meanwhile.

        A robot tells of the unit it acts on, and after a loss of power nothing jogs (C-HOST manual 2-10).

        :raises RobotBusy: none does.
        :raises NotSent: it did not tell.
        """
        reply = await self._ask(STATUS, unit.address, proof)
        axes = reply.axes if isinstance(reply, AxisStatuses) else []
        if not any(axis.motion_mode == MotionMode.JOG for axis in axes):
            raise RobotBusy(
                f"The JOG of {unit.address} is not over, but no axis was seen to jog; nothing was sent.",
                "Try again when all axes are known to stand still.",
            )

    async def _ask(self, query: FicsCommand[Any], asked: str, proof: Proof | None) -> Reply:
        """Ask what tells of a loss of power.

        :raises NotSent: there was no answer.
        :raises ControllerRefused: it was refused.
        """
        try:
            (reply,) = (await self._commander.ask(query, proof=proof)).replies
        except NoReply:
            raise NotSent(
                f"{asked} did not answer {query.wire_name()}, so nobody knows whether it has lost its power; "
                "nothing more was sent.",
                "Try again.",
            ) from None
        return reply

    def refuse(self) -> None:
        """Refuse what the loss forbids.

        :raises PowerCycled: always.
        """
        raise PowerCycled(f"{self.what_happened()}; nothing was sent.", ACKNOWLEDGE)

    def what_happened(self) -> str:
        """Its loss of power in words: certain, or likely."""
        has_been = "has been" if self._certain else "seems to have been"
        return f"Robot {self._commander.robot_id} {has_been} switched off and on"

    # origins

    def forget_origins(self) -> None:
        """Something of ours begins that may home the robot."""
        self.origins.forget()

    def _origins_lost(self) -> None:
        """In Ver.2 a loss of power shows in homed motors without places (C-HOST manual 4-4)."""
        if self._commander.line.mode == HostMode.VER_2:
            self.lost(certain=False)

    def witnesses_beside(self, unit: UnitAxes) -> list[UnitAxes]:
        """The units where a loss of power would show, where this one is not known to be homed.

        Those whose speeds alone would tell are asked only in doubt.
        """
        if self.origins.are_known(unit):
            return []
        homed = next(filter(self.origins.are_known, self._units), None)
        if homed is not None:
            return [homed]
        return [it for it in self._units if it is not unit and self._is_slower(it)] if self.in_doubt else []

    def _is_slower(self, unit: UnitAxes) -> bool:
        """Whether a loss of power would raise a speed of a unit."""
        return any(percent != FULL_SPEED for it in _ROWS for percent in self._known(unit, it).values())

    def knows_speeds(self, unit: UnitAxes) -> bool:
        """Whether the percentages of a unit are known: a loss of power may show in them."""
        return bool(self._known(unit, "user"))

    async def see_origins(self, unit: UnitAxes, proof: Proof | None = None) -> None:
        """See whether a unit is still homed. Call it with the sequence lock held and the unit selected.

        :raises NotSent: it did not tell.
        """
        for question in (PLACES, STATUS, PLACES):
            self.origins.note(unit, question, await self._ask(question, unit.address, proof))
            if not self.origins.are_doubtful(unit):
                return

    # speeds

    def note_speeds(self, unit: UnitAxes, query: FicsCommand[Any], found: SpeedPercents) -> None:
        """Keep the speed percentages that a unit has told first."""
        if unit.number in self._due:
            return
        coordinates = _coordinates(query)
        known = self._speeds_of(unit, coordinates)
        before = len(known)
        for axis, percent in zip(unit.names(coordinates), found.percents, strict=False):
            # What was set counts: a robot tells 100 % after a loss of power nobody has seen yet.
            known.setdefault(axis, percent)
        if len(known) > before:
            self.on_memory()

    def note_set(
        self, unit: UnitAxes, command: SetSpeedPercent | SetMotorSpeedPercent, outcome: Outcome
    ) -> None:
        """Keep the speed percentages that were set; forget those nobody can be sure of."""
        speeds = self._speeds_of(unit, _coordinates(command))
        for axis, percent in zip(unit.names(_coordinates(command)), command.percents, strict=False):
            if percent is None:
                continue
            if isinstance(outcome, RobotAnswered):
                speeds[axis] = percent
            elif isinstance(outcome, NoReply):
                speeds.pop(axis, None)
        self.on_memory()

    def _speeds_of(self, unit: UnitAxes, coordinates: Coordinates) -> Speeds:
        return self._speeds.setdefault(unit.number, {}).setdefault(coordinates, {})

    def restoring(self) -> list[FicsCommand[Any]]:
        """The commands that set the speeds again, and select the units they are set of."""
        commands: list[FicsCommand[Any]] = []
        for number in sorted(self._due):
            unit = unit_of(self._units, number)
            commands += [SelectUnit(unit=number), *filter(None, (self._setting(unit, it) for it in _ROWS))]
        return commands

    async def restore(self, select: Callable[[int], Awaitable[object]]) -> None:
        """Set the speeds again and see that they are, if power was lost; `select` makes sure of a unit.

        Call it with the sequence lock held.

        :raises PowerCycled: it was lost again.
        :raises GatewayError: they are not restored; nothing may move.
        """
        if not self._due:
            return
        await self.see()
        for number in sorted(self._due):
            unit = unit_of(self._units, number)
            await select(number)
            for coordinates in _ROWS:
                await self._set_again(unit, coordinates)
            self._due.discard(number)
        self._tell("robot.speeds.restored", self._speeds_told())
        self.on_memory()

    async def see_kept(self, command: FicsCommand[Any], unit: UnitAxes, proof: Proof) -> None:
        """See before a motion that the power was kept: by the mode, in Ver.2 by origins and speeds.

        What a loss would take away is looked at last. Call it with the sequence lock held and the unit
        selected.

        :raises PowerCycled: it was not.
        :raises NotSent: the robot did not tell.
        """
        if self._commander.line.mode != HostMode.VER_2:
            await self.see(proof)
            return
        coordinates = unit.coordinates_of(command)
        if self.origins.are_known(unit):
            await self._see_speeds(unit, coordinates, proof)
            await self.see_origins(unit, proof)
        else:
            await self.see_origins(unit, proof)
            await self._see_speeds(unit, coordinates, proof)
        if self.cycled:
            self.refuse()

    async def _see_speeds(self, unit: UnitAxes, coordinates: Coordinates, proof: Proof | None = None) -> bool:
        """Whether one below 100 %, which a loss of power would have raised, is as it was."""
        known = self._known(unit, coordinates)
        slower = any(percent != FULL_SPEED for percent in known.values())
        if not self.cycled and slower and await self._differ(unit, coordinates, known, proof):
            self.lost(certain=False)
        return slower and not self.cycled

    async def _set_again(self, unit: UnitAxes, coordinates: Coordinates) -> None:
        row = self._setting(unit, coordinates)
        if row is None:
            return
        await self._say(row, unit)
        if await self._differ(unit, coordinates, self._known(unit, coordinates)):
            raise self._not_restored(unit)

    def _setting(self, unit: UnitAxes, coordinates: Coordinates) -> FicsCommand[Any] | None:
        """The command that sets the known speeds of a unit; None where none is known."""
        known = self._known(unit, coordinates)
        setter, _ = _ROWS[coordinates]
        return setter(percents=[known.get(axis) for axis in unit.names(coordinates)]) if known else None

    async def _differ(
        self, unit: UnitAxes, coordinates: Coordinates, known: Speeds, proof: Proof | None = None
    ) -> bool:
        _, getter = _ROWS[coordinates]
        (reply,) = (await self._say(getter, unit, proof)).replies
        if not isinstance(reply, SpeedPercents):
            raise self._not_restored(unit)
        found = dict(zip(unit.names(coordinates), reply.percents, strict=False))
        return any(found.get(axis) != percent for axis, percent in known.items())

    async def _say(
        self, command: FicsCommand[Any], unit: UnitAxes, proof: Proof | None = None
    ) -> RobotAnswered:
        """Set the speeds of a unit, or ask for them.

        :raises SpeedsNotRestored: there was no answer.
        """
        try:
            return await self._commander.ask(command, proof=proof)
        except NoReply:
            raise self._not_restored(unit) from None

    def _known(self, unit: UnitAxes, coordinates: Coordinates) -> Speeds:
        """The known speeds of a unit's user or motor axes."""
        return dict(self._speeds.get(unit.number, {}).get(coordinates, {}))

    def _not_restored(self, unit: UnitAxes) -> SpeedsNotRestored:
        return SpeedsNotRestored(
            f"The speeds of {unit.address} are not certain after a loss of power; nothing was moved.",
            "Set them, then try again.",
        )

    def _speeds_told(self) -> dict[str, Any]:
        """The percentages that are set again, and the axes the gateway knows none of: those are at 100 %."""
        units = {str(unit.number): unit for unit in self._units}
        return {
            "speeds": {
                number: {it: known for it in _ROWS if (known := self._known(unit, it))}
                for number, unit in units.items()
            },
            "full_speed": {
                number: {
                    it: [axis for axis in unit.names(it) if axis not in self._known(unit, it)] for it in _ROWS
                }
                for number, unit in units.items()
            },
        }


def _coordinates(command: FicsCommand[Any]) -> Coordinates:
    motors = SetMotorSpeedPercent | GetMotorSpeedPercent | GetMotorPosition
    return "motor" if isinstance(command, motors) else "user"
