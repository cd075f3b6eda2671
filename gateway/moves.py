"""The life of a move: sent at most once, followed to its end by what the controller itself says."""

import asyncio
import secrets
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from gateway.bodies import Body, Group
from gateway.errors import (
    BodyBusy,
    BodyOffline,
    ControllerRefused,
    GatewayError,
    Moved,
    MoveFailed,
    NoReply,
    NotFound,
    NotSent,
)
from protocols.rorze.link import MoveEnded
from protocols.rorze.moves import AbsoluteMove, RelativeMove
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import CentreStallDog, OriginSearch
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import END_CAUSE_BITS, GetControllerStatus, GetEndCause, names_of
from protocols.table import Reply

HISTORY = 1000
"""Finished moves that are kept, for all bodies together."""
LOST_AFTER_S = 30.0
"""A body that has not answered this long in the middle of a move has lost it."""
RECENT_ERROR_S = 10.0
"""After a garbled or missing reply, what decides the end of a move is read twice for so long."""
MISSING_END_FRAME_S = 0.5
"""An end-of-move frame this late tells that the link master has forgotten to send them."""

MoveKind = Literal["relative", "absolute", "home", "continuous", "interpolated"]


class MoveStatus(StrEnum):
    """Where a move is in its life."""

    QUEUED = "queued"
    SENT = "sent"
    MOVING = "moving"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    STOPPED = "stopped"
    REJECTED = "rejected"
    CANCELLED = "cancelled"
    LOST = "lost"
    UNKNOWN = "unknown"

    @property
    def final(self) -> bool:
        """Whether nothing more will become of it."""
        return self not in (MoveStatus.QUEUED, MoveStatus.SENT, MoveStatus.MOVING)


class MoveError(BaseModel):
    """Why a move did not succeed, in the words of a problem detail."""

    type: str = Field(description="The kind of error; stable.")
    title: str
    detail: str
    moved: Moved = Field(description="Whether the motor did anything because of this move.")
    remedy: str
    controller_error: str | None = Field(
        default=None, description="The controller's error code, such as 0x51."
    )


class Move(BaseModel):
    """One move of one body, from the request to its end."""

    model_config = ConfigDict(extra="forbid")

    id: str
    body_id: str = Field(description="Address of the body, LINE.3F.")
    group_id: str | None = Field(default=None, description="The group it was sent to, if it was.")
    kind: MoveKind
    status: MoveStatus = MoveStatus.QUEUED
    end_cause: str | None = Field(
        default=None,
        description="normal, stall, cw_limit, ccw_limit, ems, stop_command, or several joined by +, as the "
        "controller says; not_executed or position_mismatch as the gateway found.",
    )
    command: str = Field(description="The three characters of the controller's command.")
    frame: str = Field(description="The bytes sent, without CR.")
    start_position: int | None = Field(default=None, description="In pulses, before the move.")
    target_position: int | None = Field(
        default=None, description="In pulses, where it can be known beforehand."
    )
    position: int | None = Field(default=None, description="In pulses, as last read.")
    completion: Literal["frame", "polling"] | None = Field(
        default=None, description="Whether the end was announced by the link master or found by polling."
    )
    evidence: Annotated[list[str], Field(description="How the gateway knows what it says.")] = []
    error: MoveError | None = None
    created_at: datetime
    sent_at: datetime | None = None
    acknowledged_at: datetime | None = None
    ended_at: datetime | None = None
    event_cursor: str = Field(
        default="", description="Events after this cursor include all later news of the move."
    )


