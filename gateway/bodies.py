"""A body as the gateway sees it: its address, what was last known of it, and how to ask it something."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

from gateway.errors import ControllerRefused, GatewayError, NoReply
from gateway.exchange import Answered, Lane, Outcome
from gateway.line import Line, lane_of
from gateway.units import Scale
from protocols.rorze.link import Refusal
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply, Retry

if TYPE_CHECKING:
    from gateway.moves import Move

R = TypeVar("R", bound=Reply)


@dataclass(eq=False)
class Body:
    """One RC-420 axis controller."""

    line: Line
    number: int
    name: str = ""
    scale: Scale | None = None
    position_tolerance: int = 0
    """Pulses by which the final position may miss the target of a successful move."""
    poll_interval_s: float = 0.2
    """While it has a move, its state is asked for this often."""
    moving: bool | None = None
    """None until its status has been read since it was out of reach."""
    look_due: asyncio.Event = field(default_factory=asyncio.Event)
    """Its state is to be read now, not at the next poll."""
    rest_position: int | None = None
    """The position at which the motor is known to stand still; None while it may move."""
    status_bits: int | None = None
    position: int | None = None
    position_at: float | None = None
    move: "Move | None" = None
    """The move that is not over yet."""
    move_ended: asyncio.Event = field(default_factory=asyncio.Event)
    """The link master has announced the end of a move."""
    free: asyncio.Event = field(default_factory=asyncio.Event)
    """The last move is over and recorded: the next one may begin."""
    went_silent: bool = False
    """Whether it has been offline since its last move was sent: it may have lost its power meanwhile."""

    @cached_property
    def short(self) -> str:
        """Its two hexadecimal digits."""
        return f"{self.number:02X}"

    @cached_property
    def address(self) -> str:
        """Its address that is always unique, such as `LINE.3F`."""
        return f"{self.line.id}.{self.short}"

    @property
    def online(self) -> bool:
        """Whether it can be asked now, as far as is known."""
        return self.line.state != "down" and self.number not in self.line.offline

    async def ask(
        self,
        command: RorzeCommand[R],
        *,
        lane: Lane | None = None,
        expires_at: float | None = None,
        on_written: Callable[[float], None] | None = None,
    ) -> tuple[R, Answered]:
        """Send a command and give its reply.

        :raises GatewayError: it was refused, not sent, or not answered; the error says which.
        """
        lane = lane_of(command) if lane is None else lane
        future = self.line.submit(self.number, command, lane, expires_at=expires_at, on_written=on_written)
        self.forget_position_after(command)
        outcome = await future
        self.forget_position_after(command)
        answered = answer_or_raise(self.address, command, outcome)
        reply = reply_of(self.number, command, answered, self.address)
        return cast("R", reply), answered

    def forget_state(self) -> None:
        """It is out of reach: what was moving counts as moving, what stood still may move."""
        self.moving = self.moving or None
        self.rest_position = None

    def forget_position_after(self, command: RorzeCommand[Any]) -> None:
        """Whatever is not a mere read may have moved the motor, or renamed where it stands."""
        if command.retry is not Retry.READ:
            self.rest_position = None


@dataclass(eq=False)
class Group:
    """A virtual body: several bodies of one line under one number."""

    line: Line
    number: int
    members: list[Body]
    name: str = ""

    @property
    def short(self) -> str:
        """Its two hexadecimal digits."""
        return f"{self.number:02X}"

    @property
    def address(self) -> str:
        """Its unique address, such as `LINE.80`."""
        return f"{self.line.id}.{self.short}"

    async def ask(
        self,
        command: RorzeCommand[Any],
        *,
        expires_at: float | None = None,
        on_written: Callable[[float], None] | None = None,
    ) -> dict[Body, Reply | GatewayError]:
        """Send a command to all members in one frame and give one reply or error for each.

        :raises GatewayError: nobody can have executed it, or nobody answered.
        """
        future = self.line.submit(
            self.number, command, lane_of(command), expires_at=expires_at, on_written=on_written
        )
        self._forget_positions_after(command)
        outcome = await future
        self._forget_positions_after(command)
        answered = answer_or_raise(self.address, command, outcome)
        return {member: _member_result(member, command, answered) for member in self.members}

    def _forget_positions_after(self, command: RorzeCommand[Any]) -> None:
        for member in self.members:
            member.forget_position_after(command)


def _member_result(member: Body, command: RorzeCommand[Any], answered: Answered) -> Reply | GatewayError:
    try:
        return reply_of(member.number, command, answered, member.address)
    except GatewayError as error:
        return error


def answer_or_raise(address: str, command: RorzeCommand[Any], outcome: Outcome) -> Answered:
    """Turn everything that is no answer into its error."""
    if isinstance(outcome, Answered):
        return outcome
    if isinstance(outcome, Refusal):
        raise ControllerRefused(address, command.code, outcome.error)
    raise outcome


def reply_of(number: int, command: RorzeCommand[Any], answered: Answered, address: str) -> Reply:
    """Pick one body's reply out of an answer."""
    reply = answered.replies.get(number)
    if isinstance(reply, Refusal):
        raise ControllerRefused(address, command.code, reply.error)
    if reply is None:
        raise NoReply(
            f"The group's reply to {command.code} does not mention {address}.",
            "Read its status and position.",
        )
    return reply
