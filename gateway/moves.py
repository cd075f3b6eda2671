"""The life of a move: sent at most once, followed to its end by what the controller itself says."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Literal, NamedTuple

from pydantic import Field

from gateway.bodies import Body, Group
from gateway.errors import (
    BodyBusy,
    ControllerRefused,
    GatewayError,
    MoveFailed,
    NoReply,
    NotExecuted,
    NotSent,
    QueueFull,
    StoppedFirst,
)
from gateway.move_log import MoveLog, new_id
from gateway.move_record import MoveError, MoveRecord, MoveStatus
from protocols.rorze.link import MoveEnded
from protocols.rorze.moves import AbsoluteMove, RelativeMove
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import CentreStallDog, GetHomingDistance, OriginSearch
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import END_CAUSE_BITS, GetControllerStatus, GetEndCause, names_of
from protocols.table import Reply

LOST_AFTER_S = 30.0
"""A body that has not answered this long in the middle of a move has lost it."""
RECENT_ERROR_S = 10.0
"""After a garbled or missing reply, what decides the end of a move is read twice for so long."""
POWER_ON_POSITION = 0
"""An assumption: what a controller calls its position, and the distance of its last homing (0PD), when it
has been switched on; a loss of power of 10 ms may switch it on again (RC-420 manual 5.4.2)."""
BELIEVED_S = 0.5
"""Where a motor rests is asked again before a move when it was read longer ago: power is lost at rest too."""
PULSES_RUNNING, MOTION_ERRORS = 0x01, 0x66
"""Bits of the controller status: a limit, EMS, the movement range or STALL can end a move (9CD)."""
STILL_MOVING = 0x50
"""The refusal of a controller whose motor moves already."""
MISSING_END_FRAME_S = 0.5
"""An end-of-move frame this late tells that the link master has forgotten to send them."""

MoveKind = Literal["relative", "absolute", "home", "continuous", "interpolated"]


class Move(MoveRecord):
    """One move of one body."""

    group_id: str | None = Field(default=None, description="The group it was sent to, if it was.")
    kind: MoveKind
    end_cause: str | None = Field(
        default=None,
        description="normal, stall, cw_limit, ccw_limit, ems, stop_command, or several joined by +, as the "
        "controller says; not_executed or position_mismatch as the gateway found.",
    )
    start_position: int | None = Field(default=None, description="In pulses, before the move.")
    target_position: int | None = Field(
        default=None, description="In pulses, where it can be known beforehand."
    )
    position: int | None = Field(default=None, description="In pulses, as last read.")
    completion: Literal["frame", "polling"] | None = Field(
        default=None, description="Whether the end was announced by the link master or found by polling."
    )


class Moves:
    """All moves of a plant: starts them, follows them, remembers them."""

    def __init__(self, publish: Callable[[str, Body, Move], str]) -> None:
        self._publish = publish
        self._log = MoveLog[Move]()
        self._tasks: dict[asyncio.Task[None], asyncio.Future[GatewayError | None]] = {}

    def get(self, move_id: str) -> Move:
        """Find a move by its id.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return self._log.get(move_id)

    def of(self, body: Body) -> list[Move]:
        """The body's moves, newest first."""
        return self._log.of(body.address)

    async def wait(self, move_id: str, timeout_s: float) -> Move:
        """Give the move when it is over, or as it is when the time is up.

        :raises NotFound: there is none, or it is no longer kept.
        """
        return await self._log.wait(move_id, timeout_s)

    async def start(
        self, target: Body | Group, command: RorzeCommand[Any], start_within_s: float = 5.0
    ) -> list[Move]:
        """Send a motion command, and give its moves when the controllers have accepted or refused it.

        One move comes back for a body, one for each member for a group.

        :raises BodyBusy: a body still has a move that is not over; nothing was sent.
        :raises ControllerRefused: the body refused; nothing moved.
        :raises NotSent: the line is down, the body offline, or the time was up; nothing was sent.
        """
        bodies = target.members if isinstance(target, Group) else [target]
        for body in bodies:
            if body.move is not None:
                raise BodyBusy(
                    f"{body.address} still has the move {body.move.id}; nothing was sent.",
                    "Wait for it or stop it.",
                )
        epoch = target.line.gate.epoch(target.number)
        flight = _Flight(
            target, command, [(body, self._new(body, target, command)) for body in bodies], epoch
        )
        task = asyncio.create_task(self._fly(flight, start_within_s), name=f"move {flight.moves[0][1].id}")
        self._tasks[task] = flight.answered
        task.add_done_callback(self._tasks.pop)
        task.add_done_callback(lambda _: flight.answered.cancel())
        refusal = await asyncio.shield(flight.answered)
        if refusal is not None:
            raise refusal
        return [move for _, move in flight.moves]

    async def close(self) -> None:
        """Stop following, once the lines are closed; the motors keep doing what they do."""
        tasks, answers = list(self._tasks), list(self._tasks.values())
        await asyncio.gather(*answers, return_exceptions=True)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _new(self, body: Body, target: Body | Group, command: RorzeCommand[Any]) -> Move:
        now = datetime.now(UTC)
        move = Move(
            id=new_id(now),
            body_id=body.address,
            group_id=target.address if isinstance(target, Group) else None,
            kind=kind_of(command),
            command=command.code,
            frame=target.line.frame_of(target.number, command),
            created_at=now,
        )
        self._log.add(move)
        body.move = move
        body.free.clear()
        move.event_cursor = self._publish("body.move.queued", body, move)
        return move

    def _advance(self, body: Body, move: Move, status: MoveStatus, error: GatewayError | None = None) -> None:
        """The only place where a move changes its status."""
        move.status = status
        if error is not None:
            move.error = describe(error)
        if status is MoveStatus.SENT:
            move.sent_at = datetime.now(UTC)
        if status.final:
            move.ended_at = datetime.now(UTC)
            body.move = None
            body.free.set()
            self._log.end(move)
        self._publish(
            "body.move.started" if status is MoveStatus.MOVING else f"body.move.{status}", body, move
        )

    # from the queue to the reply

    async def _fly(self, flight: "_Flight", start_within_s: float) -> None:
        """One motion command, from the queue to the end of all its moves."""
        try:
            results = await self._send(flight, start_within_s)
        except GatewayError as error:
            results = {body: error for body, _ in flight.moves}
        for body, move in flight.moves:
            self._reply(body, move, results[body])
        flight.answer(results)
        await asyncio.gather(*(self._see_through(body, move, results[body]) for body, move in flight.moves))

    async def _send(self, flight: "_Flight", start_within_s: float) -> "_Results":
        expires_at = asyncio.get_running_loop().time() + start_within_s
        for body, move in flight.moves:
            await _know_the_start(body, move, flight.command)

        def written(_: float) -> None:
            for body, move in flight.moves:
                body.moving, body.went_silent = True, False
                body.move_ended.clear()
                self._advance(body, move, MoveStatus.SENT)

        target = flight.target
        if target.line.gate.epoch(target.number) != flight.epoch:
            raise StoppedFirst
        if isinstance(target, Group):
            return {**await target.ask(flight.command, expires_at=expires_at, on_written=written)}
        reply, _ = await target.ask(flight.command, expires_at=expires_at, on_written=written)
        return {target: reply}

    def _reply(self, body: Body, move: Move, result: "Reply | GatewayError") -> None:
        if isinstance(result, ControllerRefused):
            body.moving = result.error == STILL_MOVING
            body.rest_position = None if body.moving else move.start_position
            self._advance(body, move, MoveStatus.REJECTED, result)
        elif isinstance(result, NoReply):
            return
        elif isinstance(result, GatewayError):
            self._advance(body, move, MoveStatus.CANCELLED, result)
        else:
            move.acknowledged_at = datetime.now(UTC)

    async def _see_through(self, body: Body, move: Move, result: "Reply | GatewayError") -> None:
        if isinstance(result, NoReply):
            await self._resolve(body, move, result)
        if not move.status.final:
            await self._follow(body, move)

    async def _resolve(self, body: Body, move: Move, error: NoReply) -> None:
        """Nobody knows whether the command was executed: let the motor tell, where its state can prove it."""
        errors_before = body.status_bits or 0
        state = await self._state(body, lambda _: False)
        if state is None:
            self._advance(body, move, MoveStatus.LOST, error)
            return
        move.position = state.position
        if state.runs:
            move.evidence.append("The motor runs, so the command was executed although no reply came.")
        elif _on_target(body, move) and not body.went_silent:
            move.evidence.append("The motor stands at the target, although no reply came.")
        elif _untouched(move, state, errors_before) and not body.went_silent:
            move.evidence.append("The motor stands where it stood: the command was not executed.")
            move.end_cause = "not_executed"
            self._at_rest(body, move.position)
            self._advance(body, move, MoveStatus.FAILED, _lost_on_its_way(body, move))
        else:
            move.evidence.append(f"The motor stands at {move.position}, which proves nothing.")
            self._at_rest(body, move.position)
            self._advance(body, move, MoveStatus.UNKNOWN, error)

    # from the reply to the end

    async def _follow(self, body: Body, move: Move) -> None:
        """Ask the controller until the pulses have ended, and why they have."""
        while True:
            announced = body.move_ended.is_set()
            state = await self._state(body, lambda it: it.runs or _ended_as_asked(body, move, it))
            if state is None:
                self._advance(body, move, MoveStatus.LOST, _gone(body))
                return
            move.position = state.position
            if not state.runs:
                break
            if announced:  # an earlier move's end
                body.move_ended.clear()
            if move.status is MoveStatus.SENT:
                self._advance(body, move, MoveStatus.MOVING)
            await wait_for(body.move_ended, body.poll_interval_s)
        move.completion = "frame" if body.move_ended.is_set() else "polling"
        self._at_rest(body, move.position)
        await self._conclude(body, move, state)
        if move.completion == "polling" and move.status is not MoveStatus.LOST:
            await self._expect_end_frame(body)

    async def _conclude(self, body: Body, move: Move, state: "_State") -> None:
        causes = names_of(state.cause, END_CAUSE_BITS)
        move.end_cause = "+".join(causes) or "normal"
        if causes == ["stop_command"]:
            self._advance(body, move, MoveStatus.STOPPED)
        elif causes:
            self._advance(body, move, MoveStatus.FAILED, _ended_by(body, move.end_cause))
        elif _power_was_lost(body, move):
            move.end_cause = None
            self._advance(body, move, MoveStatus.LOST, _without_power(body))
        elif move.target_position is not None and not _on_target(body, move):
            move.end_cause = "position_mismatch"
            self._advance(body, move, MoveStatus.FAILED, _missed(body, move))
        elif not await _kept_its_power(body, move):
            move.end_cause = None
            self._advance(body, move, MoveStatus.UNKNOWN, _perhaps_without_power(body))
        else:
            self._advance(body, move, MoveStatus.SUCCEEDED)

    @staticmethod
    def _at_rest(body: Body, position: int | None) -> None:
        body.moving = False
        body.rest_position = position

    async def _state(self, body: Body, plausible: "Callable[[_State], bool]") -> "_State | None":
        """What the motor does; None when the body has been silent for too long.

        What is not plausible, or was read while the line garbles frames, counts only when read twice alike.
        """
        loop = asyncio.get_running_loop()
        give_up_at = loop.time() + LOST_AFTER_S
        while loop.time() < give_up_at:
            try:
                state = await _read_state(body)
                while _line_erred(body) or not plausible(state):
                    again = await _read_state(body)
                    if again.confirms(state):
                        return again
                    state = again
            except GatewayError as error:
                if isinstance(error, QueueFull):  # crowded out is not silent
                    give_up_at = loop.time() + LOST_AFTER_S
                await asyncio.sleep(body.poll_interval_s)
            else:
                return state
        return None

    async def _expect_end_frame(self, body: Body) -> None:
        """A move that ended unannounced is a sign that the link master has restarted."""
        if not await wait_for(body.move_ended, MISSING_END_FRAME_S) and body.move is None:
            body.line.set_up_again(f"the end of a move of {body.short} was not announced")

    def ended(self, body: Body, frame: MoveEnded) -> None:
        """The link master announces an end: only a reason to look now, never a proof."""
        if body.move is None or body.move.command == frame.code:
            body.move_ended.set()


