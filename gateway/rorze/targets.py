"""Bodies, groups and link masters as the operations see them."""

import asyncio
import types
from collections.abc import Callable, Sequence
from contextlib import AbstractAsyncContextManager
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Final

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.move_record import START_WITHIN_S
from gateway.core.next_calls import NextCall
from gateway.core.stops import StopMode
from gateway.core.targets import BegunMoves, CommandReplies, MemberAnswers, Opened, Stopped, Target, stopped
from gateway.rorze.alarms import calls_for_body, calls_for_group, calls_for_line
from gateway.rorze.bodies import Body, Group, answer_or_raise, reply_of
from gateway.rorze.line import Line, lane_of
from gateway.rorze.move_requests import MoveRequest, common_command
from gateway.rorze.moves import Moves
from gateway.rorze.plans import (
    GroupPlan,
    PlannedMove,
    Rate,
    at_own_speed,
    group_plan_of,
    plan_of,
    with_own_pattern,
)
from gateway.rorze.samples import BodySamples, samples_of
from gateway.rorze.stops import Stops
from gateway.rorze.stored_program import EndlessPrograms
from protocols.rorze.commands import COMMANDS
from protocols.rorze.link_master import SetGroup
from protocols.rorze.notation import Printable
from protocols.rorze.programs import EndProgram, RunProgram, StepProgram
from protocols.rorze.row import LINK_MASTER, RorzeCommand
from protocols.rorze.stops import StopDecelerating, StopImmediately
from protocols.table import Reply, Retry, WireFault

CODE_LENGTH = 3


class VerbatimReply(Reply, args="{text}"):
    """A reply of which nothing is known."""

    text: Annotated[str, Printable("[ -~]*")]


class Verbatim(
    RorzeCommand[VerbatimReply],
    args="{text}",
    errors=frozenset({0x23, 0x49, 0x4A, 0x5D}),
    retry=Retry.NEVER,
    starts=False,
):
    """A command that is not in the table: it is sent as it was written, once."""

    text: Annotated[str, Printable("[ -%'-~]*")]


def read_text(text: str) -> RorzeCommand[Any]:
    """Recognise a command of the table, so that the table's rules hold for it; others stay text.

    :raises InvalidRequest: it is not in the table's form.
    """
    code, parameters = text[:CODE_LENGTH], text[CODE_LENGTH:]
    row = COMMANDS.get(code)
    if row is None:
        return _verbatim(code)(text=parameters)
    try:
        return row.read(parameters)
    except WireFault as error:
        raise InvalidRequest(f"{code}: {error}; nothing was sent.", "Write it as the manual does.") from None


@lru_cache(maxsize=64)
def _verbatim(code: str) -> type[Verbatim]:
    row: type[Verbatim] = types.new_class(
        "Verbatim",
        (Verbatim,),
        {"code": code, "args": "{text}"},
        lambda body: body.update(__module__=__name__),
    )
    return row


STOP_MODES: Final[dict[type[Any], StopMode]] = {
    StopDecelerating: "decelerate",
    StopImmediately: "immediate",
}


class _Motors(Target):
    """Bodies that are commanded together."""

    collection: ClassVar[str]
    stop_modes = STOP_MODES

    def __init__(self, thing: Body | Group, moves: Moves, stops: Stops, endless: EndlessPrograms) -> None:
        self.thing = thing
        self.address = thing.address
        self.path = f"/{self.collection}/{thing.address}"
        self._moves, self._stops, self._endless = moves, stops, endless
        self.log = moves.log

    @property
    def _bodies(self) -> Sequence[Body]:
        return self.thing.members if isinstance(self.thing, Group) else [self.thing]

    async def _look_into(self, command: Any) -> None:
        """Know what the programs do that are to be started; errors as of `EndlessPrograms.learn`."""
        if isinstance(command, RunProgram | StepProgram):
            for body in self._bodies:
                await self._endless.learn(body)

    async def start(self, command: Any, start_within_s: float = START_WITHIN_S) -> BegunMoves | Opened:
        """Start the moves of its bodies; errors as of `Moves.start`."""
        moves = await self._moves.start(self.thing, command, start_within_s)
        return BegunMoves(self.path, moves, self.address if isinstance(self.thing, Group) else None)

    def at_own_speed(self, request: MoveRequest) -> AbstractAsyncContextManager[MoveRequest]:
        """Write the `max_speed` of a move to its bodies; errors as of `limited_speed.limited`."""
        return at_own_speed(self.thing, request)

    async def stop_by(self, command: Any) -> CommandReplies | MemberAnswers | Stopped:
        """Stop its bodies; UES ends a program, and is only asked."""
        if isinstance(command, EndProgram):
            return await self.ask(command)
        return await super().stop_by(command)

    async def stop(self, mode: StopMode) -> Stopped:
        """Stop its bodies."""
        return await stopped("bodies", self._stops.stop(self._bodies, mode))


