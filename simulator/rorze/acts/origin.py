"""Origin search and its settings: commands beginning with zero (RC-420 manual 13.5, 13.6.2, 14)."""

from collections.abc import Callable, Generator
from functools import partial
from typing import Any

from protocols.rorze.origin import (
    CentreStallDog,
    GetHomingDistance,
    GetHomingRetries,
    GetOriginOffset,
    GetOverrunFactor,
    Home,
    HomeFastThenDecelerate,
    HomeFastThenStop,
    HomeLikeRc204,
    HomeWithStallDetection,
    SetHomingRetries,
    SetOriginOffset,
    SetOverrunFactor,
)
from protocols.rorze.position import SignedPulses
from protocols.rorze.profile import plan, steady
from protocols.rorze.row import RorzeCommand
from simulator.rorze.actions import Refused, acts_out
from simulator.rorze.acts.kept import keeps
from simulator.rorze.acts.moves import LIMIT_ON, STALLED, require_safe
from simulator.rorze.acts.patterns import Ramps, ramps_of
from simulator.rorze.axis import held
from simulator.rorze.controller import Rc420, StallFinder
from simulator.rorze.motion import Direction
from simulator.rorze.motor import CCW_LIMIT_CAUSE, STALL_CAUSE, Edge, Halted, Leg, Task
from simulator.rorze.world import CCW, CCW_LIMIT, CW, CW_LIMIT, ORIGIN, STALL

NO_STALL_DETECTION = 0x54

ON_DOG, OFF_DOG = Edge(ORIGIN, True), Edge(ORIGIN, False)
COVERED, OPEN = Edge(STALL, True), Edge(STALL, False)

Steps = Generator[Leg, float, float]
"""Part of a search: its legs, and in the end the moment at which the last of them ended."""


