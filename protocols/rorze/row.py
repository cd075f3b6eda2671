"""The columns of the RC-420 command table, and the body numbers a command can be addressed to."""

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import ClassVar, Final, Literal

from protocols.rorze.notation import PositionReference
from protocols.table import Ack, Command, Effect, R_co, Retry

LAST_BODY = 0x77
FIRST_GROUP, LAST_GROUP = 0x80, 0x9E
MOVE_ENDED, EVENT, LINK_MASTER = 0x7D, 0x7E, 0x7F

ModeName = Literal["stepping", "encoder", "servo"]
MODE_NAMES: Final[Mapping[str, ModeName]] = MappingProxyType({"0": "stepping", "1": "encoder", "2": "servo"})
"""The operating modes (RC-420 manual 13.1)."""

MAX_COMMAND_LENGTH = 60
"""Characters between introducer and CR; longer commands are refused with error 23h (RC-420 manual 12)."""


WRONG_MODE: Final = 0x61
OTHER_MODE: Final = frozenset({WRONG_MODE})
"""An assumption: the manual marks commands by operating mode, but not what they answer in another one."""
OF_THE_FORM: Final = frozenset({0x23, 0x49, 0x4A, 0x4B, 0x5D})
"""Too long, no command, wrong parameters, a wrong checksum behind the RC-400, a value out of range."""


class RorzeCommand(Command[R_co]):
    """A row of RC-420 manual chapter 19, with the columns of its page in chapter 14."""

    modes: ClassVar[str] = "012"
    """Operating modes in which it is allowed, by their digits."""
    moving: ClassVar[bool] = True
    """Allowed while the motor moves."""
    program: ClassVar[bool] = True
    """Allowed in a user program."""
    errors: ClassVar[frozenset[int]] = frozenset()
    """Error codes that its page lists, or that chapter 21 has for what it does."""
    takes_s: ClassVar[float] = 0.0
    """Seconds before the reply comes, beyond the usual: 1.5 for the flash memory (RC-420 manual 14.12)."""

    def __init_subclass__(
        cls,
        *,
        code: str | None = None,
        args: str | None = None,
        modes: str | None = None,
        moving: bool | None = None,
        program: bool | None = None,
        errors: frozenset[int] | None = None,
        takes_s: float | None = None,
        retry: Retry | None = None,
        effect: Effect | None = None,
        starts: bool | None = None,
        echo: tuple[str, ...] | None = None,
        example: tuple[str, ...] | None = None,
    ) -> None:
        """Take the columns from the class keywords."""
        super().__init_subclass__(args="" if args is None and code else args)
        columns: dict[str, object] = {
            "code": code,
            "modes": modes,
            "moving": moving,
            "program": program,
            "errors": errors,
        }
        columns |= {"takes_s": takes_s, "retry": retry, "echo": echo, "example": example}
        cls._take_columns(columns | {"effect": effect, "starts": starts})

    @cached_property
    def frame_text(self) -> str:
        """Code and parameters as they stand on the wire; they are written out once."""
        return self.code + self.written()

    def rules_out(self, error: int | None) -> bool:
        """Say whether this error cannot be the answer to the command as written (RC-420 manual 21).

        The command must then have arrived changed. A row keeps the form of its page, which lists 4Ah and 5Dh
        where a value may be wrong nevertheless.
        """
        return error in OF_THE_FORM and error not in self.errors

    @cached_property
    def steps_index(self) -> bool:
        """True if the command steps the position index, with `P[+]` or `P[-]` (RC-420 manual 13.4.3)."""
        return any(map(_steps, self.__dict__.values()))

    def retry_class(self) -> Retry:
        """The retry class of this very command: each time it steps the position index is another step."""
        return Retry.NEVER if self.steps_index else self.retry

    @cached_property
    def is_only_question(self) -> bool:
        """True if all commands of the code ask the same and change nothing: a read without parameters."""
        return self.retry is Retry.READ and not self.__pydantic_fields__


def _steps(value: object) -> bool:
    return isinstance(value, PositionReference) and isinstance(value.position, str)


class Question(RorzeCommand[R_co], retry=Retry.READ):
    """Asks for what the controller holds, and changes nothing."""


class Setting(RorzeCommand[Ack], retry=Retry.SETTING):
    """Sets what can be read back, and is answered with its bare code."""


class LinkMasterCommand(RorzeCommand[R_co]):
    """A command to the RC-400 itself, at body number 7F."""
