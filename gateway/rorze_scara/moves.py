"""The moves of SCARA robots: one frame starts all axes, and when one fails all stop (RC-420 manual 13.10)."""

import asyncio
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Any, Final, TypeVar

from gateway.core.errors import (
    BodyBusy,
    ControllerRefused,
    GatewayEnding,
    GatewayError,
    InvalidRequest,
    Moved,
    NoReply,
    NotFound,
)
from gateway.core.events import Event
from gateway.core.exchange import Lane
from gateway.core.journal.intents import OF_MOVES
from gateway.core.move_record import RESTARTED, Move, MoveStatus
from gateway.core.move_runs import Beginning, MoveRuns, in_the_middle
from gateway.core.next_calls import NextCall
from gateway.core.origin import new_id, working
from gateway.core.supervisor import supervise
from gateway.core.verdicts import Unbegun, Unwatched, Verdict, VerdictWords, judge, worst_of
from gateway.rorze.bodies import Body, Group
from gateway.rorze.knowledge import PULSES_RUNNING
from gateway.rorze.move_proof import MOTION_ERRORS, SharedWay
from gateway.rorze.moves import Moves
from gateway.rorze.samples import samples_of
from gateway.rorze.stops import Stops
from gateway.rorze_scara.geometry import GeometryDiffers
from gateway.rorze_scara.paths import PathsDiffer
from gateway.rorze_scara.preparation import (
    Plan,
    know_pattern,
    prepare,
    prove_power,
    trajectory_of,
    weigh,
    wish_of,
    with_own_pattern,
    work_out,
)
from gateway.rorze_scara.record import (
    PlannedScaraMove,
    ScaraAxisMove,
    ScaraMove,
    ScaraPlace,
    ScaraSamples,
)
from gateway.rorze_scara.requests import ScaraMoveRequest
from gateway.rorze_scara.scara import Scara
from protocols.rorze.link import MoveEnded
from protocols.rorze.status import ControllerStatus, GetControllerStatus

WATCH_S: Final = 0.1
"""The pause between two questions to all controllers of a robot that moves."""

ATTEMPTS: Final = 3
"""Tries in all of a preparation that gets no reply."""

T = TypeVar("T")


@dataclass(eq=False)
class _Run:
    """A move under way."""

    scara: Scara
    move: ScaraMove
    moves: dict[Body, Move] = field(default_factory=dict)
    """The moves of the bodies, once they are begun."""
    begun: bool = False
    """True if the controllers have accepted or refused it."""
    stopping: "asyncio.Task[Any] | None" = None

    @property
    def under_way(self) -> bool:
        """True if an axis may still move."""
        return any(not move.status.final for move in self.moves.values())


