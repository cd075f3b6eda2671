"""The plant: the configured lines with their bodies, groups and robots, and everything that works on them."""

import asyncio
import logging
import random
from collections.abc import Callable, Collection, Iterable
from functools import partial
from typing import Any, TypeVar

from gateway import config as settings
from gateway.config import Config
from gateway.core.addresses import numbered_address
from gateway.core.admission import Admission
from gateway.core.errors import (
    Ambiguous,
    BodyBusy,
    Cancelled,
    ControllerRefused,
    GatewayError,
    HeldUp,
    InvalidRequest,
    NoReply,
    NotFound,
)
from gateway.core.events import EventHub
from gateway.core.lanes import Lane
from gateway.core.loop_watch import SUSPENDED_S, LoopWatch
from gateway.core.move_record import Move
from gateway.core.origin import POLL, acting
from gateway.fics.axes import UnitAxes
from gateway.fics.line import FicsLine
from gateway.fics.moves import RobotMoves
from gateway.fics.robot import Robot
from gateway.fics.watch import watch
from gateway.rorze.bodies import Body, Group
from gateway.rorze.body_watch import HEALTH_POLL_S as HEALTH_POLL_S
from gateway.rorze.body_watch import BodyWatch
from gateway.rorze.exchange import RorzeExchange
from gateway.rorze.line import Line
from gateway.rorze.moves import Moves
from gateway.rorze.power import Power, needs_place
from gateway.rorze.scans import Scans
from gateway.rorze.stops import Stops
from gateway.wind_down import SUBJECT, WindDown
from protocols.rorze.link import MoveEnded, StatusChanged, UnknownMessage
from protocols.rorze.row import FIRST_GROUP, LAST_GROUP
from protocols.rorze.status import GetControllerStatus
from protocols.table import Effect
from transports import Transport, create
from transports.recorder import Recorded, Recorder
from transports.trace_file import TraceFile

log = logging.getLogger(__name__)


