"""The moves of SCARA robots: one frame starts all axes, and when one fails all stop (RC-420 manual 13.10)."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from typing import Any, Final

from gateway.core.errors import (
    BodyBusy,
    ControllerRefused,
    GatewayError,
    InvalidRequest,
    Moved,
    NoReply,
    NotFound,
)
from gateway.core.events import Event
from gateway.core.exchange import Lane
from gateway.core.move_record import RESTARTED, Move, MoveStatus
from gateway.core.move_runs import Found, Motion, MoveRun, MoveRuns, found
from gateway.core.origin import new_id
from gateway.core.supervisor import Deed, supervise
from gateway.core.times import happens
from gateway.core.verdicts import Unwatched, VerdictWords, worst_of
from gateway.rorze.bodies import Body, Group, idle_bodies_of
from gateway.rorze.knowledge import PULSES_RUNNING
from gateway.rorze.move_proof import MOTION_ERRORS
from gateway.rorze.moves import Moves
from gateway.rorze.samples import samples_of
from gateway.rorze.starts import SharedWay
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


class ScaraRun(MoveRun[ScaraMove, "ScaraRun"]):
    """A move of a robot: its axes have moves of their own, which are watched over together."""

    controller = "each of its axes"

    def __init__(self, keeper: "ScaraMoves", scara: Scara, move: ScaraMove) -> None:
        super().__init__(keeper, move, scara, scara.line, scara.id, WATCH_S)
        self.scara = scara
        self.moves: dict[Body, Move] = {}
        """The moves of the bodies, once they are begun."""
        self._keeper = keeper
        self._begun = False
        """True if the controllers have accepted or refused it."""
        self._errors: Mapping[Body, int] = {}
        """Errors that each body had before."""
        self._stopping: asyncio.Task[Any] | None = None
        self._over = asyncio.Event()
        """Set when all axes have ended."""

    # the robot

    def _free(self) -> tuple[Deed, ...]:
        self._keeper.forget(self)
        is_claimed = self.scara.move is self.move  # one of other bodies was never claimed
        return super()._free() if is_claimed else ()

    def _lose(self, _why: str, /) -> None:
        """Stop the axes that may move, since their ends can no longer be coordinated."""
        if self.moves:
            self._keeper.stops.stop(self.scara.members, self.scara.on_fault)

    def advance(self, status: MoveStatus, error: GatewayError | None = None) -> None:
        """Change the status of the move, and note what is known of its axes at its end."""
        if status.final and self.move.axes:
            self._note_axes()
            if status in (MoveStatus.SUCCEEDED, MoveStatus.STOPPED, MoveStatus.FAILED):
                place = self.scara.robot.place([axis.position for axis in self.move.axes])
                self.move.coordinates = ScaraPlace.of(place)
        super().advance(status, error)

    # what bodies tell

    def advanced(self, body: Body, move: Move) -> None:
        """The move of a body has changed its status."""
        self.moves[body] = move
        if move.status is MoveStatus.QUEUED:
            self._note_axes()
            self._keeper.log.on_change(self.move)  # the next life has to know the moves of its axes
        if move.status is MoveStatus.SENT and self.move.status is MoveStatus.QUEUED:
            self.advance(MoveStatus.SENT)
        self._look_after()

    def failed(self, body: Body, why: str) -> None:
        """Something has happened to an axis: the others need not wait until it is proved."""
        if self._begun and self._is_under_way():
            self._stop_all(body, why)

    def begin(self) -> None:
        """The controllers have accepted or refused it."""
        self._begun = True
        acknowledged = [body for body, move in self.moves.items() if move.acknowledged_at]
        self.move.acknowledged_at = datetime.now(UTC) if acknowledged else None
        for body, move in self.moves.items():
            if acknowledged and not move.acknowledged_at and not move.status.final:
                self.failed(body, "it has not answered the start, and others have")

    # while it runs

    async def follow(self, doubt: NoReply | None = None) -> None:
        """Ask all controllers at once how they are, until all have ended or one is in trouble."""
        self._begun = True
        known = ((body, body.told.status_bits) for body in self.moves)
        self._errors = {body: MOTION_ERRORS if bits is None else bits & MOTION_ERRORS for body, bits in known}
        self._look_after()
        await super().follow(doubt)

    async def _come_to_rest(self) -> "ScaraRun":
        """Watch, in spite of faults of the gateway itself, until no axis has a move any more."""
        with ExitStack() as watched:
            for body in self._errors:
                watched.enter_context(body.motion.watched_as_a_whole())
            await supervise(f"the watch of {self.move.id}", self._watch)
        for body in self.moves:
            await body.motion.free.wait()
        return self

    async def _watch(self) -> None:
        await super()._come_to_rest()

    @property
    def runs(self) -> bool:
        """True while an axis may still move, and none is in trouble."""
        return self._is_under_way() and self._stopping is None

    def _is_under_way(self) -> bool:
        return any(not move.status.final for move in self.moves.values())

    async def _look(self) -> "ScaraRun":
        """Have who rests looked at; stop all where one is missing twice, or has an error it did not have."""
        if not self.runs:
            return self
        seen = await _statuses(self.scara.group)
        missing = [body for body in self._errors if seen and body not in seen]
        if missing:
            again = await _statuses(self.scara.group)
            missing = [body for body in missing if again and body not in again]
        for body in missing:
            self.failed(body, "it does not answer, and others do")
        for body, before in self._errors.items():
            bits = seen.get(body, PULSES_RUNNING)
            if not bits & PULSES_RUNNING:
                body.motion.end_due.set()
            if bits & MOTION_ERRORS & ~before:
                self.failed(body, "it reports an error")
        return self

    async def _pause(self) -> None:
        await happens(self._over, self._every_s)

    def _seen_to_move(self) -> None:
        """Note that an axis was seen to run."""
        if any(move.status is MoveStatus.MOVING for move in self.moves.values()):
            super()._seen_to_move()

    def _look_after(self) -> None:
        """See what has become of the axes."""
        if not self._begun or self.move.status.final:
            return
        self._note_axes()
        if not self._is_under_way():
            self._over.set()
            return
        for body, move in self.moves.items():
            if move.status.final and move.status is not MoveStatus.SUCCEEDED:
                self._stop_all(body, f"its move is {move.status}")
                return
        self._seen_to_move()

    def _stop_all(self, body: Body, why: str) -> None:
        """Stop every axis, once."""
        if self._stopping is not None:
            return
        self._stopping = self._keeper.stops.stop(self.scara.members, self.scara.on_fault)
        axis = self.scara.members.index(body)
        self.move.evidence.append(
            f"All axes were stopped at the first sign, from {body.address}, axis {axis}: {why}."
        )

    # the end

    async def _finding(self, _: "ScaraRun", /) -> Found:
        """Find the worst of the ends of the axes: it tells how the robot's move did."""
        self.move.failed_axes = sorted(self.scara.members.index(body) for body in self._failed())
        return found(worst_of(move.status for move in self.moves.values()))

    def _failed(self) -> dict[Body, Move]:
        return {
            body: move
            for body, move in self.moves.items()
            if move.status not in (MoveStatus.SUCCEEDED, MoveStatus.STOPPED)
        }

    def _words(self) -> VerdictWords:
        failed = self._failed()
        told = [
            f"Axis {self.scara.members.index(body)}: {move.error.detail if move.error else _cause(move)}"
            for body, move in failed.items()
        ]
        return VerdictWords(
            self.who,
            "finger",
            begins="move was started",
            stopped=", and all its axes were stopped" if self._stopping else "",
            told=" ".join(told),
            cause="+".join(dict.fromkeys(_cause(move) for move in failed.values())),
            moved=self._moved(),
        )

    def _moved(self) -> Moved:
        told = {"yes" if move.error is None else move.error.moved for move in self.moves.values()}
        return "yes" if "yes" in told else "unknown" if "unknown" in told else "no"

    def _note_axes(self) -> None:
        """Write into the record what is known of its axes."""
        moves = {body.address: move for body, move in self.moves.items()}
        for axis in self.move.axes:
            move = moves.get(axis.body_id)
            if move is not None:
                axis.move_id, axis.status, axis.end_cause = move.id, move.status, move.end_cause
                axis.position = axis.position if move.position is None else move.position


