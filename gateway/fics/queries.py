"""Questions to a robot: each put to the right unit, and once for all who ask the same meanwhile."""

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from gateway.errors import GatewayError
from gateway.exchange import Lane
from gateway.fics.errors import RobotRefused
from protocols.fics.positions import DownloadPositions
from protocols.fics.row import BLOCK_ERRORS, Block, FicsCommand
from protocols.table import Reply

if TYPE_CHECKING:
    from gateway.fics.robot import Robot

UNIT_HOLDS_S = 0.5
"""For so long a question trusts the unit the robot has told: an assumption, no loss of power is shorter."""

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


class Queries:
    """The questions that are being put to a robot."""

    def __init__(self, robot: "Robot") -> None:
        self._robot = robot
        self._waiting: dict[Question, asyncio.Task[Heard | GatewayError]] = {}
        """Those that wait for the floor; an equal one shares the answer."""
        self._tasks: set[asyncio.Task[Heard | GatewayError]] = set()
        self._unit_holds_until = 0.0

    async def close(self) -> None:
        """Ask nothing more: once the line is closed all who wait are told so."""
        if self._tasks:
            await asyncio.wait(self._tasks)

    async def ask(self, query: FicsCommand[Any], number: int | None, lane: Lane) -> Heard:
        """Put a question to a unit, or to the robot as a whole; what is a mere read is shared.

        :raises GatewayError: it was refused, not sent, or not answered; the error says which.
        """
        if lane is not Lane.READ:
            return await self._put(query, number, lane)
        question = (number, query.text())
        task = self._waiting.get(question)
        if task is None:
            task = asyncio.create_task(self._put_for_all(query, number), name=f"question {query.text()}")
            self._waiting[question] = task
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        answer = await asyncio.shield(task)
        if isinstance(answer, GatewayError):
            raise answer
        return answer

    async def _put_for_all(self, query: FicsCommand[Any], number: int | None) -> Heard | GatewayError:
        question = (number, query.text())
        mine = asyncio.current_task()

        def begun() -> None:
            """Whoever asks from now on wants a later answer."""
            if self._waiting.get(question) is mine:
                del self._waiting[question]

        try:
            return await self._put(query, number, Lane.READ, begun)
        except GatewayError as error:
            return error
        finally:
            begun()

    async def _put(
        self,
        query: FicsCommand[Any],
        number: int | None,
        lane: Lane,
        begun: Callable[[], object] = lambda: None,
    ) -> Heard:
        robot = self._robot
        async with robot.line.floor.held(lane):
            begun()
            robot.line.admission.revise()  # after a suspension no unit is trusted
            if number is not None:
                await self._select(number, afresh=isinstance(query, DownloadPositions))
            outcome = await robot.dialogue.say(query, robot.line.stop_epoch)
            robot.learn(query, number, outcome)
        return heard_now(*robot.dialogue.answered(query, outcome).replies)

    async def _select(self, number: int, *, afresh: bool) -> None:
        """Make sure of the unit whose values are told: no answer tells it, and a loss of power changes it.

        While the terminal is at work the robot does not tell its unit (C-HOST manual 1-7), and the one it has
        told before is trusted.
        """
        robot, selection, loop = self._robot, self._robot.selection, asyncio.get_running_loop()
        told = selection.unit is not None
        trusted = told and (loop.time() < self._unit_holds_until or robot.moves_by_itself)
        afresh = afresh or not (trusted or selection.only(number))
        try:
            await selection.make(number, afresh=afresh)
        except RobotRefused as refused:
            if selection.unit != number:
                raise
            if refused.fics_error == BLOCK_ERRORS[Block.TERMINAL_RUNS]:
                robot.see_motion(moves=True)
        if afresh and robot.motion is None:
            self._unit_holds_until = loop.time() + UNIT_HOLDS_S
