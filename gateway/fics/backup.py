"""Backups of a robot: its variables, settings and positions as text, and compared with a text."""

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

from pydantic import ValidationError

from gateway.core.backup_record import Difference
from gateway.core.backups import BackupLine, BackupPart, commented, parts_of, refuse, section
from gateway.core.errors import Misplaced
from gateway.core.readings import ProgressListener
from gateway.fics import settings
from gateway.fics.agreement import same_number
from gateway.fics.axes import DISPLAYED
from gateway.fics.errors import RobotBusy
from gateway.fics.settings import SETTINGS, SMOOTH, SettingsChange
from gateway.fics.units import AskedRobot, RobotUnit
from protocols.fics.notation import Quantity
from protocols.fics.positions import LAST_POSITION, UploadPosition
from protocols.fics.variables import LAST_VARIABLE, GetVariable, SetVariable
from protocols.wording import plain_number, sentence

KIND = "robot"
VARIABLES = "variables"
Kind = Literal["variables", "settings", "positions"]
"""The kinds of sections; each unit has its own of settings and of positions."""
PREAMBLE = (
    "; Backup of motion controllers. Restore it by `motion-gateway restore TARGET FILE`.\n"
    "; Positions that a section does not name are not set, and variables are 0.\n"
    "; A setting or a section that is taken out is left as it is by a restore.\n"
)
GAP = 16
"""The search for positions ends after this number of positions that are not set; the text says where."""
ON: Final = {"on": True, "off": False}

_PAIR = re.compile(r"([A-Z@])=([+-]?[0-9]+(?:\.[0-9]+)?)")
_VARIABLE = re.compile("V([0-9]{2})")

Values = Mapping[str, float]
"""A value for each axis."""
OnRead = Callable[[], None]


@dataclass
class UnitContents:
    """The contents of a unit, or of its part of a backup; None where a section is missing."""

    settings: dict[str, Values | bool] | None = None
    positions: dict[int, Values] | None = None


@dataclass
class RobotContents:
    """The contents of a robot, or of a backup."""

    variables: dict[int, float] | None = None
    units: dict[int, UnitContents] = field(default_factory=dict)

    def without(self, kinds: Collection[str]) -> "RobotContents":
        """Leave out kinds of sections, which a restore leaves as they are."""
        emptied = dict.fromkeys({"settings", "positions"} & {*kinds})
        units = {number: replace(unit, **emptied) for number, unit in self.units.items()}
        return RobotContents(None if VARIABLES in kinds else self.variables, units)


def whole(robot: AskedRobot) -> RobotContents:
    """Every section that a robot has."""
    return RobotContents({}, {unit.number: UnitContents({}, {}) for unit in robot.units})


# from a robot


async def read(robot: AskedRobot, wanted: RobotContents, on_read: OnRead = lambda: None) -> RobotContents:
    """Read the sections that are wanted.

    :raises GatewayError: something was not read.
    """
    found = RobotContents()
    if wanted.variables is not None:
        found.variables = {}
        for number in range(LAST_VARIABLE + 1):
            if value := (await robot.read(GetVariable(number=number))).value:
                found.variables[number] = value
            on_read()
    for number, sections in wanted.units.items():
        unit, held = robot.unit(number), UnitContents()
        if sections.settings is not None:
            held.settings = await _settings(unit, on_read)
        if sections.positions is not None:
            held.positions = await _positions(unit, on_read, sections.positions)
        found.units[number] = held
    return found


async def _settings(unit: RobotUnit, on_read: OnRead) -> dict[str, Values | bool]:
    found: dict[str, Values | bool] = {}
    for name in (SMOOTH, *SETTINGS):
        value = getattr(await settings.read(unit, [name]), name)
        on_read()
        found[name] = (
            value if isinstance(value, bool) else {axis: _bare(amount) for axis, amount in value.items()}
        )
    return found


def _bare(value: Any) -> float:
    return float(getattr(value, "value", value))


