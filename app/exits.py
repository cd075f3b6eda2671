"""How a command of the command line ends: the exit codes that scripts read, and one sentence why."""

import errno
from typing import Any

import typer
from typer.core import TyperGroup

DONE = 0
REFUSED = 1
"""Exit code of a request that was refused or did not succeed: the gateway's answer says why."""
USAGE = 2
NOT_SENT = 3
"""The gateway could not be reached or could not start, or it sent nothing."""
UNKNOWN = 4
"""Exit code of a request that was sent, and whose outcome is unknown."""
UNDER_WAY = 5
"""Exit code of an action that is still under way when the wait for its end is over."""
CONFIG = 78

IN_WORDS = (
    "Exit codes: 0 done; 1 refused, or not succeeded; 2 wrong arguments; 3 nothing was sent; 4 sent, "
    "and nobody knows what became of it, or a stop is not confirmed; 5 still under way when the time of "
    "--wait was over; 78 wrong configuration."
)

_BY_WEIGHT = (DONE, UNDER_WAY, USAGE, REFUSED, NOT_SENT, UNKNOWN)


class Failure(Exception):
    """A command did not do what was asked; the message is for people, the code for scripts."""

    def __init__(self, sentence: str, code: int) -> None:
        super().__init__(sentence)
        self.code = code


class Misuse(Failure):
    """A command was not understood, and nothing was sent; the sentence comes without its full stop."""

    def __init__(self, sentence: str) -> None:
        super().__init__(f"{sentence}. Nothing was sent.", USAGE)


class Commands(TyperGroup):
    """Commands that end with a sentence on standard error and its exit code where they fail."""

    def invoke(self, ctx: Any) -> Any:  # typer does not export the type of what it hands in
        """Run the command that was named."""
        try:
            return super().invoke(ctx)
        except Failure as failure:
            typer.echo(str(failure), err=True)
            raise typer.Exit(failure.code) from None
        except OSError as error:  # of standard output: it is written to when all else is done
            if error.errno == errno.EPIPE:  # nobody reads on: no matter for people
                raise
            typer.echo(
                f"The outcome cannot be printed: {error.strerror}. What was asked for may have been done: "
                "read status and position before anything else.",
                err=True,
            )
            raise typer.Exit(UNKNOWN) from None


def worst(*codes: int) -> int:
    """The code of several things that were done together: that of what people have to see to first."""
    return max(codes, key=_BY_WEIGHT.index, default=DONE)
