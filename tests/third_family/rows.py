"""The command table of toy axes: rows say what is said, a codec how it stands in binary frames."""

from binascii import crc_hqx
from struct import Struct
from typing import Annotated, Any, ClassVar, Final, NamedTuple, Self

from pydantic import Field

from protocols.lines import Garbage
from protocols.packed import Packed, Packing
from protocols.table import Ack, Command, Effect, R_co, Reply, Retry

START, REFUSED, SIZE = 0xA5, 0xFF, 22
FRAME: Final = Struct(">BHB16s")
"""Start, number of the command, code, and data with zeros behind; two bytes of CRC follow."""


class Frame(NamedTuple):
    """A command, or the reply to the one with its number."""

    number: int
    code: int
    data: bytes

    def packed(self) -> bytes:
        body = FRAME.pack(START, *self)
        return body + crc_hqx(body, 0).to_bytes(2)


class Frames:
    """Cuts a stream into frames whose CRC is right."""

    def __init__(self) -> None:
        self._begun = b""

    def feed(self, data: bytes, /) -> list[Frame | Garbage]:
        found: list[Frame | Garbage] = []
        self._begun += data
        while len(self._begun) >= SIZE:
            frame = self._begun[:SIZE]
            good = frame[0] == START and not crc_hqx(frame, 0)
            found.append(Frame(*FRAME.unpack_from(frame)[1:]) if good else Garbage(frame[:1], "no frame"))
            self._begun = self._begun[len(frame) if good else 1 :]
        return found

    def pending(self) -> int:
        return len(self._begun)


class ToyCommand(Command[R_co]):
    """A row of the toy's table; its code is a byte in two digits."""

    codec: ClassVar = Packing()

    def __init_subclass__(cls, *, code: str = "", args: str = "", **columns: Any) -> None:
        super().__init_subclass__(args=args)
        cls._take_columns({"code": code, "retry": None, "effect": None, **columns})

    @classmethod
    def of_example(cls) -> Self:
        return cls.unpack(FRAME.unpack_from(cls.example[0])[3])

    def frame(self, number: int) -> bytes:
        return Frame(number, int(self.code, 16), self.packed()).packed()


class Status(Reply):
    """All that an axis tells."""

    codec: ClassVar = Packing()
    place: Annotated[int, Packed("i")]
    speed: Annotated[int, Packed("H")]
    moves: Annotated[bool, Packed("?")]
    stopped: Annotated[bool, Packed("?")] = Field(description="True if a stop has ended its last motion.")
    alarm: Annotated[int, Packed("B")]
    newest: Annotated[int, Packed("H")] = Field(description="The number of the newest motion it has taken.")
    life: Annotated[int, Packed("H")] = Field(description="Number of times it was switched on.")


class Done(Ack):
    """It is taken."""

    codec: ClassVar = Packing()


def _frame(head: str, crc: str) -> tuple[bytes]:
    """Write out a frame: its bytes up to the zeros, and the CRC."""
    return (bytes.fromhex(head).ljust(FRAME.size, b"\0") + bytes.fromhex(crc),)


class GetStatus(ToyCommand[Status], code="01", retry=Retry.READ, example=_frame("A5 0007 01", "BF15")):
    """状態: tell where it is and what it does."""


class SetSpeed(ToyCommand[Done], code="02", retry=Retry.SETTING, example=_frame("A5 0007 02 0032", "1074")):
    """速度: set the speed, in steps per second; it is kept without power."""

    speed: Annotated[int, Field(ge=1, le=999), Packed("H")]


class Home(ToyCommand[Done], code="10", effect=Effect.MOTION, example=_frame("A5 0007 10", "B1F6")):
    """原点復帰: find 0."""


class Go(ToyCommand[Done], code="11", effect=Effect.MOTION, example=_frame("A5 0007 11 00000064", "D301")):
    """移動: move to a place, in steps."""

    place: Annotated[int, Field(ge=-100_000, le=100_000), Packed("i")]


class Jog(ToyCommand[Done], code="12", effect=Effect.MOTION, example=_frame("A5 0007 12 01", "3816")):
    """寸動: move on until it is stopped, up or down."""

    up: Annotated[bool, Packed("?")]


class Halt(ToyCommand[Done], code="20", retry=Retry.STOP, example=_frame("A5 0007 20", "93F5")):
    """停止: stop."""


ROWS: Final = (GetStatus, SetSpeed, Home, Go, Jog, Halt)