_Results = dict[Body, "Reply | GatewayError"]


@dataclass(eq=False)
class _Flight:
    """A motion command on its way, with one move for each body it moves."""

    target: Body | Group
    command: RorzeCommand[Any]
    moves: list[tuple[Body, Move]]
    epoch: int
    """The target's stop epoch at admission."""
    answered: "asyncio.Future[GatewayError | None]" = field(
        default_factory=lambda: asyncio.get_running_loop().create_future()
    )

    def answer(self, results: _Results) -> None:
        """Tell who asked: an error if a single body did not take the command, or nobody was sent it."""
        errors = [
            it for it in results.values() if isinstance(it, GatewayError) and not isinstance(it, NoReply)
        ]
        alone = isinstance(self.target, Body)
        nobody = len(errors) == len(results) and not isinstance(errors[0], ControllerRefused)
        if not self.answered.done():
            self.answered.set_result(errors[0] if errors and (alone or nobody) else None)


async def _know_the_start(body: Body, move: Move, command: RorzeCommand[Any]) -> None:
    """Know where the motor stands and where it should come to: the evidence if the reply should be lost."""
    try:
        if body.rest_position is None or _read_long_ago(body):
            reply, answer = await body.ask(GetPosition())
            body.rest_position = body.position = reply.pulses
            body.position_at = answer.at
        move.start_position = move.position = body.rest_position
        move.target_position = await target_of(body, command, body.rest_position)
    except NoReply as error:
        raise NotSent(
            f"{body.address} did not tell its position before the move; the move was not sent.", error.remedy
        ) from None