class Plant:
    """All lines of a configuration. `open_transport` is replaced by tests that have no ports."""

    def __init__(
        self,
        config: Config,
        *,
        open_transport: Callable[[str], Transport] = create,
        rng: random.Random | None = None,
    ) -> None:
        self.config = config
        self.events = EventHub()
        self.lines: dict[str, Line] = {}
        self.recorders: dict[str, Recorder] = {}
        self._bodies: dict[str, Body] = {}
        self._groups: dict[str, Group] = {}
        self._robots: dict[str, Robot] = {}
        self._polls: list[asyncio.Task[None]] = []
        self._defining = asyncio.Lock()
        self.watch = LoopWatch()
        self.watch.on_held = self._was_held
        self.admission = Admission(self.watch)
        for line in config.lines:
            port = self._open_port(line, open_transport)
            if line.robot is not None:
                self._add_robot(line, line.robot, port, rng)
            else:
                self._add_line(line, port, rng)
        self.moves = Moves(self._publish_move)
        self.stops = Stops(self.events, self.groups_of)
        self.scans = Scans(self.events)
        self.robot_moves = RobotMoves()
        self._end = WindDown(self)
        for built in self.ports().values():
            built.admission = self.admission
            built.recorder = self.recorders[built.id]

    # life

    async def start(self) -> None:
        """Open the lines; ports that are missing are tried again and again."""
        for port in self.ports().values():
            port.start()
        with acting(POLL):
            self._polls = [
                *(asyncio.create_task(watch(robot), name=f"watch {robot.id}") for robot in self.robots()),
                *(
                    asyncio.create_task(
                        BodyWatch(body, self.stops.on_line).run(), name=f"watch {body.address}"
                    )
                    for body in self.bodies()
                ),
                *(
                    asyncio.create_task(self._watch_groups(line), name=f"watch the groups of {line.id}")
                    for line in self.lines.values()
                ),
            ]

    async def wind_down(self) -> None:
        """Let nothing begin any more, stop what would never end, and name what still moves, within seconds.

        Reads and stops go on until the lines are closed.
        """
        await self._end.done()

    def hurry(self) -> None:
        """Wait for nothing longer than a stop takes to be written."""
        self._end.hurry()

    async def close(self) -> None:
        """End all work. What `on_exit` leaves moving runs on in the controllers; nothing more is sent."""
        await self.wind_down()
        self.watch.close()
        for poll in self._polls:
            poll.cancel()
        await asyncio.gather(*self._polls, return_exceptions=True)
        await self.stops.close()
        for robot in self.robots():
            await robot.close()
        for line in self.lines.values():
            await line.close()
        await self.scans.close()
        await self.moves.close()
        await self.robot_moves.close()
        for recorder in self.recorders.values():
            await asyncio.to_thread(recorder.close)

    def _open_port(self, line: settings.Line, open_transport: Callable[[str], Transport]) -> Transport:
        file = (
            TraceFile(line.trace_file, line.trace_file_bytes, line.trace_files) if line.trace_file else None
        )
        self.recorders[line.id] = recorder = Recorder(line.trace_entries, file)
        port = open_transport(line.address)
        return Recorded(port, recorder) if line.trace_entries or line.trace_file else port

    def _add_robot(
        self, line: settings.Line, it: settings.Robot, port: Transport, rng: random.Random | None
    ) -> None:
        built = FicsLine(
            line.id,
            port,
            it.id,
            mode=line.mode,
            terminator=line.terminator,
            reply_timeout_s=line.reply_timeout_s,
            late_reply_s=line.late_reply_s,
            rng=rng,
        )
        units = [
            UnitAxes(it.id, unit.number, list(unit.axes), list(unit.motor_axes or unit.axes), unit.systems)
            for unit in it.units
        ]
        self._robots[it.id] = Robot(
            it.id, it.name or "", built, units, self._publish_robot, poll_interval_s=line.poll_interval_s
        )

    def _add_line(self, line: settings.Line, port: Transport, rng: random.Random | None) -> None:
        built = Line(
            line.id,
            port,
            [body.number for body in line.bodies],
            {group.number: [int(member, 16) for member in group.members] for group in line.groups},
            introducer=line.introducer,
            reply_timeout_s=line.reply_timeout_s,
            late_reply_s=line.late_reply_s,
            interject_stops=line.stop_mode == "interject",
            rng=rng,
        )
        built.gate.add(lambda exchange, _: self._flash_while_moving(built, exchange))
        built.gate.add(lambda exchange, _: self._motion_while_stopping(built, exchange))
        built.gate.add(lambda exchange, now: self._motion_to_a_lost_place(built, exchange, now))
        built.on_message = lambda frame: self._on_message(built, frame)
        built.on_change = lambda what, facts: self._on_change(built, what, facts)
        self.lines[line.id] = built
        for it in line.bodies:
            body = Body(
                built,
                it.number,
                it.name or "",
                it.units,
                position_tolerance=it.position_tolerance,
                poll_interval_s=line.poll_interval_s,
                power=Power(it.power_comment, it.needs_origin),
            )
            body.on_news = partial(self._on_news, body)
            self._bodies[body.address] = body
        for group in line.groups:
            members = [self._bodies[f"{line.id}.{member}"] for member in group.members]
            self._add_group(Group(built, group.number, members))

    def _add_group(self, group: Group) -> None:
        group.on_strangers = partial(self._on_strangers, group)
        self._groups[group.address] = group

    # finding

    def ports(self) -> dict[str, Line | FicsLine]:
        """The lines of both protocols, by their ids in the order of the configuration."""
        ports = {robot.line.id: robot.line for robot in self.robots()} | self.lines
        return {line.id: ports[line.id] for line in self.config.lines}

    def port(self, line_id: str) -> Line | FicsLine:
        """Find a line of either protocol.

        :raises NotFound: there is none of this id.
        """
        ports = self.ports()
        if line_id not in ports:
            raise NotFound(f"There is no line {line_id}; {_there_are(ports)}.")
        return ports[line_id]

    def line(self, line_id: str) -> Line:
        """Find a line with bodies.

        :raises NotFound: there is none of this id.
        :raises InvalidRequest: it leads to a robot.
        """
        port = self.port(line_id)
        if not isinstance(port, Line):
            raise InvalidRequest(
                f"Line {line_id} leads to a robot and has no bodies; nothing was sent.",
                "GET /robots lists the robots, with their lines.",
            )
        return port

    def bodies(self) -> list[Body]:
        """All bodies, in the order of the configuration."""
        return list(self._bodies.values())

    def bodies_of(self, line: Line) -> list[Body]:
        """The bodies of one line, in the order of the configuration."""
        return [body for body in self.bodies() if body.line is line]

    def robots(self) -> list[Robot]:
        """All robots, in the order of the configuration."""
        return list(self._robots.values())

    def robot(self, robot_id: str) -> Robot:
        """Find a robot.

        :raises NotFound: there is none of this id.
        """
        if robot_id not in self._robots:
            raise NotFound(f"There is no robot {robot_id}; {_there_are(self._robots)}.")
        return self._robots[robot_id]

    def groups(self) -> list[Group]:
        """All groups."""
        return list(self._groups.values())

    def groups_of(self, body: Body) -> list[Group]:
        """The groups a body is in."""
        return [group for group in self._groups.values() if body in group.members]

    def body(self, address: str) -> Body:
        """Find a body by `3F`, if only one line has it, or by `LINE.3F`; lower case will do.

        :raises NotFound: no line has it.
        :raises Ambiguous: several lines have it.
        """
        return _find(self._bodies, self.lines, address, "body")

    def group(self, address: str) -> Group:
        """Find a group by `80`, if only one line has it, or by `LINE.80`.

        :raises NotFound: no line has it.
        :raises Ambiguous: several lines have it.
        """
        return _find(self._groups, self.lines, address, "group")

    async def define_group(self, address: str, members: list[str], name: str = "") -> Group:
        """Define a virtual body at the link master (XVS), in the order of the members.

        :raises GatewayError: the members are not on one line, or one moves, or the link master refused.
        """
        home = address.rpartition(".")[0]
        bodies = [self.body(f"{home}.{it}" if home and "." not in it else it) for it in members]
        if len(bodies) < 2 or len(set(bodies)) < len(bodies):
            raise InvalidRequest("A group has at least two members, each once; nothing was sent.")
        line = bodies[0].line
        number = _group_number(address, line)
        if any(body.line is not line for body in bodies):
            raise InvalidRequest("All members of a group are on one line; nothing was sent.")
        group = Group(line, number, bodies, name)
        async with self._defining:
            await self._define(group, self._groups.get(group.address))
            self._add_group(group)
        return group

    @staticmethod
    async def _define(group: Group, old: Group | None) -> None:
        """From the first word to the link master on, nothing but stops is sent to the number."""
        for body in (*group.members, *(old.members if old else ())):
            if body.move is not None:
                raise BodyBusy(
                    f"{body.address} is moving; nothing was sent.", "Wait for the end of its move."
                )
        if old is not None:
            old.in_force = False
            group.line.cancel(lambda it: it.body == old.number and it.lane is not Lane.STOP, old.redefined())
        try:
            await group.line.define_group(group.number, [body.number for body in group.members])
        except GatewayError:  # refused, not sent, or about to be undone; whoever is cancelled does not know
            if old is not None:
                old.in_force = True
            raise

    # news

    def _publish_move(self, kind: str, body: Body, move: Move) -> str:
        return self.events.publish(kind, f"/bodies/{body.address}", move, correlation=move.id).cursor

    def _publish_robot(self, kind: str, subject: str, data: dict[str, Any], correlation: str | None) -> str:
        return self.events.publish(kind, subject, data, correlation).cursor

    def _on_message(self, line: Line, frame: MoveEnded | StatusChanged | UnknownMessage) -> None:
        if isinstance(frame, UnknownMessage):
            self.events.publish("line.message", f"/lines/{line.id}", {"frame": frame.text})
            return
        body = self._bodies.get(f"{line.id}.{frame.body:02X}")
        subject = f"/bodies/{line.id}.{frame.body:02X}"
        if isinstance(frame, StatusChanged):
            self.events.publish("body.controller_event", subject, dict(frame.fields))
        elif body is None:
            self.events.publish("body.end_frame", subject, {"command": frame.code, "cause": frame.cause})
        else:
            self.moves.ended(body, frame)

    def _on_change(self, line: Line, what: str, facts: dict[str, object]) -> None:
        number = facts.pop("body", None)
        if number is None:
            self._line_changed(line, what)
            self.events.publish(what, f"/lines/{line.id}", facts)
            return
        address = f"{line.id}.{number:02X}"
        if what == "body.offline" and address in self._bodies:
            body = self._bodies[address]
            if facts["asked"]:
                body.fell_silent()
            else:
                body.out_of_sight()
        if what == "body.online" and address in self._bodies:
            self._bodies[address].look_due.set()
            self.stops.in_reach_again(self._bodies[address])
        self.events.publish(what, f"/bodies/{address}", facts)

    def _line_changed(self, line: Line, what: str) -> None:
        """What happens while a line is down is known only when its bodies have been asked."""
        for body in self.bodies_of(line):
            if what == "line.down":
                body.out_of_sight()
            elif what == "line.up":
                self.stops.in_reach_again(body)
                if body.moving is None:
                    body.look_due.set()

    def _on_news(self, body: Body, kind: str, facts: dict[str, object]) -> None:
        self.events.publish(kind, f"/bodies/{body.address}", facts)

    def _on_strangers(self, group: Group, numbers: set[int]) -> None:
        """The link master means others by the group than we do: who has obeyed may move now."""
        strangers = [f"{group.line.id}.{number:02X}" for number in sorted(numbers)]
        for address in strangers:
            if address in self._bodies:
                self._bodies[address].may_move()
        group.line.counters["strangers_in_groups"] += 1
        self.events.publish("group.strangers", f"/groups/{group.address}", {"bodies": strangers})
        group.line.set_up_again(f"{', '.join(strangers)} obeyed group {group.short}")

    def _was_held(self, seconds: float) -> None:
        """What has waited while the loop was held for long is not sent any more, and nothing is believed."""
        suspended = seconds > SUSPENDED_S
        log.warning(
            "the gateway was suspended or held up for %.1f s%s",
            seconds,
            "; what waited is cancelled, and all lines are fenced" if suspended else "",
        )
        self.events.publish(
            "gateway.loop.held", SUBJECT, {"seconds": round(seconds, 3), "cancelled": suspended}
        )
        if not suspended:
            return
        for port in self.ports().values():
            port.revoke(HeldUp)
            port.fence()
        for body in self.bodies():
            body.may_move()
        for robot in self.robots():
            robot.was_left_alone()

    # rules and watching

    def _flash_while_moving(self, line: Line, exchange: RorzeExchange) -> GatewayError | None:
        """A flash command holds up the line for 1.5 s: not while anything moves there, or may move."""
        if not exchange.command.takes_s:
            return None
        code, bodies = exchange.command.code, self.bodies_of(line)
        moving = [body.address for body in bodies if body.moving]
        if moving:
            return BodyBusy(f"{', '.join(moving)} moves; {code} was not sent.", "Wait for standstill.")
        unread = [body.address for body in bodies if body.moving is None and body.online]
        if unread:
            return BodyBusy(
                f"Whether {', '.join(unread)} moves is not known yet; {code} was not sent.",
                "Try again when the status has been read.",
            )
        return None

    def _motion_while_stopping(self, line: Line, exchange: RorzeExchange) -> GatewayError | None:
        """Until a stop is confirmed nothing is sent that could move the motor again."""
        if exchange.command.effect is not Effect.MOTION:
            return None
        numbers = line.groups.get(exchange.body, [exchange.body])
        stopping = [
            body.address
            for body in self.bodies_of(line)
            if body.number in numbers and self.stops.under_way(body)
        ]
        if not stopping:
            return None
        return Cancelled(
            f"The stop of {', '.join(stopping)} is not confirmed yet; nothing was sent.",
            "Wait for standstill.",
        )

    def _motion_to_a_lost_place(self, line: Line, exchange: RorzeExchange, now: float) -> GatewayError | None:
        """A motion to a place is written only where the place is what it was when it was asked for."""
        if not needs_place(exchange.command):
            return None
        numbers = line.groups.get(exchange.body, [exchange.body])
        for body in self.bodies_of(line):
            if body.number in numbers:
                refusal = body.power.refuses_write(body.address, exchange.command, now)
                if refusal is not None:
                    return refusal
        return None

    async def _watch_groups(self, line: Line) -> None:
        """Notice that the link master has restarted by the groups it has forgotten."""
        while True:
            await asyncio.sleep(HEALTH_POLL_S)
            for group in [it for it in self.groups() if it.line is line]:
                if line.state != "ready" or not any(member.online for member in group.members):
                    continue
                try:
                    await group.ask(GetControllerStatus())
                except (NoReply, ControllerRefused):
                    line.set_up_again(f"group {group.short} does not answer")
                    break
                except GatewayError:
                    continue


def _group_number(address: str, line: Line) -> int:
    text = address.removeprefix(f"{line.id}.")
    try:
        number = int(text, 16) if len(text) == 2 else -1
    except ValueError:
        number = -1
    if not FIRST_GROUP <= number <= LAST_GROUP:
        raise InvalidRequest(f"{address} is no group number: they go from 80 to 9E; nothing was sent.")
    return number


T = TypeVar("T", Body, Group)


def _find(things: dict[str, T], lines: Iterable[str], address: str, what: str) -> T:
    line_id, _, short = numbered_address(address).rpartition(".")
    wanted = [line_id] if line_id else lines
    found = [things[key] for line in wanted if (key := f"{line}.{short}") in things]
    if not found:
        raise NotFound(f"There is no {what} {address} in the configuration; nothing was sent.")
    if len(found) > 1:
        names = [thing.address for thing in found]
        raise Ambiguous(
            f"Several lines have {what} {short}: {', '.join(names)}; nothing was sent.",
            f"Say which {what} is meant: {' or '.join(names)}.",
        )
    return found[0]


def _there_are(names: Collection[str]) -> str:
    return f"there {'is' if len(names) == 1 else 'are'} {', '.join(names) or 'none'}"
