"""The RC-420's speed curve: how long a move takes, where it is at any moment, how commands bend it.

Everything is in pulses, pps, pps/s and seconds. A curve is a row of phases of constant jerk, so the position
is a cubic in time and nothing is integrated step by step.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import pairwise
from math import ceil, floor, inf
from operator import attrgetter
from typing import Literal, NamedTuple, Self

TICK_S = 0.00086
"""Seconds for which the controller holds one speed while it counts a ramp's pulses.

An assumption: the manual does not give it. Every length from 0.8556 to 0.8630 ms makes all four pulse counts
of RC-420 manual 13.3.5 come out.
"""

# A count that exceeds a whole number by no more than this is that number: the excess is floating-point noise.
_ROUNDING_SLACK = 1e-6


class ProfileError(ValueError):
    """A move the controller would refuse; `code` is its error code (RC-420 manual 21)."""

    def __init__(self, code: int, sentence: str) -> None:
        super().__init__(sentence)
        self.code = code


@dataclass(frozen=True, slots=True)
class SpeedParameters:
    """One set of speed parameters S[n] (RC-420 manual 13.3.1).

    `low` is OL (1-30,000 pps), `high` OH (1-1,000,000 pps), `acceleration` OS (1-10,000,000 pps/s); `rising`
    OA and `falling` OB are the shares (0-100 %) of the ramp's time in which the acceleration rises and falls.
    Raises ProfileError 0x45, 0x46 or 0x5D.
    """

    low: int
    high: int
    acceleration: int
    rising: int
    falling: int

    def __post_init__(self) -> None:
        for name, value, least, most in (
            ("OL", self.low, 1, 30_000),
            ("OH", self.high, 1, 1_000_000),
            ("OS", self.acceleration, 1, 10_000_000),
            ("OA", self.rising, 0, 100),
            ("OB", self.falling, 0, 100),
        ):
            if not least <= value <= most:
                raise ProfileError(
                    0x5D, f"{name} is {value}, but must be {least} to {most}; nothing was planned."
                )
        if self.low > self.high:
            raise ProfileError(0x45, f"OL {self.low} pps is above OH {self.high} pps; lower OL or raise OH.")
        if self.rising + self.falling > 100:
            raise ProfileError(0x46, f"OA {self.rising} % and OB {self.falling} % exceed 100 %; lower one.")

    def capped(self, top: int) -> Self:
        """Give this shape with no speed above `top` pps."""
        return replace(self, low=min(self.low, top), high=min(self.high, top))


class SpeedChange(NamedTuple):
    """A speed change set before the move by SES (RC-420 manual 13.3.7).

    It starts ("F") or is complete ("T") when `pulses` have been emitted; `speed` is 1-1,000,000 pps.
    """

    mark: Literal["F", "T"]
    pulses: int
    speed: int


class ChangeSpan(NamedTuple):
    """Where a speed change starts and is complete, in pulses from the start of the move: what SED answers."""

    start: int
    end: int
    speed: int


class Phase(NamedTuple):
    """A stretch of constant jerk (pps/s/s); it lasts until the next phase starts."""

    start_s: float
    position: float
    speed: float
    acceleration: float = 0.0
    jerk: float = 0.0

    def at(self, at_s: float) -> Self:
        """The state this phase has come to at a moment, as the phase that would start there."""
        t, acceleration, jerk = at_s - self.start_s, self.acceleration, self.jerk
        return self.__class__(
            at_s,
            self.position + t * (self.speed + t * (acceleration / 2 + t * jerk / 6)),
            self.speed + t * (acceleration + t * jerk / 2),
            acceleration + t * jerk,
            jerk,
        )


class Leg(NamedTuple):
    """From `at` pulses on, the speed heads for `speed` pps.

    `rising` shapes the ramp when that is faster, `falling` when it is slower. None bars that way: the leg
    then holds the speed it finds.
    """

    at: float
    speed: float
    rising: SpeedParameters | None
    falling: SpeedParameters | None


@dataclass(frozen=True, slots=True)
class Curve:
    """Position over time without an end: the last phase goes on for ever at a steady speed above zero.

    The controller counts a ramp tick by tick and rounds up. Here a ramp is a smooth S with the same speeds
    and the same shares, its time scaled so that it covers exactly the counted pulses: by less than 0.2 % for
    the ramps of RC-420 manual 13.3.5.
    """

    phases: tuple[Phase, ...]

    def at(self, at_s: float) -> Phase:
        """The state at a moment; before the curve's start, the state there."""
        at_s = max(at_s, self.phases[0].start_s)
        index = bisect_right(self.phases, at_s, key=attrgetter("start_s"))
        state = self.phases[index - 1].at(at_s)
        if index < len(self.phases) and state.position > self.phases[index].position:
            # Rounding must not run ahead of the next phase: a pulse once emitted is never taken back.
            return state._replace(position=self.phases[index].position)
        return state

    def time_of(self, position: float) -> float:
        """When `position` is reached; the curve's start if that lies beyond it."""
        index = bisect_left(self.phases, position, key=attrgetter("position")) - 1
        if index < 0:
            return self.phases[0].start_s
        phase = self.phases[index]
        if index == len(self.phases) - 1:
            return phase.start_s + (position - phase.position) / phase.speed
        end_s = self.phases[index + 1].start_s
        return first_moment(lambda at_s: phase.at(at_s).position >= position, phase.start_s, end_s)

    def along(self, legs: Iterable[Leg]) -> "Curve":
        """The curve bent by one leg after another."""
        return reduce(Curve._bent_by, legs, self)

    def shifted(self, by_s: float) -> "Curve":
        """The curve with every moment `by_s` later."""
        return Curve(tuple(phase._replace(start_s=phase.start_s + by_s) for phase in self.phases))

    def _bent_by(self, leg: Leg) -> "Curve":
        at_s = self.time_of(leg.at)
        junction = Phase(at_s, max(leg.at, self.phases[0].position), self.at(at_s).speed)
        kept = (phase for phase in self.phases if phase.start_s < junction.start_s)
        parameters = leg.rising if leg.speed > junction.speed else leg.falling
        if parameters is None or leg.speed == junction.speed:
            return Curve((*kept, junction))
        return Curve((*kept, *_ramp(junction, parameters, leg.speed)))


