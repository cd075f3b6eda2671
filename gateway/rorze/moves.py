"""Moves of bodies: which command starts them, and what it needs before it is written."""

from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final, cast

from gateway.core.errors import GatewayError, NoReply, NotAllowed, NotFound, NotSent
from gateway.core.events import Event
from gateway.core.exchange import Lane
from gateway.core.move_record import RESTARTED, START_WITHIN_S, Move, MoveKind
from gateway.core.move_runs import Motion, MoveRuns
from gateway.core.origin import new_id
from gateway.rorze.asked_body import believed
from gateway.rorze.bodies import Body, Group, R, idle_bodies_of
from gateway.rorze.knowledge import MotorState
from gateway.rorze.move_proof import BodyRun
from gateway.rorze.plans import Planned
from gateway.rorze.power import ProofTooOld
from gateway.rorze.samples import BodyTrajectory
from gateway.rorze.starts import SharedWay
from protocols.rorze.interpolation import (
    GetDrivenAxis,
    GetStartPosition,
    MoveToExtensionStart,
    StartInterpolation,
    TurnFinger,
)
from protocols.rorze.link import MoveEnded
from protocols.rorze.moves import AbsoluteMove, RelativeMove
from protocols.rorze.origin import CentreStallDog, OriginSearch
from protocols.rorze.row import RorzeCommand

FROM_TOLD_POSITIONS: Final = (StartInterpolation, MoveToExtensionStart, TurnFinger)


class PreparationOutdated(GatewayError):
    """An interpolated move was prepared for other positions than those in which the axes stand."""

    kind = "preparation-outdated"


async def require_start_positions(
    target: Body | Group, command: RorzeCommand[Any], positions: Mapping[Body, int]
) -> None:
    """See that an interpolated move was prepared for where the axes stand, in pulses (HCD, HPD).

    Every controller that is asked to move must hold the position of each axis that moves.

    :raises PreparationOutdated: one does not, or was told positions after its preparation.
    :raises ControllerRefused, NotSent: one did not tell.
    """
    if not isinstance(command, FROM_TOLD_POSITIONS):
        return
    if isinstance(command, StartInterpolation):
        _require_prepared(positions)
    try:
        for body, driven in (await _of_all(target, GetDrivenAxis())).items():
            told = await _of_all(target, GetStartPosition(axis=driven.axis))
            for controller, start in told.items():
                if start.pulses != positions[body]:
                    raise _outdated(
                        f"{controller.address} was told that axis {driven.axis} stands at {start.pulses}, "
                        f"and {body.address} stands at {positions[body]}"
                    )
    except NoReply as error:
        raise NotSent(
            f"{target.address} did not tell what its move was prepared for; the move was not sent.",
            error.remedy,
        ) from None


def _require_prepared(bodies: Mapping[Body, int]) -> None:
    for body in bodies:
        if body.prepared.is_prepared is False:
            raise _outdated(
                f"Nobody has prepared {body.address} since it was told positions, moved or lost its power"
            )


async def _of_all(target: Body | Group, question: RorzeCommand[R]) -> dict[Body, R]:
    async def ask() -> dict[Body, R]:
        if isinstance(target, Body):
            return {target: (await target.ask(question, lane=Lane.VERIFY))[0]}
        replies = await target.ask(question, lane=Lane.VERIFY)
        for reply in replies.values():
            if isinstance(reply, GatewayError):
                raise reply
        return cast("dict[Body, R]", replies)

    return await believed(target.line, ask)


def _outdated(why: str) -> PreparationOutdated:
    return PreparationOutdated.worded("preparation.outdated", why=why)


