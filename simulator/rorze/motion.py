"""A running move: which pulses the motor has been given at any moment, and how commands bend or end it."""

from typing import Literal

from protocols.rorze.profile import Profile, SpeedParameters, first_moment

Direction = Literal[1, -1]
"""CW counts up, CCW counts down."""

# Wider than the rounding of any clock, so that a search never begins short of what it looks for.
_MARGIN_S = 1e-3


class PulseTrain:
    """The pulses of one move; `now` is seconds of the caller's clock, which never goes back."""

    def __init__(self, profile: Profile, direction: Direction, now: float) -> None:
        self.profile = profile.starting_at(now)
        self.direction = direction

    @property
    def started_at(self) -> float:
        """The moment the move was started."""
        return self.profile.start_s

    @property
    def final(self) -> bool:
        """Tell whether the move ends with it."""
        return True

    @property
    def ends_at(self) -> float | None:
        """The moment of the last pulse as things stand; None for an endless move."""
        return self.profile.end_s

    def running(self, now: float) -> bool:
        """Tell whether pulses are still to come."""
        return not self.profile.ended(now)

    def emitted(self, now: float) -> int:
        """Pulses given to the motor since the start, 0 or more."""
        return self.profile.emitted(now)

    def displacement(self, now: float) -> int:
        """Pulses since the start, CW positive."""
        return self.direction * self.emitted(now)

    def speed(self, now: float) -> float:
        """Speed in pps; 0 once the move has ended."""
        return self.profile.speed(now)

    def time_when(self, pulses: int) -> float | None:
        """The first moment at which `pulses` have been emitted; None if the move ends before that.

        For pulses from before the last change of speed, it is the moment of that change.
        """
        if self.profile.distance is not None and pulses > self.profile.distance:
            return None
        curve = self.profile.curve
        earliest, latest = curve.phases[0].start_s, curve.time_of(pulses) + _MARGIN_S
        if self.emitted(earliest) >= pulses:
            return earliest
        return first_moment(lambda now: self.emitted(now) >= pulses, earliest, latest)

    def decelerate_to_stop(self, now: float, parameters: SpeedParameters | None = None) -> None:
        """Ramp down to OL and end: 5SS, with the parameters set by 5MS or else the move's own (14.5)."""
        self.profile = self.profile.braked(now, parameters or self.profile.deceleration)

    def change_speed(self, now: float, speed: int) -> None:
        """Ramp to `speed`, 1-1,000,000 pps: 5CS (RC-420 manual 13.3.6)."""
        move = self.profile
        self.profile = move.diverted(now, speed, rising=move.acceleration, falling=move.deceleration)

    def accelerate(self, now: float) -> None:
        """Ramp up to OH of the acceleration: 5AS. A faster move keeps its speed."""
        up = self.profile.acceleration
        self.profile = self.profile.diverted(now, up.high, rising=up, falling=None)

    def decelerate(self, now: float) -> None:
        """Ramp down to OL of the deceleration and run on: 5DS. A slower move keeps its speed."""
        down = self.profile.deceleration
        self.profile = self.profile.diverted(now, down.low, rising=None, falling=down)