class BodyTarget(_Motors):
    """A body."""

    collection = "bodies"
    thing: Body

    async def ask(self, command: Any) -> CommandReplies:
        """Send a command that starts no move; errors as of `Body.ask`."""
        await self._look_into(command)
        reply, answered = await self.thing.ask(command)
        return CommandReplies((reply,), answered.at, texts=(answered.text,))

    def calls_for(self, error: GatewayError) -> Sequence[NextCall]:
        """The calls that help where a request about the body has failed."""
        return calls_for_body(error, self.address)

    def read(self, text: str) -> RorzeCommand[Any]:
        """Read a command as it stands on the line; errors as of `read_text`."""
        return read_text(text)

    def command_for(self, request: MoveRequest) -> RorzeCommand[Any]:
        """Put a wish for a move into a command, by the body's scale."""
        return request.command(self.thing.scale)

    async def plan(self, command: Any, limit: Rate | None = None) -> PlannedMove:
        """Work out a move; errors as of `plan_of`."""
        self._moves.require_end(command)
        return await plan_of(self.thing, with_own_pattern([self.thing], command, limit), limit)

    async def samples(self, move_id: str) -> BodySamples:
        """Give where it was seen during a move, beside its plan; errors as of `Trajectories.of`."""
        return await samples_of(self._moves.trajectories.of(move_id))


class GroupTarget(_Motors):
    """A group."""

    collection = "groups"
    thing: Group

    async def ask(self, command: Any) -> MemberAnswers:
        """Send a command to all members; errors as of `Group.ask`."""
        await self._look_into(command)
        results = await self.thing.ask(command)
        return MemberAnswers(self.address, {body.address: result for body, result in results.items()})

    def calls_for(self, error: GatewayError) -> Sequence[NextCall]:
        """The calls that help where a request about the group has failed."""
        return calls_for_group(error, self.address)

    def command_for(self, request: MoveRequest) -> RorzeCommand[Any]:
        """Put a wish for a move into one command for all members; errors as of `common_command`."""
        return common_command(self.thing, request)

    async def plan(self, command: Any, limit: Rate | None = None) -> GroupPlan:
        """Work out the moves of all members; errors as of `plan_of`."""
        self._moves.require_end(command)
        own = with_own_pattern(self.thing.members, command, limit)
        return await group_plan_of(self.thing, own, limit)


class LinkMasterTarget(Target):
    """The link master of a line."""

    def __init__(self, line: Line, define: Callable[[SetGroup], Any]) -> None:
        self.line = line
        self.address = f"{line.id}.{LINK_MASTER:02X}"
        self.path = f"/lines/{line.id}"
        self._define = define

    def calls_for(self, error: GatewayError) -> Sequence[NextCall]:
        """The calls that help where a request about the line has failed."""
        return calls_for_line(error, self.line.id)

    async def ask(self, command: Any) -> CommandReplies:
        """Send it a command; a group is defined so that the gateway knows its members."""
        if isinstance(command, SetGroup):
            await self._define(command)
            return CommandReplies((SetGroup.reply_type()(),), asyncio.get_running_loop().time())
        outcome = await self.line.submit(LINK_MASTER, command, lane_of(command))
        answered = answer_or_raise(self.address, command, outcome)
        reply: Reply = reply_of(LINK_MASTER, command, answered, self.address)
        return CommandReplies((reply,), answered.at)