def _read_long_ago(body: Body) -> bool:
    return body.position_at is None or asyncio.get_running_loop().time() - body.position_at > BELIEVED_S


async def target_of(body: Body, command: RorzeCommand[Any], start: int) -> int | None:
    """Where the command should bring the motor, as far as it can be known beforehand."""
    if isinstance(command, RelativeMove):
        amount = await _amount(body, command.distance)
        sign = 1 if command.code[1] == "+" else -1
        return None if amount is None else start + sign * amount
    if isinstance(command, AbsoluteMove):
        return await _amount(body, command.position)
    return None


async def _amount(body: Body, value: int | PositionReference | str) -> int | None:
    if isinstance(value, int):
        return value
    if isinstance(value, PositionReference) and isinstance(value.position, int):
        reply, _ = await body.ask(GetPositionEntry(entry=value))
        return reply.pulses
    return None


class _State(NamedTuple):
    """What a controller says of its motor."""

    bits: int
    position: int
    cause: int = 0
    """Of the end, once it stands still."""

    @property
    def runs(self) -> bool:
        return bool(self.bits & PULSES_RUNNING)

    def confirms(self, other: "_State") -> bool:
        """Whether both may be true: a motor at rest stays where it is."""
        return (self.runs and other.runs) or self == other


async def _read_state(body: Body) -> _State:
    status, _ = await body.ask(GetControllerStatus())
    position, answer = await body.ask(GetPosition())
    state = _State(status.bits or 0, position.pulses)
    body.status_bits, body.position, body.position_at = state.bits, state.position, answer.at
    if state.runs:
        return state
    cause, _ = await body.ask(GetEndCause())
    return state._replace(cause=cause.bits)


