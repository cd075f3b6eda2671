"""The places of a body's memory: the command that sets each, and the question that tells it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Literal

from pydantic import ValidationError

from gateway.rorze.memories import LAST_PLACES, signed
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.notation import BILLION, Interval, PositionReference
from protocols.rorze.patterns import SetPattern, SetSpeedChange
from protocols.rorze.position_table import GetNumberedPositionEntry, SetPositionEntry
from protocols.rorze.programs import GetProgramMemory, SetProgramMemory
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply

Command = RorzeCommand[Any]
Section = Literal["settings", "speed-sets", "patterns", "positions", "memories", "program"]

SECTIONS: Final[tuple[Section, ...]] = (
    "settings",
    "speed-sets",
    "patterns",
    "positions",
    "memories",
    "program",
)
LAST_POSITION = 2047
BITS = 1 << 32

_READ_BY: Final[Mapping[str, Row]] = {SetPositionEntry.code: GetNumberedPositionEntry}
"""The answer of 3ND repeats the number, so that none can be mistaken for another."""
_UNITS: Final[Mapping[str, str]] = {
    **dict.fromkeys(("OLS", "OHS", "PLS"), "pps"),
    **dict.fromkeys(("0SS", "PES", "PKS", "QIS", "HZS"), "pulses"),
    **dict.fromkeys(("OAS", "OBS"), "%"),
    **dict.fromkeys(("HAS", "HFS"), "um"),
    "OSS": "pps/s",
    "CCS": "ms",
    "PTS": "10 ms",
}
_WORDS: Final[Mapping[str, str]] = {
    "CES": "output that reports an error, and its state then",
    "CFS": "what an interrupt does",
    "COS": "states of the general outputs",
    "CPS": "edge that sets off an interrupt",
    "DCS": "equal samples, one each ms, that make a change of an input",
    "DIS": "logic of the general inputs",
    "DLS": "logic of the sensor inputs and of the CLR output",
    "SES": "change of speed: where it begins in pulses, and the speed then in pps",
    "SPS": "speed sets of a pattern",
    "UDS": "memory of the user program",
}


@dataclass(frozen=True)
class BackupPlace:
    """A place of a body that holds a value."""

    row: Row
    """The command that sets it."""
    at: Mapping[str, object]
    """Fields of the command that select the place among its kind."""

    @property
    def question(self) -> Command:
        """The question that reads it."""
        return _question_of(self.row, self.at)

    @property
    def key(self) -> str:
        """The key that tells it from all others."""
        return _key_of(self.row, self.at)

    @property
    def emptied(self) -> Command | None:
        """The command that makes it 0, as a table is where it names nothing; None where nothing does."""
        value = _ZERO.get(self.row.code)
        return None if value is None else self.row(**self.at, **{value: 0})

    @property
    def can_be_unset(self) -> bool:
        """True if a command takes its value away, if only with those of others."""
        return self.row.code in _ZERO or self.row is SetSpeedChange

    @property
    def is_always_set(self) -> bool:
        """True if there is only one of its kind, which has a value from the beginning."""
        return not self.at

    def setting(self, reply: Reply) -> Command | None:
        """The command that sets what a reply tells; None where a table has nothing there.

        A value that cannot be set was never set.
        """
        told = {name: value for name, value in given(reply).items() if name in self.row.model_fields}
        if self.row is SetSpeedChange:
            told.pop("end", None)
        try:
            command = normal(self.row(**{**told, **self.at}))
        except ValidationError:
            return None
        return None if command == self.emptied else command


_ZERO: Final[Mapping[str, str]] = {"3PS": "pulses", "UDS": "value"}


def given(model: Reply | Command) -> dict[str, object]:
    """The fields that have a value."""
    return {name: value for name in type(model).model_fields if (value := getattr(model, name)) is not None}


def _read_by(row: Row, values: Mapping[str, object]) -> tuple[Row, dict[str, object]]:
    """The question that reads a place, and its fields."""
    if row is SetProgramMemory and str(values["memory"])[0] == "D":
        return GetProgramMemory, {"memory": values["memory"], "notation": "hexadecimal"}
    reading = _READ_BY.get(row.code) or COMMANDS[f"{row.code[:-1]}D"]
    return reading, {name: values[name] for name in reading.model_fields if name in values}


def _question_of(row: Row, values: Mapping[str, object]) -> Command:
    reading, fields = _read_by(row, values)
    return reading(**fields)


def _key_of(row: Row, values: Mapping[str, object]) -> str:
    """The text of the question. Places are known to be some, and thousands: none is validated."""
    reading, fields = _read_by(row, values)
    return f"{reading.code}{reading.text_of(fields)}"


def place_of(command: Command) -> BackupPlace | None:
    """The place that a command sets; None where a backup has no such place."""
    if isinstance(command, SetPositionEntry) and command.pulses is None:
        return None  # it would store where the motor stands
    try:
        return PLACES.get(_key_of(type(command), given(command)))
    except (KeyError, ValidationError):
        return None


def normal(command: Command) -> Command:
    """Put a command as a backup writes it: bounds are named, 32 bits of a memory are a number if they can be.

    That a number below 0 has the bits of its two's complement is an assumption.
    """
    if isinstance(command, Interval) and command.lower is None:
        return type(command)(**{**given(command), "lower": 1 - BILLION, "upper": BILLION - 1})
    if not isinstance(command, SetProgramMemory) or command.memory[0] != "D":
        return command
    bits = command.bits if command.value is None else command.value % BITS
    number = None if bits is None else signed(bits)
    if number is None or abs(number) >= BILLION:
        return SetProgramMemory(memory=command.memory, bits=bits)
    return SetProgramMemory(memory=command.memory, value=number)


def words_of(row: Row) -> str:
    """Name the thing that a command sets, with the unit of its value."""
    title = _WORDS.get(row.code) or row.titles()[1].partition(";")[0].removeprefix("set ").removeprefix(
        "the "
    )
    unit = _UNITS.get(row.code)
    return f"{title}, {unit}" if unit else title


def _each(code: str, **at: object) -> BackupPlace:
    return BackupPlace(COMMANDS[code], MappingProxyType(at))


def _settings() -> Iterator[BackupPlace]:
    """All of RC-420 manual 18 but speeds and patterns; what others depend on comes first.

    CPS clears what CFS has set for its input (RC-420 manual 13.9.4), and outputs come last.
    """
    yield from map(_each, ("EAS", "EDS", "EPS", "DIS", "DLS"))
    yield from (_each("DCS", bit=bit) for bit in range(15))
    yield from map(_each, ("0BS", "0RS", "0SS", "CCS"))
    yield from map(_each, ("PAS", "PBS", "PES", "PJS", "PKS", "PLS", "PSS", "PTS", "QIS", "QSS"))
    yield from map(_each, ("HTS", "HCS", "HAS", "HFS"))
    yield from (_each("HZS", axis=axis) for axis in range(10))
    yield from (_each("CES", cause=cause) for cause in ("ems", "limit", "stall", "any"))
    for port in (8, 9):
        yield _each("CPS", port=port)
        yield _each("CSS", port=port)
        for recorded in ("position", "encoder", "encoder_in_pulses"):
            yield _each("CFS", port=port, recorded=recorded)
        yield _each("CFS", port=port, pulsed="output")
    yield from (_each("9VS", comment_number=number) for number in range(1, 8))
    yield from map(_each, ("3IS", "UAS", "COS"))


def _speed_sets() -> Iterator[BackupPlace]:
    for number in (None, *range(30)):
        at = {} if number is None else {"speed_set": number}
        yield from (_each(code, **at) for code in ("OLS", "OHS", "OSS", "OAS", "OBS"))


def _patterns() -> Iterator[BackupPlace]:
    for pattern in range(30):
        yield BackupPlace(SetPattern, {"pattern": pattern})
        yield from (BackupPlace(SetSpeedChange, {"pattern": pattern, "point": point}) for point in range(16))


def _positions() -> Iterator[BackupPlace]:
    numbers = range(LAST_POSITION + 1)
    yield from (
        BackupPlace(SetPositionEntry, {"entry": PositionReference(position=number)}) for number in numbers
    )


def _memories() -> Iterator[BackupPlace]:
    for bank, last in LAST_PLACES.items():
        yield from (BackupPlace(SetProgramMemory, {"memory": f"{bank}{place}"}) for place in range(last + 1))


def _by_key(places: Iterable[BackupPlace]) -> Mapping[str, BackupPlace]:
    return MappingProxyType({place.key: place for place in places})


PLACES_OF: Final[Mapping[Section, Mapping[str, BackupPlace]]] = {
    "settings": _by_key(_settings()),
    "speed-sets": _by_key(_speed_sets()),
    "patterns": _by_key(_patterns()),
    "positions": _by_key(_positions()),
    "memories": _by_key(_memories()),
}
"""The places of each section, by their keys, in the order in which they are read and written."""
PLACES: Final = {key: place for places in PLACES_OF.values() for key, place in places.items()}

RAM_ONLY: Final[tuple[Row, ...]] = (SetProgramMemory, SetSpeedChange)
"""Places that no flash memory holds (RC-420 manual 18): they are gone with the power."""
