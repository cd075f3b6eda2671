"""Motion commands: written at most once, when all they depend on is proved, and ended."""

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeVar

from gateway.core.errors import Expired, GatewayError
from gateway.core.lanes import Lane
from gateway.fics.axes import UnitAxes
from gateway.fics.commander import Commander
from gateway.fics.errors import NotProved
from gateway.fics.exchange import FicsExchange, Outcome, Proof
from gateway.fics.motion_state import MOVES_ALL_UNITS, MotionState
from gateway.fics.power import RobotPower
from gateway.fics.questions import UNIT
from gateway.fics.selection import Selection
from gateway.fics.system_errors import SystemErrors
from protocols.fics.link import FicsRefusal
from protocols.fics.row import FicsCommand
from protocols.fics.system import HostMode, SelectUnit

T = TypeVar("T")


class Accepted(NamedTuple):
    """A motion command that was written: its exchange, and its outcome to come."""

    exchange: FicsExchange
    outcome: "asyncio.Future[Outcome]"
    """Ver.2: only a refusal ever comes here."""

    def was_not_written(self) -> bool:
        """Whether it was withdrawn before it was written."""
        outcome = self.outcome.result() if self.outcome.done() else None
        return isinstance(outcome, GatewayError) and outcome.moved == "no"

    def was_refused(self) -> bool:
        """Whether nothing moved because of it."""
        return self.outcome.done() and isinstance(self.outcome.result(), FicsRefusal)


@dataclass(eq=False)
class Motions:
    """The motion commands of one robot."""

    commander: Commander
    state: MotionState
    selection: Selection
    power: RobotPower
    errors: SystemErrors
    poll_interval_s: float
    """How often what moves is looked at."""

    def __post_init__(self) -> None:
        self.line = self.commander.line
        self._select = partial(self.selection.make, afresh=True)

    def require_fit(self, command: FicsCommand[Any]) -> None:
        """Refuse motion while the robot is not fit for it.

        :raises NotSent: power was lost, or an error stands.
        :raises RobotBusy: something moves, or a stop is not confirmed.
        """
        self.power.require_known(command)
        self.errors.require_none(command)
        self.state.require_still(command)

    async def begin(
        self,
        command: FicsCommand[Any],
        unit: UnitAxes,
        *,
        epoch: int,
        expires_at: float,
        on_written: Callable[[float], None],
    ) -> Accepted:
        """Write a motion command at most once, and give its outcome to come; it ends with `end`.

        :raises NotSent: it was not written; the error says why.
        :raises ControllerRefused: the mode, the speeds or the unit could not be made sure of.
        """

        def note(now: float) -> None:
            self.state.begin(command, unit.number)
            if isinstance(command, MOVES_ALL_UNITS):
                self.power.forget_origins()
                self.commander.bits.compare_again()
            on_written(now)

        async with self.line.sequence_lock.held(Lane.COMMAND, expires_at):
            doubt: NotProved | None = None
            while True:
                try:
                    proof = await in_time(expires_at, self._prove(command, unit, epoch))
                    written = await self.commander.start(
                        command, epoch=epoch, expires_at=expires_at, proof=proof, on_written=note
                    )
                except NotProved as error:
                    doubt = error  # all is asked again
                except Expired as late:
                    raise (doubt or late) from None
                else:
                    return Accepted(*written)

    async def _prove(self, command: FicsCommand[Any], unit: UnitAxes, epoch: int) -> Proof:
        """See to everything a motion depends on: the speeds, the unit, and last that the power is not lost.

        :raises NotSent: nobody knows, or something forbids the motion.
        :raises ControllerRefused: as of `begin`.
        """
        if self.line.stop_epoch != epoch:
            raise self.line.overtaken()
        self.require_fit(command)
        joining = self.state.command is not None
        proof = self.line.begin_proof(command, UNIT, *self.power.signs(command, unit, joining=joining))
        if self.line.mode == HostMode.VER_2:
            await self.commander.see_error()
            self.require_fit(command)
        if self.state.command is not None:
            await self.power.see_jogging(unit, proof)
        else:
            await self.power.restore(self._select)
            await self._select(unit.number)
            await self.power.see_kept(command, unit, proof)
        self.require_fit(command)
        return proof

    def sending(self, command: FicsCommand[Any], unit: UnitAxes) -> AbstractContextManager[None]:
        """Wait for the disk once, for a motion command and for all that has to go before it."""
        return self.line.sending(lambda: [*self.power.restoring(), SelectUnit(unit=unit.number), command])

    def end(self, accepted: Accepted | None = None) -> None:
        """The motion command that was begun is over; an answer it still owes is no longer waited for."""
        self.state.end(refused=accepted is not None and accepted.was_refused())
        if accepted is not None and not accepted.outcome.done():
            self.line.give_up(accepted.exchange)

    async def leave_refusal(self, lane: Lane) -> int | None:
        """Leave a refusal that nobody reads; gives what `Commander.leave_refusal` gives, None in trouble."""
        try:
            async with self.line.sequence_lock.held(lane):
                return await self.commander.leave_refusal()
        except GatewayError:
            return None

    async def see_power(self, unit: UnitAxes | None = None, *, speeds: bool = True) -> bool:
        """Whether the robot proves that it was not switched off; in Ver.2 a `unit` tells by its signs.

        Its `speeds` are one of them, where it is not homed.

        :raises PowerCycled: it was.
        :raises GatewayError: it did not tell.
        """
        async with self.line.sequence_lock.held(Lane.COMMAND):
            if unit is None:
                await self.power.see()
                return self.line.mode != HostMode.VER_2
            if self.line.mode == HostMode.VER_2:
                await self.selection.make(unit.number, afresh=False)
            return await self.power.see_signs(unit, speeds=speeds)

    async def restore_speeds(self) -> None:
        """Set the speeds again that were lost with the power; errors as of `RobotPower.restore`."""
        async with self.line.sequence_lock.held(Lane.COMMAND):
            await self.power.restore(self._select)


async def in_time(expires_at: float, preparation: Coroutine[Any, Any, T]) -> T:
    """Do what has to be done before a command is written, until that would come too late.

    :raises Expired: it took too long.
    """
    try:
        async with asyncio.timeout_at(expires_at):
            return await preparation
    except TimeoutError:
        raise Expired("robot") from None
