"""The end of a plant: nothing begins any more, what would never end is stopped, what still moves is named."""

import asyncio
import logging
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from gateway.core.errors import ShuttingDown
from gateway.core.lanes import Lane
from gateway.core.move_record import MoveStatus
from gateway.core.stops import UNCONFIRMED
from gateway.fics.robot import Robot
from gateway.rorze.bodies import Body

if TYPE_CHECKING:
    from gateway.plant import Plant

log = logging.getLogger(__name__)

WIND_DOWN_S = 3.0
"""So long it is waited for stops to be confirmed."""
HURRY_S = 0.3
"""So long it is waited when somebody is impatient: a stop that was asked for has been written by then."""

ENDS_ITSELF = "It goes on to the end of its move."
NOT_OURS = "No move that the gateway follows explains it."
SUBJECT = "/gateway"


class WindDown:
    """Done once, before the streams end and the lines are closed."""

    def __init__(self, plant: "Plant") -> None:
        self._plant = plant
        self._task: asyncio.Task[None] | None = None
        self._limit: asyncio.Timeout | None = None
        self._patience_s = WIND_DOWN_S
        self._stops: list[asyncio.Task[Any]] = []

    async def done(self) -> None:
        """Wind down, or wait until that is done."""
        if self._task is None:
            self._task = asyncio.create_task(self._wind_down(), name="wind down")
        await asyncio.shield(self._task)

    def hurry(self) -> None:
        """Wait no longer than a stop takes to be written."""
        self._patience_s = HURRY_S
        if self._limit is not None and not self._limit.expired():
            self._limit.reschedule(asyncio.get_running_loop().time() + HURRY_S)

    async def _wind_down(self) -> None:
        plant = self._plant
        plant.admission.end()
        plant.events.publish("gateway.shutting_down", SUBJECT, {"on_exit": plant.config.server.on_exit})
        for port in plant.ports().values():
            port.revoke(ShuttingDown)
        self._stop()
        with suppress(TimeoutError):
            async with asyncio.timeout(self._patience_s) as self._limit:
                await self._come_to_rest()
        self._limit = None
        self._name_what_moves()
        await plant.scans.close()
        plant.moves.let_go()
        plant.robot_moves.let_go()

    # stopping

    def _stop(self) -> None:
        """Queue all stops at once; only what was sent has to be stopped."""
        plant, everything = self._plant, self._plant.config.server.on_exit == "stop"
        bodies = [it for it in plant.bodies() if (everything and it.moving) or self._never_ends(it)]
        if bodies:
            self._stops.append(plant.stops.stop(bodies, "decelerate"))
        for robot in plant.robots():
            robot.jogs.end_all("stopped")
            if everything and robot.moving:
                self._stops.append(robot.stop("decelerate"))

    def _never_ends(self, body: Body) -> bool:
        """Whether its last move is one that only a stop ends, and nobody has seen that end."""
        move = next(iter(self._plant.moves.of(body)), None)
        if move is None or move.kind != "continuous" or move.sent_at is None:
            return False
        unseen = move.status in (MoveStatus.LOST, MoveStatus.UNKNOWN) and body.moving is not False
        return unseen or not move.status.final

    async def _come_to_rest(self) -> None:
        """Wait for stops, for those who are told that nothing was sent, and for the ends of uploads."""
        plant = self._plant
        for robot in plant.robots():
            await robot.jogs.settled()
        await plant.stops.confirmed()
        for robot in plant.robots():
            await robot.stops.confirmed()
        await plant.moves.begun()
        await plant.robot_moves.begun()
        for robot in plant.robots():
            if robot.line.uploading:
                async with robot.line.sequence_lock.held(Lane.STOP):
                    pass

    # naming

    def _name_what_moves(self) -> None:
        for body in self._plant.bodies():
            why = _why_body_moves(body, stopped=self._plant.stops.unconfirmed(body) is not None)
            move = None if body.move is None else body.move.id
            self._name("body", f"/bodies/{body.address}", why, move)
        for robot in self._plant.robots():
            moves = [unit.move.id for unit in robot.units if unit.move is not None]
            why = _why_robot_moves(robot, under_way=bool(moves))
            self._name("robot", f"/robots/{robot.id}", why, next(iter(moves), None))

    def _name(self, what: str, subject: str, why: str | None, move: str | None) -> None:
        if why is not None:
            log.warning("%s is left moving, as far as is known: %s", subject.rpartition("/")[2], why)
            data = {"move_id": move, "detail": why}
            self._plant.events.publish(f"{what}.left_moving", subject, data, move)


def _why_body_moves(body: Body, *, stopped: bool) -> str | None:
    """Why it may still move; None where it stands still, as far as is known."""
    if stopped:
        return UNCONFIRMED
    if not body.moving:
        return None
    return NOT_OURS if body.move is None else ENDS_ITSELF


def _why_robot_moves(robot: Robot, *, under_way: bool) -> str | None:
    if robot.stops.unconfirmed is not None:
        return UNCONFIRMED
    if not robot.moving:
        return None
    return ENDS_ITSELF if under_way else NOT_OURS
