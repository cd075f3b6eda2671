"""Operating mode, pulse format, soft limits and event messages: code E (RC-420 manual 13.1, 13.11, 14)."""

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from protocols.rorze.inputs_outputs import SENSORS, InputMask, OutputMask, SensorMask
from protocols.rorze.notation import Bounds, Hex, Interval, SignedValue, Word
from protocols.rorze.row import MODE_NAMES, ModeName, Question, RorzeCommand, Setting
from protocols.table import Ack, Reply, Retry, SyntaxFault, Wire, wire_of

SETTING_ERRORS = frozenset({0x4A, 0x50})

STATUS_LETTERS = {
    "controller": "C",
    "end_cause": "M",
    "sensors": "S",
    "inputs": "I",
    "outputs": "O",
    "position": "P",
}
"""The letter of each kind of status in event settings and event messages."""

CONTROLLER_BITS = (
    "1 limit error, 2 EMS error, 3 command error, 4 initialisation error, 5 movement range error, "
    "6 STALL error, 7 communication error"
)
END_CAUSE_BITS = "0 STALL, 1 CW limit, 2 CCW limit, 3 EMS, 4 stop command"

EndCauseMask = Annotated[int, Field(ge=0, le=0x1F), Hex(2)]


class EventMask(BaseModel):
    """The changes that cause an event message: a bit that is 1 reports; a mask left out reports nothing."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    controller: Annotated[int, Field(ge=0, le=0xFE), Hex(2)] | None = Field(
        None, description=f"Controller status that rises: {CONTROLLER_BITS}. Bit 0 never reports."
    )
    end_cause: EndCauseMask | None = Field(None, description=f"End cause that rises: {END_CAUSE_BITS}.")
    sensors: SensorMask | None = Field(None, description=f"Sensor input that changes: {SENSORS}.")
    inputs: InputMask | None = Field(None, description="General input that changes; bit 0 is D0.")


class EventReport(BaseModel):
    """The kinds of status chosen for event messages."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    # The manual says H00-HFE, but bit 0 is set while pulses run.
    controller: Annotated[int, Field(ge=0, le=0xFF), Hex(2)] | None = Field(
        None, description=f"Controller status: 0 pulses running, {CONTROLLER_BITS}."
    )
    end_cause: EndCauseMask | None = Field(None, description=f"End cause: {END_CAUSE_BITS}.")
    sensors: SensorMask | None = Field(None, description=f"Sensor inputs: {SENSORS}.")
    inputs: InputMask | None = Field(None, description="General inputs, bit 0 is D0.")
    outputs: OutputMask | None = Field(None, description="General outputs, bit 0 is D0.")
    position: SignedValue | None = Field(
        None, description="Position in pulses; encoder counts in encoder mode."
    )


class Lettered(Wire):
    """The fields of a model that are given, each after its letter: `C:H06,I:H0001`; read in any order."""

    def __init__(self, model: type[BaseModel]) -> None:
        self._model = model
        self._wires = {
            name: wire_of(field.annotation, field.metadata) for name, field in model.model_fields.items()
        }
        self._names = {letter: name for name, letter in STATUS_LETTERS.items()}
        item = "|".join(f"{STATUS_LETTERS[name]}:{wire.pattern}" for name, wire in self._wires.items())
        self.pattern = rf"(?:(?:{item})(?:,(?:{item}))*)?"

    def encode(self, value: Any) -> str:
        """Write what is given, in the order C, M, S, I, O, P."""
        given = {name: getattr(value, name) for name in self._wires}
        return ",".join(
            f"{STATUS_LETTERS[name]}:{self._wires[name].encode(item)}"
            for name, item in given.items()
            if item is not None
        )

    def decode(self, text: str) -> object:
        """Read the fields; one that comes twice is a fault."""
        values: dict[str, object] = {}
        for letter, written in re.findall(r"(\w):([^,]+)", text):
            name = self._names[letter]
            if name in values:
                raise SyntaxFault(f"{text!r} gives {letter} twice")
            values[name] = self._wires[name].decode(written)
        return self._model.model_validate(values)


class Letters(Wire):
    """A list of kinds of status, each as its letter: `C,I,P`; it may be empty."""

    pattern = "(?:[CMSIOP](?:,[CMSIOP])*)?"
    _letters = Word(**STATUS_LETTERS)

    def encode(self, value: Any) -> str:
        """Write the letters in the order given."""
        return ",".join(self._letters.encode(kind) for kind in value)

    def decode(self, text: str) -> object:
        """Read the letters in the order given."""
        return [self._letters.decode(letter) for letter in text.split(",") if letter]


def _each_once(kinds: list[str]) -> list[str]:
    if len(set(kinds)) < len(kinds):
        raise ValueError("each kind of status may be given once")
    return kinds


