"""Inputs, outputs, sensors and what they set off: code C (RC-420 manual 13.9, 14)."""

from typing import Annotated, Literal

from pydantic import Field

from protocols.rorze.notation import (
    Amount,
    Bounds,
    Digits,
    Flag,
    FlagValue,
    Hex,
    Interval,
    Number,
    UpTo,
    Word,
)
from protocols.rorze.row import OTHER_MODE, Question, RorzeCommand, Setting
from protocols.table import Ack, Effect, Reply, Retry

SENSORS = "0 STALL, 1 ORG, 2 CW limit, 3 CCW limit, 4 INP, 5 EMS"

ERROR_OUTPUT_BITS = {"any": 0, "stall": 1, "limit": 2, "ems": 3}
"""The bits of CRD. Only bit 2 is known; the others are assumed, as the causes E, L, S, A read backwards."""

InputBit = Annotated[int, Field(ge=0, le=9), Number()]
InputMask = Annotated[int, Field(ge=0, le=0x3FF), Hex(4)]
SensorMask = Annotated[int, Field(ge=0, le=0x3F), Hex(2)]
OutputBit = Annotated[int, Field(ge=0, le=15), Number()]
OutputMask = Annotated[int, Field(ge=0, le=0xFFFF), Hex(4)]
ClearSignal = Annotated[Literal["clear"], Word(clear="CL")]
ErrorCause = Annotated[Literal["ems", "limit", "stall", "any"], Word(ems="E", limit="L", stall="S", any="A")]
InterruptInput = Annotated[int, Field(ge=8, le=9), Number()]
InterruptEdge = Annotated[Literal["off", "falling", "rising"], Word(off="0", falling="1", rising="2")]
Recorded = Annotated[
    Literal["position", "encoder", "encoder_in_pulses"],
    Word(position="P", encoder="E", encoder_in_pulses="C"),
]
Pulsed = Annotated[Literal["output"], Word(output="O")]

CAUSE = "What the output reports: `ems`, `limit` (CW or CCW), `stall`, or `any` of them."
PORT = "Interrupt input, 8 or 9."
ONE_BIT = "State of the bit asked for, 0 or 1."
RECORDED = "Value to record in the position table; give this or `pulsed`."
PULSED = "A one-shot pulse on an output; give this or `recorded`."
PULSE_OUTPUT = "General output that gives the pulse, 0-7."
PULSE_STATE = "State during the pulse, 0 or 1."
PULSE_TIME = "Length of the pulse in ms, 1-30000."


class Inputs(Reply, args="{on}|{bits}"):
    """One general input, or all ten."""

    on: FlagValue | None = Field(None, description=ONE_BIT)
    bits: InputMask | None = Field(None, description="Bit 0 is input D0, bit 9 is D9.")


class Sensors(Reply, args="{on}|{bits}"):
    """One sensor input, or all six."""

    on: FlagValue | None = Field(None, description=ONE_BIT)
    bits: SensorMask | None = Field(None, description=f"Bits: {SENSORS}.")


class Outputs(Reply, args="{on}|{bits}"):
    """One general output, or all sixteen."""

    on: FlagValue | None = Field(None, description=ONE_BIT)
    bits: OutputMask | None = Field(None, description="Bit 0 is output D0, bit 15 is D15.")


class ErrorOutputs(Reply, args="{on}|{bits}"):
    """Error outputs: on or off for one cause, or the bits of all causes."""

    on: FlagValue | None = Field(None, description=ONE_BIT)
    bits: Annotated[int, Field(ge=0, le=0xF), Hex(1)] | None = Field(
        None, description="Bits: 0 any, 1 STALL, 2 limit, 3 EMS."
    )


class ClearPulseTime(Reply, args="{duration_ms}"):
    """The length of the CLR signal's one-shot pulse."""

    duration_ms: Annotated[int, Field(ge=0, lt=1_000_000_000), Digits(9)]


class ErrorOutput(Reply, args="<{output},{state}>"):
    """The output that reports an error; nothing where none does."""

    output: Annotated[int, Field(ge=0, le=15), UpTo(2)] | None = Field(None, description="0-15.")
    state: FlagValue | None = Field(None, description="State it takes on an error, 0 or 1.")


class InterruptAction(Reply, args="<{number}>|<{output},{state},{duration_ms}>"):
    """The action of an interrupt; both fields are empty if it has none."""

    number: Annotated[int, Field(ge=0, le=2047), Digits(4)] | None = Field(
        None, description="Position number that takes the value, 0-2047."
    )
    output: Annotated[int, Field(ge=0, le=7), Digits(1)] | None = Field(None, description=PULSE_OUTPUT)
    state: FlagValue | None = Field(None, description=PULSE_STATE)
    duration_ms: Annotated[int, Field(ge=1, le=30_000), Digits(5)] | None = Field(
        None, description=PULSE_TIME
    )


