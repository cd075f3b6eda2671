"""The moves of SCARA robots: one frame starts all axes, and when one fails all stop (RC-420 manual 13.10)."""

import asyncio
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Final

from gateway.core.errors import (
    BodyBusy,
    ControllerRefused,
    GatewayError,
    Moved,
    MoveFailed,
    NoReply,
    ShuttingDown,
)
from gateway.core.lanes import Lane
from gateway.core.move_log import MoveLog, new_id
from gateway.core.move_record import Move, MoveError, MoveStatus
from gateway.core.origin import working
from gateway.rorze.bodies import PULSES_RUNNING, Body, Group
from gateway.rorze.move_proof import MOTION_ERRORS, Stretch
from gateway.rorze.moves import Moves
from gateway.rorze.scaras.preparation import Plan, prepare, work_out
from gateway.rorze.scaras.record import PlannedScaraMove, ScaraAxisMove, ScaraMove, ScaraPlace
from gateway.rorze.scaras.requests import ScaraMoveRequest
from gateway.rorze.scaras.scara import Scara
from gateway.rorze.stops import Stops
from protocols.rorze.link import MoveEnded
from protocols.rorze.status import ControllerStatus, GetControllerStatus

WATCH_S: Final = 0.1
"""While a robot moves, all its controllers are asked at once so long after their last answer."""

ATTEMPTS: Final = 3
"""A preparation without a reply is made anew, so often in all."""

_WORST_FIRST: Final = (
    MoveStatus.LOST,
    MoveStatus.UNKNOWN,
    MoveStatus.FAILED,
    MoveStatus.REJECTED,
    MoveStatus.CANCELLED,
    MoveStatus.STOPPED,
)
"""An axis that ended so decides how the robot's move did."""
_OF_THE_ROBOT: Final = {MoveStatus.REJECTED: MoveStatus.FAILED, MoveStatus.CANCELLED: MoveStatus.FAILED}
"""What an axis did not do, others did."""


@dataclass(eq=False)
class _Run:
    """A move under way."""

    scara: Scara
    move: ScaraMove
    request: ScaraMoveRequest
    moves: dict[Body, Move] = field(default_factory=dict)
    """Those of the bodies, once they are begun."""
    begun: bool = False
    """Whether the controllers have accepted or refused it."""
    stopping: "asyncio.Task[Any] | None" = None

    @property
    def under_way(self) -> bool:
        """Whether an axis may still move."""
        return any(not move.status.final for move in self.moves.values())