@dataclass(eq=False)
class ScaraMotion(Motion[ScaraRun, Plan]):
    """A move that is prepared at all controllers and started by one frame for all axes."""

    request: ScaraMoveRequest
    keeper: "ScaraMoves"

    @asynccontextmanager
    async def _held(self, expires_at: float) -> AsyncIterator[None]:
        scara = self.runs[0].scara
        await know_pattern(scara, self.request.pattern)
        async with scara.line.undivided([scara.group.number], expires_at):
            yield

    async def _prepare(self) -> Plan:
        """Work the move out and prepare it, anew where a reply was lost: nothing moves by that."""
        [run] = self.runs
        for left in reversed(range(ATTEMPTS)):
            try:
                plan = await work_out(run.scara, self.request, Lane.VERIFY)
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

    async def _write(self, proof: Plan, expires_at: float) -> Mapping[ScaraRun, object]:
        """Start it by one frame, where every axis still stands where the plan begins."""
        [run], scara = self.runs, self.runs[0].scara
        course = {
            body: SharedWay(start, end, scara.tolerance_pulses)
            for body, start, end in zip(scara.members, proof.here.pulses, proof.target, strict=True)
            if body in proof.movers
        }
        self.keeper.follow(run, proof.movers)
        left_s = expires_at - asyncio.get_running_loop().time()
        bodies = self.keeper.bodies
        await bodies.start(proof.addressee, proof.manoeuvre.motion, left_s, course)
        run.begin()
        for body, move in run.moves.items():
            bodies.plan_samples(move.id, partial(trajectory_of, proof, body, self.request.pattern))
        self.answer(None)
        return {}


