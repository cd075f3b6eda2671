"""The paths of interpolated moves: lines, arcs and rounded corners, and the axes' positions along them.

Lengths are micrometres, places complex numbers, angles radians (RC-420 manual 13.10.3 to 13.10.7).
"""

from abc import ABC, abstractmethod
from cmath import phase, rect
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from math import ceil, floor, inf, pi, tan
from typing import NamedTuple

from protocols.rorze.scara import Mechanics, Pose, within_half_turn

CLOSE_UM = 1e-6
"""Nearer than this, two places are one."""

NUDGE_UM = 1e-3
"""Micrometres beside the origin at which the direction of a line through it is taken; no piece is shorter."""

FINEST_UM = 1.0
"""Micrometres by which the path goes on while an axis turns as far as it would have to jump."""

TOLERANCE_PULSES = 0.1
"""Pulses by which a straight stretch between two knots may miss an axis's true position."""

LEAST_HALVINGS = 2

JUMP = 1e-3
"""Radians: what the heading turns by more between two pieces is no rounding."""

ARC_STEP = pi / 4


class PathFault(ValueError):
    """An error 64: no path can be made of the points."""


class Corner(NamedTuple):
    """A point of a path, and the radius that rounds the corner there; 0 leaves it sharp."""

    at: complex
    radius: float = 0.0


class Segment(ABC):
    """A stretch of a path."""

    length: float

    @abstractmethod
    def at(self, along: float) -> complex:
        """The place `along` micrometres from the start."""

    @abstractmethod
    def cuts(self) -> list[float]:
        """Where it comes nearest to the origin or farthest from it, and both ends, in order."""


@dataclass(frozen=True)
class StraightLine(Segment):
    """Straight on."""

    start: complex
    end: complex

    @cached_property
    def length(self) -> float:  # type: ignore[override]  # computed here, given elsewhere
        """From end to end."""
        return abs(self.end - self.start)

    @cached_property
    def _ahead(self) -> complex:
        return (self.end - self.start) / self.length

    def at(self, along: float) -> complex:
        """The place `along` micrometres from the start; the end itself at the end."""
        return self.end if along >= self.length else self.start + self._ahead * along

    def cuts(self) -> list[float]:
        """The nearest point of the path."""
        nearest = -(self.start * self._ahead.conjugate()).real
        return _spaced([nearest], self.length)


@dataclass(frozen=True)
class Arc(Segment):
    """A part of a circle: `arm` leads from the centre to the start, `turn` is counterclockwise.

    `length` may be another than that of the arc, where the speed of another point counts.
    """

    centre: complex
    arm: complex
    turn: float
    length: float

    def at(self, along: float) -> complex:
        """The place `along` micrometres from the start."""
        return self.centre + self.arm * rect(1.0, self.turn * along / self.length)

    def cuts(self) -> list[float]:
        """Both ends of the diameter through the origin, and no piece longer than an eighth of a circle."""
        steps = ceil(abs(self.turn) / ARC_STEP)
        shares = {step / steps for step in range(1, steps)}
        if abs(self.arm) > 0 and abs(self.centre) > 0:
            first = phase(self.centre / self.arm) / self.turn
            half = pi / abs(self.turn)
            shares |= {first + number * half for number in range(-2, 3)}
        return _spaced([share * self.length for share in shares], self.length)


def _spaced(places: Iterable[float], length: float) -> list[float]:
    """Both ends and the places between them, in order, those left out that are next to another."""
    spaced = [0.0]
    for place in sorted(places):
        if spaced[-1] + NUDGE_UM < place < length - NUDGE_UM:
            spaced.append(place)
    return [*spaced, length]


