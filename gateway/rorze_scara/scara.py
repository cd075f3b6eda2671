"""A SCARA robot as the gateway sees it: its mechanics, its bodies, and what all of them say at once."""

from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from typing import NamedTuple, cast

from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.exchange import Lane
from gateway.core.stops import StopMode
from gateway.core.targets import Looked
from gateway.rorze.bodies import Body, Group, R
from gateway.rorze.line import Line
from gateway.rorze_scara.record import ScaraMove
from protocols.rorze.position import GetPosition
from protocols.rorze.row import RorzeCommand
from protocols.rorze.scara import BeltLinked, FingerPlace, Mechanics, OutOfReach


class AxisPlaces(NamedTuple):
    """Where the axes of a robot stand, and when the answer came on the event loop's clock."""

    pulses: tuple[int, ...]
    at: float


@dataclass(eq=False)
class Scara(Looked):
    """Two or three bodies of one line whose axes move together."""

    id: str
    group: Group
    robot: Mechanics
    name: str = ""
    own_path: int = 63
    """The interpolation path that the gateway overwrites for its lines."""
    keep_out_um: int = 10_000
    """A path that passes the origin nearer than this, and not straight through it, is refused; 0: none is."""
    tolerance_pulses: int = 2
    on_fault: StopMode = "decelerate"
    move: ScaraMove | None = None
    """The move that is not over yet."""

    def __post_init__(self) -> None:
        for body in self.members:
            body.own_speed.shares_ramps_with(self.members)

    @property
    def members(self) -> list[Body]:
        """The bodies of axes 0, 1 and 2."""
        return self.group.members

    @property
    def line(self) -> Line:
        """The line of all of them."""
        return self.group.line

    @property
    def path(self) -> str:
        """Where it stands among all resources."""
        return f"/scaras/{self.id}"

    def claim(self, move: ScaraMove) -> None:
        """Let no other move begin."""
        self.move = move

    def release(self) -> None:
        """Let another move begin."""
        self.move = None

    # kinematics

    def place_of(self, pulses: Sequence[float]) -> FingerPlace:
        """Where the finger ends at these positions of the axes.

        :raises InvalidRequest: they are too many or too few, or none that the arm can have.
        """
        if len(pulses) != self.robot.axes:
            raise InvalidRequest(
                f"{self.id} has {self.robot.axes} axes, not {len(pulses)}; nothing was sent."
            )
        try:
            return self.robot.place(pulses)
        except OutOfReach as error:
            raise InvalidRequest(f"{error} Nothing was sent.") from None

    def pulses_of(self, place: FingerPlace, *, is_turned: bool = True) -> tuple[int, ...]:
        """The positions of the axes as HLS answers them (13.10.7): cut towards zero, one of the two elbows.

        `is_turned` tells that the direction of the place was asked for.

        :raises InvalidRequest: the arm does not come there, or its finger cannot point there.
        """
        robot = self.robot
        try:
            if is_turned and isinstance(robot, BeltLinked):
                return robot.cut(robot.pulses_pointed(place))
            return robot.whole_pulses(place)
        except OutOfReach as error:
            raise InvalidRequest(f"{error} Nothing was sent.") from None

    # all members at once

    @asynccontextmanager
    async def looking(self) -> AsyncIterator[None]:
        """Leave no command error of what is asked inside at any of them."""
        async with AsyncExitStack() as stack:
            for body in self.members:
                await stack.enter_async_context(body.looking())
            yield

    async def ask(self, command: RorzeCommand[R], *, lane: Lane | None = None) -> list[R]:
        """Send a command to all members in one frame, and give their replies in the order of the axes.

        :raises GatewayError: one has refused it, or has not answered.
        """
        results = await self.group.ask(command, lane=lane)
        for result in results.values():
            if isinstance(result, GatewayError):
                raise result
        return cast("list[R]", list(results.values()))

    async def stand(self, lane: Lane | None = None) -> AxisPlaces:
        """Ask all axes at once where they stand (6PD); errors as of `ask`."""
        pulses = tuple(reply.pulses for reply in await self.ask(GetPosition(), lane=lane))
        place = self.members[0].told.place
        return AxisPlaces(pulses, 0.0 if place is None else place.at)
