"""A plant whose bodies and robots are found without naming their family."""

from gateway.fics.family import Fics
from gateway.fics.moves import RobotMoves
from gateway.fics.robot import Robot
from gateway.plant import Plant
from gateway.rorze.bodies import Body, Group
from gateway.rorze.family import Rorze
from gateway.rorze.line import Line
from gateway.rorze.moves import Moves
from gateway.rorze.scans import Scans
from gateway.rorze.stops import Stops


class TestedPlant(Plant):
    """A plant of bodies and robots."""

    __test__ = False

    @property
    def rorze(self) -> Rorze:
        return self.family(Rorze)

    @property
    def fics(self) -> Fics:
        return self.family(Fics)

    @property
    def lines(self) -> dict[str, Line]:
        return self.rorze.lines

    @property
    def moves(self) -> Moves:
        return self.rorze.moves

    @property
    def stops(self) -> Stops:
        return self.rorze.stops

    @property
    def scans(self) -> Scans:
        return self.rorze.scans

    @property
    def robot_moves(self) -> RobotMoves:
        return self.fics.moves

    def line(self, line_id: str) -> Line:
        self.port(line_id)
        return self.lines[line_id]

    def body(self, address: str) -> Body:
        return self.rorze.body(address)

    def bodies(self) -> list[Body]:
        return self.rorze.bodies()

    def group(self, address: str) -> Group:
        return self.rorze.group(address)

    def groups(self) -> list[Group]:
        return self.rorze.groups()

    async def define_group(self, address: str, members: list[str], name: str = "") -> Group:
        return await self.rorze.define_group(address, members, name)

    def robot(self, robot_id: str) -> Robot:
        return self.fics.robot(robot_id)

    def robots(self) -> list[Robot]:
        return self.fics.robots()