def _line_erred(body: Body) -> bool:
    error_at = body.line.last_error_at
    return error_at is not None and asyncio.get_running_loop().time() - error_at < RECENT_ERROR_S


def _on_target(body: Body, move: Move) -> bool:
    if move.target_position is None or move.position is None:
        return False
    return abs(move.position - move.target_position) <= body.position_tolerance


def _ended_as_asked(body: Body, move: Move, state: _State) -> bool:
    """Whether an announced end, the end cause and the position all tell of success."""
    target = state.position if move.target_position is None else move.target_position
    near = abs(state.position - target) <= body.position_tolerance
    return body.move_ended.is_set() and not state.cause and near


def _untouched(move: Move, state: _State, errors_before: int) -> bool:
    """Whether the motor proves that a move of some length was never begun."""
    ended_at_once = state.bits & ~errors_before & MOTION_ERRORS
    has_length = move.kind in ("relative", "absolute", "continuous")
    return has_length and state.position == move.start_position and not ended_at_once


def _power_was_lost(body: Body, move: Move) -> bool:
    """Whether a body that calls its end normal may have been switched off in the middle of the move."""
    at_power_on = move.position == POWER_ON_POSITION
    if _on_target(body, move) and not at_power_on:
        return False
    fell_back = at_power_on and move.kind in ("relative", "absolute", "continuous")
    return body.went_silent or (fell_back and not _on_target(body, move))


