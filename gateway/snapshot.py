"""The plant as it is now: what follows a gap in the stream, so that nobody has to read everything again."""

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, Final

from pydantic import Field

from gateway.core.event_types import EVENTS, EventData, EventType
from gateway.core.events import SNAPSHOT, Filter
from gateway.core.family import AnyLine, Family
from gateway.core.line_state import LineState
from gateway.core.move_record import Move
from gateway.core.records import Record
from gateway.fics.family import Fics
from gateway.fics.move_record import RobotMove
from gateway.rorze.family import Rorze
from protocols.rorze.status import CONTROLLER_STATUS_BITS, names_of


class LineNow(Record):
    """A line."""

    line_id: str
    state: LineState
    down_reason: str | None


class BodyNow(Record):
    """A body, as far as is known."""

    body_id: str
    online: bool
    moving: bool | None
    move_id: str | None
    position: int | None = Field(description="In pulses.")
    homed: str
    power_cycled: bool
    status: list[str] | None


class RobotNow(Record):
    """A robot, as far as is known."""

    robot_id: str
    online: bool
    mode: int
    moving: bool | None
    power_cycled: bool
    error: str | None = Field(description="The code of the error that stands.")


class Snapshot(EventData):
    """The plant when the event was made; later events up to `as_of` are in it already."""

    as_of: str = Field(description="The cursor of the newest event that it takes account of.")
    lines: list[LineNow] = Field(description="None where only some bodies or robots are wanted.")
    bodies: list[BodyNow]
    robots: list[RobotNow]
    moves: list[Move | RobotMove] = Field(description="Those that are not over.")


TYPES: Final = (
    EventType(SNAPSHOT, EVENTS, Snapshot, "follows each gap: all that is known now of what is wanted"),
)


def taking(families: Collection[Family], ports: Mapping[str, AnyLine]) -> Callable[[Filter, str], Snapshot]:
    """Give what makes a snapshot of a plant for a client, who wants some of it, at a cursor."""

    def take(wanted: Filter, as_of: str) -> Snapshot:
        def moves() -> Iterator[Any]:
            for family in families:
                for log in family.move_logs():
                    yield from (move for move in log.under_way() if wanted.wants_address(move.body_id))

        rorze = [family for family in families if isinstance(family, Rorze)]
        fics = [family for family in families if isinstance(family, Fics)]
        return Snapshot(
            as_of=as_of,
            lines=[] if wanted.bodies else [_line(line) for line in ports.values()],
            bodies=[it for family in rorze for it in _bodies(family) if wanted.wants_address(it.body_id)],
            robots=[it for family in fics for it in _robots(family) if wanted.wants_address(it.robot_id)],
            moves=list(moves()),
        )

    return take


def _line(line: AnyLine) -> LineNow:
    return LineNow(line_id=line.id, state=line.state, down_reason=line.trouble)


def _bodies(rorze: Rorze) -> Iterator[BodyNow]:
    for body in rorze.bodies():
        bits = body.status_bits
        yield BodyNow(
            body_id=body.address,
            online=body.online,
            moving=body.moving if body.online else None,
            move_id=None if body.move is None else body.move.id,
            position=body.position,
            homed=body.power.homed,
            power_cycled=body.power.cycled,
            status=None if bits is None else names_of(bits, CONTROLLER_STATUS_BITS),
        )


def _robots(fics: Fics) -> Iterator[RobotNow]:
    for robot in fics.robots():
        yield RobotNow(
            robot_id=robot.id,
            online=robot.online,
            mode=robot.mode,
            moving=robot.moving,
            power_cycled=robot.power_cycled,
            error=None if robot.latched_error is None else robot.latched_error.code,
        )
