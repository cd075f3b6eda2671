"""By which commands each setting is read and set, its unit, and its value when it leaves the factory."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, NamedTuple, get_args

from pydantic import Field, model_validator

from gateway.core.records import RequestModel, SentBack, example
from gateway.rorze.asked_body import is_mark
from gateway.rorze.changes import Item, Query, Setter, SettingCodec, plain, switch
from gateway.rorze.speed_sets import (
    STANDARD,
    Acceleration,
    Falling,
    MaximumSpeed,
    Rising,
    StartSpeed,
    go_together,
    items_of,
)
from protocols.rorze import encoder, input_logic, inputs_outputs, interpolation, modes, origin, stall_sensor
from protocols.rorze.interpolation import PulsesOfTurn, RobotType
from protocols.rorze.notation import BILLION, Pulses, TwoDecimals
from protocols.rorze.position_table import GetPositionIndex, SetPositionIndex
from protocols.rorze.programs import GetProgramAutostart, SetProgramAutostart
from protocols.rorze.row import ModeName, RorzeCommand
from protocols.rorze.status import GetInformation, SetUserComment

Input = Literal["d0", "d1", "d2", "d3", "d4", "d5", "d6", "d7", "d8", "d9"]
Sensor = Literal["stall", "origin", "cw_limit", "ccw_limit", "in_position", "ems"]
FilteredInput = Literal["d0", "d1", "d2", "d3", "d4", "d5", "d6", "d7"]
Output = Literal[
    "d0", "d1", "d2", "d3", "d4", "d5", "d6", "d7", "d8", "d9", "d10", "d11", "d12", "d13", "d14", "d15"
]
ErrorCause = Literal["ems", "limit", "stall", "any"]
CommentNumber = Literal["1", "2", "3", "4", "5", "6", "7"]
AxisNumber = Literal["0", "1", "2", "3", "4", "5", "6", "7", "8", "9"]
Port = Literal["8", "9"]
"""A general input that interrupts."""
Recorded = Literal["position", "encoder", "encoder_in_pulses"]
Contact = Literal["normally_open", "normally_closed"]
Edge = Literal["off", "falling", "rising"]


class Stretch(RequestModel):
    """Positions from the lower to the upper, in pulses."""

    lower: Pulses = Field(description="Lower position in pulses, below `upper`.")
    upper: Pulses = Field(description="Upper position in pulses.")


class ErrorOutputSetting(RequestModel):
    """The output that reports an error."""

    output: Annotated[int, Field(ge=0, le=15)]
    on: bool = Field(description="The state that it takes on an error.")


class InterruptPulse(RequestModel):
    """A one-shot pulse on an output."""

    output: Annotated[int, Field(ge=0, le=7)]
    on: bool = Field(description="The state during the pulse.")
    duration_ms: Annotated[int, Field(ge=1, le=30_000)]


class HomingSettings(RequestModel):
    """Settings of origin searches and of the centring of stall dogs (RC-420 manual 13.5, 13.6.2)."""

    origin_offset: Annotated[int, Field(ge=1, le=65_535)] | None = Field(
        default=None, description="0SS: pulses from the CW edge of the origin sensor to the origin."
    )
    overrun_factor: Annotated[int, Field(ge=0, le=5)] | None = Field(
        default=None, description="0BS: origin offsets to overrun the origin sensor (RC-420 manual 13.5.1)."
    )
    homing_retries: Annotated[int, Field(ge=0, le=9)] | None = Field(
        default=None, description="0RS: how often a failed origin search is tried again."
    )
    stall_sensor_interval: Annotated[int, Field(ge=100, le=65_535)] | None = Field(
        default=None, description="QIS: period of the stall dogs in pulses, from ON edge to ON edge."
    )
    stall_sensor_detection: bool | None = Field(default=None, description="QSS.")
    start_speed_pps: StartSpeed | None = None
    maximum_speed_pps: MaximumSpeed | None = None
    acceleration_pps_s: Acceleration | None = None
    rising_percent: Rising | None = None
    falling_percent: Falling | None = None


class EncoderSettings(RequestModel):
    """How the encoder is counted, watched and adjusted to (RC-420 manual 13.7)."""

    encoder_multiplier: Literal["double", "quadruple"] | None = Field(
        default=None, description="PAS: edges counted for each encoder line (RC-420 manual 13.7.3)."
    )
    encoder_ratio: Annotated[TwoDecimals, Field(ge=1, le=99_999.99)] | None = Field(
        default=None, description="PBS: motor pulses for each encoder count, at most two decimals."
    )
    encoder_stall_threshold: Annotated[int, Field(ge=0, le=3_000)] | None = Field(
        default=None, description="PES: pulses between motor and encoder that are a step-out."
    )
    encoder_stall_detection: bool | None = Field(default=None, description="PSS.")
    adjustment: bool | None = Field(
        default=None, description="PJS: adjust to the encoder after a move; encoder mode only."
    )
    adjustment_limit: Annotated[int, Field(ge=1, le=65_535)] | None = Field(
        default=None,
        description="PKS: most pulses of an adjustment, beyond which is a STALL error; encoder mode only.",
    )
    adjustment_speed_pps: Annotated[int, Field(ge=0, le=50_000)] | None = Field(
        default=None, description="PLS: 0 is the start speed of speed set 30; encoder mode only."
    )
    adjustment_delay_ms: Annotated[int, Field(ge=0, le=9_990, multiple_of=10)] | None = Field(
        default=None,
        description="PTS: wait between a move and its adjustment, in steps of 10 ms; encoder mode only.",
    )


class Settings(EncoderSettings, HomingSettings):
    """Settings by name; null is one that is not set, or not known."""

    operating_mode: ModeName | None = Field(
        default=None,
        description="EAS: stepping motor, stepping motor with encoder, or servo drive (RC-420 manual 13.1).",
    )
    pulse_format: Literal["pulse_direction", "cw_ccw"] | None = Field(default=None, description="EDS.")
    soft_limits: Stretch | None = Field(
        default=None, description="EPS: moves that would end outside are refused; null where there are none."
    )

    input_logic: dict[Input, Contact] | None = Field(default=None, description="DIS.")
    sensor_logic: dict[Sensor | Literal["clear_output"], Contact] | None = Field(
        default=None, description="DLS: the sensor inputs, and the CLR output."
    )
    noise_filters: dict[FilteredInput | Sensor, Annotated[int, Field(ge=1, le=99)]] | None = Field(
        default=None, description="DCS: equal samples, one each ms, that make a change of level."
    )
    outputs: dict[Output, bool] | None = Field(
        default=None, description="COS: general outputs; FIS keeps them as they are then."
    )
    error_outputs: dict[ErrorCause, ErrorOutputSetting | None] | None = Field(
        default=None, description="CES: the output that reports an error; each needs one of its own."
    )
    interrupt_edges: dict[Port, Edge] | None = Field(
        default=None,
        description="CPS: the edge that interrupts; setting it clears what is recorded and pulsed.",
    )
    interrupt_ranges: dict[Port, Stretch | None] | None = Field(
        default=None, description="CSS: where an interrupt is heeded; null for everywhere."
    )
    interrupt_records: dict[Port, dict[Recorded, Annotated[int, Field(ge=0, le=2_047)] | None]] | None = (
        Field(default=None, description="CFS: the positions of the table that take a value.")
    )
    interrupt_pulses: dict[Port, InterruptPulse | None] | None = Field(
        default=None, description="CFS: the pulse that an interrupt gives."
    )
    clear_pulse_ms: Annotated[int, Field(ge=0, lt=BILLION)] | None = Field(
        default=None, description="CCS: the CLR signal's pulse; 0 gives none; servo mode only."
    )

    robot_type: RobotType | None = Field(default=None, description="HTS; not in encoder mode.")
    driven_axis: Annotated[int, Field(ge=0, le=9)] | None = Field(
        default=None, description="HCS: the axis of a SCARA robot that it drives; not in encoder mode."
    )
    arm_length_um: Annotated[int, Field(ge=1, lt=BILLION)] | None = Field(
        default=None, description="HAS; not in encoder mode."
    )
    finger_length_um: Annotated[int, Field(ge=1, lt=BILLION)] | None = Field(
        default=None, description="HFS; not in encoder mode."
    )
    pulses_per_turn: dict[AxisNumber, PulsesOfTurn] | None = Field(
        default=None, description="HZS: of each axis, with up to eight decimals; not in encoder mode."
    )

    position_index: Annotated[int, Field(ge=0, le=2_047)] | None = Field(
        default=None, description="3IS: moves that step it change it, too."
    )
    comments: dict[CommentNumber, str] | None = Field(
        default=None,
        description="9VS: up to 40 printable ASCII characters; the mark of the gateway is not shown.",
    )
    autostart: bool | None = Field(
        default=None, description="UAS: whether the user program starts at power-on (RC-420 manual 15)."
    )


class HomingChange(SentBack, HomingSettings, json_schema_extra=example(origin_offset=20, homing_retries=1)):
    """Changes of the set-up of homing; the rest stays as it is."""

    read_only = frozenset(("body_id", "in_unit", "overrun", "last"))
    wrapped = "settings"

    _go_together = model_validator(mode="after")(go_together)


class EncoderChange(SentBack, EncoderSettings, json_schema_extra=example(encoder_stall_threshold=128)):
    """Changes of the set-up of the encoder; the rest stays as it is."""

    read_only = frozenset(("body_id", "operating_mode", "in_unit", "unavailable", "last"))
    wrapped = "settings"


class BodySettingsChange(SentBack, Settings, json_schema_extra=example(origin_offset=20, homing_retries=1)):
    """Settings to change; the others stay as they are.

    Null ends soft limits, error outputs, and what interrupts are heeded for, record and pulse. For every
    other setting null says that it is not set, or cannot be read, which has to be so.
    """

    read_only = frozenset(("body_id", "version", "in_unit", "unavailable", "flash", "about"))
    wrapped = "settings"

    _go_together = model_validator(mode="after")(go_together)


Unit = Literal["pulse", "pps", "pps/s", "percent", "ms", "um", "pulse/count"]
Key = str | None
"""Part of a setting that exists several times, such as an input; None of a single one."""
FARTHEST: Final = BILLION - 1
CONTACTS: Final = ("normally_open", "normally_closed")


class WholeQuestion(NamedTuple):
    """One question for all of a setting's members: a bit for each."""

    question: Query
    names: Mapping[str, int]
    words: tuple[Any, Any]
    """The meaning of 0, and of 1."""

    def values_in(self, reply: Any) -> dict[str, Any]:
        """The members' values, by their names."""
        return {name: self.words[reply.bits >> bit & 1] for name, bit in self.names.items()}