async def _kept_its_power(body: Body, move: Move) -> bool:
    """Whether a normal end is proved: a controller that was switched off and on again looks the same at 0.

    It announces no end then, and has forgotten how far its last homing went.
    """
    if move.position != POWER_ON_POSITION or move.completion == "frame":
        return True
    if await wait_for(body.move_ended, MISSING_END_FRAME_S):
        move.completion = "frame"
        return True
    move.evidence.append(
        f"The motor stands at {POWER_ON_POSITION}, as after a loss of power, and no end was announced."
    )
    if not await _remembers_homing(body):
        return False
    move.evidence.append("The controller remembers its last homing, so it has kept its power.")
    return True


async def _remembers_homing(body: Body) -> bool:
    """Asked twice: one garbled digit must not prove anything."""
    try:
        first, _ = await body.ask(GetHomingDistance())
        second, _ = await body.ask(GetHomingDistance())
    except GatewayError:
        return False
    return first == second and first.pulses != POWER_ON_POSITION


async def wait_for(event: asyncio.Event, timeout_s: float) -> bool:
    """Whether it happens in time."""
    try:
        async with asyncio.timeout(timeout_s):
            return await event.wait()
    except TimeoutError:
        return False


def kind_of(command: RorzeCommand[Any]) -> MoveKind:
    """What kind of move a motion command makes."""
    if isinstance(command, RelativeMove):
        return "continuous" if command.distance == "endless" else "relative"
    if isinstance(command, AbsoluteMove):
        return "absolute"
    return "home" if isinstance(command, OriginSearch | CentreStallDog) else "interpolated"


def describe(error: GatewayError) -> MoveError:
    """An error as it stands in a move."""
    code = error.error if isinstance(error, ControllerRefused) else None
    return MoveError.of(error, None if code is None else f"0x{code:02X}")


def _ended_by(body: Body, cause: str | None) -> MoveFailed:
    return MoveFailed(
        f"The move of {body.address} was ended by {cause}; the motor stands still.",
        "Remove the cause, clear the controller's status, and home the axis if steps were lost.",
    )


def _gone(body: Body) -> MoveFailed:
    return MoveFailed(
        f"{body.address} stopped answering in the middle of the move; it may still be moving.",
        "Check its power and cable, stop it, and home it again.",
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
