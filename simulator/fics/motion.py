"""How one axis moves in time: a ramp up, a steady stretch, a ramp down, straight or S-shaped."""

from dataclasses import dataclass, replace
from math import copysign, inf, sqrt


@dataclass(frozen=True, slots=True)
class Ramps:
    """The shape of a move: speeds in units/s, accelerations in units/s² (infinite: without a ramp)."""

    start_speed: float
    speed: float
    acceleration: float = inf
    deceleration: float = inf
    s_curve: bool = False


@dataclass(frozen=True, slots=True)
class _Phase:
    """A stretch of time in which the speed goes from one value to another."""

    start_s: float
    duration_s: float
    way: float
    """Gone before it, in units."""
    speed: float
    gain: float
    """Growth of the speed over the phase."""
    s_curve: bool

    @property
    def end_s(self) -> float:
        return self.start_s + self.duration_s

    @property
    def end_way(self) -> float:
        return self.way + (self.speed + self.gain / 2) * self.duration_s

    def way_at(self, now: float) -> float:
        share = self._share(now)
        gained = share**3 - share**4 / 2 if self.s_curve else share**2 / 2
        return self.way + (self.speed * share + self.gain * gained) * self.duration_s

    def speed_at(self, now: float) -> float:
        share = self._share(now)
        return self.speed + self.gain * (share**2 * (3 - 2 * share) if self.s_curve else share)

    def _share(self, now: float) -> float:
        return min(max((now - self.start_s) / self.duration_s, 0.0), 1.0) if self.duration_s else 1.0


@dataclass(frozen=True, slots=True)
class Glide:
    """One axis on its way from `origin` to `target`; it is there exactly when it has ended."""

    origin: float
    target: float
    ramps: Ramps
    phases: tuple[_Phase, ...]

    @property
    def starts_at(self) -> float:
        """The moment it was planned from."""
        return self.phases[0].start_s

    @property
    def ends_at(self) -> float:
        """The moment it stands still."""
        return self.phases[-1].end_s

    @property
    def direction(self) -> float:
        """1 towards plus, -1 towards minus."""
        return copysign(1.0, self.target - self.origin)

    def place(self, now: float) -> float:
        """Where the axis is."""
        if now >= self.ends_at:
            return self.target
        return self.origin + self.direction * self._phase(now).way_at(now)

    def speed(self, now: float) -> float:
        """How fast it is, without a sign, in units/s; 0 once it has ended."""
        return 0.0 if now >= self.ends_at else self._phase(now).speed_at(now)

    def time_at(self, place: float) -> float:
        """The first moment at which it has come as far as a place ahead; infinite if it never does."""
        if (place - self.target) * self.direction > 0:
            return inf
        early, late = self.starts_at, self.ends_at
        while early < (middle := (early + late) / 2) < late:
            if (self.place(middle) - place) * self.direction >= 0:
                late = middle
            else:
                early = middle
        return late

    def braked(self, now: float) -> "Glide":
        """The motion, ramped down to the start speed from now on; one that is as good as there goes on."""
        origin, speed = self.place(now), self.speed(now)
        drop = speed - min(self.ramps.start_speed, speed)
        brake = _Phase(now, drop / self.ramps.deceleration, 0.0, speed, -drop, self.ramps.s_curve)
        target = origin + self.direction * brake.end_way
        if now >= self.ends_at or (target - self.target) * self.direction >= 0:
            return self
        return replace(self, origin=origin, target=target, phases=(brake,))

    def _phase(self, now: float) -> _Phase:
        return next(phase for phase in self.phases if now < phase.end_s)


def glide(origin: float, target: float, ramps: Ramps, now: float) -> Glide:
    """Plan a move that starts now; a short one never reaches its speed.

    The shape of a ramp changes neither its length nor its duration: an S-curve is as fast in the mean.
    """
    distance = abs(target - origin)
    low = min(ramps.start_speed, ramps.speed)
    # Both ramps together, in units for each (units/s)² they gain.
    cost = 1 / (2 * ramps.acceleration) + 1 / (2 * ramps.deceleration)
    peak = min(ramps.speed, sqrt(low**2 + distance / cost)) if cost else ramps.speed
    up_s, down_s = (peak - low) / ramps.acceleration, (peak - low) / ramps.deceleration
    steady = max(distance - (low + peak) / 2 * (up_s + down_s), 0.0)
    up = _Phase(now, up_s, 0.0, low, peak - low, ramps.s_curve)
    cruise = _Phase(up.end_s, steady / peak if peak else 0.0, up.end_way, peak, 0.0, s_curve=False)
    down = _Phase(cruise.end_s, down_s, cruise.end_way, peak, low - peak, ramps.s_curve)
    return Glide(origin, target, ramps, (up, cruise, down))