class ScaraMoves:
    """All moves of all SCARA robots: starts them, watches over them, remembers them."""

    def __init__(self, moves: Moves, stops: Stops, publish: Callable[[str, ScaraMove], str]) -> None:
        self._moves, self._stops, self._publish = moves, stops, publish
        self.log = MoveLog[ScaraMove]()
        self._runs: dict[Body, _Run] = {}
        """Of the members of robots that move."""
        self._tasks: set[asyncio.Task[Any]] = set()

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
        scara.line.admission.require()
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
        run = _Run(scara, move, request)
        scara.move = move
        self.log.add(move)
        move.event_cursor = self._publish("queued", move)
        return await asyncio.shield(self._task(self._begin(run, start_within_s), f"move {move.id}"))

    async def plan(self, scara: Scara, request: ScaraMoveRequest) -> PlannedScaraMove:
        """Work out a move; only reads are sent.

        :raises InvalidRequest: the arm does not come there, or no path leads there.
        :raises GatewayError: the robot did not tell where it stands.
        """
        return (await work_out(scara, request)).told()

    async def begun(self) -> None:
        """Wait until every move that was asked for has been taken or refused."""
        beginning = [task for task in self._tasks if task.get_name().startswith("move")]
        if beginning:
            await asyncio.wait(beginning)

    def let_go(self) -> None:
        """Give those who wait for moves what is known now."""
        self.log.let_go()

    async def close(self) -> None:
        """Stop watching, once the lines are closed; the motors keep doing what they do."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    # what bodies tell

    def advanced(self, body: Body, move: Move) -> None:
        """The move of a body has changed its status."""
        run = self._runs.get(body)
        if run is not None:
            run.moves[body] = move
            if move.status is MoveStatus.SENT and run.move.status is MoveStatus.QUEUED:
                self._advance(run, MoveStatus.SENT)
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

    async def _begin(self, run: _Run, start_within_s: float) -> ScaraMove:
        scara = run.scara
        try:
            expires_at = asyncio.get_running_loop().time() + start_within_s
            async with scara.line.undivided([scara.group.number], expires_at):
                await self._set_off(run, await self._prepare(run), expires_at)
        except GatewayError as error:
            refused = isinstance(error, ControllerRefused)
            self._end(run, MoveStatus.REJECTED if refused else MoveStatus.CANCELLED, error)
            raise
        except asyncio.CancelledError:
            self._end(run, MoveStatus.CANCELLED, ShuttingDown())
            raise
        return run.move

    async def _prepare(self, run: _Run) -> Plan:
        """Work the move out and prepare it, anew where a reply was lost: nothing moves by that."""
        for left in reversed(range(ATTEMPTS)):
            try:
                plan = await work_out(run.scara, run.request, Lane.PROOF)
                _note_plan(run.move, plan)
                await prepare(plan, run.move.preparation.append)
            except NoReply:
                if not left:
                    raise
            else:
                break
        return plan

    async def _set_off(self, run: _Run, plan: Plan, expires_at: float) -> None:
        """Start it by one frame, where every axis still stands where the plan begins."""
        scara = run.scara
        course = {
            body: Stretch(start, end, scara.tolerance_pulses)
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
        self._task(self._watch(run), f"watch of {run.move.id}")
        self._look_after(run)

    # while it runs

    async def _watch(self, run: _Run) -> None:
        """Ask all controllers at once how they are, until all have ended or one is in trouble."""
        errors = {body: (body.status_bits or 0) & MOTION_ERRORS for body in run.moves}
        for body in errors:
            body.watched = True
        try:
            with working("followers"):
                while run.under_way and run.stopping is None:
                    await self._see(run, errors)
                    await asyncio.sleep(WATCH_S)
        finally:
            for body in errors:
                body.watched = False
                body.end_due.set()

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
                body.end_due.set()
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
        if run.move.status is MoveStatus.SENT and any(it.status is MoveStatus.MOVING for it in moves):
            self._advance(run, MoveStatus.MOVING)

    def _stop_all(self, run: _Run, body: Body, why: str) -> None:
        """Stop every axis, once."""
        if run.stopping is not None:
            return
        axis = run.scara.members.index(body)
        run.move.evidence.append(
            f"All axes were stopped at the first sign, from {body.address}, axis {axis}: {why}."
        )
        run.stopping = self._stops.stop(run.scara.members, run.scara.on_fault)
        self._keep(run.stopping)

    # the end

    def _finish(self, run: _Run) -> None:
        """All axes have ended: the worst of them tells how the robot's move did."""
        worst = min(run.moves.values(), key=lambda move: _badness(move.status)).status
        if worst is MoveStatus.SUCCEEDED:
            run.move.end_cause = "normal"
            self._end(run, worst)
        elif worst is MoveStatus.STOPPED:
            run.move.end_cause = "stop_command"
            self._end(run, worst)
        else:
            failed = {body: move for body, move in run.moves.items() if _failed(move)}
            run.move.failed_axes = sorted(run.scara.members.index(body) for body in failed)
            run.move.end_cause = "+".join(dict.fromkeys(_cause(move) for move in failed.values()))
            self._end(run, _OF_THE_ROBOT.get(worst, worst), _failure(run, failed))

    def _note_axes(self, run: _Run) -> None:
        """Write into the record what is known of its axes."""
        for body, axis in zip(run.scara.members, run.move.axes, strict=True):
            move = run.moves.get(body)
            if move is not None:
                axis.move_id, axis.status, axis.end_cause = move.id, move.status, move.end_cause
                axis.position = axis.position if move.position is None else move.position

    def _end(self, run: _Run, status: MoveStatus, error: GatewayError | None = None) -> None:
        scara, move = run.scara, run.move
        if move.axes:
            self._note_axes(run)
            if status in (MoveStatus.SUCCEEDED, MoveStatus.STOPPED, MoveStatus.FAILED):
                move.coordinates = ScaraPlace.of(scara.robot.place([axis.position for axis in move.axes]))
        for body in scara.members:
            if self._runs.get(body) is run:
                del self._runs[body]
        scara.move = None
        self._advance(run, status, error)

    def _advance(self, run: _Run, status: MoveStatus, error: GatewayError | None = None) -> None:
        """The only place where a move changes its status."""
        move = run.move
        move.status = status
        if error is not None:
            move.error = MoveError.of(error)
        if status is MoveStatus.SENT:
            move.sent_at = datetime.now(UTC)
        if status.final:
            move.ended_at = datetime.now(UTC)
            self.log.end(move)
        self._publish("started" if status is MoveStatus.MOVING else status, move)

    def _task(self, work: Any, name: str) -> "asyncio.Task[Any]":
        return self._keep(asyncio.create_task(work, name=name))

    def _keep(self, task: "asyncio.Task[Any]") -> "asyncio.Task[Any]":
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
    """The status of those who answer; of nobody where the frame was lost: that proves nothing."""
    try:
        results = await group.ask(GetControllerStatus(), lane=Lane.PROOF)
    except GatewayError:
        return {}
    return {
        body: result.bits or 0 for body, result in results.items() if isinstance(result, ControllerStatus)
    }


def _badness(status: MoveStatus) -> int:
    return _WORST_FIRST.index(status) if status in _WORST_FIRST else len(_WORST_FIRST)


def _failed(move: Move) -> bool:
    return move.status not in (MoveStatus.SUCCEEDED, MoveStatus.STOPPED)


def _cause(move: Move) -> str:
    return move.end_cause or str(move.status)


def _failure(run: _Run, failed: Mapping[Body, Move]) -> MoveFailed:
    """Say which axes have failed, and why."""
    told = [
        f"Axis {run.scara.members.index(body)}: {move.error.detail if move.error else _cause(move)}"
        for body, move in failed.items()
    ]
    stopped = ", and all its axes were stopped" if run.stopping else ""
    failure = MoveFailed(
        f"The move of {run.scara.id} failed{stopped}. {' '.join(told)}",
        "Remove the cause, see where the finger is, and bring it back by moves of single axes or by homing.",
    )
    failure.moved = _moved(run.moves.values())
    return failure


def _moved(moves: Iterable[Move]) -> Moved:
    """What the robot did, by what its axes did."""
    told = {"yes" if move.error is None else move.error.moved for move in moves}
    return "yes" if "yes" in told else "unknown" if "unknown" in told else "no"
