"""Command errors that the gateway's own questions leave at a body are cleared again."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Final

from gateway.core.errors import GatewayError
from gateway.rorze.asked_body import AskedBody
from gateway.rorze.knowledge import Tracker
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import (
    CONTROLLER_STATUS_BITS,
    ClearControllerStatus,
    ControllerStatus,
    GetControllerStatus,
)
from protocols.table import Effect, Reply

COMMAND_ERROR: Final = 1 << CONTROLLER_STATUS_BITS.index("command_error")


class OwnRefusals(Tracker):
    """The questions that a body has refused while the gateway looked, such as SPD of a pattern never set.

    9CS clears all errors but STALL (RC-420 manual 14.9), so it is sent only at rest, and where the command
    error stands alone and nobody else has caused it. What cannot be cleared is left: nothing depends on it.
    """

    def __init__(self, body: AskedBody) -> None:
        self._body = body
        self._known_clear = False
        """True if its status had no command error when it was last read, and nothing was refused since."""
        self._looking = 0
        self._ours = False
        """True if a command error that stands now can only be that of a question of ours."""
        self._refused = False

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:  # noqa: ARG002
        """Note what its status tells."""
        if type(reply) is ControllerStatus and reply.bits is not None:
            self._known_clear = not reply.bits & COMMAND_ERROR

    def done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """Note that its errors were cleared."""
        self._known_clear |= certain and type(command) is ClearControllerStatus

    def refused(self, command: RorzeCommand[Any]) -> None:
        """Note that it has refused a command: what is no question was a caller's."""
        self._known_clear = False
        self._refused = True
        self._ours = self._ours and command.effect is Effect.READ

    @asynccontextmanager
    async def cleared(self) -> AsyncIterator[None]:
        """Leave no command error of what is asked inside; of several who look at once the last clears."""
        if not self._looking:
            self._ours, self._refused = self._known_clear, False
        self._looking += 1
        try:
            yield
        finally:
            self._looking -= 1
            if not self._looking and self._refused and self._ours:
                await self._clear()

    async def _clear(self) -> None:
        body = self._body
        try:
            async with body.line.undivided([body.number]):
                status, _ = await body.ask(GetControllerStatus())
                if status.bits == COMMAND_ERROR and self._ours:
                    await body.ask(ClearControllerStatus())
        except GatewayError:
            return
