"""Rules across the bodies of a line, asked in the instant in which a frame is written."""

from collections.abc import Callable, Sequence

from gateway.core.errors import BodyBusy, Cancelled, GatewayError, InvalidRequest
from gateway.rorze.bodies import Body
from gateway.rorze.line import Line, shown
from gateway.rorze.power import needs_place
from gateway.rorze.session import RorzeExchange
from protocols.rorze.programs import RunProgram, StepProgram
from protocols.table import Effect


class Guards:
    """The guards of one line, which stand at its gate."""

    def __init__(
        self,
        line: Line,
        bodies: Sequence[Body],
        stopping: Callable[[Body], bool],
        keeps_out: Callable[[Body, RorzeExchange], bool],
        restored: Callable[[Body, RorzeExchange], bool],
        refuses_program: Callable[[Body, str], GatewayError | None],
    ) -> None:
        self._line = line
        self._bodies = {body.number: body for body in bodies}
        self._stopping = stopping
        """True if a stop of a body is not confirmed yet."""
        self._keeps_out = keeps_out
        """True if an exchange would divide the upload of a program to a body."""
        self._restored = restored
        """True if an exchange would change a body to which a backup is being restored."""
        self._refuses_program = refuses_program
        """Why the program of a body must not be started now."""
        line.gate.add(self._refuses)

    def _refuses(self, exchange: RorzeExchange, now: float) -> GatewayError | None:
        reached = self._reached_by(exchange)
        return (
            self._flash_while_moving(exchange)
            or self._motion_at_the_wrong_time(exchange, reached, now)
            or self._amid_an_upload(exchange, reached)
            or self._amid_a_restore(exchange, reached)
        )

    def _reached_by(self, exchange: RorzeExchange) -> list[Body]:
        alone = self._bodies.get(exchange.target)
        if alone is not None:
            return [alone]
        members = self._line.groups.get(exchange.target, ())
        return [body for number, body in self._bodies.items() if number in members]

    def _flash_while_moving(self, exchange: RorzeExchange) -> GatewayError | None:
        """A flash command holds up the line for 1.5 s: not while anything moves there, or may move."""
        if not exchange.command.takes_s:
            return None
        code = exchange.command.code
        moving = [body.address for body in self._bodies.values() if body.moving]
        if moving:
            return BodyBusy(f"{', '.join(moving)} moves; {code} was not sent.", "Wait for standstill.")
        unread = [body.address for body in self._bodies.values() if body.moving is None and body.online]
        if unread:
            return BodyBusy(
                f"Whether {', '.join(unread)} moves is not known yet; {code} was not sent.",
                "Try again when the status has been read.",
            )
        return None

    def _motion_at_the_wrong_time(
        self, exchange: RorzeExchange, reached: Sequence[Body], now: float
    ) -> GatewayError | None:
        """Refuse a motion before a stop is confirmed, to a lost place, or without a known end."""
        if exchange.command.effect is not Effect.MOTION:
            return None
        return (
            self._while_stopping(reached)
            or self._to_a_lost_place(exchange, reached, now)
            or self._without_a_move(exchange, reached)
            or self._program_without_end(exchange, reached)
        )

    def _while_stopping(self, reached: Sequence[Body]) -> GatewayError | None:
        """Until a stop is confirmed nothing is sent that could move the motor again."""
        stopping = [body.address for body in reached if self._stopping(body)]
        if not stopping:
            return None
        return Cancelled(
            f"The stop of {', '.join(stopping)} is not confirmed yet; nothing was sent.",
            "Wait for standstill.",
        )

    def _to_a_lost_place(
        self, exchange: RorzeExchange, reached: Sequence[Body], now: float
    ) -> GatewayError | None:
        """A motion to a place is written only where the place is what it was when it was asked for."""
        if not needs_place(exchange.command):
            return None
        for body in reached:
            refusal = body.power.refuses_write(body.address, exchange.command, now)
            if refusal is not None:
                return refusal
        return None

    def _without_a_move(self, exchange: RorzeExchange, reached: Sequence[Body]) -> GatewayError | None:
        """Refuse a motion without a record of its move, on any path: it would not be followed to its end."""
        command = exchange.command
        if not command.starts_motion:
            return None
        frame = shown(exchange.frame)
        for body in reached:
            move = body.move
            if move is None or move.frame != frame:
                return InvalidRequest(
                    f"{command.code} starts a move, and {body.address} has no record of it; "
                    "nothing was sent.",
                    "Start a move.",
                )
        return None

    def _program_without_end(self, exchange: RorzeExchange, reached: Sequence[Body]) -> GatewayError | None:
        """A program is started only where it was seen to have no move without an end."""
        command = exchange.command
        if not isinstance(command, RunProgram | StepProgram):
            return None
        refusals = (self._refuses_program(body, command.code) for body in reached)
        return next((refusal for refusal in refusals if refusal is not None), None)

    def _amid_an_upload(self, exchange: RorzeExchange, reached: Sequence[Body]) -> GatewayError | None:
        """While a program is uploaded nothing else changes or runs it, and nothing moves the motor."""
        uploading = [body.address for body in reached if self._keeps_out(body, exchange)]
        if not uploading:
            return None
        return BodyBusy(
            f"A program is being uploaded to {', '.join(uploading)}; {exchange.command.code} was not sent.",
            "Wait for its end or cancel it.",
        )

    def _amid_a_restore(self, exchange: RorzeExchange, reached: Sequence[Body]) -> GatewayError | None:
        """While a backup is restored nothing else changes the body, and nothing moves the motor."""
        restored = [body.address for body in reached if self._restored(body, exchange)]
        if not restored:
            return None
        return BodyBusy(
            f"A backup is being restored to {', '.join(restored)}; {exchange.command.code} was not sent.",
            "Wait for its end or cancel it.",
        )
