"""The command table of toy axes."""

from typing import Annotated, Any, ClassVar, Final

from pydantic import Field

from protocols.table import Ack, Command, Effect, Reply, Retry, Wire


class _Whole(Wire):
    pattern = "-?[0-9]{1,6}"

    def decode(self, text: str) -> int:
        return int(text)


Amount = Annotated[int, Field(ge=-100_000, le=100_000), _Whole()]
Number = Annotated[int, Field(ge=0, le=999), _Whole()]


class ToyCommand(Command[Any]):
    """A row of the toy's table."""

    answered: ClassVar[bool] = True

    def __init_subclass__(
        cls,
        *,
        code: str = "",
        args: str = "",
        retry: Retry | None = None,
        effect: Effect | None = None,
        echo: tuple[str, ...] | None = None,
        example: tuple[str, ...] | None = None,
    ) -> None:
        super().__init_subclass__(args=args)
        cls._take_columns({"code": code, "retry": retry, "effect": effect, "echo": echo, "example": example})


class PlaceReply(Reply, args="{place} {moves}"):
    """Where the axis is, and whether it moves."""

    place: Amount
    moves: Annotated[int, Field(ge=0, le=1), _Whole()]


class EchoReply(Reply, args="{number}"):
    """The number that was sent."""

    number: Number


class GetPlace(ToyCommand, code="PL", retry=Retry.READ, example=("PL",)):
    """位置: where the axis is."""

    _reply_type = PlaceReply


class Echo(ToyCommand, code="EC", args="{number}", retry=Retry.READ, echo=("number",), example=("EC 7",)):
    """反響: a number comes back."""

    _reply_type = EchoReply
    number: Number


class SetSpeed(ToyCommand, code="SP", args="{speed}", retry=Retry.SETTING, example=("SP 50",)):
    """速度: set the speed, in steps per second."""

    _reply_type = Ack
    speed: Number


class Go(ToyCommand, code="GO", args="{place}", effect=Effect.MOTION, example=("GO 100",)):
    """移動: move to a place, in steps."""

    _reply_type = Ack
    place: Amount


class Halt(ToyCommand, code="HT", retry=Retry.STOP, example=("HT",)):
    """停止: stop the axis."""

    _reply_type = Ack


ROWS: Final = (GetPlace, Echo, SetSpeed, Go, Halt)