@dataclass(frozen=True)
class Profile:
    """One move: a curve that ends where `distance` pulses are reached, or never if that is None.

    Moments are seconds on one clock, which reads 0 at the start unless `starting_at` says otherwise. A move
    bent on its way keeps no memory of before: an earlier moment is answered as the moment of the last bend.
    """

    curve: Curve
    distance: int | None
    legs: tuple[Leg, ...]
    brake_at: float
    acceleration: SpeedParameters
    deceleration: SpeedParameters
    start_s: float = 0.0

    @cached_property
    def end_s(self) -> float | None:
        """The moment of the last pulse; None for an endless move."""
        return None if self.distance is None else self.curve.time_of(self.distance)

    @property
    def duration_s(self) -> float | None:
        """Seconds from the start to the last pulse; None for an endless move."""
        return None if self.end_s is None else self.end_s - self.start_s

    def starting_at(self, start_s: float) -> "Profile":
        """Give this move on a clock that reads `start_s` at its start."""
        return replace(self, curve=self.curve.shifted(start_s - self.start_s), start_s=start_s)

    def ended(self, at_s: float) -> bool:
        """Say whether the last pulse is out."""
        return self.end_s is not None and at_s >= self.end_s

    def position(self, at_s: float) -> float:
        """Pulses since the start, with the fraction of the one under way."""
        position = self.curve.at(at_s).position
        if self.distance is None:
            return position
        return self.distance if self.ended(at_s) else min(position, self.distance)

    def emitted(self, at_s: float) -> int:
        """Whole pulses since the start; the last one comes at `end_s` and not before."""
        whole = floor(self.position(at_s))
        if self.distance is None or self.ended(at_s):
            return whole
        return min(whole, self.distance - 1)

    def speed(self, at_s: float) -> float:
        """Speed in pps; 0 after the last pulse."""
        return 0.0 if self.ended(at_s) else self.curve.at(at_s).speed

    def braking(self, at_s: float) -> bool:
        """Say whether the deceleration that ends the move has begun."""
        return self.curve.at(at_s).position >= self.brake_at

    def diverted(
        self, at_s: float, speed: int, rising: SpeedParameters | None, falling: SpeedParameters | None
    ) -> "Profile":
        """The move with its speed heading for `speed` pps, 1 or more, from now on (RC-420 manual 13.3.6).

        Where the deceleration starts was fixed at the start of the move and stays so, as do speed changes
        that lie ahead. Once the deceleration has begun nothing changes: the manual is silent on that, and a
        move sped up there would end at full speed. Raises ProfileError 0x5D.
        """
        if speed < 1:
            raise ProfileError(0x5D, f"A speed of {speed} pps is below 1 pps; the move goes on unchanged.")
        if self.ended(at_s) or self.braking(at_s):
            return self
        now = self.curve.at(at_s)
        ahead = (leg for leg in self.legs if leg.at > now.position)
        legs = (Leg(now.position, speed, rising, falling), *ahead)
        return replace(self, curve=Curve((now,)).along(legs), legs=legs)

    def braked(self, at_s: float, parameters: SpeedParameters) -> "Profile":
        """The move decelerating from now on to OL of `parameters` and ending there; at once if no faster.

        It never passes its own target: a stop that needs more pulses than are left is cut off there, and one
        that would end the final deceleration no sooner changes nothing.
        """
        now = self.curve.at(at_s)
        curve = Curve((now,)).along([Leg(now.position, parameters.low, None, parameters)])
        return self._ending(at_s, curve, floor(curve.phases[-1].position))

    def _ending(self, at_s: float, curve: Curve, distance: int) -> "Profile":
        no_sooner = self.distance is not None and distance >= self.distance
        if self.ended(at_s) or (no_sooner and self.braking(at_s)):
            return self
        if self.distance is not None:
            distance = min(distance, self.distance)
        return replace(self, curve=curve, distance=distance, legs=(), brake_at=curve.phases[0].position)


