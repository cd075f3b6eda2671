"""The life of a move: sent at most once, followed to its end by what the controller itself says."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Any, Final, cast

from gateway.core.errors import (
    ControllerRefused,
    GatewayError,
    NoReply,
    NotAllowed,
    NotFound,
    NotSent,
    restarted_in_motion,
)
from gateway.core.events import Event
from gateway.core.exchange import Lane
from gateway.core.journal.intents import OF_MOVES
from gateway.core.move_record import RESTARTED, START_WITHIN_S, Move, MoveKind, MoveStatus
from gateway.core.move_runs import Beginning, MoveRuns, guarded
from gateway.core.next_calls import NextCall
from gateway.core.origin import new_id, working
from gateway.core.supervisor import do_each
from gateway.core.times import happens, together
from gateway.core.trajectories import Trajectories
from gateway.core.verdicts import Unbegun, judge
from gateway.rorze.alarms import calls_for_body
from gateway.rorze.asked_body import believed
from gateway.rorze.bodies import Body, Group, R, idle_bodies_of
from gateway.rorze.knowledge import MotorState
from gateway.rorze.line import Line
from gateway.rorze.move_proof import MISSING_END_FRAME_S, MoveProof, SharedWay
from gateway.rorze.plans import Planned, crossed_limit, target_of
from gateway.rorze.power import ProofTooOld
from gateway.rorze.probes import follow_s, poll_s
from gateway.rorze.samples import BodyTrajectory
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
from protocols.rorze.position import GetPosition
from protocols.rorze.row import RorzeCommand
from protocols.table import Reply

OUT_OF_RANGE: Final = "0x5D"
"""The controller's error; it does not say which range is meant."""


async def name_limits(body: Body, command: RorzeCommand[Any], refusal: Reply | GatewayError) -> None:
    """Name the target and the limit, where a refused move leads beyond one; only reads are sent."""
    if not isinstance(refusal, ControllerRefused) or refusal.error_code != OUT_OF_RANGE:
        return
    try:
        here, _ = await body.ask(GetPosition())
        target = await target_of(body, command, here.pulses)
        crossed = None if target is None else await crossed_limit(body, target)
    except GatewayError:
        return  # the refusal stands, with the controller's own words
    if crossed is None:
        return
    refusal.reword("body.beyond-limits", body=body.address, code=refusal.command_code, beyond=crossed.said)


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


SET_UP_AGAIN_S = 60.0
"""Least seconds between requests to the link master to announce ends of moves, where it does not."""
WATCHED_S = 2.0
"""A body that is watched is asked alone this often."""