@dataclass(frozen=True)
class BodySetting:
    """One member of the document, and all that it is made of."""

    items: Mapping[Key, Item]
    unit: Unit | None = None
    default: Any = None
    whole: WholeQuestion | None = None

    @property
    def item(self) -> Item:
        """The first of them; they have one row."""
        return next(iter(self.items.values()))

    @property
    def name(self) -> str:
        """That of the document's member."""
        return self.item.name.partition(".")[0]

    @property
    def modes(self) -> str:
        """The operating modes in which it can be set, by their digits."""
        return self.item.setter.modes


Row = type[RorzeCommand[Any]]


def _single(
    name: str, query: Row, setter: type[Setter], codec: SettingCodec, default: Any, unit: Unit | None = None
) -> BodySetting:
    return BodySetting({None: Item(name, query(), setter, codec)}, unit, default)


def _each(
    name: str,
    rows: tuple[Row, type[Setter]],
    places: Mapping[str, Mapping[str, Any]],
    codec: SettingCodec,
    default: Any,
    *,
    unit: Unit | None = None,
    whole: WholeQuestion | None = None,
) -> BodySetting:
    query, setter = rows
    items: dict[Key, Item] = {
        key: Item(f"{name}.{key}", query(**place), setter, codec, place) for key, place in places.items()
    }
    return BodySetting(items, unit, default, whole)