async def _positions(unit: RobotUnit, on_read: OnRead, wanted: Iterable[int] = ()) -> dict[int, Values]:
    """Read the table, until `GAP` numbers behind those that are set or wanted are not set.

    A robot ends its list at a number that is not set, and there may be more behind it.
    """
    found: dict[int, Values] = {}
    first, last = 1, max(wanted, default=0)
    while first <= min(last + GAP, LAST_POSITION):
        for number, coordinates in await unit.positions(first, LAST_POSITION):
            found[number] = _by_axis(unit, coordinates)
            first, last = number + 1, max(number, last)
            on_read()
        first += 1
        on_read()
    return found


def _by_axis(unit: RobotUnit, coordinates: Sequence[float | None]) -> Values:
    named = zip(unit.axes, coordinates, strict=False)
    return {axis: value for axis, value in named if value is not None}


# as text


@dataclass(frozen=True)
class RobotSource:
    """A robot that a backup is read from."""

    robot: AskedRobot
    require_free: Callable[[], None]
    """Raises where a backup is being restored to it."""

    @property
    def address(self) -> str:
        """The robot's id."""
        return self.robot.id

    @property
    def baud(self) -> int | None:
        """The speed of its line; None where its port does not tell."""
        return self.robot.line.baud

    async def require_ready(self) -> None:
        """Make sure that it answers and is not being restored; errors as of `text_of`."""
        self.require_free()
        await self.robot.read(GetVariable(number=0))

    async def read(self, progress: ProgressListener) -> str:
        """Read what it tells of what it keeps; errors as of `text_of`."""
        self.require_free()
        progress.expect(None)
        return await text_of(self.robot, progress.has_read)


async def text_of(robot: AskedRobot, on_read: OnRead = lambda: None) -> str:
    """Read a robot and write what it keeps.

    :raises RobotBusy: it has lost its power meanwhile, so that not all was read of one state.
    :raises GatewayError: it was not read.
    """
    losses = robot.known.power.losses
    contents = await read(robot, whole(robot), on_read)
    if robot.known.power.losses != losses:
        raise RobotBusy(f"{robot.id} has lost its power while it was read.", "Read the backup again.")
    named = f" ({robot.name})" if robot.name else ""
    parts = [f"\n; /robots/{robot.id}{named}\n[{KIND} {robot.id}]\n"]
    parts.append(
        section(VARIABLES, (f"V{number:02d} {_number(value)}\n" for number, value in _of(contents.variables)))
    )
    for number, held in contents.units.items():
        unit = robot.unit(number)
        parts.append(section(f"unit {number} settings", _setting_lines(unit, held.settings or {})))
        parts.append(section(f"unit {number} positions", _position_lines(unit, held.positions or {})))
    return "".join(parts)


def _of(variables: Mapping[int, float] | None) -> Iterable[tuple[int, float]]:
    return (variables or {}).items()


def _setting_lines(unit: RobotUnit, held: Mapping[str, Values | bool]) -> Iterator[str]:
    for name, value in held.items():
        yield commented(f"{name} {_written(value)}", _unit_of(unit, name, value))


def _unit_of(unit: RobotUnit, name: str, value: Values | bool) -> str:
    if isinstance(value, bool):
        return "S-curve; on or off"
    quantity = SETTINGS[name].quantity
    if quantity is not None:
        return ", ".join(dict.fromkeys(unit.systems[axis].unit(quantity) for axis in value))
    return next((words for part, words in _UNITS.items() if part in name), "type of homing")


_UNITS: Final = {"percent": "%", "_ms": "ms", "_pps": "pps"}


def _position_lines(unit: RobotUnit, held: Mapping[int, Values]) -> Iterator[str]:
    units = ", ".join(dict.fromkeys(unit.systems[axis].unit(Quantity.POSITION) for axis in unit.axes))
    yield f"; Positions were looked for up to number {min(max(held, default=0) + GAP, LAST_POSITION)}.\n"
    for number, values in held.items():
        yield commented(f"{number} {_written(values)}", units)


def _written(value: Values | bool) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return " ".join(f"{axis}={_number(amount)}" for axis, amount in value.items())


def _number(value: float) -> str:
    return plain_number(value, 9)


# from a text