class Moves(MoveRuns[Body, Move]):
    """All moves of bodies, and of groups of them."""

    def __init__(
        self,
        publish: Callable[[str, Body, Move], Event],
        *,
        allow_endless_moves: bool = False,
        on_trajectory: Callable[[Body], None] = lambda _: None,
    ) -> None:
        super().__init__()
        self._on_trajectory = on_trajectory
        """Called when the trajectory of a move begins, or has ended."""
        self._tell = publish
        self._allow_endless_moves = allow_endless_moves
        self.trajectories = Trajectories[BodyTrajectory]()
        self._no_set_up_before: dict[Line, float] = {}

    def of(self, body: Body) -> list[Move]:
        """The body's moves, newest first."""
        return self.log.of(body.address)

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
        moves = [(body, _new(body, target, command, kind or kind_of(command))) for body in bodies]
        proofs = [MoveProof(body, move) for body, move in moves]
        run = _MoveRun(target, command, proofs, epoch, course or {}, on_sent)
        refusal = await self._start(moves, partial(self._run, run, start_within_s), run.answered)
        if refusal is not None:
            raise refusal
        return [proof.move for proof in run.proofs]

    def require_end(self, command: RorzeCommand[Any]) -> None:
        """Refuse a move without an end where the configuration does.

        :raises NotAllowed: it does.
        """
        if kind_of(command) == "continuous" and not self._allow_endless_moves:
            raise NotAllowed(
                "Moves without an end are switched off; nothing was sent.",
                "Give a distance, or set allow_endless_moves in the configuration.",
            )

    def _move_of(self, who: Body) -> Move | None:
        return who.move

    def _calls(self, who: Body, error: GatewayError) -> Sequence[NextCall]:
        return calls_for_body(error, who.address)

    def _publish(self, news: str, who: Body, move: Move, /) -> Event:
        return self._tell(f"body.move.{news}", who, move)

    def _claim(self, who: Body, move: Move, /) -> None:
        who.claim(move)

    def _free(self, who: Body) -> None:
        who.release()
        do_each("the end of a trajectory", partial(self._on_trajectory, who))  # the body is free once

    def _lose(self, who: Body, _why: str, /) -> None:
        who.may_move()  # what is not written yet never is: no move stands for it

    def advance(self, who: Body, move: Move, status: MoveStatus, error: GatewayError | None = None) -> None:
        """Change the status of a move, and note what its positions are counted in."""
        move.counted_in = who.counted_in or move.counted_in
        super().advance(who, move, status, error)

    # from the queue to the reply

    async def _run(self, run: "_MoveRun", start_within_s: float) -> None:
        """One motion command, from the queue to the end of all its moves."""
        OF_MOVES.set([proof.move.id for proof in run.proofs])
        try:
            results = await self._send(run, start_within_s)
        except GatewayError as error:
            results = {proof.body: error for proof in run.proofs}
        for proof in sorted(run.proofs, key=lambda proof: isinstance(results[proof.body], ControllerRefused)):
            result = results[proof.body]
            if isinstance(result, ControllerRefused):  # last, for it is looked into
                results[proof.body] = result = await proof.contradicted(result) or result
                await name_limits(proof.body, run.command, result)
            self._reply(proof.body, proof.move, result)
        run.answer(results)
        await together(*(self._each_through(proof, results[proof.body]) for proof in run.proofs))

    async def _send(self, run: "_MoveRun", start_within_s: float) -> "_Results":
        expires_at = asyncio.get_running_loop().time() + start_within_s
        while True:
            for proof in run.proofs:
                await proof.know_the_start(run.command)
                if proof.body in run.course:
                    proof.expect(run.course[proof.body])
                self.log.on_change(proof.move)  # before its intent: it is what the next life judges by
            if not run.course:  # nobody has planned it
                stand = {proof.body: proof.before.position for proof in run.proofs if proof.before}
                await require_start_positions(run.target, run.command, stand)
            try:
                return await self._write(run, expires_at)
            except ProofTooOld:  # nothing was written
                continue

    def plan_samples(self, move_id: str, work_out: Callable[[], Awaitable[Planned]]) -> None:
        """Say what works out the plan beside the samples of a move; without any it is as any other."""
        with suppress(NotFound):
            self.trajectories.of(move_id).work_out = work_out

    async def _write(self, run: "_MoveRun", expires_at: float) -> "_Results":
        def written(at: float) -> None:
            for proof in run.proofs:
                proof.body.was_set_going(run.command)
                self.advance(proof.body, proof.move, MoveStatus.SENT)
                run.on_sent(proof.move)
                trajectory = BodyTrajectory(proof.body, proof.move, run.command, at)
                proof.body.motion.trace(trajectory)
                self.trajectories.begin(proof.move.id, trajectory)
                self._on_trajectory(proof.body)

        target = run.target
        if target.line.gate.epoch(target.number) != run.epoch:
            raise target.line.gate.overtaken(target.number)
        if isinstance(target, Group):
            return {**await target.ask(run.command, expires_at=expires_at, on_written=written)}
        reply, _ = await target.ask(run.command, expires_at=expires_at, on_written=written)
        return {target: reply}

    def _reply(self, body: Body, move: Move, result: "Reply | GatewayError") -> None:
        if isinstance(result, ControllerRefused):
            if move.status is MoveStatus.SENT:
                body.was_refused()
            asked_itself = result.address in (move.body_id, move.group_id)
            self.end(body, move, judge(Unbegun.REFUSED if asked_itself else Unbegun.WITHHELD, given=result))
        elif isinstance(result, NoReply):
            return
        elif isinstance(result, GatewayError):
            self.end(body, move, judge(Unbegun.WITHHELD, given=result))
        else:
            move.acknowledged_at = datetime.now(UTC)

    # over restarts

    def take_over(
        self, body: Body, move: Move, *, begun: bool, tolerance: int, since: str = RESTARTED
    ) -> None:
        """Go on with a move of an earlier life: ask the body, and follow the move to its end.

        `tolerance` is by how many pulses it may miss its target.
        """
        if not self._take_over(body, move, begun=begun, asked="the body", since=since):
            return
        answered: Beginning = asyncio.get_running_loop().create_future()
        answered.set_result(None)
        proof = MoveProof(body, move, rested_at(move), tolerance, since)
        following = partial(self._follow_through, proof, restarted_in_motion(body.address))
        self._see_through(move.id, following, answered, partial(self._give_up, [(body, move)]))

    # from the reply to the end

    async def _each_through(self, proof: MoveProof, result: "Reply | GatewayError") -> None:
        """See one of several moves through: a fault of the gateway itself at one ends no other."""
        give_up = partial(self._give_up, [(proof.body, proof.move)])
        await guarded(proof.move.id, partial(self._follow_through, proof, result), give_up)

    async def _follow_through(self, proof: MoveProof, result: "Reply | GatewayError") -> None:
        if isinstance(result, NoReply):
            verdict = await proof.without_reply(result)
            if verdict is not None:
                self.end(proof.body, proof.move, verdict)
        elif not proof.move.status.final:
            await happens(proof.body.motion.end_due, poll_s(proof.body.line))
        if not proof.move.status.final:
            await self._follow(proof)

    async def _follow(self, proof: MoveProof) -> None:
        """Ask the controller until the pulses have ended, and why they have."""
        with working("followers"):
            await self._follow_to_rest(proof)

    async def _follow_to_rest(self, proof: MoveProof) -> None:
        body, move = proof.body, proof.move
        while True:
            announced, due = body.motion.announced.is_set(), body.motion.end_due.is_set()
            asked_at, set_ups = asyncio.get_running_loop().time(), body.line.set_ups
            state = await proof.running()
            if state is None:
                self.end(body, move, proof.given_up())
                return
            move.position = state.position
            if not state.runs:
                break
            proof.set_ups = set_ups
            if announced:  # an earlier move's end
                body.motion.announced.clear()
            if due:
                body.motion.end_due.clear()
            if move.status is MoveStatus.SENT:
                self.advance(body, move, MoveStatus.MOVING)
            took_s = asyncio.get_running_loop().time() - asked_at
            pause_s = WATCHED_S if body.motion.watched else body.poll_interval_s
            await happens(body.motion.end_due, max(pause_s, follow_s(body.line) - took_s))
        move.completion = "frame" if body.motion.announced.is_set() else "polling"
        body.stands()
        self.end(body, move, await proof.at_rest(state))
        if move.completion == "polling" and move.status is not MoveStatus.LOST:
            await self._expect_end_frame(proof)

    async def _expect_end_frame(self, proof: MoveProof) -> None:
        """An unannounced end is a sign that the link master has restarted, if the line answered then."""
        body = proof.body
        if proof.set_ups != body.line.set_ups:
            return
        if await happens(body.motion.announced, MISSING_END_FRAME_S) or body.move is not None:
            return
        now = asyncio.get_running_loop().time()
        if now >= self._no_set_up_before.get(body.line, now):
            self._no_set_up_before[body.line] = now + SET_UP_AGAIN_S
            body.line.set_up_again(
                f"the link master has not announced the end of a move of {body.short}, as after a restart"
            )

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