def rounded(start: complex, corners: Sequence[Corner]) -> list[Segment]:
    """The lines from the start over the corners to the last of them, and the arcs that round these.

    :raises PathFault: there is no corner, the last is rounded, or an arc does not fit between its neighbours.
    """
    if not corners:
        raise PathFault("The path has no points.")
    if corners[-1].radius > 0:
        raise PathFault("The end of the path has a radius.")
    points = [Corner(start)]
    for corner in corners:
        if abs(corner.at - points[-1].at) > CLOSE_UM:
            points.append(corner)
    segments: list[Segment] = []
    here, used = start, 0.0
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        arc, taken = _rounding(before.at, corner, after.at)
        _check_room(abs(corner.at - before.at), used + taken)
        segments += _line(here, arc.at(0.0) if arc else corner.at)
        segments += [arc] if arc else []
        here, used = arc.at(arc.length) if arc else corner.at, taken
    _check_room(abs(points[-1].at - points[-2].at) if len(points) > 1 else 0.0, used)
    return [*segments, *_line(here, points[-1].at)]


def _rounding(before: complex, corner: Corner, after: complex) -> tuple[Arc | None, float]:
    """The arc of a corner, and how much of both its sides it takes."""
    ahead, onward = (corner.at - before), (after - corner.at)
    ahead, onward = ahead / abs(ahead), onward / abs(onward)
    turn = phase(onward / ahead)
    if corner.radius == 0 or turn == 0:
        return None, 0.0
    taken = corner.radius * tan(abs(turn) / 2)
    arm = corner.radius * ahead * (-1j if turn > 0 else 1j)
    return Arc(corner.at - ahead * taken - arm, arm, turn, corner.radius * abs(turn)), taken


def _check_room(side: float, taken: float) -> None:
    if taken > side + CLOSE_UM:
        raise PathFault(f"The rounded corners need {taken:.0f} um of a side of {side:.0f} um.")


def _line(start: complex, end: complex) -> list[Segment]:
    return [StraightLine(start, end)] if abs(end - start) > CLOSE_UM else []


class _Piece(NamedTuple):
    """A part of a segment along which the heading turns by less than half a circle."""

    segment: Segment
    offset: float
    """Distance of the segment's start along the path, in micrometres."""
    first: float
    last: float
    """Along the segment."""
    side: int
    """1 where the lead is ahead of the origin, -1 where it is behind."""
    heading: float
    """Heading at the start of the piece, in radians."""

    def polar(self, along: float) -> tuple[float, float]:
        """Lead and heading at a place along the segment."""
        before, now = _direction(self, self.first), _direction(self, along)
        turned = phase(now / before) if before else 0.0
        return self.side * abs(self.segment.at(along)), self.heading + turned


def _direction(piece: _Piece, along: float) -> complex:
    """The place as seen from the origin; the origin itself is taken a little inside the piece.

    It is 0 where the piece does not leave the origin.
    """
    here = piece.segment.at(along)
    if abs(here) > CLOSE_UM:
        return here
    nudge = min(NUDGE_UM, (piece.last - piece.first) / 2)
    return piece.segment.at(along + (nudge if along < piece.last else -nudge))


def _turning(piece: _Piece, along: float) -> float:
    """Radians a micrometre by which the heading turns at a place of the segment; 0 in the origin itself."""
    here = piece.segment.at(along)
    if abs(here) <= CLOSE_UM:
        return 0.0
    step = min(NUDGE_UM, (piece.last - piece.first) / 2) * (1 if along < piece.last else -1)
    return abs(phase(piece.segment.at(along + step) / here) / step)


class Knot(NamedTuple):
    """A position of an axis in pulses from its start, and how far along the path it is due."""

    along: float
    pulses: float


