"""The columns of the C-HOST command table: when a command is answered, what blocks it (C-HOST manual 1-7)."""

from collections.abc import Mapping
from enum import StrEnum
from functools import cached_property
from types import MappingProxyType
from typing import ClassVar, Final

from protocols.members import at_hand
from protocols.table import Ack, Command, Effect, R_co, Retry

NAME_LENGTH = 3


@at_hand
class WhenAnswered(StrEnum):
    """When a command is answered, in either communication mode (C-HOST manual 1-1-1, 1-7)."""

    ALWAYS = "always"
    """A query: answered at once in both modes."""
    ON_COMPLETION = "on_completion"
    """Ver.2: never. Ver.3: with its bare name when it is done, with an error when it is not."""
    AT_ONCE = "at_once"
    """Ver.2: never. Ver.3: with its bare name as soon as it is accepted, as JOG is."""


@at_hand
class Block(StrEnum):
    """A state in which the system takes no command: a letter of the manual's table (C-HOST manual 1-7)."""

    TERMINAL_RUNS = "a"
    """Automatic operation, homing or JOG from the teaching terminal."""
    TERMINAL_EDITS = "b"
    """Data or parameters are being edited at the teaching terminal."""
    MOTION = "c"
    """A motion command or a macro of the host is under way."""
    UNIT_MOTION = "d"
    """A motion command of the host is under way in the present unit."""


BLOCK_ERRORS: Final[Mapping[Block, str]] = MappingProxyType(
    {Block.TERMINAL_RUNS: "E01", Block.TERMINAL_EDITS: "E03", Block.MOTION: "E01", Block.UNIT_MOTION: "E01"}
)
"""The error each block is reported with (C-HOST manual 1-7)."""

UPLOAD_ERROR: Final = "E03"
"""Refusal of a command between POF 1 and POF 2. An assumption: the manual prints no error for it."""


OUT_OF_RANGE: Final = "E05"
WRONG_FORM: Final = "E06"
NO_SUCH_MACRO: Final = "E12"


class FicsCommand(Command[R_co], args=""):
    """A row of C-HOST manual 1-7 or 4-1; a setting and its query are two rows of the same name."""

    answered: ClassVar[WhenAnswered] = WhenAnswered.ON_COMPLETION
    blocked: ClassVar[frozenset[Block]] = frozenset()
    """The states in which it is refused."""
    during_upload: ClassVar[bool] = False
    """Allowed between POF 1 and POF 2."""
    answered_as: ClassVar[str] = ""
    """The name its answers carry, where it is not its own."""
    ranged: ClassVar[bool] = False
    """True if the page gives the whole range of its values for every robot: the row keeps them within."""
    ends_with: ClassVar[str] = ""
    """The name that follows the last of several answers; empty where there is only one."""

    def __init_subclass__(
        cls,
        *,
        code: str | None = None,
        args: str | None = None,
        answered: WhenAnswered | None = None,
        blocked: str | None = None,
        during_upload: bool | None = None,
        answered_as: str | None = None,
        ends_with: str | None = None,
        ranged: bool | None = None,
        retry: Retry | None = None,
        effect: Effect | None = None,
        echo: tuple[str, ...] | None = None,
        example: tuple[str, ...] | None = None,
    ) -> None:
        """Take the columns from the class keywords; `blocked` is the letters of the manual's table."""
        super().__init_subclass__(args=args)
        columns: dict[str, object] = {
            "code": code,
            "answered": answered,
            "blocked": None if blocked is None else frozenset(map(Block, blocked)),
            "during_upload": during_upload,
            "answered_as": answered_as,
            "ends_with": ends_with,
            "ranged": ranged,
        }
        cls._take_columns(columns | {"retry": retry, "effect": effect, "echo": echo, "example": example})

    @cached_property
    def text(self) -> str:
        """The command as it stands on the wire, without terminator; it is written out once."""
        parameters = self.written()
        return f"{self.code} {parameters}" if self.code and parameters else self.code or parameters

    @cached_property
    def reply_names(self) -> tuple[str, ...]:
        """Names that a reply can have: of a refusal, of an answer, and of the line that ends several."""
        name = self.code or self.wire_name()
        return (name, self.answered_as, self.ends_with) if self.answered_as or self.ends_with else (name,)

    def wire_name(self) -> str:
        """The three characters it begins with; a macro's are its own."""
        return self.code

    @classmethod
    def is_query(cls) -> bool:
        """Say whether the command is answered with data, in both modes."""
        return cls.answered is WhenAnswered.ALWAYS

    @classmethod
    def is_told_apart(cls) -> bool:
        """Say whether the reply repeats all parameters, so that no other command of the row can have it."""
        return bool(cls.echo) and set(cls.echo) == set(cls.model_fields)

    def rules_out(self, error: str) -> bool:
        """Say whether this error cannot be the answer to the command as written (C-HOST manual 2-12).

        The command must then have arrived changed. A row keeps the form of its page; a name that is no
        macro's has never been one.
        """
        no_such_macro = error == NO_SUCH_MACRO and bool(self.code)
        out_of_range = error == OUT_OF_RANGE and (self.ranged or not self.model_fields_set)
        return error == WRONG_FORM or no_such_macro or out_of_range


class Query(FicsCommand[R_co], answered=WhenAnswered.ALWAYS, retry=Retry.READ):
    """A command that is answered with data and changes nothing."""


class RobotAction(FicsCommand[Ack]):
    """A command that does something; Ver.3 answers its bare name, Ver.2 nothing."""
