"""Fics robots: all of a plant, each alone on its line, with their moves."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Annotated, Any, ClassVar, Final, Literal

from pydantic import Field

from gateway.core.alarms import Cause
from gateway.core.backup_record import Restore
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.events import Event
from gateway.core.exchange import Lane
from gateway.core.family import (
    PortInfo,
    Site,
    TargetKind,
    Watch,
    facts_of,
)
from gateway.core.operation import DocumentSection, RouteWords
from gateway.core.restores import Restores
from gateway.core.sampler import Sampler
from gateway.core.supervisor import Deed
from gateway.core.targets import Replies, Target
from gateway.core.works import DurableJobs
from gateway.fics import config, settings, signals
from gateway.fics.addressed import STOP_MODES, RobotTarget, UnitTarget
from gateway.fics.alarms import causes
from gateway.fics.axes import AskedUnit, NamedRobot, RobotId, UnitAxes, UnitNumber
from gateway.fics.backup_restore import RobotRestore, amid_a_restore, motion_without_proof
from gateway.fics.bits import Bits
from gateway.fics.event_types import TYPES
from gateway.fics.jogs import JogSession
from gateway.fics.knowledge import Macros
from gateway.fics.line import FicsLine
from gateway.fics.live import ChannelSource, UnitSource
from gateway.fics.move_record import RobotMove
from gateway.fics.moves import RobotMoves
from gateway.fics.robot import Robot, RobotNow, Robots
from gateway.fics.stops import RobotStopReport
from gateway.fics.units import RobotUnit
from gateway.fics.watch import watch
from protocols.fics.commands import ROWS, Row, of_the_robot
from protocols.fics.jog import StartJog
from protocols.fics.positions import BeginPositionUpload, EndPositionUpload, UploadPosition
from protocols.fics.row import WhenAnswered
from protocols.fics.system import SetCommunicationMode
from protocols.wording import as_given
from transports.base import Transport

ROBOT = TargetKind("/robots/{robot_id}", RobotMove, tag="robot commands", listed=True)
UNIT = TargetKind("/robots/{robot_id}/units/{unit}", RobotMove, tag="robot commands", listed=True)
WORDS: Final = RouteWords(
    "The robot's reply.", begun="The robot has not refused the move; ask again at Location."
)
_ANSWERED: Final[Mapping[WhenAnswered, str]] = {
    WhenAnswered.ALWAYS: "answered at once",
    WhenAnswered.ON_COMPLETION: "answered when it is done, in Ver.2 not at all",
    WhenAnswered.AT_ONCE: "answered when it is accepted, in Ver.2 not at all",
}


class RobotLineInfo(PortInfo):
    """A line: one port with a robot."""

    protocol: Literal["fics"]
    robot_id: str
    mode: Annotated[int, Field(description="The robot's communication mode, 3 or 2 (C-HOST manual 1-1-1).")]
    online: Annotated[bool, Field(description="True if the robot can be asked now, as far as is known.")]


class Fics(Robots):
    """All lines with robots."""

    moves: RobotMoves
    kind = "robot"
    line_table = config.FicsLineTable
    line_info = RobotLineInfo
    now = RobotNow
    move_records = (RobotMove,)
    collections = ("robots",)
    event_types = TYPES
    controllers = "Fics robots that speak C-HOST"
    told_when_up: ClassVar = {
        "mode": (int | None, Field(None, description="The communication mode of a Fics: 2 or 3."))
    }
    told_of_ports = "a Fics robot"
    told_of_stops = "for robots ASS and AES (C-HOST manual 2-7, 2-8)"
    stop_report = RobotStopReport
    sections = (
        DocumentSection(
            "robots", "Fics robots: units, axes, state, errors, inputs, outputs and variables.", "lines", True
        ),
        DocumentSection("robot moves", "Moves of a robot's units, and runs of its macros.", "lines", True),
        DocumentSection(
            "robot positions", "The table of positions that a robot keeps, as JSON and as CSV.", "backups"
        ),
        DocumentSection("robot settings", "Speeds, soft limits and homing of a robot's axes.", "backups"),
        DocumentSection(
            "robot commands", "Every command of the C-HOST manual to a robot or to one of its units."
        ),
    )
    words: ClassVar = dict.fromkeys((ROBOT.path, UNIT.path), WORDS)
    names: ClassVar = {"robot_id": RobotId, "unit": UnitNumber}
    commands = tuple((ROBOT if of_the_robot(row) else UNIT, row) for row in ROWS)
    stop_modes = STOP_MODES
    sessions: ClassVar = {StartJog: JogSession}
    rows = (signals.ROWS, settings.ROWS)
    things: ClassVar = {
        **dict.fromkeys((Robot, NamedRobot), lambda fics, robot_id: fics.robot(robot_id)),
        **dict.fromkeys((RobotUnit, AskedUnit), lambda fics, robot_id, unit: fics.robot(robot_id).unit(unit)),
    }
    never_alone = (BeginPositionUpload, UploadPosition, EndPositionUpload, SetCommunicationMode)

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self._tables: dict[str, config.FicsLineTable] = {}
        self.moves = RobotMoves(self._tell_move, site.events.live.demand_changes)
        self.restores: Restores[RobotRestore] = Restores(self._publish_restore)

    def add(self, table: config.FicsLineTable, port: Transport) -> FicsLine:
        """Build a line with its robot and its units."""
        robot_table = table.robot
        line = FicsLine(
            table.id,
            port,
            robot_table.id,
            mode=table.mode,
            terminator=table.terminator,
            reply_timeout_s=table.reply_timeout_s,
            late_reply_s=table.late_reply_s,
            rng=self.site.rng,
        )
        units = [
            UnitAxes(
                robot_table.id, unit.number, list(unit.axes), list(unit.motor_axes or unit.axes), unit.systems
            )
            for unit in robot_table.units
        ]
        line.gate.add(motion_without_proof)
        line.gate.add(amid_a_restore(partial(self.restores.amid, robot_table.id)))
        self._tables[robot_table.id] = table
        self._all[robot_table.id] = robot = Robot(
            robot_table.id,
            robot_table.name or "",
            line,
            units,
            self.site.events.publish,
            poll_interval_s=table.poll_interval_s,
            bits=Bits(robot_table.status_bits, robot_table.sensor_bits),
            macros=Macros(robot_table.macros or {}),
        )
        power = robot.known.power
        power.on_memory = self.site.known.keep(robot_table.id, power)
        return line

    def _tell_move(self, what: str, unit: AskedUnit, move: RobotMove) -> Event:
        return self.site.events.publish(f"robot.move.{what}", f"/robots/{unit.address}", move, move.id)

    def _publish_restore(self, what: str, restore: Restore) -> None:
        self.site.events.publish(f"robot.restore.{what}", restore.target, restore, correlation=restore.id)

    # finding

    def target(self, collection: str, names: Sequence[str]) -> Target:
        """Find a robot or a unit; errors as of `robot` and `Robot.unit`."""
        robot_id, *of_robot = names
        robot = self.robot(robot_id)
        if not of_robot:
            return RobotTarget(robot, self.moves)
        if len(of_robot) != 2 or of_robot[0] != "units" or not of_robot[1].isdecimal():
            raise NotFound(f"There is no {as_given('/'.join(('', collection, *names)))}; nothing was sent.")
        return UnitTarget(robot, robot.unit(int(of_robot[1])), self.moves)

    def link_of(self, line_id: str) -> Target:
        """Refuse a link: none stands between a line and its robot."""
        raise InvalidRequest(
            f"Line {line_id} leads to a robot and has no bodies; nothing was sent.",
            "GET /robots lists the robots, with their lines.",
        )

    def addresses(self) -> Iterator[str]:
        """Robots and units."""
        for robot in self.robots():
            yield robot.id
            yield from (unit.address for unit in robot.units)

    def info(self, line: FicsLine) -> RobotLineInfo:
        """Tell the state of a line."""
        return {
            **facts_of(line),
            "protocol": "fics",
            "robot_id": self.on_line(line).id,
            "mode": line.mode,
            "online": line.online,
        }

    @classmethod
    def facts(cls, row: Row) -> list[str]:
        """Tell what stands in the row's line of the manual's table."""
        blocks = ", ".join(sorted(f"({block})" for block in row.blocked)) or "nothing"
        return [
            f"Command `{row.code or 'named by the macro'}`; {_ANSWERED[row.answered]}; blocked by {blocks} "
            f"(C-HOST manual 1-7); retry class `{row.retry}`.",
            f"Example: `{row.example[0]}`.",
        ]

    @classmethod
    def answer_model(cls, row: Row) -> Any:
        """One reply, or any number of them."""
        generic: Any = Replies
        return generic[row.reply_type()] if row.ends_with else row.reply_type()

    @classmethod
    def is_dated(cls, row: Row) -> bool:
        """Only queries tell something."""
        return row.is_query()

    def causes(self) -> Iterator[Cause]:
        """The causes of the robots' alarms."""
        return causes(self._all.get)

    # over restarts

    def trajectories(self) -> Sequence[Any]:
        """The trajectories of the moves."""
        return self.moves.trajectories.all

    def works(self) -> Mapping[str, DurableJobs[Any]]:
        """Restores."""
        return {"robot_restore": self.restores}

    # life

    def watches(self, line: FicsLine) -> Iterator[Watch]:
        """Look after the robot on a line."""
        live = self.site.events.live
        for robot in self.robots():
            if robot.line is line:
                yield partial(watch, robot)
                table = self._tables[robot.id]
                units = (UnitSource(robot, unit, live, table.move_samples_per_s) for unit in robot.units)
                yield Sampler(
                    line,
                    live,
                    [*units, ChannelSource(robot, live, table.input_edges_per_s)],
                    table.live_share,
                ).run

    def at_work(self, line: FicsLine) -> Iterator[str]:
        """The robot, while positions are written into it, or a backup restored."""
        return (
            robot.id
            for robot in self.robots()
            if robot.line is line and (line.uploading or self.restores.is_under_way(robot.id))
        )

    def was_left_alone(self) -> tuple[Deed, ...]:
        """Name what stops what jogs, and has every robot looked at."""
        return *super().was_left_alone(), *(robot.known.doubt for robot in self.robots())

    # the end

    async def at_rest(self) -> None:
        """Wait for stops, for refusals of moves, and for the ends of uploads."""
        await super().at_rest()
        for robot in self.robots():
            if robot.line.uploading:
                async with robot.line.sequence_lock.held(Lane.STOP):
                    pass

    def letting_go(self) -> tuple[Deed, ...]:
        """End restores, and give the waiters for moves what is known now."""
        return self.restores.close, *super().letting_go()


FAMILY: Final = Fics
