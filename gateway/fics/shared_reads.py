"""Questions to a robot: each put to the right unit, and once for all who ask the same meanwhile."""

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from gateway.core.errors import ControllerRefused, Expired, GatewayError
from gateway.core.lanes import Lane
from protocols.fics.positions import DownloadPositions
from protocols.fics.row import BLOCK_ERRORS, Block, FicsCommand
from protocols.table import Reply

if TYPE_CHECKING:
    from gateway.fics.robot import Robot

TURN_WITHIN_S = 5.0
"""So long a read or a command waits for the robot to be free, and then for the line; a move says how long."""

Question = tuple[int | None, str]
"""A unit, or none, and the text of a query."""


class Heard(NamedTuple):
    """What a robot has answered, and when, on the event loop's clock."""

    replies: tuple[Any, ...]
    """None after a deed, several after a download."""
    at: float


def heard_now(*replies: Reply) -> Heard:
    """What was heard just now."""
    return Heard(replies, asyncio.get_running_loop().time())


def deadline_of(lane: Lane) -> float | None:
    """Until when a request that comes now may wait; proofs of stops and moves are never too late."""
    if lane not in (Lane.COMMAND, Lane.READ):
        return None
    return asyncio.get_running_loop().time() + TURN_WITHIN_S


def _is_over(expires_at: float | None) -> bool:
    return expires_at is not None and asyncio.get_running_loop().time() >= expires_at


class Queries:
    """The questions that are being put to a robot."""

    def __init__(self, robot: "Robot") -> None:
        self._robot = robot
        self._waiting: dict[Question, asyncio.Task[Heard | GatewayError]] = {}
        """Those that wait for the floor; an equal one shares the answer."""
        self._tasks: set[asyncio.Task[Heard | GatewayError]] = set()

    async def close(self) -> None:
        """Ask nothing more: once the line is closed all who wait are told so."""
        if self._tasks:
            await asyncio.wait(self._tasks)

    async def ask(
        self, query: FicsCommand[Any], number: int | None, lane: Lane, expires_at: float | None
    ) -> Heard:
        """Put a question to a unit, or to the robot as a whole; what is a mere read is shared.

        :raises Expired: the robot was not free by then.
        :raises GatewayError: it was refused, not sent, or not answered; the error says which.
        """
        if lane is not Lane.READ:
            return await self._put(query, number, lane, expires_at)
        answer = await asyncio.shield(self._shared(query, number, expires_at))
        while isinstance(answer, Expired) and not _is_over(expires_at):  # for somebody who asked before
            answer = await asyncio.shield(self._shared(query, number, expires_at))
        if isinstance(answer, GatewayError):
            raise answer
        return answer

    def _shared(
        self, query: FicsCommand[Any], number: int | None, expires_at: float | None
    ) -> "asyncio.Task[Heard | GatewayError]":
        """The equal question that waits, or a new one."""
        question = (number, query.text())
        if question not in self._waiting:
            asking = self._put_for_all(query, number, expires_at)
            task = asyncio.create_task(asking, name=f"question {query.text()}")
            self._waiting[question] = task
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        return self._waiting[question]

    async def _put_for_all(
        self, query: FicsCommand[Any], number: int | None, expires_at: float | None
    ) -> Heard | GatewayError:
        question = (number, query.text())
        mine = asyncio.current_task()

        def begun() -> None:
            """Whoever asks from now on wants a later answer."""
            if self._waiting.get(question) is mine:
                del self._waiting[question]

        try:
            return await self._put(query, number, Lane.READ, expires_at, begun)
        except GatewayError as error:
            return error
        finally:
            begun()

    async def _put(
        self,
        query: FicsCommand[Any],
        number: int | None,
        lane: Lane,
        expires_at: float | None,
        begun: Callable[[], object] = lambda: None,
    ) -> Heard:
        robot = self._robot
        async with robot.line.sequence_lock.held(lane, expires_at):
            begun()
            robot.line.admission.revise()  # after a suspension no unit is trusted
            if number is not None:
                await self._select(number, afresh=isinstance(query, DownloadPositions))
            outcome = await robot.dialogue.say(query, robot.line.stop_epoch, expires_at=deadline_of(lane))
            robot.learn(query, number, outcome)
        return heard_now(*robot.dialogue.answered(query, outcome).replies)

    async def _select(self, number: int, *, afresh: bool) -> None:
        """Make sure of the unit whose values are told: no answer tells it, and a loss of power changes it.

        While the terminal is at work the robot does not tell its unit (C-HOST manual 1-7), and the one it has
        told before is trusted.
        """
        robot, selection = self._robot, self._robot.selection
        afresh = afresh or not (selection.is_trusted() or selection.only(number))
        try:
            await selection.make(number, afresh=afresh)
        except ControllerRefused as refused:
            if selection.unit != number:
                raise
            selection.trust()
            if refused.error_code == BLOCK_ERRORS[Block.TERMINAL_RUNS]:
                robot.see_motion(moves=True)