def ramp_time_s(parameters: SpeedParameters, start: float, end: float) -> float:
    """Seconds from `start` to `end` pps, up or down (RC-420 manual 13.3.2, 13.3.3)."""
    mean_share = 1 - (parameters.rising + parameters.falling) / 200
    return abs(end - start) / (parameters.acceleration * mean_share)


def ramp_pulses(parameters: SpeedParameters, start: float, end: float) -> int:
    """Pulses of the ramp from `start` to `end` pps, up or down: what SHD and SSD answer.

    The speed at the start of each tick holds through that tick, and the sum is rounded up (RC-420 manual
    13.3.5).
    """
    if start == end:
        return 0
    shape = _s_shape(Phase(0.0, 0.0, start), parameters, end, ramp_time_s(parameters, start, end))
    return _counted(Curve(shape))


def plan(
    distance: int | None,
    acceleration: SpeedParameters,
    deceleration: SpeedParameters,
    changes: Sequence[SpeedChange] = (),
) -> Profile:
    """A high-speed move of `distance` pulses, endless if None (RC-420 manual 13.3.5, 13.3.7).

    The deceleration starts where its own OH needs it to, whatever the speed is there. A move too short for
    both ramps has its top speed lowered, in whole pps, until they fit; pulses left over run at that speed.
    Raises ProfileError 0x62 or 0x65 when the speed changes do not suit the move.
    """
    up, down = acceleration, deceleration
    if distance is not None and not changes:
        top = _top_speed(distance, up, down)
        up, down = up.capped(top), down.capped(top)
    spans = resolve_changes(up, down, changes)
    legs = [Leg(0, up.high, up, None), *(Leg(span.start, span.speed, up, down) for span in spans)]
    brake_at = inf
    if distance is not None:
        brake_at = distance - ramp_pulses(down, down.high, down.low)
        _check_last_change(spans, brake_at, down)
        legs.append(Leg(brake_at, down.low, None, down))
    curve = Curve((Phase(0.0, 0.0, up.low),)).along(legs)
    return Profile(curve, distance, tuple(legs), brake_at, acceleration, deceleration)


def plan_slow(
    distance: int | None,
    acceleration: SpeedParameters,
    deceleration: SpeedParameters,
    changes: Sequence[SpeedChange] = (),
) -> Profile:
    """A low-speed move of `distance` pulses at OL, endless if None (RC-420 manual 13.2.2).

    It does not make the speed changes of its pattern, an assumption; but they must suit it as they must a
    high-speed move (RC-420 manual 13.3.7). Raises ProfileError 0x62 or 0x65 when they do not.
    """
    if changes:
        plan(distance, acceleration, deceleration, changes)
    return steady(distance, acceleration.low, acceleration, deceleration)


def steady(
    distance: int | None, speed: int, acceleration: SpeedParameters, deceleration: SpeedParameters
) -> Profile:
    """A move without ramps at `speed` pps (1 or more), endless if `distance` is None (RC-420 manual 13.2.2).

    The parameters shape nothing but speed changes and stops on the way.
    """
    curve = Curve((Phase(0.0, 0.0, speed),))
    return Profile(curve, distance, (), inf if distance is None else distance, acceleration, deceleration)


def resolve_changes(
    acceleration: SpeedParameters, deceleration: SpeedParameters, changes: Iterable[SpeedChange]
) -> tuple[ChangeSpan, ...]:
    """Where each change, in the order of their numbers, starts and is complete (RC-420 manual 13.3.7).

    Raises ProfileError 0x65 if one would start before the acceleration, or the change before it, is complete.
    """
    spans: list[ChangeSpan] = []
    speed, reached_at = acceleration.high, ramp_pulses(acceleration, acceleration.low, acceleration.high)
    for change in changes:
        pulses = ramp_pulses(acceleration if change.speed > speed else deceleration, speed, change.speed)
        start = change.pulses - pulses if change.mark == "T" else change.pulses
        if start < reached_at:
            raise ProfileError(
                0x65,
                f"The change to {change.speed} pps would start at pulse {start}, but {speed} pps "
                f"are reached only at pulse {reached_at}; nothing was moved. Correct or clear it with SES.",
            )
        speed, reached_at = change.speed, start + pulses
        spans.append(ChangeSpan(start, reached_at, speed))
    return tuple(spans)