class InterruptMode(Reply, args="{edge}"):
    """The edge that sets off an interrupt."""

    edge: InterruptEdge


class PulseOutput(
    RorzeCommand[Ack],
    code="CBS",
    args="{bit},{duration_ms}",
    errors=frozenset({0x4A}),
    retry=Retry.NEVER,
    effect=Effect.SETTING,
    example=("&3FCBS1,1000", ">&3FCBS"),
):
    """汎用出力の1ショット反転出力の設定: invert a general output for a time.

    Refused with 4A for an output that is inverted already or is an error output (CES), and for output 0 in
    mode 2.
    """

    bit: OutputBit = Field(description="General output, 0-15.")
    duration_ms: Annotated[int, Field(ge=1, lt=1_000_000_000), Number()]


class GetClearPulseTime(
    Question[ClearPulseTime],
    code="CCD",
    modes="2",
    errors=OTHER_MODE,
    example=("&3FCCD", ">&3FCCD000000050"),
):
    """CLR信号1ショットパルス時間取得: get the length of the CLR signal's one-shot pulse."""


class SetClearPulseTime(
    Setting,
    code="CCS",
    args="{duration_ms}",
    modes="2",
    errors=frozenset({0x4A}) | OTHER_MODE,
    example=("&3FCCS50", ">&3FCCS"),
):
    """CLR信号1ショットパルス時間設定: set the length of the CLR signal's one-shot pulse; 1 ms by default.

    With 0 the signal is not given (RC-420 manual 13.9.5).
    """

    duration_ms: Amount


class GetErrorOutput(
    Question[ErrorOutput],
    code="CED",
    args="{cause}",
    program=False,
    errors=frozenset({0x4A}),
    example=("&3FCEDE", ">&3FCED2,1", "&3FCEDA", ">&3FCED"),
):
    """エラー出力機能取得: get the output that reports an error."""

    cause: ErrorCause = Field(description=CAUSE)


class SetErrorOutput(
    Setting,
    code="CES",
    args="{cause}<,{output},{state}>",
    errors=frozenset({0x4A, 0x67}),
    example=("&3FCESE,2,1", ">&3FCES", "&3FCESA", ">&3FCES"),
):
    """エラー出力機能設定: set the output that reports an error; without output and state, none does.

    Each cause needs an output of its own. Output 0 is not available in mode 2.
    """

    cause: ErrorCause = Field(description=CAUSE)
    output: OutputBit | None = Field(None, description="General output, 0-15; give it together with `state`.")
    state: Flag | None = Field(None, description="State the output takes on an error, 0 or 1.")


class GetInterruptAction(
    Question[InterruptAction],
    code="CFD",
    args="{port},{recorded}|{port},{pulsed}",
    program=False,
    errors=frozenset({0x4A}),
    example=(
        "&3FCFD8,P",
        ">&3FCFD0025",
        "&3FCFD8,P",
        ">&3FCFD",
        "&3FCFD8,O",
        ">&3FCFD5,1,00010",
    ),
):
    """割込み発生時機能取得: get what an interrupt records or which pulse it gives."""

    port: InterruptInput = Field(description=PORT)
    recorded: Recorded | None = Field(None, description=RECORDED)
    pulsed: Pulsed | None = Field(None, description=PULSED)


class SetInterruptAction(
    Setting,
    code="CFS",
    args="{port},{recorded}:<{number}>|{port},{pulsed}:<{output},{state},{duration_ms}>",
    program=False,
    errors=frozenset({0x4A}),
    example=("&3FCFS8,P:25", ">&3FCFS", "&3FCFS8,O:5,1,10", ">&3FCFS"),
):
    """割込み発生時機能設定: set what an interrupt records or which pulse it gives; left out, it does not.

    The four actions of an input are set one by one and may all be in force.
    """

    port: InterruptInput = Field(description=PORT)
    recorded: Recorded | None = Field(None, description=RECORDED)
    number: Annotated[int, Field(ge=0, le=2047), Number()] | None = Field(
        None, description="Position number that takes the value, 0-2047; with `recorded`."
    )
    pulsed: Pulsed | None = Field(None, description=PULSED)
    output: Annotated[int, Field(ge=0, le=7), Number()] | None = Field(None, description=PULSE_OUTPUT)
    state: Flag | None = Field(None, description=PULSE_STATE)
    duration_ms: Annotated[int, Field(ge=1, le=30_000), Number()] | None = Field(None, description=PULSE_TIME)


class GetInputs(
    Question[Inputs],
    code="CID",
    args="{bit}|",
    errors=frozenset({0x4A}),
    example=("&3FCID5", ">&3FCID1", "&3FCID", ">&3FCIDH003C"),
):
    """汎用入力状態取得: get the state of one general input, or of all."""

    bit: InputBit | None = Field(None, description="General input, 0-9; left out, all.")