def parse(robot: AskedRobot, text: str) -> RobotContents:
    """Read what a backup has of a robot.

    :raises InvalidText: it has faults, each with its line and column.
    """
    parts = parts_of(text, KIND)
    part = next((part for part in parts if part.name == robot.id), None)
    if part is None:
        names = ", ".join(part.name for part in parts)
        refuse([Misplaced(parts[0].line, 1, f"The backup has nothing of robot {robot.id}, but of {names}.")])
    return _Parsing(robot).contents(part or parts[0])


@dataclass
class _Parsing:
    robot: AskedRobot
    faults: list[Misplaced] = field(default_factory=list)

    def contents(self, part: BackupPart) -> RobotContents:
        found = RobotContents()
        for name, lines in part.sections.items():
            unit = self._unit(name)
            if name == VARIABLES:
                found.variables = dict(self._each(lines, _variable))
                found.variables = {number: value for number, value in found.variables.items() if value}
            elif unit is None:
                self.faults.append(Misplaced(part.headings[name], 1, f"There is no section [{name}]."))
            elif name.endswith("settings"):
                held = found.units.setdefault(unit.number, UnitContents())
                held.settings = dict(self._each(lines, lambda *words, of=unit: _setting(of, *words)))
            else:
                held = found.units.setdefault(unit.number, UnitContents())
                held.positions = dict(self._each(lines, lambda *words, of=unit: _position(of, *words)))
        refuse(sorted(self.faults))
        return found

    def _unit(self, name: str) -> RobotUnit | None:
        names = {
            f"unit {unit.number} {section}": unit
            for unit in self.robot.units
            for section in ("settings", "positions")
        }
        return names.get(name)

    def _each(
        self, lines: Iterable[BackupLine], read: Callable[[str, str], tuple[Any, Any]]
    ) -> Iterator[Any]:
        """Read what the lines say; what comes twice is a fault."""
        seen = set()
        for line in lines:
            words = line.text.partition(";")[0].split(maxsplit=1)
            if not words:
                continue
            try:
                key, value = read(words[0], words[1] if len(words) > 1 else "")
            except ValueError as fault:
                self.faults.append(Misplaced(line.number, 1, str(fault)))
                continue
            if key in seen:
                self.faults.append(Misplaced(line.number, 1, f"{words[0]} comes twice."))
            seen.add(key)
            yield key, value


def _variable(name: str, value: str) -> tuple[int, float]:
    match = _VARIABLE.fullmatch(name)
    if match is None:
        raise ValueError(f"{name} is no variable: they are V00 to V{LAST_VARIABLE}.")
    command = _valid(name, lambda: SetVariable(number=int(match[1]), value=_float(value)))
    return command.number, command.value


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{text!r} is no number.") from None


def _setting(unit: RobotUnit, name: str, text: str) -> tuple[str, Values | bool]:
    if name == SMOOTH:
        if text.strip() not in ON:
            raise ValueError(f"{name} is on or off.")
        return name, ON[text.strip()]
    if name not in SETTINGS:
        raise ValueError(f"There is no setting {name}.")
    values = _pairs(unit.names(SETTINGS[name].coordinates), text)
    _valid(name, lambda: change_of(unit, {name: values}))
    return name, values


def _position(unit: RobotUnit, number: str, text: str) -> tuple[int, Values]:
    if not number.isdecimal() or not 1 <= int(number) <= LAST_POSITION:
        raise ValueError(f"{number} is no position: they go from 1 to {LAST_POSITION}.")
    values = _pairs(unit.axes, text)
    _valid(number, lambda: UploadPosition(coordinates=in_a_row(unit, values)))
    return int(number), values


def _pairs(axes: Sequence[str], text: str) -> Values:
    found: dict[str, float] = {}
    for word in text.split():
        match = _PAIR.fullmatch(word)
        if match is None or match[1] not in axes or match[1] in found:
            raise ValueError(f"{word}: values stand behind their axes, each once: {'=1 '.join(axes)}=1.")
        found[match[1]] = float(match[2])
    if not found:
        raise ValueError(f"Values have to follow: {'=1 '.join(axes)}=1.")
    return found


def _valid(name: str, build: Callable[[], Any]) -> Any:
    """Build something.

    :raises ValueError: a value is not possible.
    """
    try:
        return build()
    except ValidationError as error:
        raise ValueError(f"{name}: {sentence(error.errors()[0])}.") from None


