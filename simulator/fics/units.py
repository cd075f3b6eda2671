"""One unit of a Fics: its motors, its user axes, its positions, and what it is doing."""

from collections.abc import Mapping, Sequence

from simulator.fics.axes import Axis, Motor
from simulator.fics.course import PATH_CHECKS, Course, Span
from simulator.fics.geometry import Geometry, OutOfReach, Places
from simulator.fics.mechanics import Mechanics
from simulator.truth import TruthLog

Position = tuple[float | None, ...]
"""Values for the first axes of a unit; None leaves an axis where it is."""


class BeyondLimits(Exception):
    """A soft limit forbids it."""


class Unit(Mechanics):
    """Axes that move together. Settings and positions outlast the power, an assumption."""

    def __init__(
        self,
        number: int,
        geometry: Geometry,
        motors: Sequence[Motor],
        converted: Sequence[Axis] = (),
        truth: TruthLog | None = None,
    ) -> None:
        super().__init__(number, geometry, motors, truth)
        self.users: tuple[Axis, ...] = (*converted, *motors[geometry.converted :])
        """The user axes: those that are converted, and the other motors themselves."""
        self.positions: dict[int, Position] = {}
        self.s_curve = False
        self.course: Course | None = None

    def lose_power(self) -> None:
        """Forget where the motors stand, and go at full speed again (C-HOST manual 2-15, 4-5)."""
        for motor in self.motors:
            motor.lose_power()
        for axis in (*self.users, *self.motors):
            axis.percent = 100.0

    def motor_places(self, now: float) -> Places:
        """The coordinates of the motors."""
        return self.at_rest() if self.course is None else self.course.motor_places(now)

    def user_places(self, now: float) -> Places:
        """The coordinates of the user axes, whether they are known to the controller or not."""
        return self.geometry.to_user(self.motor_places(now))

    def motors_of(self, user_axis: int) -> Sequence[Motor]:
        """The motors that move a user axis."""
        if self.is_converted(user_axis):
            return self.motors[: self.geometry.converted]
        return self.motors[user_axis : user_axis + 1]

    def is_converted(self, user_axis: int) -> bool:
        """Tell whether a user axis differs from the motors."""
        return user_axis < self.geometry.converted

    def shown_motors(self, now: float) -> list[float | None]:
        """The answer of MPS, of the motors."""
        return [
            motor.measure.shown(at) if motor.known() else None
            for motor, at in zip(self.motors, self.motor_places(now), strict=True)
        ]

    def shown_users(self, now: float) -> list[float | None]:
        """The answer of APS, of the user axes."""
        return [
            axis.measure.shown(at) if all(motor.known() for motor in self.motors_of(place)) else None
            for place, (axis, at) in enumerate(zip(self.users, self.user_places(now), strict=True))
        ]

    def moves(self, motor: int) -> bool:
        """Tell whether a motor is on its way: all of those together that a converted move needs."""
        if self.course is None:
            return False
        if not self.course.converted or not self.is_converted(motor):
            return self.course.moves(motor)
        return any(map(self.course.moves, range(self.geometry.converted)))

    def require_free_way(self, spans: Mapping[int, Span]) -> None:
        """Check that the motors can follow a converted move within their soft limits.

        :raises OutOfReach: the arms cannot.
        :raises BeyondLimits: a motor would have to leave its limits.
        """
        for check in range(PATH_CHECKS + 1):
            self._require_place(spans, check / PATH_CHECKS)

    def free_share(self, spans: Mapping[int, Span]) -> float:
        """The share of a converted move up to which the motors can follow it."""
        free, blocked = 0.0, 1.0
        for check in range(1, PATH_CHECKS + 1):
            if not self._is_free(spans, check / PATH_CHECKS):
                blocked = check / PATH_CHECKS
                break
            free = check / PATH_CHECKS
        while free < 1.0 and free < (middle := (free + blocked) / 2) < blocked:
            free, blocked = (middle, blocked) if self._is_free(spans, middle) else (free, middle)
        return free

    def _is_free(self, spans: Mapping[int, Span], share: float) -> bool:
        try:
            self._require_place(spans, share)
        except (OutOfReach, BeyondLimits):
            return False
        return True

    def _require_place(self, spans: Mapping[int, Span], share: float) -> None:
        start = self.geometry.to_user(self.at_rest())
        user = tuple(spans[axis].place(share) if axis in spans else at for axis, at in enumerate(start))
        for motor, at in zip(self.motors, self.geometry.to_motors(user), strict=True):
            if not motor.within_limits(at):
                raise BeyondLimits(f"{motor.name} would go to {at:.2f}")
