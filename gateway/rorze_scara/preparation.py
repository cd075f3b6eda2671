"""The preparation of a SCARA robot's move: work it out, tell the controllers, see that they agree."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

from gateway.core.errors import ControllerRefused, GatewayError, InvalidRequest, PowerCycled
from gateway.core.exchange import Lane
from gateway.rorze.bodies import Body, Group
from gateway.rorze.plans import (
    AlongPath,
    Planned,
    PlannedTrajectory,
    Wish,
    crossed_of,
    limited,
    parameters_of_pattern,
    slow_pattern_of,
    standard_of,
)
from gateway.rorze_scara import geometry, paths
from gateway.rorze_scara.geometry import WHOLE_TURN_MDEG
from gateway.rorze_scara.record import PlannedScaraMove, ScaraPlace
from gateway.rorze_scara.requests import Course, Manoeuvre, MoveStart, ScaraMoveRequest, TurnSpeed
from gateway.rorze_scara.scara import Scara
from protocols.rorze.interpolation import (
    SetPathPoint,
    SetStartPosition,
    StartInterpolation,
    TurnFinger,
)
from protocols.rorze.modes import GetSoftLimits
from protocols.rorze.path import PathFault
from protocols.rorze.patterns import GetPattern
from protocols.rorze.profile import ProfileError, SpeedParameters
from protocols.rorze.profile import plan as profile
from protocols.rorze.row import RorzeCommand
from protocols.rorze.scara import OutOfReach


@dataclass(frozen=True)
class Plan:
    """A move that was worked out from where the robot stands."""

    scara: Scara
    here: MoveStart
    manoeuvre: Manoeuvre
    course: Course

    @property
    def target(self) -> tuple[int, ...]:
        """Where the axes should come to."""
        return tuple(
            start + turned for start, turned in zip(self.here.pulses, self.course.turned, strict=True)
        )

    @property
    def addressee(self) -> Body | Group:
        """The addressee of the motion: for HFM the finger's controller alone (13.10.9), else the group."""
        return self.scara.members[-1] if isinstance(self.manoeuvre.motion, TurnFinger) else self.scara.group

    @property
    def movers(self) -> list[Body]:
        """The bodies that it moves."""
        target = self.addressee
        return target.members if isinstance(target, Group) else [target]

    @property
    def frame(self) -> str:
        """The frame that starts it."""
        return self.scara.line.frame_of(self.addressee.number, self.manoeuvre.motion)

    def positions(self) -> list[SetStartPosition]:
        """The commands that tell the controllers where all axes stand (HPS)."""
        return [
            SetStartPosition(axis=axis, position=position) for axis, position in enumerate(self.here.pulses)
        ]

    def record(self) -> PlannedScaraMove:
        """As clients are told who only ask."""
        line, number = self.scara.line, self.scara.group.number
        before = (*self.positions(), *self.manoeuvre.preparation)
        return PlannedScaraMove(
            scara_id=self.scara.id,
            frames=[*(line.frame_of(number, command) for command in before), self.frame],
            start=ScaraPlace.of(self.here.place),
            target=ScaraPlace.of(self.scara.robot.place(self.target)),
            start_positions=list(self.here.pulses),
            target_positions=list(self.target),
            length_um=self.course.length_um,
        )


async def work_out(scara: Scara, request: ScaraMoveRequest, lane: Lane | None = None) -> Plan:
    """Work out where a move leads from where the robot stands now; only reads are sent.

    :raises InvalidRequest: the arm does not come there, no path leads there, or it ends beyond a soft limit.
    :raises GatewayError: the controllers did not tell where they stand, or hold different paths.
    """
    pulses, _ = await scara.stand(lane)
    stored = request.stored_path
    points = {} if stored is None else await paths.read(scara, stored, lane)
    robot = scara.robot
    try:
        pose = robot.pose(pulses)
        here = MoveStart(pulses, pose, robot.place(pulses), points, scara.own_path)
        manoeuvre = request.manoeuvre(here)
        course = manoeuvre.course(robot, pose)
    except (OutOfReach, PathFault) as error:
        raise InvalidRequest(
            f"{scara.id} cannot do that: {error} Nothing was moved.", "See its coordinates and its geometry."
        ) from None
    if course.sharpest_turn * scara.keep_out_um > 1:
        raise InvalidRequest(
            f"{scara.id} would pass the origin within {1 / course.sharpest_turn:.0f} um, where the base has "
            "to turn too fast; nothing was moved.",
            "Align the arm with the target, and lead the path through the centre (RC-420 manual 13.10.6).",
        )
    plan = Plan(scara, here, manoeuvre, course)
    await _require_limits(plan, lane)
    return plan


async def _require_limits(plan: Plan, lane: Lane | None) -> None:
    """Refuse what would end beyond a soft limit (EPS): its axis alone would refuse, and the others start."""
    scara = plan.scara
    limits = await scara.ask(GetSoftLimits(), lane=lane)
    for axis, (body, bounds, target) in enumerate(zip(scara.members, limits, plan.target, strict=True)):
        crossed = await crossed_of(body, bounds, target) if body in plan.movers else None
        if crossed is not None:
            raise InvalidRequest.worded(
                "scara.beyond-limits", scara=scara.id, axis=axis, body=body.address, beyond=crossed.said
            )