class Search:
    """The steps of origin searches, all with the speeds of pattern 30."""

    def __init__(self, axis: Rc420, ramps: Ramps) -> None:
        self._axis = axis
        self._ramps = ramps

    def origin(self) -> Steps:
        """The search in its seven cases, told apart by the sensors alone (13.5.2).

        A dog met on the way CCW is met at its CW edge; any other is left on its CW side and entered again.
        """
        met_going_ccw = yield from self._meet_dog(self._slow_to_dog)
        if not met_going_ccw:
            yield from self._enter_from_cw()
        return (yield self._slow(CCW, distance=self._axis.settings.origin_offset))

    def fast_then_stop(self) -> Steps:
        """At high speed to the dog, an immediate stop, then the slow search from there (02M)."""
        yield from self._meet_dog(lambda direction: self._fast_to_dog(direction, ramp=False))
        return (yield from self.origin())

    def fast_then_decelerate(self) -> Steps:
        """At high speed to the dog, down to OL, then the slow search from there (03M)."""
        yield from self._meet_dog(lambda direction: self._fast_to_dog(direction, ramp=True))
        return (yield from self.origin())

    def like_rc204(self) -> Steps:
        """The search with its end on the CW side of the dog, the offset away from the edge (04M).

        The way there is an assumption: the manual gives the place only.
        """
        met_going_ccw = yield from self._meet_dog(self._slow_to_dog)
        if not met_going_ccw:
            yield from self._enter_from_cw()
        yield self._slow(CW, until=OFF_DOG)
        return (yield self._slow(CW, distance=self._axis.settings.origin_offset))

    def stall_centre(self) -> Steps:
        """From a covered STALL sensor to the middle of its slit (13.6.2).

        The way there is an assumption: to the CW edge, back across the slit, then half of it forward.
        """
        yield from self._find(CW, OPEN)
        now = yield from self._find(CCW, COVERED)
        cw_edge = self._axis.motor.pulses(now)
        now = yield from self._find(CCW, OPEN)
        width = cw_edge - self._axis.motor.pulses(now)
        return (yield self._slow(CW, distance=(width + 1) // 2))

    def with_stall_centre(self) -> Steps:
        """The search, then the centring from where it ended (01M)."""
        yield from self.origin()
        if not self._axis.sees(STALL):
            raise self._no_slit()
        return (yield from self.stall_centre())

    def _no_slit(self) -> Halted:
        """The disc or its sensor is at fault."""
        self._axis.stalls.add(StallFinder.SENSOR)
        return Halted(STALL_CAUSE)

    def _slow(self, direction: Direction, until: Edge | None = None, distance: int | None = None) -> Leg:
        """A leg at the start speed OL."""
        return Leg(direction, steady(distance, self._ramps.up.low, *self._ramps), until)

    def _slow_to_dog(self, direction: Direction) -> Leg:
        return self._slow(direction, until=ON_DOG)

    def _fast_to_dog(self, direction: Direction, ramp: bool) -> Leg:
        return Leg(direction, plan(None, *self._ramps), ON_DOG, ramp)

    def _meet_dog(self, leg: Callable[[Direction], Leg]) -> Generator[Leg, float, bool]:
        """Go to the dog, CCW first and back from the CCW limit; whether it was met on the way CCW."""
        if self._axis.sees(ORIGIN):
            return False
        if not self._axis.sees(CCW_LIMIT):
            try:
                yield leg(CCW)
            except Halted as halted:
                if halted.cause != CCW_LIMIT_CAUSE:
                    raise
            else:
                return True
        yield leg(CW)
        return False

    def _enter_from_cw(self) -> Steps:
        """Leave the dog on its CW side, overrun, and come back to its edge."""
        settings = self._axis.settings
        yield self._slow(CW, until=OFF_DOG)
        yield self._slow(CW, distance=settings.origin_offset * settings.overrun_factor)
        return (yield self._slow(CCW, until=ON_DOG))

    def _find(self, direction: Direction, edge: Edge) -> Steps:
        """Go to an edge of the slit; with none within a whole period the disc or its sensor is at fault."""
        now = yield self._slow(direction, edge, self._axis.settings.stall_interval)
        if self._axis.sees(edge.sensor) != edge.on:
            raise self._no_slit()
        return now


def _search(axis: Rc420, steps: Callable[[], Steps], centred: bool, begun: int) -> Task:
    """Search, again after each failure at a limit while retries are left; then the place is position 0.

    The manual does not say which failures are retried; those at a limit are an assumption.
    """
    for retries_left in range(axis.settings.search_retries, -1, -1):
        try:
            now = yield from steps()
        except Halted as halted:
            if not retries_left or halted.cause == STALL_CAUSE:
                raise
        else:
            axis.set_origin(begun, centred, now)
            return


def _start(axis: Rc420, command: RorzeCommand[Any], now: float, steps: Callable[[Search], Steps]) -> None:
    search = Search(axis, ramps_of(axis, None))
    require_safe(axis)
    centred = steps in (Search.stall_centre, Search.with_stall_centre)
    axis.start(command.code, _search(axis, lambda: steps(search), centred, axis.motor.pulses(now)), now)


acts_out(Home)(partial(_start, steps=Search.origin))
acts_out(HomeFastThenStop)(partial(_start, steps=Search.fast_then_stop))
acts_out(HomeFastThenDecelerate)(partial(_start, steps=Search.fast_then_decelerate))
acts_out(HomeLikeRc204)(partial(_start, steps=Search.like_rc204))


@acts_out(HomeWithStallDetection)
def _home_with_stall_detection(axis: Rc420, command: HomeWithStallDetection, now: float) -> None:
    if axis.stalls:
        raise Refused(STALLED)
    if not axis.settings.stall_detection:
        raise Refused(NO_STALL_DETECTION)
    _start(axis, command, now, Search.with_stall_centre)


@acts_out(CentreStallDog)
def _centre_stall_dog(axis: Rc420, command: CentreStallDog, now: float) -> None:
    require_safe(axis)
    if not axis.sees(STALL):
        raise Refused(STALLED)
    if axis.sees(CW_LIMIT) or axis.sees(CCW_LIMIT):
        raise Refused(LIMIT_ON)
    _start(axis, command, now, Search.stall_centre)


@acts_out(GetHomingDistance)
def _get_distance(axis: Rc420, _: GetHomingDistance, _now: float) -> SignedPulses:
    return SignedPulses(pulses=held(axis.search_travel))


keeps(GetOverrunFactor, SetOverrunFactor, "overrun_factor")
keeps(GetHomingRetries, SetHomingRetries, "search_retries")
keeps(GetOriginOffset, SetOriginOffset, "origin_offset")
