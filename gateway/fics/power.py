"""Power lost and back: seen by the mode or the origins, kept in mind, and the speeds set again."""

from typing import TYPE_CHECKING, Any, Final

from gateway.errors import NoReply, NotSent
from gateway.fics.errors import PowerCycled, RobotRefused, SpeedsNotRestored
from gateway.fics.exchange import Answered
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.motor_axes import GetMotorSpeedPercent, SetMotorSpeedPercent
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import GetSpeedPercent, SetSpeedPercent
from protocols.fics.status import AxisStatuses, GetAxisStatus, MotionMode
from protocols.fics.system import CommunicationMode, GetCommunicationMode, HostMode

if TYPE_CHECKING:
    from gateway.fics.exchange import Outcome
    from gateway.fics.robot import Robot
    from gateway.fics.units import Coordinates, RobotUnit

FULL_SPEED: Final = 100.0
"""What every speed percentage is after power-on (C-HOST manual 2-15, 4-5)."""

ACKNOWLEDGE = "See that its speeds are right, acknowledge the power cycle, then home it."

Setter = type[SetSpeedPercent] | type[SetMotorSpeedPercent]
Getter = type[GetSpeedPercent] | type[GetMotorSpeedPercent]
_ROWS: Final[dict["Coordinates", tuple[Setter, Getter]]] = {
    "user": (SetSpeedPercent, GetSpeedPercent),
    "motor": (SetMotorSpeedPercent, GetMotorSpeedPercent),
}

Speeds = dict[str, float]
"""Percent by axis. One that is user and motor axis has one percentage: an assumption (C-HOST manual 4)."""