class Moves(MoveRuns[Move]):
    """All moves of bodies, and of groups of them."""

    def __init__(
        self,
        tell: Callable[[str, Body, Move], Event],
        *,
        allow_endless_moves: bool = False,
        on_trajectory: Callable[[Body], None] = lambda _: None,
    ) -> None:
        super().__init__(tell, on_trajectory)
        self._allow_endless_moves = allow_endless_moves

    async def start(
        self,
        target: Body | Group,
        command: RorzeCommand[Any],
        start_within_s: float = START_WITHIN_S,
        course: Mapping[Body, SharedWay] | None = None,
        on_sent: Callable[[Move], None] = lambda _: None,
        kind: MoveKind | None = None,
    ) -> list[Move]:
        """Send a motion command, and give its moves when the controllers have accepted or refused it.

        One move comes back for a body, one for each member for a group; `on_sent` is called with each when
        the command is on the wire. `kind` is what it is for, where the command does not tell. `course` says
        where the planner of the move has seen the motors, and where they should come to.

        :raises NotAllowed: it would never end, and the configuration does not allow that.
        :raises BodyBusy: a body moves, or the group is being defined anew; nothing was sent.
        :raises PowerCycled: a body has lost its power, and would go to another place; nothing was sent.
        :raises PreparationOutdated: an interpolated move was prepared for other positions; nothing was sent.
        :raises ControllerRefused: the body refused; nothing moved.
        :raises NotSent: the line is down, the body offline, the time was up, or the gateway ends or was held
            up; nothing was sent.
        """
        self.require_end(command)
        target.line.require_fit()
        bodies = idle_bodies_of(target)
        for body in bodies:
            body.require_power(command)
        epoch = target.line.gate.epoch(target.number)
        runs = [BodyRun(self, body, _new(body, target, command, kind or kind_of(command))) for body in bodies]
        await self._begin(BodiesMotion(runs, target, command, epoch, course or {}, on_sent), start_within_s)
        return [run.move for run in runs]

    def require_end(self, command: RorzeCommand[Any]) -> None:
        """Refuse a move without an end where the configuration does.

        :raises NotAllowed: it does.
        """
        if kind_of(command) == "continuous" and not self._allow_endless_moves:
            raise NotAllowed(
                "Moves without an end are switched off; nothing was sent.",
                "Give a distance, or set allow_endless_moves in the configuration.",
            )

    def plan_samples(self, move_id: str, work_out: Callable[[], Awaitable[Planned]]) -> None:
        """Say what works out the plan beside the samples of a move; without any it is as any other."""
        with suppress(NotFound):
            self.trajectories.of(move_id).work_out = work_out

    # over restarts

    def take_over(
        self, body: Body, move: Move, *, begun: bool, tolerance: int, since: str = RESTARTED
    ) -> None:
        """Go on with a move of an earlier life: ask the body, and follow the move to its end.

        `tolerance` is by how many pulses it may miss its target.
        """
        before = None if move.start_position is None else MotorState(0, move.start_position)
        run = BodyRun(self, body, move, before=before, tolerance=tolerance, resumed=since)
        self._go_on(run, since, begun=begun)

    def ended(self, body: Body, frame: MoveEnded) -> None:
        """The link master announces an end: a reason to ask now, never a proof."""
        if body.move is None:
            body.moved_unseen()
        if body.move is None or body.move.command == frame.code:
            body.motion.end_was_announced()


def _new(body: Body, target: Body | Group, command: RorzeCommand[Any], kind: MoveKind) -> Move:
    now = datetime.now(UTC)
    return Move(
        id=new_id(now),
        body_id=body.address,
        group_id=target.address if isinstance(target, Group) else None,
        kind=kind,
        command=command.code,
        frame=target.line.frame_of(target.number, command),
        created_at=now,
        counted_in=body.counted_in,
    )


@dataclass(eq=False)
class BodiesMotion(Motion[BodyRun, None]):
    """A motion command, with one move for each body that it moves."""

    _disproved = (ProofTooOld,)

    target: Body | Group
    command: RorzeCommand[Any]
    epoch: int
    """The target's stop epoch at admission."""
    course: Mapping[Body, SharedWay]
    on_sent: Callable[[Move], None]

    async def _prepare(self) -> None:
        """Prove the start of each body; errors as of `BodyRun.know_the_start`."""
        for run in self.runs:
            await run.know_the_start(self.command, self.course.get(run.body))
        if not self.course:  # nobody has planned it
            stand = {run.body: run.before.position for run in self.runs if run.before}
            await require_start_positions(self.target, self.command, stand)

    async def _write(self, _: None, expires_at: float) -> Mapping[BodyRun, object]:
        """Write the command; errors as of `Body.ask` and `Group.ask`."""
        target = self.target
        if target.line.gate.epoch(target.number) != self.epoch:
            raise target.line.gate.overtaken(target.number)
        if isinstance(target, Body):
            told = await target.ask(self.command, expires_at=expires_at, on_written=self.was_written)
            return {self.runs[0]: told[0]}
        replies = await target.ask(self.command, expires_at=expires_at, on_written=self.was_written)
        return {run: replies[run.body] for run in self.runs}

    def _sent(self, run: BodyRun, at: float) -> None:
        run.set_going(self.command)
        self.on_sent(run.move)
        run.trace(BodyTrajectory(run.body, run.move, self.command, at))


def kind_of(command: RorzeCommand[Any]) -> MoveKind:
    """The kind of move that a motion command makes."""
    if isinstance(command, RelativeMove):
        return "continuous" if command.distance == "endless" else "relative"
    if isinstance(command, AbsoluteMove):
        return "absolute"
    return "home" if isinstance(command, OriginSearch | CentreStallDog) else "interpolated"