StatusKind = Literal["controller", "end_cause", "sensors", "inputs", "outputs", "position"]
StatusKinds = Annotated[list[StatusKind], AfterValidator(_each_once), Letters()]
Masks = Annotated[EventMask, Lettered(EventMask)]
Mode = Annotated[ModeName, Word(**{name: digit for digit, name in MODE_NAMES.items()})]
Format = Annotated[Literal["pulse_direction", "cw_ccw"], Word(pulse_direction="0", cw_ccw="1")]

KINDS = "What event messages carry; empty for nothing."


class OperatingMode(Reply, args="{mode}"):
    """The operating mode."""

    mode: Mode


class PulseOutputFormat(Reply, args="{pulse_format}"):
    """Format of the pulse output."""

    pulse_format: Format


class EventMasks(Reply, args="{mask}"):
    """The changes that cause an event message."""

    mask: Masks


class EventStatus(Reply, args="{status}"):
    """The status an event message would carry now."""

    status: Annotated[EventReport, Lettered(EventReport)]


class EventKinds(Reply, args="{kinds}"):
    """The kinds of status that event messages carry."""

    kinds: StatusKinds = Field(description=KINDS)


class GetOperatingMode(Question[OperatingMode], code="EAD", example=("&3FEAD", ">&3FEAD0")):
    """動作モード取得: get the operating mode."""


class SetOperatingMode(
    Setting,
    code="EAS",
    args="{mode}",
    moving=False,
    errors=SETTING_ERRORS,
    example=("&3FEAS0", ">&3FEAS"),
):
    """動作モード設定: set the operating mode; stepping by default (RC-420 manual 13.1)."""

    mode: Mode = Field(description="Stepping motor, stepping motor with encoder, or servo drive.")


class GetPulseFormat(Question[PulseOutputFormat], code="EDD", example=("&3FEDD", ">&3FEDD1")):
    """パルス出力方式取得: get how pulses are put out."""


class SetPulseFormat(
    Setting,
    code="EDS",
    args="{pulse_format}",
    moving=False,
    errors=SETTING_ERRORS,
    example=("&3FEDS1", ">&3FEDS"),
):
    """パルス出力方式設定: set how pulses are put out; as CW and CCW pulses by default."""

    pulse_format: Format = Field(description="1P, pulse and direction, or 2P, CW and CCW pulses.")


class GetEventMask(
    Question[EventMasks],
    code="EMD",
    program=False,
    # The example prints S before M, its syntax line M before S; both orders are read.
    example=("&3FEMD", ">&3FEMDC:H06,M:H00,S:H00,I:H0001"),
):
    """イベントマスク取得: get the changes that cause an event message."""


class SetEventMask(
    Setting,
    code="EMS",
    args="{mask}",
    moving=False,
    program=False,
    errors=SETTING_ERRORS,
    example=("&3FEMSC:H06,I:H0001", ">&3FEMS"),
):
    """イベントマスク設定: set the changes that cause an event message.

    Event messages come only after XID to the link master (RC-420 manual 13.11).
    """

    mask: Masks


class GetSoftLimits(
    Question[Bounds],
    code="EPD",
    program=False,
    example=("&3FEPD", ">&3FEPD-000000500,+000000500"),
):
    """移動可能範囲取得: get the soft limits."""


class SetSoftLimits(
    Interval,
    RorzeCommand[Ack],
    code="EPS",
    args="<{lower},{upper}>",
    moving=False,
    program=False,
    errors=SETTING_ERRORS,
    retry=Retry.SETTING,
    example=("&3FEPS-500,500", ">&3FEPS", "&3FEPS", ">&3FEPS"),
):
    """移動可能範囲設定: set the soft limits; without any, the whole range.

    A move that would end outside them is refused with 5D.
    """


# The pages of ERD and ESD are lost; their columns are those of EMD, the example of ERD is that of 13.11.3.
class GetEventStatus(
    Question[EventStatus],
    code="ERD",
    program=False,
    example=("&3FERD", ">&3FERDM:H01,I:H0000"),
):
    """イベント応答のステータス一括取得: get the status that an event message would carry now."""


class GetEventKinds(Question[EventKinds], code="ESD", program=False, example=("&3FESD", ">&3FESDC,I,P")):
    """イベント応答種別取得: get the kinds of status that event messages carry."""


class SetEventKinds(
    Setting,
    code="ESS",
    args="{kinds}",
    moving=False,
    program=False,
    errors=SETTING_ERRORS,
    example=("&3FESSC,I,P", ">&3FESS"),
):
    """イベント応答種別設定: set the kinds of status that event messages carry."""

    kinds: StatusKinds = Field(description=KINDS)
