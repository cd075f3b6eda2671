"""The settings that FIS writes to flash memory, in the words of clients (RC-420 manual 18)."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from gateway.core.records import RequestModel, SentBack, example
from gateway.rorze.speed_sets import Acceleration, Falling, MaximumSpeed, Rising, StartSpeed, go_together
from protocols.rorze.interpolation import PulsesOfTurn, RobotType
from protocols.rorze.notation import BILLION, Pulses, TwoDecimals
from protocols.rorze.row import ModeName

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

    lower: Pulses = Field(description="In pulses, below `upper`.")
    upper: Pulses = Field(description="In pulses.")


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
    """What origin searches and the centring of stall dogs go by (RC-420 manual 13.5, 13.6.2)."""

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
    """What of the set-up of homing shall change; the rest stays as it is."""

    read_only = frozenset(("body_id", "in_unit", "overrun", "last"))
    wrapped = "settings"

    _go_together = model_validator(mode="after")(go_together)


class EncoderChange(SentBack, EncoderSettings, json_schema_extra=example(encoder_stall_threshold=128)):
    """What of the set-up of the encoder shall change; the rest stays as it is."""

    read_only = frozenset(("body_id", "operating_mode", "in_unit", "unavailable", "last"))
    wrapped = "settings"


class BodySettingsChange(SentBack, Settings, json_schema_extra=example(origin_offset=20, homing_retries=1)):
    """Settings to change; the others stay as they are.

    Null ends soft limits, error outputs, and what interrupts are heeded for, record and pulse. Of all others
    it says that they are not set, or cannot be read, which has to be so.
    """

    read_only = frozenset(("body_id", "version", "in_unit", "unavailable", "flash", "about"))
    wrapped = "settings"

    _go_together = model_validator(mode="after")(go_together)
