"""A robot that is brought back to what a backup has of it."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from gateway.core.errors import GatewayError, InvalidRequest, NoReply, PowerCycled
from gateway.core.exchange import Lane
from gateway.core.origin import Origin, current
from gateway.core.restores import Comparison, ComparisonListener, Watcher
from gateway.fics import backup, settings
from gateway.fics.axes import at_rest
from gateway.fics.backup import RobotContents, UnitContents
from gateway.fics.conversation import deadline_of
from gateway.fics.errors import NotDone, RobotBusy, RobotPositionsDiffer
from gateway.fics.exchange import FicsExchange
from gateway.fics.robot import Robot
from gateway.fics.settings import SETTINGS, SettingsChange
from gateway.fics.tables import UPLOAD, runs_of
from gateway.fics.units import RobotUnit
from protocols.fics.positions import BeginPositionUpload, ClearPositions, EndPositionUpload
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSmoothAcceleration
from protocols.fics.system import HostMode, SelectUnit
from protocols.fics.variables import SetVariable
from protocols.table import Effect

ATTEMPTS = 3
"""The most attempts at a step that is not known to be done."""
NO_FLASH = "C-HOST has no command that writes flash memory; nothing was sent."
READINGS = 3
"""The most readings of a robot that loses its power meanwhile."""


@dataclass(eq=False)
class RobotRestore:
    """One robot, and what it is to hold."""

    robot: Robot
    wanted: RobotContents
    held: RobotContents = field(default_factory=RobotContents)
    """The contents at the last comparison."""
    origin: Origin = field(default_factory=current)
    """The request that asked for it: what it sends passes."""
    epoch: int = field(init=False)
    """The stop epoch of the robot at the beginning: a stop ends the restore."""

    def __post_init__(self) -> None:
        self.epoch = self.robot.line.stop_epoch

    @property
    def address(self) -> str:
        """The robot's id."""
        return self.robot.id

    @property
    def baud(self) -> int | None:
        """The speed of its line; None where its port does not tell."""
        return self.robot.line.baud

    @property
    def scale(self) -> None:
        """A robot counts in its own units, which are those of its backup."""

    @property
    def answers(self) -> None:
        """A robot ends its answer where nothing more is set."""

    def lets_pass(self, exchange: FicsExchange) -> bool:
        """True if something that changes or moves the robot may go: only what belongs to the restore."""
        return exchange.origin == self.origin

    async def require_rest(self) -> None:
        """Make sure that the robot stands still.

        :raises RobotBusy: it moves, or a stop is not confirmed.
        :raises GatewayError: it did not tell.
        """
        self.robot.line.require_fit()
        self.robot.known.motion.require_still(UPLOAD)
        for unit in self.robot.units:
            if not at_rest((await unit.status()).values()):
                raise RobotBusy(f"{unit.address} moves; nothing was changed.", "Wait for standstill.")
        self._require_no_stop()

    # compared

    async def compare(
        self, reader: ComparisonListener, *, lasting: bool = False, sure: bool = True
    ) -> Comparison:
        """Read what the backup has. In Ver.3 the mode proves that the power was kept meanwhile.

        :raises InvalidRequest: what is kept without power is wanted, which C-HOST does not tell.
        :raises GatewayError: it was not read, or it loses its power again and again.
        """
        if lasting:
            raise InvalidRequest(NO_FLASH)
        for _ in range(READINGS):
            losses = self.robot.known.power.losses
            self.held = await backup.read(self.robot, self.wanted, reader.has_read)
            if sure:
                await self._confirm(reader)
            if await self._has_kept_power() and self.robot.known.power.losses == losses:
                break
        else:
            raise RobotBusy(f"{self.address} loses its power again and again.", "See to its power supply.")
        differences = backup.differences(self.robot, self.wanted, self.held)
        proved = self.robot.mode == HostMode.VER_3
        return Comparison(await self._frames(), differences, proved)

    async def _confirm(self, reader: ComparisonListener) -> None:
        """Read until two readings agree where something differs: one garbled digit proves nothing."""
        before = None
        while self.held != before and backup.differences(self.robot, self.wanted, self.held):
            before, self.held = self.held, await backup.read(self.robot, self.wanted, reader.has_read)

    async def _has_kept_power(self) -> bool:
        async with self.robot.line.sequence_lock.held(Lane.COMMAND, deadline_of(Lane.COMMAND)):
            try:
                await self.robot.conversation.prepare([self.robot.known.power.mode_kept()])
            except PowerCycled:
                return False
        return True

    async def _frames(self) -> list[str]:
        """The exact commands that make the robot hold the backup; a unit is selected before its own."""
        commands: list[FicsCommand[Any]] = [*self._variables()]
        for unit in self._units():
            own: list[FicsCommand[Any]] = []
            if (change := self._settings(unit)) is not None:
                own += await settings.commands(unit, change)
            own += self._clears(unit)
            for first, positions in runs_of(self._positions(unit)):
                own += [BeginPositionUpload(first=first), *positions, EndPositionUpload()]
            several = len(self.robot.units) > 1
            commands += [SelectUnit(unit=unit.number), *own] if own and several else own
        return [command.text for command in commands]

    def _units(self) -> list[RobotUnit]:
        return [self.robot.unit(number) for number in self.wanted.units]

    def _variables(self) -> list[SetVariable]:
        wanted = self.wanted.variables or {}
        numbers = backup.differing_variables(self.wanted, self.held)
        return [SetVariable(number=number, value=wanted.get(number, 0.0)) for number in numbers]

    def _settings(self, unit: RobotUnit) -> SettingsChange | None:
        """The settings to be changed; None where all agree."""
        wanted, held = self._sections(unit)
        names = backup.differing_settings(wanted, held)
        return (
            backup.change_of(unit, {name: (wanted.settings or {})[name] for name in names}) if names else None
        )

    def _clears(self, unit: RobotUnit) -> list[ClearPositions]:
        wanted, held = self._sections(unit)
        numbers = backup.differing_positions(wanted, held)
        gone = [number for number in numbers if number not in (wanted.positions or {})]
        return [ClearPositions(first=number, count=1) for number in gone]

    def _positions(self, unit: RobotUnit) -> list[tuple[int, list[float | None]]]:
        wanted, held = self._sections(unit)
        table = wanted.positions or {}
        numbers = backup.differing_positions(wanted, held)
        return [(number, backup.in_a_row(unit, table[number])) for number in numbers if number in table]

    def _sections(self, unit: RobotUnit) -> tuple[UnitContents, UnitContents]:
        return self.wanted.units[unit.number], self.held.units[unit.number]

    # written

    async def write(self, watcher: Watcher) -> None:
        """Write what differs; each part is read back before the next.

        :raises GatewayError: it was ended, or a step is not known to be taken.
        """
        for variable in self._variables():
            await self._done(watcher, 1, partial(self.robot.change, variable))
        for unit in self._units():
            if (change := self._settings(unit)) is not None:
                commands = len(await settings.commands(unit, change))
                await self._done(watcher, commands, partial(settings.change, unit, change))
            for clear in self._clears(unit):
                await self._done(watcher, 1, partial(self.robot.ask_all, clear, unit.number))
            if positions := self._positions(unit):
                commands = sum(len(run) + 2 for _, run in runs_of(positions))
                store = partial(self.robot.upload_positions, positions, unit.number)
                await self._done(watcher, commands, store)

    async def _done(self, watcher: Watcher, commands: int, work: Callable[[], Awaitable[object]]) -> None:
        """Do a step that does no harm when it is done twice; repeat it where its outcome is not known."""
        for attempt in range(1, ATTEMPTS + 1):
            watcher.require_wanted()
            self._require_no_stop()
            try:
                await work()
            except (NoReply, NotDone, RobotPositionsDiffer):
                if attempt == ATTEMPTS:
                    raise
            else:
                break
        for _ in range(commands):
            watcher.has_written()

    def _require_no_stop(self) -> None:
        if self.robot.line.stop_epoch != self.epoch:
            raise self.robot.line.overtaken()

    # kept without power

    async def save(self, _: Watcher) -> None:
        """Refuse: C-HOST has no command for it.

        :raises InvalidRequest: always.
        """
        raise InvalidRequest(NO_FLASH)

    async def power_cycled(self, _: Watcher) -> None:
        """Refuse: what is kept without power is not stated.

        :raises InvalidRequest: always.
        """
        raise InvalidRequest(NO_FLASH)


