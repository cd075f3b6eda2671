"""User programs in the controller: codes U (RC-420 manual 14.U, 15)."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from protocols.rorze.notation import (
    BILLION,
    Digits,
    Flag,
    FlagValue,
    Hex,
    Number,
    Plain,
    Printable,
    SignedValue,
    Word,
)
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack, Effect, R_co, Reply, Retry, Wire

LAST_ADDRESS = 6038
STEPS = LAST_ADDRESS + 1
LARGEST_COUNT = 9_999_999

LABEL = "[0-9A-Za-z_]{1,13}"
"""The name of a place in the program."""
_MEMORY = r"D(?:1[0-9]{2}|[1-9]?[0-9])|[CT][12]?[0-9]"
# Without spaces, which a controller ignores, and without the characters that begin a frame.
_INSTRUCTION = rf"\*{LABEL}|" r'[0-9A-Z][!"%\x27-~]{0,31}'

Label = Annotated[str, Field(pattern=f"^(?:{LABEL})$"), Printable(LABEL)]
Address = Annotated[int, Field(ge=0, le=LAST_ADDRESS), Number()]
AddressValue = Annotated[int, Field(ge=0, le=LAST_ADDRESS), Digits(5)]
Memory = Annotated[str, Field(pattern=f"^(?:{_MEMORY})$"), Printable("[DCT][0-9]{1,3}")]
Instruction = Annotated[str, Field(pattern=f"^(?:{_INSTRUCTION})$"), Printable(_INSTRUCTION)]
StoredInstruction = Annotated[str, Field(pattern="^[ -~]{1,32}$"), Printable("[ -~]{1,32}")]

MEMORY_DESCRIPTION = "Data memory D0-D199, counter C0-C29 or timer T0-T29 (0.1 s)."


class ShortHex(Wire):
    """Up to 32 bits as H and hexadecimal digits, not filled."""

    pattern = "H[0-9A-F]{1,8}"

    def encode(self, value: Any) -> str:
        """Write upper case digits."""
        return f"H{value:X}"

    def decode(self, text: str) -> int:
        """Read the digits after H."""
        return int(text[1:], 16)


class ProgramCommand(RorzeCommand[R_co], program=False):
    """Base of all commands about the user program: not allowed in the program itself."""


class ProgramQuestion(ProgramCommand[R_co], retry=Retry.READ):
    """Base of the questions."""


class PlaceCommand(ProgramCommand[R_co]):
    """A command that may name a place in the program: a label, an address, or neither."""

    label: Label | None = Field(
        None, description="Up to 13 letters, digits and underscores, without the `*`."
    )
    address: Address | None = Field(None, description="Address 0 to 6038.")


class PlaceQuery(PlaceCommand[R_co], errors=frozenset({0x4A, 0x5B}), retry=Retry.READ):
    """A question for what stands at a place; without one, at the place after that of the last question."""

    def retry_class(self) -> Retry:
        """The retry class of this very question: without a place each steps on."""
        return Retry.NEVER if (self.label, self.address) == (None, None) else super().retry_class()

    @property
    def instruction(self) -> str | None:
        """The instruction at the place, if it is known: a label, which the reply thereby repeats."""
        return None if self.label is None else f"*{self.label}"


class AutostartReply(Reply, args="{autostart}"):
    """Start of the program at power-on, on or off."""

    autostart: FlagValue


class GetProgramAutostart(ProgramQuestion[AutostartReply], code="UAD", example=("&3FUAD", ">&3FUAD1")):
    """オートスタート機能取得: tell whether the user program starts at power-on."""


class SetProgramAutostart(
    ProgramCommand[Ack],
    code="UAS",
    args="{autostart}",
    errors=frozenset({0x4A}),
    retry=Retry.SETTING,
    example=("&3FUAS1", ">&3FUAS"),
):
    """オートスタート機能設定: set whether the user program starts at power-on.

    It takes effect once program (FUS) and settings (FIS) are in flash.
    """

    autostart: Flag


class FreeSteps(Reply, args="{steps}"):
    """The room left for the user program."""

    steps: Annotated[int, Field(ge=0, le=STEPS), Digits(5)]


class GetFreeProgramSteps(ProgramQuestion[FreeSteps], code="UBD", example=("&3FUBD", ">&3FUBD01534")):
    """残りステップ数取得: get the steps left for the user program."""


class ClearProgram(
    ProgramCommand[Ack],
    code="UCS",
    moving=False,
    errors=frozenset({0x50, 0x5A}),
    retry=Retry.CONDITIONAL,
    effect=Effect.MAINTENANCE,
    example=("&3FUCS", ">&3FUCS"),
):
    """RAM領域消去: clear the user program in RAM; the copy in flash stays."""


class MemoryReply(Reply, args="{value}|{bits}"):
    """Content of a user memory: a value, or its 32 bits if these were asked for."""

    value: SignedValue | None = None
    bits: Annotated[int, Field(ge=0, le=0xFFFFFFFF), Hex(8)] | None = None


class GetProgramMemory(
    ProgramQuestion[MemoryReply],
    code="UDD",
    args="{memory}|{notation}{memory}",
    errors=frozenset({0x4A}),
    example=("&3FUDDC10", ">&3FUDD+000000099", "&3FUDDHD0", ">&3FUDDH000000FF"),
):
    """ユーザーメモリ取得: get a data memory, counter or timer of the user program.

    Bits set in hexadecimal may not read back correctly as a decimal value.
    """

    memory: Memory = Field(description=MEMORY_DESCRIPTION)
    notation: Annotated[Literal["hexadecimal"], Word(hexadecimal="H")] | None = Field(
        None, description="Ask for the 32 bits; left out, for the decimal value."
    )


class SetProgramMemory(
    ProgramCommand[Ack],
    code="UDS",
    args="{memory},{value}|{memory},{bits}",
    errors=frozenset({0x4A}),
    retry=Retry.SETTING,
    example=("&3FUDSC10,99", ">&3FUDS", "&3FUDSD0,HFF", ">&3FUDS"),
):
    """ユーザーメモリ設定: set a data memory, counter or timer of the user program.

    A counter or timer holds 0 to 9,999,999 (RC-420 manual 15.2.5; 14.U rounds to ten million).
    """

    memory: Memory = Field(description=MEMORY_DESCRIPTION)
    value: Annotated[int, Field(gt=-BILLION, lt=BILLION), Plain()] | None = Field(
        None, description="A decimal value."
    )
    bits: Annotated[int, Field(ge=0, le=0xFFFFFFFF), ShortHex()] | None = Field(
        None, description="32 bits, for a data memory only."
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if not self.memory.startswith("D") and not (
            self.value is not None and 0 <= self.value <= LARGEST_COUNT
        ):
            raise ValueError(f"a counter or timer holds a value of 0 to {LARGEST_COUNT}")
        return self


class AddressReply(Reply, args="{address}"):
    """An address of the user program."""

    address: AddressValue


class GetLastProgramAddress(ProgramQuestion[AddressReply], code="UED", example=("&3FUED", ">&3FUED00534")):
    """最終アドレス取得: get the address at which the next instruction of the user program will be stored.

    0 is an empty program (RC-420 manual 15.2.6; 14.U calls it the last address).
    """


class EndProgram(
    ProgramCommand[Ack],
    code="UES",
    args="<{motor}>",
    errors=frozenset({0x4A}),
    retry=Retry.STOP,
    example=("&3FUES", ">&3FUES"),
):
    """強制終了: end the user program."""

    motor: (
        Annotated[
            Literal["stop_immediately", "stop_decelerating"],
            Word(stop_immediately="0", stop_decelerating="1"),
        ]
        | None
    ) = Field(None, description="Stop of a moving motor before the end; left out, it moves on.")


class GetProgramAddress(ProgramQuestion[AddressReply], code="UND", example=("&3FUND", ">&3FUND00125")):
    """実行アドレス取得: get the address the user program is at, or ended at."""


class ProgramLine(Reply, args="{address},<{instruction}>"):
    """An address of the user program and what stands there."""

    address: AddressValue
    instruction: StoredInstruction | None = None


class GetProgramLine(
    PlaceQuery[ProgramLine],
    code="UPD",
    args="*{label}|{address}|",
    echo=("address", "instruction"),
    example=("&3FUPD*TS", ">&3FUPD00511,*TS", "&3FUPD512", ">&3FUPD00512,WAT5", "&3FUPD", ">&3FUPD00513,END"),
):
    """1アドレス取得(アドレス付き): get one address of the user program, with its number.

    Without label and address: the one after that of the last UPD or UWD.
    """


class ProgramStatus(Reply, args="{status}"):
    """The state of the user program: running, or how it ended."""

    status: Annotated[int, Field(ge=0, le=0xFF), Hex(2)] = Field(
        description="0: ended normally. Bits: 0 running, 1 ended by UES, 2 command error, "
        "3 branch to an empty address, 4 ended by EED, 5 move while moving, 7 one step done."
    )


class GetProgramStatus(ProgramQuestion[ProgramStatus], code="URD", example=("&3FURD", ">&3FURDH00")):
    """実行状況取得: tell how the user program runs or ended."""


class RunProgram(
    PlaceCommand[Ack],
    code="URG",
    args="*{label}|{address}|",
    errors=frozenset({0x4A, 0x5A, 0x5B}),
    retry=Retry.CONDITIONAL,
    effect=Effect.MOTION,
    starts=False,
    example=("&3FURG*ST1", ">&3FURG", "&3FURG125", ">&3FURG"),
):
    """実行開始: run the user program from a label or address, or from its beginning."""


class StepProgram(
    PlaceCommand[Ack],
    code="USG",
    args="*{label}|{address}|",
    errors=frozenset({0x4A, 0x5A, 0x5B}),
    retry=Retry.NEVER,
    effect=Effect.MOTION,
    starts=False,
    example=("&3FUSG*ST1", ">&3FUSG", "&3FUSG", ">&3FUSG"),
):
    """1アドレス実行: execute one address of the user program.

    That after the label, the one given, or the next one (see UND).
    """


class ProgramInstruction(Reply, args="<{instruction}>"):
    """The instruction at an address of the user program; null where the address is empty."""

    instruction: StoredInstruction | None = None


class GetProgramInstruction(
    PlaceQuery[ProgramInstruction],
    code="UWD",
    args="*{label}|{address}|",
    echo=("instruction",),
    example=(
        "&3FUWD*TS",
        ">&3FUWD*TS",
        "&3FUWD512",
        ">&3FUWDWAT5",
        "&3FUWD",
        ">&3FUWDEND",
        "&3FUWD",
        ">&3FUWD",
    ),
):
    """1アドレス取得: get one address of the user program.

    Without label and address: the one after that of the last UPD or UWD.
    """


class AddProgramInstruction(
    ProgramCommand[Ack],
    code="UWS",
    args="{instruction}",
    moving=False,
    errors=frozenset({0x4A, 0x50, 0x5A, 0x5B}),
    retry=Retry.NEVER,
    effect=Effect.MAINTENANCE,
    example=("&3FUWS00M", ">&3FUWS"),
):
    """1アドレス転送: add an instruction or a label at the end of the user program in RAM."""

    instruction: Instruction = Field(
        description="An instruction of up to 32 characters without spaces, or `*` and a label of up to 13."
    )