class ScaraMoves(MoveRuns[_Run, ScaraMove]):
    """All moves of all SCARA robots: those of their axes are watched over together."""

    def __init__(self, moves: Moves, stops: Stops, publish: Callable[[str, ScaraMove], Event]) -> None:
        super().__init__()
        self._moves, self._stops, self._tell = moves, stops, publish
        self._runs: dict[Body, _Run] = {}
        """The run of each member of a robot that moves."""
        self._tasks: set[asyncio.Task[Any]] = set()
        """Tasks that watch over moves, and stop them."""

    async def start(self, scara: Scara, request: ScaraMoveRequest, start_within_s: float = 5.0) -> ScaraMove:
        """Prepare a move and start it, undivided, and give it when the controllers have accepted it.

        :raises InvalidRequest: the arm does not come there, or no path leads there; nothing moved.
        :raises BodyBusy: the robot or one of its bodies moves; nothing was sent.
        :raises PathsDiffer: the controllers hold different paths; nothing moved.
        :raises GeometryDiffers: a controller calculates otherwise than the gateway; nothing moved.
        :raises PowerCycled: a body has lost its power; nothing moved.
        :raises ControllerRefused: a controller has refused the preparation or the start; nothing moved.
        :raises NotSent: it was not prepared, or not started; nothing moved.
        """
        scara.line.require_fit()
        self._require_idle(scara)
        now = datetime.now(UTC)
        move = ScaraMove(
            id=new_id(now),
            body_id=scara.id,
            scara_id=scara.id,
            kind=request.kind,
            command="",
            frame="",
            created_at=now,
        )
        run = _Run(scara, move)
        answered: Beginning = asyncio.get_running_loop().create_future()
        beginning = partial(self._begin, run, request, start_within_s, answered)
        refusal = await self._start([(run, move)], beginning, answered)
        if refusal is not None:
            raise refusal
        return move

    async def plan(self, scara: Scara, request: ScaraMoveRequest) -> PlannedScaraMove:
        """Work out a move; only reads are sent.

        :raises InvalidRequest: the arm does not come there, or no path leads there.
        :raises GatewayError: the robot did not tell where it stands.
        """
        sent = with_own_pattern(scara, request)
        async with scara.looking():
            return await weigh(await work_out(scara, sent), sent.pattern, wish_of(scara, request))

    async def samples(self, move_id: str) -> ScaraSamples:
        """Give where its axes were seen during a move, beside their plans; errors as of `Trajectories.of`."""
        move = self.log.get(move_id)
        of_axes = [
            self._moves.trajectories.of(axis.move_id) for axis in move.axes if axis.move_id is not None
        ]
        if not of_axes:
            raise NotFound(f"The move {move_id} was not started, so there are no samples of it.")
        axes = [await samples_of(samples) for samples in of_axes]
        return ScaraSamples(scara_id=move.scara_id, move_id=move_id, axes=axes)

    async def close(self) -> None:
        """Stop watching, once the lines are closed; the motors keep doing what they do."""
        await super().close()
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # over restarts

    def resume(
        self, scaras: Mapping[str, Scara], records: Sequence[Mapping[str, Any]], since: str = RESTARTED
    ) -> None:
        """Take over the moves of an earlier life, once those of the bodies are taken over."""
        own = [ScaraMove.model_validate(record) for record in records if record.get("scara_id") in scaras]
        self.log.remember(own)
        for move in own:
            if not move.status.final:
                self._resume(scaras[move.scara_id], move, since)

    def _resume(self, scara: Scara, move: ScaraMove, since: str) -> None:
        """Go on with a move by those of its bodies; one that was still being prepared has moved nothing."""
        run = _Run(scara, move, begun=True)
        if not any(axis.move_id for axis in move.axes):
            self.end(run, run.move, judge(Unbegun.GATEWAY_ENDED, VerdictWords(begins="move was started")))
            return
        run.moves = self._moves_of(scara, move)
        if not run.moves:
            self.end(run, run.move, judge(Unwatched.OTHER_MEMBERS, VerdictWords(scara.id, "finger")))
            return
        move.evidence.append(in_the_middle(since, "each of its axes"))
        self._claim(run, move)
        self._runs |= dict.fromkeys(run.moves, run)
        self._begin_to_watch(run)
        self._look_after(run)

    def _moves_of(self, scara: Scara, move: ScaraMove) -> dict[Body, Move]:
        """The moves of a robot's bodies; none where it has other bodies now, or one is not kept any more."""
        if [axis.body_id for axis in move.axes] != [body.address for body in scara.members]:
            return {}
        both = zip(scara.members, move.axes, strict=True)
        try:
            return {body: self._moves.get(axis.move_id) for body, axis in both if axis.move_id is not None}
        except NotFound:
            return {}

    # what bodies tell

    def advanced(self, body: Body, move: Move) -> None:
        """The move of a body has changed its status."""
        run = self._runs.get(body)
        if run is not None:
            run.moves[body] = move
            if move.status is MoveStatus.QUEUED:
                self._note_axes(run)
                self.log.on_change(run.move)  # the next life has to know the moves of its axes
            if move.status is MoveStatus.SENT and run.move.status is MoveStatus.QUEUED:
                self.advance(run, run.move, MoveStatus.SENT)
            self._look_after(run)

    def announced(self, body: Body, frame: MoveEnded) -> None:
        """A move has ended: where the frame names a cause, the others need not wait until it is proved."""
        if frame.cause:
            self._failed(body, f"the link master has announced its end with cause {frame.cause:02X}")

    def fell_silent(self, body: Body) -> None:
        """A body does not answer any more."""
        self._failed(body, "it does not answer")

    def _failed(self, body: Body, why: str) -> None:
        run = self._runs.get(body)
        if run is not None and run.begun and run.under_way:
            self._stop_all(run, body, why)

    # before it starts

    def _require_idle(self, scara: Scara) -> None:
        scara.group.require_in_force()
        if scara.move is not None:
            raise BodyBusy(
                f"{scara.id} still has the move {scara.move.id}; nothing was sent.", "Wait for it or stop it."
            )
        for body in scara.members:
            if body.move is not None:
                raise BodyBusy(
                    f"{body.address} of {scara.id} still has the move {body.move.id}; nothing was sent.",
                    "Wait for it or stop it.",
                )

    async def _begin(
        self, run: _Run, request: ScaraMoveRequest, start_within_s: float, answered: Beginning
    ) -> None:
        """Prepare and start the move; on failure its record says why, for the caller may be gone."""
        scara = run.scara
        OF_MOVES.set([run.move.id])
        try:
            expires_at = asyncio.get_running_loop().time() + start_within_s
            await know_pattern(scara, request.pattern)
            async with scara.line.undivided([scara.group.number], expires_at):
                plan = await self._prepare(run, request)
                await self._set_off(run, plan, expires_at)
                for body, move in run.moves.items():
                    self._moves.plan_samples(move.id, partial(trajectory_of, plan, body, request.pattern))
        except GatewayError as error:
            refused = isinstance(error, ControllerRefused)
            self.end(run, run.move, judge(Unbegun.REFUSED if refused else Unbegun.WITHHELD, given=error))
            answered.set_result(error)
        except asyncio.CancelledError:
            self.end(run, run.move, judge(Unbegun.WITHHELD, given=GatewayEnding()))
            raise
        else:
            answered.set_result(None)

    async def _prepare(self, run: _Run, request: ScaraMoveRequest) -> Plan:
        """Work the move out and prepare it, anew where a reply was lost: nothing moves by that."""
        for left in reversed(range(ATTEMPTS)):
            try:
                plan = await work_out(run.scara, request, Lane.VERIFY)
                _note_plan(run.move, plan)
                await prepare(plan, run.move.preparation.append)
            except NoReply:
                if not left:
                    raise
            except (InvalidRequest, ControllerRefused, GeometryDiffers, PathsDiffer):
                await prove_power(run.scara)  # that explains it, too
                raise
            else:
                break
        return plan

    async def _set_off(self, run: _Run, plan: Plan, expires_at: float) -> None:
        """Start it by one frame, where every axis still stands where the plan begins."""
        scara = run.scara
        course = {
            body: SharedWay(start, end, scara.tolerance_pulses)
            for body, start, end in zip(scara.members, plan.here.pulses, plan.target, strict=True)
            if body in plan.movers
        }
        self._runs |= dict.fromkeys(plan.movers, run)
        left_s = expires_at - asyncio.get_running_loop().time()
        await self._moves.start(plan.addressee, plan.manoeuvre.motion, left_s, course)
        run.begun = True
        acknowledged = [body for body, move in run.moves.items() if move.acknowledged_at]
        run.move.acknowledged_at = datetime.now(UTC) if acknowledged else None
        for body, move in run.moves.items():
            if acknowledged and not move.acknowledged_at and not move.status.final:
                self._failed(body, "it has not answered the start, and others have")
        self._begin_to_watch(run)
        self._look_after(run)

    # while it runs

    def _begin_to_watch(self, run: _Run) -> None:
        known = ((body, body.told.status_bits) for body in run.moves)
        errors = {body: MOTION_ERRORS if bits is None else bits & MOTION_ERRORS for body, bits in known}
        self._keep(supervise(f"the watch of {run.move.id}", partial(self._watch, run, errors)))

    async def _watch(self, run: _Run, errors: Mapping[Body, int]) -> None:
        """Ask all controllers at once how they are, until all have ended or one is in trouble.

        `errors` are those that each had before.
        """
        with ExitStack() as watched:
            for body in errors:
                watched.enter_context(body.motion.watched_as_a_whole())
            with working("followers"):
                while run.under_way and run.stopping is None:
                    await self._see(run, errors)
                    await asyncio.sleep(WATCH_S)
        for body in run.moves:
            await body.motion.free.wait()
        self._look_after(run)

    async def _see(self, run: _Run, errors: Mapping[Body, int]) -> None:
        """Have who rests looked at; stop all where one is missing twice, or has an error it did not have."""
        seen = await _statuses(run.scara.group)
        missing = [body for body in errors if seen and body not in seen]
        if missing:
            again = await _statuses(run.scara.group)
            missing = [body for body in missing if again and body not in again]
        for body in missing:
            self._failed(body, "it does not answer, and others do")
        for body, before in errors.items():
            bits = seen.get(body, PULSES_RUNNING)
            if not bits & PULSES_RUNNING:
                body.motion.end_due.set()
            if bits & MOTION_ERRORS & ~before:
                self._failed(body, "it reports an error")

    def _look_after(self, run: _Run) -> None:
        """See what has become of the axes."""
        if not run.begun or run.move.status.final:
            return
        moves = run.moves.values()
        self._note_axes(run)
        if not run.under_way:
            self._finish(run)
            return
        for body, move in run.moves.items():
            if move.status.final and move.status is not MoveStatus.SUCCEEDED:
                self._stop_all(run, body, f"its move is {move.status}")
                return
        waits = run.move.status in (MoveStatus.QUEUED, MoveStatus.SENT)
        if waits and any(move.status is MoveStatus.MOVING for move in moves):
            self.advance(run, run.move, MoveStatus.MOVING)

    def _stop_all(self, run: _Run, body: Body, why: str) -> None:
        """Stop every axis, once."""
        if run.stopping is not None:
            return
        run.stopping = self._stops.stop(run.scara.members, run.scara.on_fault)
        self._keep(run.stopping)
        axis = run.scara.members.index(body)
        run.move.evidence.append(
            f"All axes were stopped at the first sign, from {body.address}, axis {axis}: {why}."
        )

    # the end

    def _lose(self, who: _Run, _why: str, /) -> None:
        """Stop the axes that may move, since their ends can no longer be coordinated."""
        if who.moves:
            self._keep(self._stops.stop(who.scara.members, who.scara.on_fault))

    def _finish(self, run: _Run) -> None:
        """All axes have ended: the worst of them tells how the robot's move did."""
        failed = {body: move for body, move in run.moves.items() if _failed(move)}
        run.move.failed_axes = sorted(run.scara.members.index(body) for body in failed)
        self.end(
            run, run.move, judge(worst_of(move.status for move in run.moves.values()), _words(run, failed))
        )

    def _note_axes(self, run: _Run) -> None:
        """Write into the record what is known of its axes."""
        moves = {body.address: move for body, move in run.moves.items()}
        for axis in run.move.axes:
            move = moves.get(axis.body_id)
            if move is not None:
                axis.move_id, axis.status, axis.end_cause = move.id, move.status, move.end_cause
                axis.position = axis.position if move.position is None else move.position

    def end(self, who: _Run, move: ScaraMove, verdict: Verdict) -> None:
        """End a move as it is judged, with what is known of its axes."""
        if move.axes:
            self._note_axes(who)
            if verdict.status in (MoveStatus.SUCCEEDED, MoveStatus.STOPPED, MoveStatus.FAILED):
                place = who.scara.robot.place([axis.position for axis in move.axes])
                move.coordinates = ScaraPlace.of(place)
        super().end(who, move, verdict)

    def _move_of(self, who: _Run) -> ScaraMove | None:
        return who.scara.move

    def _calls(self, _who: _Run, error: GatewayError, /) -> Sequence[NextCall]:
        return error.next

    def _publish(self, news: str, _who: _Run, move: ScaraMove, /) -> Event:
        return self._tell(news, move)

    def _claim(self, who: _Run, move: ScaraMove, /) -> None:
        who.scara.move = move

    def _free(self, who: _Run) -> None:
        for body in who.scara.members:
            if self._runs.get(body) is who:
                del self._runs[body]
        if who.scara.move is who.move:
            who.scara.move = None

    def _keep(self, task: "asyncio.Task[T]") -> "asyncio.Task[T]":
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task