class Moves:
    """All moves of a plant: starts them, follows them, remembers them."""

    def __init__(self, publish: Callable[[str, Body, Move], str]) -> None:
        self._publish = publish
        self._moves: OrderedDict[str, Move] = OrderedDict()
        self._over: dict[str, asyncio.Event] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def get(self, move_id: str) -> Move:
        """Find a move by its id.

        :raises NotFound: there is none, or it is no longer kept.
        """
        move = self._moves.get(move_id)
        if move is None:
            raise NotFound(
                f"There is no move {move_id}; finished moves are kept until {HISTORY} newer ones exist."
            )
        return move

    def of(self, body: Body) -> list[Move]:
        """The body's moves, newest first."""
        return [move for move in reversed(self._moves.values()) if move.body_id == body.address]

    async def wait(self, move_id: str, timeout_s: float) -> Move:
        """Give the move when it is over, or as it is when the time is up."""
        move = self.get(move_id)
        if not move.status.final and timeout_s > 0:
            try:
                async with asyncio.timeout(timeout_s):
                    await self._over[move_id].wait()
            except TimeoutError:
                return move
        return move

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
        flight = _Flight(target, command, [(body, self._new(body, target, command)) for body in bodies])
        task = asyncio.create_task(self._fly(flight, start_within_s), name=f"move {flight.moves[0][1].id}")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        refusal = await asyncio.shield(flight.answered)
        if refusal is not None:
            raise refusal
        return [move for _, move in flight.moves]

    async def close(self) -> None:
        """Stop following; the motors keep doing what they do."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def _new(self, body: Body, target: Body | Group, command: RorzeCommand[Any]) -> Move:
        now = datetime.now(UTC)
        move = Move(
            id=f"{int(now.timestamp() * 1000):012x}{secrets.token_hex(4)}",
            body_id=body.address,
            group_id=target.address if isinstance(target, Group) else None,
            kind=kind_of(command),
            command=command.code,
            frame=f"{target.line.introducer}{target.short}{command.code}{command.written()}",
            created_at=now,
        )
        self._moves[move.id] = move
        self._over[move.id] = asyncio.Event()
        self._forget_old()
        body.move = move
        move.event_cursor = self._publish("body.move.queued", body, move)
        return move

    def _forget_old(self) -> None:
        surplus = len(self._moves) - HISTORY
        old = [move.id for move in self._moves.values() if move.status.final] if surplus > 0 else []
        for move_id in old[:surplus]:
            del self._moves[move_id], self._over[move_id]

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
            self._over[move.id].set()
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
        for body, move in flight.moves:
            await _know_the_start(body, move, flight.command)

        def written(_: float) -> None:
            for body, move in flight.moves:
                body.rest_position = None
                body.moving = True
                body.move_ended.clear()
                self._advance(body, move, MoveStatus.SENT)

        target = flight.target
        expires_at = asyncio.get_running_loop().time() + start_within_s
        if isinstance(target, Group):
            return {**await target.ask(flight.command, expires_at=expires_at, on_written=written)}
        reply, _ = await target.ask(flight.command, expires_at=expires_at, on_written=written)
        return {target: reply}

    def _reply(self, body: Body, move: Move, result: "Reply | GatewayError") -> None:
        if isinstance(result, ControllerRefused):
            body.moving = False
            body.rest_position = move.start_position
            self._advance(body, move, MoveStatus.REJECTED, result)
        elif isinstance(result, NotSent):
            self._advance(body, move, MoveStatus.CANCELLED, result)
        elif not isinstance(result, GatewayError):
            move.acknowledged_at = datetime.now(UTC)

    async def _see_through(self, body: Body, move: Move, result: "Reply | GatewayError") -> None:
        if isinstance(result, NoReply):
            await self._resolve(body, move, result)
        if not move.status.final:
            await self._follow(body, move)

    async def _resolve(self, body: Body, move: Move, error: NoReply) -> None:
        """Nobody knows whether the command was executed: let the motor tell, where its state can prove it."""
        state = await self._state(body)
        if state is None:
            self._advance(body, move, MoveStatus.LOST, error)
            return
        runs, position = state
        move.position = position
        if runs:
            move.evidence.append("The motor runs, so the command was executed although no reply came.")
        elif self._on_target(body, move):
            move.evidence.append("The motor stands at the target, although no reply came.")
        elif position == move.start_position and move.kind in ("relative", "absolute", "continuous"):
            move.evidence.append("The motor stands where it stood: the command was not executed.")
            move.end_cause = "not_executed"
            self._at_rest(body, position)
            self._advance(body, move, MoveStatus.FAILED, error)
        else:
            move.evidence.append(f"The motor stands at {position}, which proves nothing.")
            self._at_rest(body, position)
            self._advance(body, move, MoveStatus.UNKNOWN, error)

    # from the reply to the end

    async def _follow(self, body: Body, move: Move) -> None:
        """Ask the controller until the pulses have ended, then ask it why."""
        while True:
            state = await self._state(body)
            if state is None:
                gone = BodyOffline(
                    f"{body.address} stopped answering in the middle of the move.", "Home it again."
                )
                self._advance(body, move, MoveStatus.LOST, gone)
                return
            runs, move.position = state
            if not runs:
                break
            if move.status is MoveStatus.SENT:
                self._advance(body, move, MoveStatus.MOVING)
            await _wait_for(body.move_ended, body.poll_interval_s)
        cause = await self._end_cause(body)
        announced = body.move_ended.is_set()
        move.completion = "frame" if announced else "polling"
        self._at_rest(body, move.position)
        self._conclude(body, move, cause)
        if not announced:
            await self._expect_end_frame(body)

    def _conclude(self, body: Body, move: Move, cause: int | None) -> None:
        causes = [] if cause is None else names_of(cause, END_CAUSE_BITS)
        move.end_cause = "+".join(causes) or (None if cause is None else "normal")
        if cause is None:
            unread = NoReply(f"{body.address} stands still, but did not say why.", "Read its status.")
            self._advance(body, move, MoveStatus.UNKNOWN, unread)
        elif causes == ["stop_command"]:
            self._advance(body, move, MoveStatus.STOPPED)
        elif causes:
            self._advance(body, move, MoveStatus.FAILED, _ended_by(body, move.end_cause))
        elif move.target_position is not None and not self._on_target(body, move):
            move.end_cause = "position_mismatch"
            self._advance(body, move, MoveStatus.FAILED, _missed(body, move))
        else:
            self._advance(body, move, MoveStatus.SUCCEEDED)

    @staticmethod
    def _on_target(body: Body, move: Move) -> bool:
        if move.target_position is None or move.position is None:
            return False
        return abs(move.position - move.target_position) <= body.position_tolerance

    @staticmethod
    def _at_rest(body: Body, position: int | None) -> None:
        body.moving = False
        body.rest_position = position

    async def _state(self, body: Body) -> tuple[bool, int] | None:
        """Whether the motor runs and where it is; None when the body has been silent for too long."""
        loop = asyncio.get_running_loop()
        give_up_at = loop.time() + LOST_AFTER_S
        while loop.time() < give_up_at:
            try:
                return await self._certain_state(body)
            except GatewayError:
                await asyncio.sleep(body.poll_interval_s)
        return None

    async def _certain_state(self, body: Body) -> tuple[bool, int]:
        """Read status and position, twice alike if the line has garbled anything lately."""
        state = await _read_state(body)
        error_at = body.line.last_error_at
        recent = error_at is not None and asyncio.get_running_loop().time() - error_at < RECENT_ERROR_S
        while recent and not state[0]:
            again = await _read_state(body)
            if again == state:
                break
            state = again
        return state

    async def _end_cause(self, body: Body) -> int | None:
        for _ in range(3):
            try:
                reply, _answer = await body.ask(GetEndCause())
            except GatewayError:
                await asyncio.sleep(body.poll_interval_s)
            else:
                return reply.bits
        return None

    async def _expect_end_frame(self, body: Body) -> None:
        """A move that ended unannounced is a sign that the link master has restarted."""
        if not await _wait_for(body.move_ended, MISSING_END_FRAME_S) and body.move is None:
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
    answered: "asyncio.Future[GatewayError | None]" = field(
        default_factory=lambda: asyncio.get_running_loop().create_future()
    )

    def answer(self, results: _Results) -> None:
        """Tell who asked: an error if a single body did not take the command, or nobody was sent it."""
        refusals = [it for it in results.values() if isinstance(it, ControllerRefused | NotSent)]
        alone = isinstance(self.target, Body)
        nobody = len(refusals) == len(results) and isinstance(refusals[0], NotSent)
        self.answered.set_result(refusals[0] if refusals and (alone or nobody) else None)


async def _know_the_start(body: Body, move: Move, command: RorzeCommand[Any]) -> None:
    """Know where the motor stands and where it should come to: the evidence if the reply should be lost."""
    try:
        if body.rest_position is None:
            reply, _ = await body.ask(GetPosition())
            body.rest_position = reply.pulses
        move.start_position = move.position = body.rest_position
        move.target_position = await target_of(body, command, body.rest_position)
    except NoReply as error:
        raise NotSent(
            f"{body.address} did not tell its position before the move; the move was not sent.", error.remedy
        ) from None


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


async def _read_state(body: Body) -> tuple[bool, int]:
    status, _ = await body.ask(GetControllerStatus())
    position, answer = await body.ask(GetPosition())
    bits = status.bits or 0
    body.status_bits, body.position, body.position_at = bits, position.pulses, answer.at
    return bool(bits & 1), position.pulses


async def _wait_for(event: asyncio.Event, timeout_s: float) -> bool:
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
    return MoveError(
        type=error.kind,
        title=error.title,
        detail=error.detail,
        moved=error.moved,
        remedy=error.remedy,
        controller_error=None if code is None else f"0x{code:02X}",
    )


def _ended_by(body: Body, cause: str | None) -> MoveFailed:
    return MoveFailed(
        f"The move of {body.address} was ended by {cause}; the motor stands still.",
        "Remove the cause, clear the controller's status, and home the axis if steps were lost.",
    )


def _missed(body: Body, move: Move) -> MoveFailed:
    return MoveFailed(
        f"{body.address} stands at {move.position} pulses, not at {move.target_position} as was asked.",
        "The command may have been garbled on the line: check the position before the next move.",
    )