async def weigh(plan: Plan, pattern: int | None, wish: Wish | None = None) -> PlannedScaraMove:
    """Tell a move that is only planned, how long it would take, and why it would be refused.

    `wish` is what would be written to the pattern before.

    :raises GatewayError: a controller did not tell its speeds.
    """
    told, course = plan.record(), plan.course
    try:
        _require_power(plan.scara)
        ramps = await _ramps(plan, pattern, wish)
        if course.length_um is None:
            turned = dict(zip(plan.scara.members, course.turned, strict=True))
            lengths = [abs(turned[body]) for body in plan.movers]
        else:
            lengths = [ceil(course.length_um)] * len(ramps)
        profiles = [profile(length, up, down) for length, (up, down) in zip(lengths, ramps, strict=True)]
    except (PowerCycled, ControllerRefused, ProfileError) as error:
        told.note = f"It would be refused: {error}"
    else:
        told.duration_s = max(profile.duration_s or 0.0 for profile in profiles)
    return told


async def _ramps(
    plan: Plan, pattern: int | None, wish: Wish | None
) -> list[tuple[SpeedParameters, SpeedParameters]]:
    if wish is None:
        return [await parameters_of_pattern(body, pattern) for body in plan.movers]
    members = plan.scara.members
    wished = zip(members, await wish(members), strict=True)
    return [(speeds, speeds) for body, speeds in wished if body in plan.movers]


async def trajectory_of(plan: Plan, body: Body, pattern: int | None) -> Planned:
    """Work out how an axis goes in a move, by the controller's present settings.

    :raises ProfileError: the controller would not make such a move.
    :raises GatewayError: the settings could not be read.
    """
    axis, (up, down) = plan.scara.members.index(body), await parameters_of_pattern(body, pattern)
    start, path = plan.here.pulses[axis], plan.course.path
    if path is not None:
        return AlongPath(profile(ceil(path.length), up, down), start, path.knots(axis))
    turned = plan.course.turned[axis]
    return PlannedTrajectory(profile(abs(turned), up, down), start, 1.0 if turned >= 0 else -1.0)


async def know_pattern(scara: Scara, pattern: int | None) -> None:
    """Know the speed sets of a pattern before the move: a stop may have to know how long its ramp takes."""
    if pattern is not None and any(pattern not in body.told.pattern_sets for body in scara.members):
        with suppress(GatewayError):  # the move does not hang on it
            await scara.ask(GetPattern(pattern=pattern), lane=Lane.VERIFY)


async def prepare(plan: Plan, note: Callable[[str], None]) -> None:
    """Tell the controllers where they stand, see that they agree, and prepare the move (13.10.7, 2 and 3).

    All of it may be sent again: it replaces what was told before. `note` takes each frame.

    :raises PowerCycled: a body has lost its power.
    :raises GeometryDiffers, PathsDiffer: a controller holds something else.
    :raises GatewayError: one has refused it, or did not answer.
    """
    scara, places = plan.scara, plan.positions()
    _require_power(scara)
    with scara.line.sending(scara.group.number, [*places, *plan.manoeuvre.preparation]):
        for place in places:
            await _tell(scara, place, note)
        await geometry.require_agreement(scara, plan.here.pulses)
        for command in plan.manoeuvre.preparation:
            await _tell(scara, command, note)
            if isinstance(command, SetPathPoint):
                await paths.require_stored(scara, command)


async def _tell(scara: Scara, command: RorzeCommand[Any], note: Callable[[str], None]) -> None:
    note(scara.line.frame_of(scara.group.number, command))
    await scara.ask(command)


async def prove_power(scara: Scara) -> None:
    """See that all bodies have kept their power: without it they have forgotten place, geometry and paths.

    :raises PowerCycled: one has not.
    :raises GatewayError: one did not tell.
    """
    for body in scara.members:
        await body.mark.stands(Lane.VERIFY)
    _require_power(scara)


def _require_power(scara: Scara) -> None:
    for body in scara.members:
        body.require_power(StartInterpolation())


# a speed of its own


def wish_of(scara: Scara, request: ScaraMoveRequest) -> Wish | None:
    """Give what the `max_speed` of a move comes to in each controller; None where it has none."""
    limit = request.max_speed
    if limit is None:
        return None

    async def wish(bodies: Sequence[Body]) -> Sequence[SpeedParameters]:
        standards = await asyncio.gather(*(standard_of(body) for body in bodies))
        if isinstance(limit, TurnSpeed):
            tops = [round(limit.exactly * pulses / WHOLE_TURN_MDEG) for pulses in scara.robot.pulses_per_turn]
        else:
            standards, tops = [_gentlest(standards)] * len(bodies), [limit.thousandths] * len(bodies)
        if min(tops) < 1:
            raise InvalidRequest("max_speed: it comes to less than one pulse a second; nothing was sent.")
        return [speeds.capped(top) for speeds, top in zip(standards, tops, strict=True)]

    return wish


def with_own_pattern(scara: Scara, request: ScaraMoveRequest) -> ScaraMoveRequest:
    """The request as it is sent; errors as of `slow_pattern_of`."""
    if request.max_speed is None:
        return request
    return request.model_copy(update={"pattern": slow_pattern_of(scara.members)})


@asynccontextmanager
async def at_own_speed(scara: Scara, request: ScaraMoveRequest) -> AsyncIterator[ScaraMoveRequest]:
    """Give a request with the pattern that has its `max_speed`, if it has one; errors as of `limited`."""
    wish = wish_of(scara, request)
    if wish is None:
        yield request
        return
    async with limited(scara.group, wish):
        yield with_own_pattern(scara, request)


def _gentlest(standards: Sequence[SpeedParameters]) -> SpeedParameters:
    """The ramp of the axis that accelerates least, and no speed that one of them does not allow."""
    ramp = min(standards, key=lambda speeds: speeds.acceleration)
    return replace(
        ramp, low=min(speeds.low for speeds in standards), high=min(speeds.high for speeds in standards)
    )