class GetSensors(
    Question[Sensors],
    code="CLD",
    args="{bit}|",
    errors=frozenset({0x4A}),
    example=("&3FCLD5", ">&3FCLD0", "&3FCLD", ">&3FCLDH0A"),
):
    """センサ状態取得: get the state of one sensor input, or of all, as the sensor logic (DLS) shows it."""

    bit: Annotated[int, Field(ge=0, le=5), Number()] | None = Field(
        None, description=f"{SENSORS}; left out, all."
    )


class SetClearSignal(
    Setting,
    code="CLS",
    args="{on}",
    modes="2",
    errors=frozenset({0x4A}) | OTHER_MODE,
    example=("&3FCLS0", ">&3FCLS"),
):
    """CLR信号状態設定: switch the CLR signal; its level follows the output logic (DLS)."""

    on: Flag = Field(description="0 off, 1 on.")


class GetOutputs(
    Question[Outputs],
    code="COD",
    args="{bit}|",
    errors=frozenset({0x4A}),
    example=("&3FCOD1", ">&3FCOD1", "&3FCOD", ">&3FCODH003D"),
):
    """汎用出力状態取得: get the state of one general output, or of all."""

    bit: OutputBit | ClearSignal | None = Field(
        None, description="General output, 0-15, or `clear` for the CLR signal in mode 2; left out, all."
    )


class SetOutputs(
    Setting,
    code="COS",
    args="{bit},{on}|{bits}",
    errors=frozenset({0x4A}),
    example=("&3FCOS3,1", ">&3FCOS", "&3FCOSH003D", ">&3FCOS"),
):
    """汎用出力状態設定: switch one general output, or all at once.

    Ends a one-shot (CBS) of that output. In mode 2 output 0 stays as it is; `clear` switches it.
    """

    bit: OutputBit | ClearSignal | None = Field(
        None, description="General output, 0-15, or `clear` for the CLR signal in mode 2; with `on`."
    )
    on: Flag | None = Field(None, description="State of that output, 0 or 1.")
    bits: Annotated[int, Field(ge=0, le=0xFFFF), Hex(4, least=1)] | None = Field(
        None, description="All outputs at once, bit 0 is D0; instead of `bit` and `on`."
    )


class GetInterruptMode(
    Question[InterruptMode],
    code="CPD",
    args="{port}",
    errors=frozenset({0x4A}),
    example=("&3FCPD8", ">&3FCPD2", "&3FCPD8", ">&3FCPD0"),
):
    """割込みモード取得: get the edge that sets off an interrupt."""

    port: InterruptInput = Field(description=PORT)


class SetInterruptMode(
    RorzeCommand[Ack],
    code="CPS",
    args="{port},{edge}",
    moving=False,
    errors=frozenset({0x4A, 0x50}),
    retry=Retry.NEVER,
    effect=Effect.SETTING,
    example=("&3FCPS8,1", ">&3FCPS", "&3FCPS8,0", ">&3FCPS"),
):
    """割込みモード設定: arm an interrupt for the next move, or switch it off.

    Clears the position numbers set by CFS to 0 and puts the pulse output in its idle state (RC-420 manual
    13.9.4).
    """

    port: InterruptInput = Field(description=PORT)
    edge: InterruptEdge


class GetErrorOutputStatus(
    Question[ErrorOutputs],
    code="CRD",
    args="{cause}|",
    errors=frozenset({0x4A}),
    example=("&3FCRDE", ">&3FCRD1", "&3FCRD", ">&3FCRDH4"),
):
    """エラー出力状態取得: get whether one cause has set its error output, or which causes have."""

    cause: ErrorCause | None = Field(None, description=f"{CAUSE} Left out, all causes.")


class ClearErrorOutputStatus(
    RorzeCommand[Ack],
    code="CRS",
    retry=Retry.CONDITIONAL,
    effect=Effect.CLEARING,
    example=("&3FCRS", ">&3FCRS"),
):
    """エラー出力状態解除: take back all error outputs; each takes the opposite of its error state."""


class GetInterruptRange(
    Question[Bounds],
    code="CSD",
    args="{port}",
    program=False,
    errors=frozenset({0x4A}),
    example=(
        "&3FCSD8",
        ">&3FCSD-000000050,+000000050",
        "&3FCSD8",
        ">&3FCSD-999999999,+999999999",
    ),
):
    """割込み有効区間取得: get the positions between which an interrupt is heeded."""

    port: InterruptInput = Field(description=PORT)


class SetInterruptRange(
    Interval,
    RorzeCommand[Ack],
    code="CSS",
    args="{port}<,{lower},{upper}>",
    moving=False,
    errors=frozenset({0x4A, 0x50}),
    retry=Retry.SETTING,
    example=("&3FCSS8,-50,50", ">&3FCSS", "&3FCSS8", ">&3FCSS"),
):
    """割込み有効区間設定: set the positions between which an interrupt is heeded; by default all."""

    port: InterruptInput = Field(description=PORT)