def rested_at(move: Move) -> MotorState | None:
    """The body's state before the move, as far as its record tells."""
    return None if move.start_position is None else MotorState(0, move.start_position)


_Results = dict[Body, "Reply | GatewayError"]


@dataclass(eq=False)
class _MoveRun:
    """A motion command on its way, with one move for each body it moves."""

    target: Body | Group
    command: RorzeCommand[Any]
    proofs: list[MoveProof]
    epoch: int
    """The target's stop epoch at admission."""
    course: Mapping[Body, SharedWay]
    on_sent: Callable[[Move], None]
    answered: Beginning = field(default_factory=lambda: asyncio.get_running_loop().create_future())

    def answer(self, results: _Results) -> None:
        """Answer the caller: an error if a single body did not take the command, or if no body got it."""
        errors = [
            result
            for result in results.values()
            if isinstance(result, GatewayError) and not isinstance(result, NoReply)
        ]
        alone = isinstance(self.target, Body)
        nobody = all(proof.move.sent_at is None for proof in self.proofs)
        if not self.answered.done():
            self.answered.set_result(errors[0] if errors and (alone or nobody) else None)


def kind_of(command: RorzeCommand[Any]) -> MoveKind:
    """The kind of move that a motion command makes."""
    if isinstance(command, RelativeMove):
        return "continuous" if command.distance == "endless" else "relative"
    if isinstance(command, AbsoluteMove):
        return "absolute"
    return "home" if isinstance(command, OriginSearch | CentreStallDog) else "interpolated"
