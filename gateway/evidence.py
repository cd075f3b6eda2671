"""What a controller's own state proves of a move: whether it was begun, is over, and how it ended."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from gateway.bodies import Body, MotorState
from gateway.errors import (
    BodyBusy,
    Expired,
    GatewayError,
    MoveFailed,
    NoReply,
    NotExecuted,
    NotSent,
    QueueFull,
)
from gateway.exchange import Lane
from gateway.move_record import LOST_AFTER_S, Move, MoveStatus
from gateway.plans import target_of
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.origin import GetHomingDistance
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import END_CAUSE_BITS, GetEndCause, names_of

RECENT_ERROR_S = 10.0
"""After a garbled or missing reply, what decides the end of a move is read twice for so long."""
POWER_ON_POSITION = 0
"""An assumption: what a controller calls its position, and the distance of its last homing (0PD), when it
has been switched on; a loss of power of 10 ms may switch it on again (RC-420 manual 5.4.2)."""
MOTION_ERRORS = 0x66
"""Bits of the controller status: a limit, EMS, the movement range or STALL can end a move (9CD)."""
MISSING_END_FRAME_S = 0.5
"""An end-of-move frame this late tells that the link master has forgotten to send them."""


class Verdict(NamedTuple):
    """How a move is over."""

    status: MoveStatus
    end_cause: str | None = None
    error: GatewayError | None = None


@dataclass(eq=False)
class Case:
    """A move of one body, with what is known of both."""

    body: Body
    move: Move
    before: MotorState | None = None
    """What the controller said just before the command was sent."""
    tolerance: int = 0
    """Pulses by which the motor may miss the target."""

    # before it is sent

    async def know_the_start(self, command: RorzeCommand[Any]) -> None:
        """Know that the motor rests, where, and where it should come to: the evidence without a reply.

        :raises BodyBusy: it moves; what it does later would prove nothing of this move.
        :raises NotSent: it did not tell.
        :raises ControllerRefused: it did not tell where an entry of its position table leads to.
        """
        body, move = self.body, self.move
        try:
            self.before = await body.where_it_rests()
            move.start_position = move.position = self.before.position
            move.target_position = await target_of(body, command, self.before.position, Lane.PROOF)
            self.tolerance = await self._tolerance()
        except NoReply as error:
            raise NotSent(
                f"{body.address} did not tell its state before the move; the move was not sent.", error.remedy
            ) from None
        if self.before.runs:
            body.may_move()
            raise BodyBusy(
                f"{body.address} moves already, by no move of this gateway; {move.command} was not sent.",
                "Wait for its end or stop it.",
            )

    async def _tolerance(self) -> int:
        """An encoder may find the motor beside its target; pulses put out are counted, and never miss it."""
        if not self.body.position_tolerance or self.move.target_position is None:
            return 0
        operation, _ = await self.body.ask(GetOperatingMode(), lane=Lane.PROOF)
        return self.body.position_tolerance if operation.mode == "encoder" else 0

    # while it may run

    async def running(self) -> MotorState | None:
        """What the motor does while the move is under way; None when the body has been silent too long."""
        return await self._state(lambda state: state.runs or self._ended_as_asked(state))

    async def _state(self, plausible: Callable[[MotorState], bool]) -> MotorState | None:
        """What is not plausible, or was read while the line garbles frames, counts only when read twice."""
        loop = asyncio.get_running_loop()
        give_up_at = loop.time() + LOST_AFTER_S
        while loop.time() < give_up_at:
            try:
                state = await self._read()
                while self._line_erred() or not plausible(state):
                    again = await self._read()
                    if self._agree(again, state):
                        return again
                    state = again
            except GatewayError as error:
                if isinstance(error, QueueFull | Expired):  # crowded out is not silent
                    give_up_at = loop.time() + LOST_AFTER_S
                await asyncio.sleep(self.body.poll_interval_s)
            else:
                return state
        return None

    async def _read(self) -> MotorState:
        state = await self.body.look()
        if state.runs:
            return state
        cause, _ = await self.body.ask(GetEndCause())
        return state._replace(cause=cause.bits)

    def _agree(self, one: MotorState, other: MotorState) -> bool:
        """Whether both may be true: a motor at rest stays where it is."""
        if one.runs or other.runs:
            return one.runs and other.runs
        same_place = abs(one.position - other.position) <= self.tolerance
        return same_place and (one.bits, one.cause) == (other.bits, other.cause)

    def _line_erred(self) -> bool:
        error_at = self.body.line.last_error_at
        return error_at is not None and asyncio.get_running_loop().time() - error_at < RECENT_ERROR_S

    def _ended_as_asked(self, state: MotorState) -> bool:
        """Whether an announced end, the end cause and the position all tell of success."""
        near = self.move.target_position is None or self._is_target(state.position)
        return self.body.move_ended.is_set() and not state.cause and near

    def _is_target(self, position: int | None) -> bool:
        target = self.move.target_position
        return target is not None and position is not None and abs(position - target) <= self.tolerance

    # the verdict

    async def without_reply(self, error: NoReply) -> Verdict | None:
        """Nobody knows whether the command was executed: let the motor tell; None where the move runs on."""
        state = await self._state(lambda _: False)
        if state is None:
            return Verdict(MoveStatus.LOST, error=error)
        self.move.position = state.position
        if state.runs:
            self._note(
                "The motor runs, and had stood still: the command was executed although no reply came."
            )
            return None
        if not self.body.went_silent:
            if self._travelled_to_target(state):
                self._note("The motor stands at the target, although no reply came.")
                return None
            if self._untouched(state) and await self._still_counts(state):
                return self._of_untouched()
        self.body.stands()
        self._note(f"The motor stands at {state.position}, which proves nothing.")
        return Verdict(MoveStatus.UNKNOWN, error=error)

    def _travelled_to_target(self, state: MotorState) -> bool:
        started_there = self.before is not None and self._is_target(self.before.position)
        return self._is_target(state.position) and not started_there

    def _untouched(self, state: MotorState) -> bool:
        """Whether the motor shows that a move of some length was never begun."""
        before = self.before
        if before is None or self.move.kind not in ("relative", "absolute", "continuous"):
            return False
        ended_at_once = state.bits & ~before.bits & MOTION_ERRORS
        return state.position == before.position and not ended_at_once

    async def _still_counts(self, state: MotorState) -> bool:
        """Whether it has kept its power: a controller that was switched off and on stands at 0, too."""
        return state.position != POWER_ON_POSITION or await self._remembers_homing()

    def _of_untouched(self) -> Verdict:
        self.body.stands()
        if self.move.start_position == self.move.target_position:
            self._note("The motor stands at the target, where it stood before: there was nothing to do.")
            return Verdict(MoveStatus.SUCCEEDED)
        self._note("The motor stands where it stood: the command was not executed.")
        return Verdict(MoveStatus.FAILED, "not_executed", _lost_on_its_way(self.body, self.move))

    async def at_rest(self, state: MotorState) -> Verdict:
        """How the move ended that came to rest."""
        body, move = self.body, self.move
        causes = names_of(state.cause, END_CAUSE_BITS)
        if causes == ["stop_command"]:
            return Verdict(MoveStatus.STOPPED, "stop_command")
        if causes:
            cause = "+".join(causes)
            return Verdict(MoveStatus.FAILED, cause, _ended_by(body, cause))
        if self._power_was_lost():
            return Verdict(MoveStatus.LOST, error=_without_power(body))
        if move.target_position is not None and not self._is_target(move.position):
            return Verdict(MoveStatus.FAILED, "position_mismatch", _missed(body, move))
        if not await self._kept_its_power():
            return Verdict(MoveStatus.UNKNOWN, error=_perhaps_without_power(body))
        return Verdict(MoveStatus.SUCCEEDED, "normal")

    def _power_was_lost(self) -> bool:
        """Whether a body that calls its end normal may have been switched off in the middle of the move."""
        at_power_on = self.move.position == POWER_ON_POSITION
        arrived = self._is_target(self.move.position)
        if arrived and not at_power_on:
            return False
        fell_back = at_power_on and self.move.kind in ("relative", "absolute", "continuous")
        return self.body.went_silent or (fell_back and not arrived)

    async def _kept_its_power(self) -> bool:
        """Whether a normal end is proved: a controller that was switched off and on looks the same at 0.

        It announces no end then, and has forgotten how far its last homing went.
        """
        if self.move.position != POWER_ON_POSITION or self.move.completion == "frame":
            return True
        if await self.body.end_announced(MISSING_END_FRAME_S):
            self.move.completion = "frame"
            return True
        self._note(
            f"The motor stands at {POWER_ON_POSITION}, as after a loss of power, and no end was announced."
        )
        return await self._remembers_homing()

    async def _remembers_homing(self) -> bool:
        """Asked twice: one garbled digit must not prove anything."""
        try:
            first, _ = await self.body.ask(GetHomingDistance())
            second, _ = await self.body.ask(GetHomingDistance())
        except GatewayError:
            return False
        remembers = first == second and first.pulses != POWER_ON_POSITION
        if remembers:
            self._note("The controller remembers its last homing, so it has kept its power.")
        return remembers

    def _note(self, sentence: str) -> None:
        self.move.evidence.append(sentence)


def gone(body: Body) -> Verdict:
    """The verdict on a move whose body has been silent too long."""
    error = MoveFailed(
        f"{body.address} stopped answering in the middle of the move; it may still be moving.",
        "Check its power and cable, stop it, and home it again.",
    )
    return Verdict(MoveStatus.LOST, error=error)


def _ended_by(body: Body, cause: str) -> MoveFailed:
    return MoveFailed(
        f"The move of {body.address} was ended by {cause}; the motor stands still.",
        "Remove the cause, clear the controller's status, and home the axis if steps were lost.",
    )


def _without_power(body: Body) -> MoveFailed:
    return MoveFailed(
        f"{body.address} seems to have lost its power in the middle of the move; the motor stands still.",
        "Home it again: its position means nothing now.",
    )


class _Unproved(GatewayError):
    """A move whose end nothing proves, nor that it was begun."""

    kind, title = MoveFailed.kind, "The end of the move is not known"
    moved = "unknown"


def _perhaps_without_power(body: Body) -> _Unproved:
    return _Unproved(
        f"{body.address} stands at {POWER_ON_POSITION} and the end of the move was not announced: it has "
        "arrived there, or has lost its power in the middle of the move.",
        "Home it again, unless its position is proved otherwise.",
    )


def _lost_on_its_way(body: Body, move: Move) -> NotExecuted:
    return NotExecuted(
        f"{move.command} was sent to {body.address} and no reply came; the motor has not moved.",
        "Send it again if it is still wanted.",
    )


def _missed(body: Body, move: Move) -> MoveFailed:
    return MoveFailed(
        f"{body.address} stands at {move.position} pulses, not at {move.target_position} as was asked.",
        "The command may have been garbled on the line, or the controller has lost its power: "
        "check the position before the next move.",
    )