class Path:
    """A way of the point that a robot leads, from a pose on; the finger may turn meanwhile.

    Where a segment begins in the origin, the arm goes through it as straight as it can (CENTER). In the midst
    of a segment axis 0 has to turn round there at once (RC-420 manual 13.10.6).
    """

    def __init__(self, robot: Mechanics, start: Pose, segments: Sequence[Segment], turn: float = 0.0) -> None:
        self._robot = robot
        self._start = start
        self._turn = turn
        self.length = sum(segment.length for segment in segments)
        self._pieces = list(self._cut(segments))

    def _cut(self, segments: Sequence[Segment]) -> Iterator[_Piece]:
        side = -1 if self._robot.lead(self._start) < 0 else 1
        heading = self._start.heading
        offset = 0.0
        for segment in segments:
            through = abs(segment.at(0.0)) <= CLOSE_UM
            for first, last in pairwise(segment.cuts()):
                piece = _Piece(segment, offset, first, last, side, heading)
                ahead = side * _direction(piece, first)
                turn = within_half_turn(phase(ahead) - heading) if ahead else 0.0
                if through and abs(turn) > pi / 2:
                    side, turn = -side, within_half_turn(turn + pi)
                through = False
                piece = piece._replace(side=side, heading=heading + turn)
                yield piece
                heading = piece.polar(last)[1]
            offset += segment.length

    def sharpest_turn(self) -> float:
        """Radians a micrometre by which the heading turns where it does so fastest; infinite where it jumps.

        That is where it passes the origin nearby (RC-420 manual 13.10.6); straight through it nothing turns.
        """
        heading, sharpest = self._start.heading, 0.0
        for piece in self._pieces:
            if abs(piece.heading - heading) > JUMP:
                return inf
            sharpest = max(sharpest, _turning(piece, piece.first), _turning(piece, piece.last))
            heading = piece.polar(piece.last)[1]
        return sharpest

    def knots(self, axis: int) -> list[Knot]:
        """The positions of an axis, to be joined by straight lines.

        :raises OutOfReach: a place on the path is none for the arm.
        """
        knots = [Knot(0.0, 0.0)]
        for piece in self._pieces:
            at = partial(self._knot, axis, piece)
            first, last = at(piece.offset + piece.first), at(piece.offset + piece.last)
            if abs(first.pulses - knots[-1].pulses) > TOLERANCE_PULSES:
                first = at(min(first.along + FINEST_UM, (first.along + last.along) / 2))
                knots.append(first)
            knots += _refined(at, first, at((first.along + last.along) / 2), last, LEAST_HALVINGS)
        return knots

    def pulses(self) -> tuple[int, ...]:
        """Pulses by which each axis has turned at the end, halves up.

        :raises OutOfReach: a place on the path is none for the arm.
        """
        end = self._start
        for piece in self._pieces:
            for along in (piece.first, piece.last):
                end = self._pose(piece, along)
                self._robot.angles(end)
        ends, starts = (self._robot.counted(self._robot.angles(pose)) for pose in (end, self._start))
        return tuple(floor(there - here + 0.5) for there, here in zip(ends, starts, strict=True))

    def _knot(self, axis: int, piece: _Piece, along: float) -> Knot:
        pose = self._pose(piece, along - piece.offset)
        return Knot(along, self._pulses(pose, axis) - self._pulses(self._start, axis))

    def _pose(self, piece: _Piece, along: float) -> Pose:
        lead, heading = piece.polar(along)
        share = (piece.offset + along) / self.length
        return Pose(lead - self._robot.ahead, heading, self._start.finger + self._turn * share)

    def _pulses(self, pose: Pose, axis: int) -> float:
        return self._robot.counted(self._robot.angles(pose))[axis]


def _refined(
    at: Callable[[float], Knot], first: Knot, middle: Knot, last: Knot, halvings: int
) -> Iterator[Knot]:
    """The knots after the first, so many that straight lines between them come near enough.

    A curve may bend both ways, and cross its straight line in the middle: the quarters have to be near, too.
    """
    quarter, three_quarters = at((first.along + middle.along) / 2), at((middle.along + last.along) / 2)
    straight = halvings <= 0 and _join(first, quarter, middle, three_quarters, last)
    if straight or last.along - first.along <= FINEST_UM:
        yield last
        return
    yield from _refined(at, first, quarter, middle, halvings - 1)
    yield from _refined(at, middle, three_quarters, last, halvings - 1)


def _join(first: Knot, *between_and_last: Knot) -> bool:
    """Say whether a straight line from the first to the last, in even steps, comes near the knots between."""
    *between, last = between_and_last
    step = (last.pulses - first.pulses) / len(between_and_last)
    return all(
        abs(knot.pulses - first.pulses - number * step) <= TOLERANCE_PULSES
        for number, knot in enumerate(between, 1)
    )