# for a robot


def in_a_row(unit: RobotUnit, values: Values) -> list[float | None]:
    """Coordinates in the order of the axes, up to the last that has one."""
    last = max(unit.axes.index(axis) for axis in values)
    return [values.get(axis) for axis in unit.axes[: last + 1]]


def change_of(unit: RobotUnit, wanted: Mapping[str, Values | bool]) -> SettingsChange:
    """Settings as a request would have them.

    :raises ValidationError: a value is not possible.
    """
    return SettingsChange.model_validate(
        {name: _request(unit, name, value) for name, value in wanted.items()}
    )


def _request(unit: RobotUnit, name: str, value: Values | bool) -> object:
    if isinstance(value, bool):
        return value
    quantity = SETTINGS[name].quantity
    if quantity is not None:
        return {
            axis: {"value": amount, "unit": unit.systems[axis].unit(quantity)}
            for axis, amount in value.items()
        }
    return {axis: int(amount) if amount.is_integer() else amount for axis, amount in value.items()}


# compared


def differences(robot: AskedRobot, wanted: RobotContents, held: RobotContents) -> list[Difference]:
    """Compare a robot with a backup."""
    return list(_differences(robot, wanted, held))


def _differences(robot: AskedRobot, wanted: RobotContents, held: RobotContents) -> Iterator[Difference]:
    for number in differing_variables(wanted, held):
        told = [_number(_of_variable(contents, number)) for contents in (wanted, held)]
        yield _difference(robot, VARIABLES, f"V{number:02d}", *told)
    for number, sections in wanted.units.items():
        both = sections, held.units[number]
        for name in differing_settings(*both):
            yield _difference(robot, f"unit {number} settings", name, *_told(both, "settings", name))
        for position in differing_positions(*both):
            yield _difference(
                robot, f"unit {number} positions", f"position {position}", *_told(both, "positions", position)
            )


def _told(both: Iterable[UnitContents], section: str, key: object) -> list[str | None]:
    """The values of a section in a backup and in the robot."""
    found = [(getattr(unit, section) or {}).get(key) for unit in both]
    return [None if value is None else _written(value) for value in found]


def _difference(robot: AskedRobot, where: str, name: str, wanted: str | None, held: str | None) -> Difference:
    return Difference(target=robot.id, section=where, name=name, wanted=wanted, held=held, restorable=True)


def _of_variable(contents: RobotContents, number: int) -> float:
    return (contents.variables or {}).get(number, 0.0)


def differing_variables(wanted: RobotContents, held: RobotContents) -> list[int]:
    """The variables that are not as in the backup."""
    if wanted.variables is None:
        return []
    numbers = sorted({*wanted.variables, *(held.variables or {})})
    return [
        number
        for number in numbers
        if not same_number(_of_variable(wanted, number), _of_variable(held, number))
    ]


def differing_settings(wanted: UnitContents, held: UnitContents) -> list[str]:
    """The settings of a unit that are not as in the backup, as a robot displays them."""
    found = held.settings or {}
    return [
        name for name, value in (wanted.settings or {}).items() if not _same(name, value, found.get(name))
    ]


def _same(name: str, wanted: Values | bool, held: Values | bool | None) -> bool:
    if isinstance(wanted, bool) or isinstance(held, bool) or held is None:
        return wanted == held
    step = DISPLAYED if SETTINGS[name].quantity is not None else 0.0
    return all(axis in held and same_number(value, held[axis], step) for axis, value in wanted.items())


def differing_positions(wanted: UnitContents, held: UnitContents) -> list[int]:
    """The positions of a unit that are not as in the backup, as a robot displays them."""
    if wanted.positions is None:
        return []
    found = held.positions or {}
    numbers = sorted({*wanted.positions, *found})
    return [number for number in numbers if not _same_place(wanted.positions.get(number), found.get(number))]


def _same_place(wanted: Values | None, held: Values | None) -> bool:
    if wanted is None or held is None:
        return wanted is held
    return wanted.keys() == held.keys() and all(
        same_number(value, held[axis], DISPLAYED) for axis, value in wanted.items()
    )
