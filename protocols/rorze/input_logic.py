"""How input levels become bits, contacts and noise filters: code D (RC-420 manual 13.9, 14)."""

from typing import Annotated, Literal

from pydantic import Field

from protocols.rorze.inputs_outputs import SENSORS, InputBit, InputMask
from protocols.rorze.notation import Digits, Hex, Number, Word
from protocols.rorze.row import Question, Setting
from protocols.table import Reply

Contact = Annotated[Literal["normally_open", "normally_closed"], Word(normally_open="0", normally_closed="1")]
FilterBit = Annotated[int, Field(ge=0, le=14), Number()]
SensorBit = Annotated[int, Field(ge=0, le=6), Number()]
SensorLogicMask = Annotated[int, Field(ge=0, le=0x7F), Hex(2)]

CONTACT = "Contact A is normally open, contact B normally closed."
INPUT = "General input, 0-9; left out, all."
INPUT_BITS = "All inputs, bit 0 is D0; a 1 is normally closed."
SENSOR = f"{SENSORS}, 6 the CLR output; left out, all."
SENSOR_BITS = f"Bits: {SENSORS}, 6 the CLR output; a 1 is normally closed."
FILTERED = "0-7 general inputs, 8 unused, 9 STALL, 10 ORG, 11 CW limit, 12 CCW limit, 13 INP, 14 EMS"
COUNT = "Equal samples, one each ms, that make a change of level, 1-99; 1 filters nothing."


class NoiseFilter(Reply, args="{count}"):
    """The count of an input's noise filter."""

    count: Annotated[int, Field(ge=1, le=99), Digits(3)] = Field(description=COUNT)


class InputLogic(Reply, args="{contact}|{bits}"):
    """The logic of one general input, or of all ten."""

    contact: Contact | None = Field(None, description=CONTACT)
    bits: InputMask | None = Field(None, description=INPUT_BITS)


class SensorLogic(Reply, args="{contact}|{bits}"):
    """The logic of one sensor input or the CLR output, or of all seven."""

    contact: Contact | None = Field(None, description=CONTACT)
    bits: SensorLogicMask | None = Field(None, description=SENSOR_BITS)


class GetNoiseFilter(
    Question[NoiseFilter],
    code="DCD",
    args="{bit}",
    program=False,
    errors=frozenset({0x4A}),
    example=("&3FDCD14", ">&3FDCD005", "&3FDCD3", ">&3FDCD001"),
):
    """ノイズキャンセル・カウント取得: get the count of an input's noise filter."""

    bit: FilterBit = Field(description=f"{FILTERED}.")


class SetNoiseFilter(
    Setting,
    code="DCS",
    args="{bit},{count}|{count}",
    program=False,
    errors=frozenset({0x4A}),
    example=("&3FDCS14,5", ">&3FDCS", "&3FDCS1", ">&3FDCS"),
):
    """ノイズキャンセル・カウント設定: set the count of an input's noise filter, or of all; 1 by default."""

    bit: FilterBit | None = Field(None, description=f"{FILTERED}; left out, all.")
    count: Annotated[int, Field(ge=1, le=99), Number()] = Field(description=COUNT)


class GetInputLogic(
    Question[InputLogic],
    code="DID",
    args="{bit}|",
    errors=frozenset({0x4A}),
    example=("&3FDID1", ">&3FDID0", "&3FDID", ">&3FDIDH003F"),
):
    """汎用入力論理取得: get the logic of one general input, or of all."""

    bit: InputBit | None = Field(None, description=INPUT)


# The pages of DIS and DLD are lost; their columns are those of DID and DLS.
class SetInputLogic(
    Setting,
    code="DIS",
    args="{bit},{contact}|{bits}",
    errors=frozenset({0x4A}),
    example=("&3FDIS0,1", ">&3FDIS", "&3FDIS9,1", ">&3FDIS"),
):
    """汎用入力論理設定: set the logic of one general input, or of all; normally open by default."""

    bit: InputBit | None = Field(None, description="General input, 0-9; with `contact`.")
    contact: Contact | None = Field(None, description=CONTACT)
    bits: Annotated[int, Field(ge=0, le=0x3FF), Hex(4, least=1)] | None = Field(
        None, description=f"{INPUT_BITS} Instead of `bit` and `contact`."
    )


class GetSensorLogic(
    Question[SensorLogic],
    code="DLD",
    args="{bit}|",
    errors=frozenset({0x4A}),
    example=("&3FDLD0", ">&3FDLD1", "&3FDLD", ">&3FDLDH01"),
):
    """センサ入力論理取得: get the logic of one sensor input, or of all."""

    bit: SensorBit | None = Field(None, description=SENSOR)


class SetSensorLogic(
    Setting,
    code="DLS",
    args="{bit},{contact}|{bits}",
    errors=frozenset({0x4A}),
    example=("&3FDLS0,1", ">&3FDLS", "&3FDLSH01", ">&3FDLS"),
):
    """センサ入力論理設定: set the logic of one sensor input, or of all; normally open by default."""

    bit: SensorBit | None = Field(None, description=f"{SENSORS}, 6 the CLR output; with `contact`.")
    contact: Contact | None = Field(None, description=CONTACT)
    bits: Annotated[int, Field(ge=0, le=0x7F), Hex(2, least=1)] | None = Field(
        None, description=f"{SENSOR_BITS} Instead of `bit` and `contact`."
    )