RESTORED: Final[tuple[type[FicsCommand[Any]], ...]] = (
    *(SetSmoothAcceleration, BeginPositionUpload, ClearPositions, SetVariable),
    *(setting.write for setting in SETTINGS.values()),
)
"""The commands that change something that a backup has."""


def motion_without_proof(exchange: FicsExchange, _: float) -> GatewayError | None:
    """Refuse a motion without a proof: it is no move, and no run would follow it."""
    if exchange.command.effect is not Effect.MOTION or exchange.needs is not None:
        return None
    name = exchange.command.wire_name()
    return InvalidRequest(
        f"{name} starts a move, and has no record of it; nothing was sent.", "Start a move."
    )


def amid_a_restore(
    restored: Callable[[], RobotRestore | None],
) -> Callable[[FicsExchange, float], GatewayError | None]:
    """Make the guard by which nothing else moves or changes a robot that is being `restored`."""

    def guard(exchange: FicsExchange, _: float) -> GatewayError | None:
        command = exchange.command
        if command.effect is not Effect.MOTION and not isinstance(command, RESTORED):
            return None
        restore = restored()
        if restore is None or restore.lets_pass(exchange):
            return None
        return RobotBusy(
            f"A backup is being restored to the robot; {command.wire_name()} was not sent.",
            "Wait for its end or cancel it.",
        )

    return guard