def _places(parameter: str, names: Mapping[str, int]) -> dict[str, dict[str, int]]:
    return {name: {parameter: number} for name, number in names.items()}


def _numbered(names: Iterable[str], first: int = 0) -> dict[str, int]:
    return {name: number for number, name in enumerate(names, first)}


_SENSORS: Final = get_args(Sensor)
_INPUT_BITS: Final = _numbered(get_args(Input))
_OUTPUT_BITS: Final = _numbered(get_args(Output))
_SENSOR_BITS: Final = _numbered((*_SENSORS, "clear_output"))
_FILTER_BITS: Final = _numbered(get_args(FilteredInput)) | _numbered(_SENSORS, 9)
"""Bit 8 is unused (DCS)."""
_PORTS: Final = {port: int(port) for port in get_args(Port)}
_COMMENTS: Final = {number: int(number) for number in get_args(CommentNumber)}
_AXES: Final = {number: int(number) for number in get_args(AxisNumber)}


def _stretch_in(reply: Any) -> dict[str, int] | None:
    found = {"lower": reply.lower, "upper": reply.upper}
    return None if found == {"lower": -FARTHEST, "upper": FARTHEST} else found


_STRETCH: Final = SettingCodec(_stretch_in, lambda value: value or {})
_COMMENT: Final = SettingCodec(
    lambda reply: "" if is_mark(reply.text) else reply.text, lambda value: {"text": value}
)
_DELAY: Final = SettingCodec(lambda reply: reply.delay_10ms * 10, lambda value: {"delay_10ms": value // 10})
_ERROR_OUTPUT: Final = SettingCodec(
    lambda reply: None if reply.output is None else {"output": reply.output, "on": bool(reply.state)},
    lambda value: {"output": value["output"], "state": int(value["on"])} if value else {},
)
_PULSE: Final = SettingCodec(
    lambda reply: (
        None
        if reply.output is None
        else {"output": reply.output, "on": bool(reply.state), "duration_ms": reply.duration_ms}
    ),
    lambda value: (
        {"output": value["output"], "state": int(value["on"]), "duration_ms": value["duration_ms"]}
        if value
        else {}
    ),
)
_OUTPUT: Final = SettingCodec(lambda reply: bool(reply.on), lambda value: {"on": int(value)})


def _contacts(name: str, rows: tuple[Row, type[Setter]], bits: Mapping[str, int]) -> BodySetting:
    whole = WholeQuestion(rows[0](), bits, CONTACTS)
    return _each(name, rows, _places("bit", bits), plain("contact"), CONTACTS[0], whole=whole)


def _speeds() -> Iterator[BodySetting]:
    units: list[Unit] = ["pps", "pps", "pps/s", "percent", "percent"]
    defaults = 50, 50_000, 100_000, 50, 50
    for item, unit, default in zip(items_of(STANDARD).values(), units, defaults, strict=True):
        yield BodySetting({None: item}, unit, default)


def _interrupt_records() -> BodySetting:
    places = {
        f"{port}.{kind}": {"port": number, "recorded": kind}
        for port, number in _PORTS.items()
        for kind in get_args(Recorded)
    }
    rows = inputs_outputs.GetInterruptAction, inputs_outputs.SetInterruptAction
    return _each("interrupt_records", rows, places, plain("number"), None)


def _of_axis() -> Iterator[BodySetting]:
    yield _single("operating_mode", modes.GetOperatingMode, modes.SetOperatingMode, plain("mode"), "stepping")
    yield _single("pulse_format", modes.GetPulseFormat, modes.SetPulseFormat, plain("pulse_format"), "cw_ccw")
    yield _single("soft_limits", modes.GetSoftLimits, modes.SetSoftLimits, _STRETCH, None, "pulse")
    yield from _speeds()
    yield _single(
        "origin_offset", origin.GetOriginOffset, origin.SetOriginOffset, plain("offset"), 10, "pulse"
    )
    yield _single("overrun_factor", origin.GetOverrunFactor, origin.SetOverrunFactor, plain("factor"), 2)
    yield _single("homing_retries", origin.GetHomingRetries, origin.SetHomingRetries, plain("retries"), 0)


def _of_encoder() -> Iterator[BodySetting]:
    rows, dogs = encoder, stall_sensor
    yield _single(
        "encoder_multiplier",
        rows.GetEncoderMultiplier,
        rows.SetEncoderMultiplier,
        plain("multiplier"),
        "quadruple",
    )
    yield _single(
        "encoder_ratio", rows.GetEncoderRatio, rows.SetEncoderRatio, plain("ratio"), 1.0, "pulse/count"
    )
    threshold = rows.GetEncoderStallThreshold, rows.SetEncoderStallThreshold
    yield _single("encoder_stall_threshold", *threshold, plain("threshold"), 128, "pulse")
    detection = rows.GetEncoderStallDetection, rows.SetEncoderStallDetection
    yield _single("encoder_stall_detection", *detection, switch("enabled"), False)
    yield _single(
        "adjustment_limit", rows.GetAdjustmentLimit, rows.SetAdjustmentLimit, plain("limit"), 800, "pulse"
    )
    yield _single(
        "adjustment_speed_pps", rows.GetAdjustmentSpeed, rows.SetAdjustmentSpeed, plain("speed"), 0, "pps"
    )
    yield _single("adjustment_delay_ms", rows.GetAdjustmentDelay, rows.SetAdjustmentDelay, _DELAY, 30, "ms")
    yield _single("adjustment", rows.GetAdjustment, rows.SetAdjustment, switch("enabled"), False)
    interval = dogs.GetStallSensorInterval, dogs.SetStallSensorInterval
    yield _single("stall_sensor_interval", *interval, plain("interval"), 2_048, "pulse")
    watched = dogs.GetStallSensorDetection, dogs.SetStallSensorDetection
    yield _single("stall_sensor_detection", *watched, switch("enabled"), False)


def _of_terminals() -> Iterator[BodySetting]:
    rows = inputs_outputs
    yield _contacts("input_logic", (input_logic.GetInputLogic, input_logic.SetInputLogic), _INPUT_BITS)
    yield _contacts("sensor_logic", (input_logic.GetSensorLogic, input_logic.SetSensorLogic), _SENSOR_BITS)
    filters = input_logic.GetNoiseFilter, input_logic.SetNoiseFilter
    yield _each("noise_filters", filters, _places("bit", _FILTER_BITS), plain("count"), 1, unit="ms")
    whole = WholeQuestion(rows.GetOutputs(), _OUTPUT_BITS, (False, True))
    outputs = rows.GetOutputs, rows.SetOutputs
    yield _each("outputs", outputs, _places("bit", _OUTPUT_BITS), _OUTPUT, False, whole=whole)
    causes = {cause: {"cause": cause} for cause in get_args(ErrorCause)}
    yield _each("error_outputs", (rows.GetErrorOutput, rows.SetErrorOutput), causes, _ERROR_OUTPUT, None)
    ports = _places("port", _PORTS)
    yield _each(
        "interrupt_edges", (rows.GetInterruptMode, rows.SetInterruptMode), ports, plain("edge"), "off"
    )
    ranges = rows.GetInterruptRange, rows.SetInterruptRange
    yield _each("interrupt_ranges", ranges, ports, _STRETCH, None, unit="pulse")
    yield _interrupt_records()
    pulsed = {port: {**place, "pulsed": "output"} for port, place in ports.items()}
    yield _each("interrupt_pulses", (rows.GetInterruptAction, rows.SetInterruptAction), pulsed, _PULSE, None)
    yield _single(
        "clear_pulse_ms", rows.GetClearPulseTime, rows.SetClearPulseTime, plain("duration_ms"), 1, "ms"
    )


def _of_robot() -> Iterator[BodySetting]:
    rows = interpolation
    yield _single("robot_type", rows.GetRobotType, rows.SetRobotType, plain("robot"), "two_axes_belt_linked")
    yield _single("driven_axis", rows.GetDrivenAxis, rows.SetDrivenAxis, plain("axis"), 0)
    yield _single("arm_length_um", rows.GetArmLength, rows.SetArmLength, plain("length"), 1, "um")
    yield _single("finger_length_um", rows.GetFingerLength, rows.SetFingerLength, plain("length"), 1, "um")
    turns = rows.GetPulsesPerTurn, rows.SetPulsesPerTurn
    yield _each("pulses_per_turn", turns, _places("axis", _AXES), plain("pulses"), 1.0, unit="pulse")


def _of_programs() -> Iterator[BodySetting]:
    yield _single("position_index", GetPositionIndex, SetPositionIndex, plain("position"), 0)
    comments = _places("comment_number", _COMMENTS)
    yield _each("comments", (GetInformation, SetUserComment), comments, _COMMENT, "")
    yield _single("autostart", GetProgramAutostart, SetProgramAutostart, switch("autostart"), False)


SETTINGS: Final[Mapping[str, BodySetting]] = {
    setting.name: setting
    for part in (_of_axis, _of_encoder, _of_terminals, _of_robot, _of_programs)
    for setting in part()
}
"""Settings by the names of the document, in the order in which they are read and set."""