def _note_plan(move: ScaraMove, plan: Plan) -> None:
    """Write into the record what is about to be prepared."""
    scara = plan.scara
    move.command, move.frame = plan.manoeuvre.motion.code, plan.frame
    move.start, move.target = ScaraPlace.of(plan.here.place), ScaraPlace.of(scara.robot.place(plan.target))
    stretches = zip(scara.members, plan.here.pulses, plan.target, strict=True)
    move.axes = [
        ScaraAxisMove(
            axis=axis, body_id=body.address, start_position=start, target_position=target, position=start
        )
        for axis, (body, start, target) in enumerate(stretches)
    ]
    move.preparation.clear()


async def _statuses(group: Group) -> dict[Body, int]:
    """The status of the bodies that answer; of none where the frame was lost: that proves nothing."""
    try:
        results = await group.ask(GetControllerStatus(), lane=Lane.VERIFY)
    except GatewayError:
        return {}
    return {
        body: result.bits or 0 for body, result in results.items() if isinstance(result, ControllerStatus)
    }


def _failed(move: Move) -> bool:
    return move.status not in (MoveStatus.SUCCEEDED, MoveStatus.STOPPED)


def _cause(move: Move) -> str:
    return move.end_cause or str(move.status)


def _words(run: _Run, failed: Mapping[Body, Move]) -> VerdictWords:
    """Say which axes have failed, and why."""
    told = [
        f"Axis {run.scara.members.index(body)}: {move.error.detail if move.error else _cause(move)}"
        for body, move in failed.items()
    ]
    return VerdictWords(
        run.scara.id,
        "finger",
        stopped=", and all its axes were stopped" if run.stopping else "",
        told=" ".join(told),
        cause="+".join(dict.fromkeys(_cause(move) for move in failed.values())),
        moved=_moved(run.moves.values()),
    )


def _moved(moves: Iterable[Move]) -> Moved:
    """The robot's verdict words, by the ends of its axes."""
    told = {"yes" if move.error is None else move.error.moved for move in moves}
    return "yes" if "yes" in told else "unknown" if "unknown" in told else "no"
