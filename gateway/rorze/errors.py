"""Refusals of bodies and of the link master."""

from collections.abc import Sequence
from typing import Any

from gateway.core.errors import CommandGarbled, ControllerRefused, GatewayError
from protocols.rorze.errors import lookup
from protocols.rorze.row import RorzeCommand

LASTING = frozenset({0x23, *range(0x40, 0x48), 0x4A, 0x54, 0x5B, 0x5D, 0x5E, 0x5F, *range(0x61, 0x66)})
"""Errors that the same request meets again until it, or a setting, is changed (RC-420 manual 21)."""

MOVING = "0x50"
"""Refusal of a command that is allowed at standstill only (RC-420 manual 21)."""
SAME_GROUP = "0x4C"
"""Refusal of a command while another of its group is executed; the manual does not define the groups."""
IN_MOTION = frozenset({MOVING, SAME_GROUP})
"""Refusals of a motion while the motor moves, or executes another command of the same group."""


def refused(address: str, command: RorzeCommand[Any], error: int | None) -> ControllerRefused:
    """The error of a command that a body, or the link master, has refused."""
    code, text = None if error is None else f"0x{error:02X}", lookup(error, command.code)
    if command.rules_out(error):
        return CommandGarbled(address, command.code, code, text)
    return ControllerRefused(address, command.code, code, text, lasting=error in LASTING)


def is_evasive(error: int | GatewayError | None) -> bool:
    """True if a refusal is no sign of a body: a link master may answer so for one that is not there."""
    code = f"0x{error:02X}" if isinstance(error, int) else getattr(error, "error_code", None)
    return code == SAME_GROUP


class ProgramDiffers(GatewayError):
    """A user program was sent, and what the body holds is another one."""

    kind = "program-differs"
    retryable = True

    def __init__(self, detail: str, line: int) -> None:
        super().__init__(detail, "Upload it again before it is run.")
        self.line = line
        """The first line of the source that differs, from 1."""


class SaveUncertain(GatewayError):
    """A body has lost its power around the moment in which it wrote to flash memory."""

    kind = "save-uncertain"
    retryable = True

    def __init__(self, address: str, what: str, remedy: str) -> None:
        super().__init__(
            f"{address} has lost its power before or while it wrote {what} to flash memory.", remedy
        )


class TakenOtherwise(GatewayError):
    """A setting was acknowledged, and the body tells another value afterwards."""

    kind = "taken-otherwise"
    retryable = True


class PartlyDone(GatewayError):
    """Some of several settings were changed, the rest were not."""

    kind = "partly-done"

    def __init__(self, address: str, done: Sequence[str], left: Sequence[str], cause: GatewayError) -> None:
        failed, *others = left
        rest = f" {', '.join(others)} was not sent." if others else ""
        super().__init__(
            f"{address} took {', '.join(done)}; then {failed} was not done: {cause.detail}{rest} Nothing "
            "moved because of it.",
            "Read what is set now, and change the rest.",
        )