class Power:
    """What a loss of power takes from a robot: its mode, its unit, its homing, its speed percentages."""

    def __init__(self, robot: "Robot") -> None:
        self._robot = robot
        self.cycled = False
        """Whether the robot has lost its power, and nobody has acknowledged that yet."""
        self._speeds: dict[int, Speeds] = {}
        """By unit, as last set, or as read before; an axis nobody spoke of is missing."""
        self._due: set[int] = set()
        """The units whose speeds have to be set again before any move."""
        self._certain = True
        """Whether the loss that nobody has acknowledged is certain."""
        self._homed: dict[int, set[int]] = {}
        """By unit, the places of the motors that had their origins when they were last looked at."""

    def lost(self, *, certain: bool) -> None:
        """It has been switched off and on, or seems to: keep it from moving until somebody knows."""
        self._due = set(self._speeds)
        self._homed.clear()  # the origins of all units are gone, and that is told once
        if not self.cycled:
            self.cycled, self._certain = True, certain
            self._robot.errors_of_system.latched = None
            self._robot.publish("robot.power_cycled", {"certain": certain, **self._speeds_told()})

    def acknowledge(self) -> None:
        """Let the robot move again."""
        if self.cycled:
            self.cycled = False
            self._robot.publish("robot.power_cycle.acknowledged", {})

    def require_known(self, what: str) -> None:
        """Refuse motion until somebody knows of the loss.

        :raises PowerCycled: nobody has acknowledged it.
        """
        if self.cycled:
            raise PowerCycled(
                f"{self._what_happened()}: nothing is homed then, and speeds the gateway does not know are "
                f"100 % again; {what} was not sent.",
                ACKNOWLEDGE,
            )

    async def see(self) -> None:
        """See that the robot has not been switched off: then it is in Ver.2; call it with the floor held.

        Where that is its own mode only `verify` can tell.

        :raises PowerCycled: it has.
        :raises NotSent: it did not tell.
        """
        robot = self._robot
        if robot.mode == HostMode.VER_2:
            return
        unanswered = NotSent(
            f"Robot {robot.id} did not answer MOD, so nobody knows whether it has lost its power; "
            "nothing more was sent.",
            "Try again.",
        )
        try:
            reply = await robot.dialogue.prepare(GetCommunicationMode(), unanswered)
        except RobotRefused:
            return  # only Ver.3 refuses
        if isinstance(reply, CommunicationMode) and reply.mode != robot.mode:
            robot.line.power_was_lost(f"the robot is in mode {reply.mode}")
            self._refuse()

    def _refuse(self) -> None:
        raise PowerCycled(f"{self._what_happened()}; nothing was sent.", ACKNOWLEDGE)

    def _what_happened(self) -> str:
        has_been = "has been" if self._certain else "seems to have been"
        return f"Robot {self._robot.id} {has_been} switched off and on"

    # origins

    def _note_origins(self, unit: "RobotUnit", found: AxisStatuses) -> None:
        """In Ver.2 a loss of power shows in origins that are gone, though nothing has homed the robot.

        Homing begins with that, and macros may home, whoever runs them.
        """
        before = self._homed.pop(unit.number, set())
        if any(it.motion_mode in (MotionMode.HOMING, MotionMode.MACRO) for it in found.axes):
            return
        self._homed[unit.number] = {place for place, axis in enumerate(found.axes) if axis.origin_done}
        if self._robot.mode == HostMode.VER_2 and before - self._homed[unit.number]:
            self.lost(certain=False)

    def forget_origins(self) -> None:
        """Something of ours begins that may home the robot."""
        self._homed.clear()

    async def _look_at_origins(self, unit: "RobotUnit") -> None:
        unanswered = NotSent(
            f"{unit.address} did not answer ACD, so nobody knows whether it has lost its power; nothing more "
            "was sent.",
            "Try again.",
        )
        reply = await self._robot.dialogue.prepare(GetAxisStatus(), unanswered)
        if isinstance(reply, AxisStatuses):
            self._note_origins(unit, reply)

    # speeds

    def note(self, unit: "RobotUnit", command: FicsCommand[Any], outcome: "Outcome") -> None:
        """Keep the speed percentages that were set, or read first; forget those nobody can be sure of.

        What was read of origins is kept, too.
        """
        if isinstance(command, SetSpeedPercent | SetMotorSpeedPercent):
            self._note_set(unit, command, outcome)
        for reply in outcome.replies if isinstance(outcome, Answered) else ():
            if isinstance(reply, AxisStatuses):
                self._note_origins(unit, reply)
            elif isinstance(reply, SpeedPercents) and unit.number not in self._due:
                self._note_read(unit, _coordinates(command), reply)

    def _note_read(self, unit: "RobotUnit", coordinates: "Coordinates", found: SpeedPercents) -> None:
        known = self._speeds.setdefault(unit.number, {})
        for axis, percent in zip(unit.names(coordinates), found.percents, strict=False):
            # What was set counts: a robot tells 100 % after a loss of power nobody has seen yet.
            known.setdefault(axis, percent)

    def _note_set(
        self, unit: "RobotUnit", command: SetSpeedPercent | SetMotorSpeedPercent, outcome: "Outcome"
    ) -> None:
        speeds = self._speeds.setdefault(unit.number, {})
        for axis, percent in zip(unit.names(_coordinates(command)), command.percents, strict=False):
            if percent is None:
                continue
            if isinstance(outcome, Answered):
                speeds[axis] = percent
            elif isinstance(outcome, NoReply):
                speeds.pop(axis, None)

    async def restore(self) -> None:
        """Set the speeds again and see that they are, if power was lost; call it with the floor held.

        :raises GatewayError: they are not restored; nothing may move.
        """
        if not self._due:
            return
        for number in sorted(self._due):
            unit = self._robot.unit(number)
            await self._robot.selection.make(number, afresh=True)
            for coordinates in _ROWS:
                await self._set_again(unit, coordinates)
            self._due.discard(number)
        self._robot.publish("robot.speeds.restored", self._speeds_told())

    async def verify(self, unit: "RobotUnit", coordinates: "Coordinates") -> None:
        """In Ver.2, where the mode tells of no loss of power: see that origins and speeds are as they were.

        Call it with the floor held and the unit selected.

        :raises PowerCycled: they are those of power-on.
        :raises NotSent: it did not tell.
        """
        if self._robot.mode != HostMode.VER_2:
            return
        await self._look_at_origins(unit)
        known = self._known(unit, coordinates)
        slower = any(percent != FULL_SPEED for percent in known.values())
        if not self.cycled and slower and await self._differ(unit, coordinates, known):
            self.lost(certain=False)
        if self.cycled:
            self._refuse()

    async def _set_again(self, unit: "RobotUnit", coordinates: "Coordinates") -> None:
        known = self._known(unit, coordinates)
        if not known:
            return
        setter, _ = _ROWS[coordinates]
        row = setter(percents=[known.get(axis) for axis in unit.names(coordinates)])
        await self._robot.dialogue.prepare(row, self._not_restored(unit))
        if await self._differ(unit, coordinates, known):
            raise self._not_restored(unit)

    async def _differ(self, unit: "RobotUnit", coordinates: "Coordinates", known: Speeds) -> bool:
        _, getter = _ROWS[coordinates]
        reply = await self._robot.dialogue.prepare(getter(), self._not_restored(unit))
        if not isinstance(reply, SpeedPercents):
            raise self._not_restored(unit)
        found = dict(zip(unit.names(coordinates), reply.percents, strict=False))
        return any(found.get(axis) != percent for axis, percent in known.items())

    def _known(self, unit: "RobotUnit", coordinates: "Coordinates") -> Speeds:
        """The known speeds of a unit's user or motor axes."""
        speeds = self._speeds.get(unit.number, {})
        return {axis: speeds[axis] for axis in unit.names(coordinates) if axis in speeds}

    def _not_restored(self, unit: "RobotUnit") -> SpeedsNotRestored:
        return SpeedsNotRestored(
            f"The speeds of {unit.address} are not certain after a loss of power; nothing was moved.",
            "Set them, then try again.",
        )

    def _speeds_told(self) -> dict[str, Any]:
        """The percentages that are set again, and the axes the gateway knows none of: those are at 100 %."""
        told = [(unit, self._speeds.get(unit.number, {})) for unit in self._robot.units]
        return {
            "speeds": {str(unit.number): speeds for unit, speeds in told if speeds},
            "full_speed": {
                str(unit.number): [axis for axis in unit.systems if axis not in speeds]
                for unit, speeds in told
            },
        }


def _coordinates(command: FicsCommand[Any]) -> "Coordinates":
    return "motor" if isinstance(command, SetMotorSpeedPercent | GetMotorSpeedPercent) else "user"
