"""One command on its way to a body, a group or the link master, and what its replies mean."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from gateway.core.errors import CommandGarbled, ControllerRefused, GatewayError
from gateway.core.exchange import Exchange, RememberedReply, remedy_of
from protocols.rorze.errors import lookup
from protocols.rorze.link import Answer, GroupAnswer, Refusal
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply, WireFault

CLEAN_AFTER_S = 10.0
"""A line without an error for this time is clean: a body that answers no question and no fence is gone."""
ReplyFrame = Answer | Refusal | GroupAnswer


@dataclass(frozen=True, slots=True)
class Answered:
    """A reply was credited; for a group, one reply or refusal for each member that is in it."""

    replies: dict[int, Reply | Refusal]
    at: float
    late: bool = False
    """It came after its deadline, but before the line was proved to be in step again."""
    text: str = field(default="", compare=False)
    """The text behind the code in the reply of one body, as it came."""


Outcome = Answered | Refusal | GatewayError
"""A refusal by the controller, an answer, or the reason why there is neither."""


@dataclass(eq=False, slots=True)
class RorzeExchange(Exchange[RorzeCommand[Any], ReplyFrame, Answered | Refusal]):
    """A command for a body, a group or the link master."""

    @property
    def body(self) -> int:
        """The number of the body, group or link master."""
        return self.target

    @property
    def key(self) -> tuple[int, str]:
        """Body and code, by which a reply is matched first."""
        return self.target, self.command.code

    @property
    def sent(self) -> str:
        """Code and body."""
        return f"{self.command.code} was sent to body {self.target:02X}"

    @property
    def remedy(self) -> str:
        """A command that steps the position index may have changed that, too."""
        if self.command.steps_index:
            return "Read status, position and the position index (3ID) before anything else."
        return remedy_of(self.command)

    def credit(self, frame: ReplyFrame, now: float) -> Answered | Refusal | None:
        """Read a frame as the reply to this exchange; None unless body, code and the whole grammar match."""
        if frame.code != self.command.code or frame.body != self.target:
            return None
        if isinstance(frame, Refusal):
            return None if self.self_identifying else frame  # a refusal does not carry the number
        try:
            if isinstance(frame, GroupAnswer):
                replies, text = self._member_replies(frame), ""
            else:
                replies, text = {frame.body: self.command.read_reply(frame.payload)}, frame.payload
        except WireFault:
            return None
        return Answered(replies, now, self.doubt is not None, text)

    def mistakes(self, said: RememberedReply) -> bool:
        """True if a copy would be credited, and be wrong (decision 10).

        It is right where the very same was asked, and asking changes nothing: that was true a moment ago.
        """
        if said.exchange.frame == self.frame:
            return not self.command.may_repeat()
        return self.credit(said.frame, 0.0) is not None

    def _member_replies(self, frame: GroupAnswer) -> dict[int, Reply | Refusal]:
        return {
            member: self.command.read_reply(answer.payload) if isinstance(answer, Answer) else answer
            for member, answer in frame.members.items()
        }


# refusals

LASTING = frozenset({0x23, *range(0x40, 0x48), 0x4A, 0x54, 0x5B, 0x5D, 0x5E, 0x5F, *range(0x61, 0x66)})
"""Errors that the same request meets again until it, or a setting, is changed (RC-420 manual 21)."""

MOVING = "0x50"
"""How what is allowed at standstill only is refused (RC-420 manual 21)."""
SAME_GROUP = "0x4C"
"""How a command is refused while another of its group is executed, whatever a group is."""
IN_MOTION = frozenset({MOVING, SAME_GROUP})
"""How a motion is refused while the motor moves, or executes another command of the same group."""


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