def first_moment(reached: Callable[[float], bool], low: float, high: float) -> float:
    """The first moment after `low` at which `reached` holds, to the last bit; it must hold at `high`."""
    while low < (middle := (low + high) / 2) < high:
        low, high = (low, middle) if reached(middle) else (middle, high)
    return high


def _top_speed(distance: int, up: SpeedParameters, down: SpeedParameters) -> int:
    """The highest speed in pps for which both ramps fit; at the lowest there are no ramps left."""

    def too_long(top: int) -> bool:
        rise, fall = up.capped(top), down.capped(top)
        return ramp_pulses(rise, rise.low, rise.high) + ramp_pulses(fall, fall.high, fall.low) > distance

    lowest, highest = min(up.low, down.low), max(up.high, down.high)
    if not too_long(highest):
        return highest
    return lowest + bisect_left(range(lowest + 1, highest), True, key=too_long)


def _check_last_change(spans: Sequence[ChangeSpan], brake_at: float, down: SpeedParameters) -> None:
    """The two conditions of RC-420 manual 13.3.7."""
    if not spans:
        return
    if spans[-1].speed != down.high:
        raise ProfileError(
            0x62,
            f"The last speed change ends at {spans[-1].speed} pps, but the deceleration starts from "
            f"{down.high} pps; nothing was moved. Let the last change set with SES end at OH.",
        )
    if spans[-1].end > brake_at:
        raise ProfileError(
            0x65,
            f"The last speed change is complete at pulse {spans[-1].end}, but the deceleration starts at "
            f"pulse {brake_at:.0f}; nothing was moved. Lengthen the move, or clear the changes with SES.",
        )


def _ramp(start: Phase, parameters: SpeedParameters, end: float) -> tuple[Phase, ...]:
    """The S from a steady state to `end` pps over exactly the counted pulses, and the steady run after it."""
    duration_s = ramp_time_s(parameters, start.speed, end)
    exact = _s_shape(Phase(0.0, 0.0, start.speed), parameters, end, duration_s)
    return _s_shape(start, parameters, end, duration_s * _counted(Curve(exact)) / exact[-1].position)


def _s_shape(start: Phase, parameters: SpeedParameters, end: float, duration_s: float) -> tuple[Phase, ...]:
    """Acceleration building up, constant and dying away, and the steady run after it.

    A deceleration is an acceleration backwards in time: it begins with OB, ends with OA (RC-420 manual
    13.3.3).
    """
    first, last = parameters.rising, parameters.falling
    if end < start.speed:
        first, last = last, first
    peak = (end - start.speed) / (duration_s * (1 - (first + last) / 200))
    phases, here = [], start
    for share, begin, finish in ((first, 0.0, peak), (100 - first - last, peak, peak), (last, peak, 0.0)):
        if share:
            length_s = duration_s * share / 100
            phases.append(here._replace(acceleration=begin, jerk=(finish - begin) / length_s))
            here = phases[-1].at(here.start_s + length_s)
    return (*phases, Phase(here.start_s, here.position, end))


def _counted(ramp: Curve) -> int:
    """Pulses of a ramp from 0 s, each tick at the speed of its start, the last tick cut short; at least 1."""
    pulses = 0.0
    for phase, following in pairwise(ramp.phases):
        first, stop = ceil(phase.start_s / TICK_S), ceil(following.start_s / TICK_S)
        pulses += TICK_S * _speed_sum(phase.at(first * TICK_S), stop - first)
    duration_s = ramp.phases[-1].start_s
    last_tick_s = (ceil(duration_s / TICK_S) - 1) * TICK_S
    pulses -= (last_tick_s + TICK_S - duration_s) * ramp.at(last_tick_s).speed
    return max(1, ceil(pulses - _ROUNDING_SLACK))


def _speed_sum(phase: Phase, ticks: int) -> float:
    """Sum of the speeds at `ticks` ticks from a phase's start, in closed form: a slow ramp has very many."""
    linear, square = ticks * (ticks - 1) / 2, ticks * (ticks - 1) * (2 * ticks - 1) / 6
    return (
        ticks * phase.speed + linear * TICK_S * phase.acceleration + square * TICK_S * TICK_S * phase.jerk / 2
    )