class ScaraMoves(MoveRuns[ScaraMove]):
    """All moves of all SCARA robots."""

    def __init__(self, bodies: Moves, stops: Stops, tell: Callable[[str, Scara, ScaraMove], Event]) -> None:
        super().__init__(tell)
        self.bodies, self.stops = bodies, stops
        self._runs: dict[Body, ScaraRun] = {}
        """The run of each member of a robot that moves."""

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
        if scara.move is not None:
            raise BodyBusy(
                f"{scara.id} still has the move {scara.move.id}; nothing was sent.", "Wait for it or stop it."
            )
        idle_bodies_of(scara.group)
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
        await self._begin(ScaraMotion([ScaraRun(self, scara, move)], request, self), start_within_s)
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
            self.bodies.trajectories.of(axis.move_id) for axis in move.axes if axis.move_id is not None
        ]
        if not of_axes:
            raise NotFound(f"The move {move_id} was not started, so there are no samples of it.")
        axes = [await samples_of(samples) for samples in of_axes]
        return ScaraSamples(scara_id=move.scara_id, move_id=move_id, axes=axes)

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
        run, begun = ScaraRun(self, scara, move), any(axis.move_id for axis in move.axes)
        run.moves = self._moves_of(scara, move)
        if begun and not run.moves:
            run.end(found(Unwatched.OTHER_MEMBERS))
            return
        self.follow(run, run.moves)
        self._go_on(run, since, begun=begun)

    def _moves_of(self, scara: Scara, move: ScaraMove) -> dict[Body, Move]:
        """The moves of a robot's bodies; none where it has other bodies now, or one is not kept any more."""
        if [axis.body_id for axis in move.axes] != [body.address for body in scara.members]:
            return {}
        both = zip(scara.members, move.axes, strict=True)
        try:
            return {body: self.bodies.get(axis.move_id) for body, axis in both if axis.move_id is not None}
        except NotFound:
            return {}

    # what bodies tell

    def follow(self, run: ScaraRun, movers: Iterable[Body]) -> None:
        """Let the news of bodies reach a run."""
        self._runs |= dict.fromkeys(movers, run)

    def forget(self, run: ScaraRun) -> None:
        """It is over."""
        self._runs = {body: other for body, other in self._runs.items() if other is not run}

    def advanced(self, body: Body, move: Move) -> None:
        """The move of a body has changed its status."""
        if body in self._runs:
            self._runs[body].advanced(body, move)

    def announced(self, body: Body, frame: MoveEnded) -> None:
        """A move has ended: where the frame names a cause, the others need not wait until it is proved."""
        if frame.cause:
            self._failed(body, f"the link master has announced its end with cause {frame.cause:02X}")

    def fell_silent(self, body: Body) -> None:
        """A body does not answer any more."""
        self._failed(body, "it does not answer")

    def _failed(self, body: Body, why: str) -> None:
        if body in self._runs:
            self._runs[body].failed(body, why)


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


def _cause(move: Move) -> str:
    return move.end_cause or str(move.status)
