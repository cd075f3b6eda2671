"""Moves without an end in user programs, refused where the configuration allows none (RC-420 manual 15)."""

from collections.abc import Sequence

from gateway.core.errors import BodyBusy, GatewayError, InvalidText, Misplaced
from gateway.rorze.bodies import Body
from gateway.rorze.stored_program import read_instructions
from protocols.rorze.moves import RelativeMove
from protocols.rorze.user_program.instruction import Communication, Instruction, InstructionFault, parse
from protocols.table import WireFault

MOST_TOLD = 100
"""So many lines are named at once."""
REMEDY = "Give a distance, or set allow_endless_moves in the configuration."


class EndlessPrograms:
    """Refuses programs with a move that only a stop ends (`1+MZ`), at the upload and at the start."""

    def __init__(self, *, allowed: bool) -> None:
        self._allowed = allowed

    def forbid(
        self, instructions: Sequence[Instruction], lines: Sequence[int], what: str, text: str = "source"
    ) -> None:
        """Refuse a program that has one; `lines` are those in its `text`, and `what` was not done.

        :raises InvalidText: it has, with each line.
        """
        if self._allowed:
            return
        endless = [line for text, line in zip(instructions, lines, strict=True) if has_no_end(text)]
        if endless:
            reason = "The move has no end, and the configuration does not allow that."
            raise InvalidText(
                text,
                f"Line {endless[0]}: {reason} {what}.",
                REMEDY,
                [Misplaced(line, 1, reason) for line in endless[:MOST_TOLD]],
            )

    async def learn(self, body: Body) -> None:
        """Know that the program in a body has none before it is run; read where it may be another.

        :raises InvalidText: it has, with each line; line N stands at address N - 1.
        :raises GatewayError: it could not be read.
        """
        if self._allowed or body.told.program_ends:
            return
        program = [_parsed(text) for text in await read_instructions(body)]
        self.forbid(program, range(1, len(program) + 1), f"The program of {body.address} was not started")
        body.told.program_was_read()

    def refuses_start(self, body: Body, code: str) -> GatewayError | None:
        """Why a program must not be started in this instant: it may be another than was looked at."""
        if self._allowed or body.told.program_ends:
            return None
        return BodyBusy(
            f"{body.address} may have another program than was searched for moves without an end, "
            f"or its power or line was away; {code} was not sent.",
            "Start it again: its program is read anew.",
        )


def has_no_end(instruction: Instruction) -> bool:
    """Tell whether an instruction is a move that only a stop ends."""
    if not isinstance(instruction, Communication) or not issubclass(instruction.row, RelativeMove):
        return False
    try:
        command = instruction.command(lambda _: 1)
    except WireFault:
        return False
    return isinstance(command, RelativeMove) and command.distance == "endless"


def _parsed(text: str) -> Instruction:
    """Parse what a controller tells; what is no known instruction counts as a label, which moves nothing."""
    try:
        return parse(text)
    except InstructionFault:
        return parse("*X")
