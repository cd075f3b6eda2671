"""RC-420 bodies behind RC-400 link masters: all of a plant, with their groups, moves, stops and scans."""

from collections.abc import Awaitable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Annotated, Any, ClassVar, Final, Literal, NamedTuple, Protocol, TypeVar

from pydantic import Field

from gateway.core.addresses import fits, none_such
from gateway.core.alarms import Cause
from gateway.core.backup_record import Reading, Restore
from gateway.core.errors import Ambiguous, InvalidRequest, NotFound
from gateway.core.events import Event
from gateway.core.family import (
    Family,
    MayMove,
    PortInfo,
    Seen,
    Site,
    TargetKind,
    Watch,
    facts_of,
    in_doubt,
    is_within,
    why_it_moves,
)
from gateway.core.jogs import JogNews
from gateway.core.marks import DETAIL
from gateway.core.move_log import MoveLog
from gateway.core.move_record import RESTARTED, Move, MoveStatus
from gateway.core.operation import DocumentSection, RouteWords
from gateway.core.origin import RESTART, acting
from gateway.core.parts import Part, numbered_address
from gateway.core.restores import Restores
from gateway.core.sampler import Sampler
from gateway.core.stops import StopMode
from gateway.core.supervisor import Deed, do_each
from gateway.core.targets import Stopped, Target, stopped
from gateway.core.works import DurableJobs
from gateway.rorze import (
    captures,
    config,
    curves,
    encoders,
    memories,
    patterns,
    settings,
    signals,
    speed_sets,
)
from gateway.rorze.alarms import causes
from gateway.rorze.asked_body import AskedBody
from gateway.rorze.backup_restore import BodyRestore
from gateway.rorze.bodies import Body, Configured, Group
from gateway.rorze.body_watch import BodyWatch, watch_events, watch_groups
from gateway.rorze.event_types import TYPES
from gateway.rorze.groups import Groups, planned_group
from gateway.rorze.guards import Guards
from gateway.rorze.jogs import BodyJogs
from gateway.rorze.line import Line
from gateway.rorze.live import BodyNow, PositionSource, SignalSource
from gateway.rorze.move_requests import BodyJog
from gateway.rorze.moves import Moves
from gateway.rorze.positions import PositionReadings, TableUploads
from gateway.rorze.power import BodyPower, PowerMark
from gateway.rorze.probes import Health, Sweep
from gateway.rorze.program_runs import ProgramRun, ProgramRuns
from gateway.rorze.program_uploads import ProgramUpload, ProgramUploads
from gateway.rorze.scans import Scans
from gateway.rorze.session import RorzeExchange
from gateway.rorze.stops import StopReport, Stops
from gateway.rorze.stored_program import EndlessPrograms
from gateway.rorze.targets import STOP_MODES, BodyTarget, GroupTarget, LinkMasterTarget
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.errors import lookup
from protocols.rorze.link import MoveEnded, StatusChanged, UnknownMessage, program_text
from protocols.rorze.link_master import SetGroup
from protocols.rorze.row import MODE_NAMES, LinkMasterCommand
from transports.base import Transport

BodyId = Annotated[
    str,
    Field(
        description="Two hex digits, 00-77, with the line's id where several lines have it: 3F or arm.3F.",
        examples=["3F"],
    ),
]
GroupId = Annotated[
    str,
    Field(
        description="Two hex digits, 80-9E, with the line's id where several lines have it: 80 or arm.80.",
        examples=["80"],
    ),
]
UNATTENDED: Final = ("continuous", "jog")
"""Moves that must not go on when the gateway ends, or has ended: nothing else would stop them."""
BODY = TargetKind("/bodies/{body_id}", Move, listed=True)
LINE = TargetKind("/lines/{line_id}", tag="line commands", listed=True)
GROUP = TargetKind(
    "/groups/{group_id}", Move, suffix="_to_group", members=True, tag="group commands", listed=True
)


class LineInfo(PortInfo):
    """A line: one port with an RC-400 and the bodies behind it."""

    protocol: Literal["rorze"]
    controllers: Annotated[str, Field(description="Answer of the link master to XID.")]
    stop_mode: Annotated[
        config.StopTiming,
        Field(
            description="Moment of a stop: at the next frame boundary, or after the reply under way.",
            json_schema_extra=DETAIL,
        ),
    ]
    strict: Annotated[
        bool,
        Field(
            description="A reply came twice here lately: an acknowledgement counts only when a fence before "
            "and one after it have shown that it was no copy."
        ),
    ]
    bodies: list[str]
    offline: Annotated[list[str], Field(description="Bodies that do not answer.")]
    groups: list[str]


class Listener(Protocol):
    """An extension made of several bodies, which hears of them before any caller waits for their moves."""

    def advanced(self, body: Body, move: Move) -> None:
        """A move has changed its status."""

    def announced(self, body: Body, frame: MoveEnded) -> None:
        """The link master has announced the end of a move."""

    def fell_silent(self, body: Body) -> None:
        """It does not answer any more."""


class ServedLine(NamedTuple):
    """A line with its configuration, and the time that the gateway takes on it for itself."""

    line: Line
    table: config.RorzeLineTable
    health: Health
    sweep: Sweep
    """Asks many of its bodies at once."""


class Rorze(Family):
    """All lines with RC-400s, and what is on them."""

    line_table = config.RorzeLineTable
    line_info = LineInfo
    now = BodyNow
    move_records = (Move,)
    collections = ("bodies", "groups")
    event_types = TYPES
    controllers = "RORZE RC-420 motion controllers behind RC-400 link masters"
    told_when_up: ClassVar = {
        "controllers": (str | None, Field(None, description="Answer of an RC-400 to XID."))
    }
    told_of_ports = "an RC-400 with which bodies"
    told_of_stops = "`decelerate` is command 5SS, `immediate` is 5IS (RC-420 manual 14)"
    stop_report = StopReport
    sections = (
        DocumentSection(
            "bodies", "RC-420 controllers: what they are, where they stand, and their state.", "moves", True
        ),
        DocumentSection(
            "positions", "The table of positions that a body keeps, as JSON and as CSV.", "lines", True
        ),
        DocumentSection("groups", "Bodies that one frame reaches together.", "lines", True),
        DocumentSection(
            "inputs and outputs",
            "Inputs, outputs, sensors and error outputs of a body, by their names.",
            "backups",
        ),
        DocumentSection("captures", "Positions that a body takes down when an input changes.", "backups"),
        DocumentSection(
            "body settings",
            "What a body keeps: settings, homing, encoder, speed sets, patterns with their curves.",
            "backups",
        ),
        DocumentSection("programs", "The user program of a body: upload, run, and its memories.", "backups"),
        DocumentSection(
            "commands",
            "Every command of the RC-420 manual to a body, under the name that `GET /commands` lists.",
        ),
        DocumentSection("group commands", "The commands of the RC-420 manual to all members of a group."),
        DocumentSection("line commands", "The commands to the link master of a line (RC-400)."),
    )
    names: ClassVar = {"body_id": BodyId, "group_id": GroupId}
    words: ClassVar = {
        GROUP.path: RouteWords(
            over="All moves are over; `status` says how each ended.", begun="The moves are under way."
        )
    }
    commands = tuple(
        (place, row)
        for place in (BODY, LINE, GROUP)
        for row in COMMANDS.values()
        if issubclass(row, LinkMasterCommand) is (place is LINE)
    )
    stop_modes = STOP_MODES
    rows = (
        settings.ROWS,
        encoders.ROWS,
        speed_sets.ROWS,
        patterns.ROWS,
        curves.ROWS,
        signals.ROWS,
        captures.ROWS,
        memories.ROWS,
    )
    things: ClassVar = {
        **dict.fromkeys((Body, AskedBody), lambda rorze, body_id: rorze.body(body_id)),
        Group: lambda rorze, group_id: rorze.group(group_id),
    }

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self.lines: dict[str, Line] = {}
        self._bodies: dict[str, Body] = {}
        self._groups = Groups(self._on_strangers)
        self._served: dict[str, ServedLine] = {}
        self.moves = Moves(
            self._publish_move,
            allow_endless_moves=site.allow_endless_moves,
            on_trajectory=self._way_changes,
        )
        self.stops = Stops(site.events, self._groups.of, self.sweep_of)
        self.listeners: list[Listener] = []
        self.jogs = BodyJogs(self.moves, self.stops, self._publish_jog)
        self.stops.on_begin = self.jogs.body_stops
        self.scans = Scans(site.events)
        self.endless = EndlessPrograms(allowed=site.allow_endless_moves)
        self.uploads = ProgramUploads(self._publish_upload, self.endless)
        self.runs = ProgramRuns(self._publish_run, self.body, self.endless)
        self.restores: Restores[BodyRestore] = Restores(self._publish_restore)
        self.position_readings = PositionReadings(partial(self._publish_positions, "position_reading"))
        self.position_uploads = TableUploads(partial(self._publish_positions, "position_upload"))

    # building

    def add(self, table: config.RorzeLineTable, port: Transport) -> Line:
        """Build a line with its bodies and groups."""
        line = Line(
            table.id,
            port,
            [body.number for body in table.bodies],
            {group.number: [int(member, 16) for member in group.members] for group in table.groups},
            introducer=table.introducer,
            reply_timeout_s=table.reply_timeout_s,
            late_reply_s=table.late_reply_s,
            interject_stops=table.stop_mode == "interject",
            half_commands=table.half_commands,
            port_baud=table.port_baud,
            rng=self.site.rng,
        )
        line.on_message = partial(self._on_message, line)
        line.on_change = partial(self._on_change, line)
        line.note_proofs(partial(self.stops.others_prove, line))
        self.lines[line.id] = line
        for body_table in table.bodies:
            self._add_body(line, table, body_table)
        Guards(
            line,
            self.bodies_of(line),
            self.stops.under_way,
            self.uploads.keeps_out,
            self._amid_a_restore,
            self.endless.refuses_start,
        )
        sweep = Sweep(line, self.bodies_of(line), table.sweep_numbers, partial(self._groups.on, line))
        line.ask_groups = sweep.look_for_silent
        for own in sweep.own:
            self._groups.look_after(own)
        self._served[line.id] = ServedLine(line, table, Health(line, table.health_share), sweep)
        for group in table.groups:
            members = [self._bodies[f"{line.id}.{member}"] for member in group.members]
            self._groups.configure(Group(line, group.number, members))
        return line

    def _add_body(self, line: Line, table: config.RorzeLineTable, own: config.BodyTable) -> None:
        configured = Configured(
            own.name or "",
            own.units,
            own.input_names,
            own.output_names,
            own.position_tolerance,
            own.in_position,
            own.slow_pattern,
            table.poll_interval_s,
            own.events,
        )
        mark = PowerMark(own.power_comment)
        body = Body(
            line, own.number, configured, BodyPower(mark, own.needs_origin, own.silence_needs_acknowledgement)
        )
        body.on_news = partial(self._on_news, body)
        body.power.on_memory = self.site.known.keep(body.address, body.power)
        self._bodies[body.address] = body

    def removing(self, line: Line) -> tuple[Deed, ...]:
        """Close a line, and forget its bodies and groups."""
        return line.close, partial(self._forget, line)

    def _forget(self, line: Line) -> None:
        self._groups.forget(line)
        for body in self.bodies_of(line):
            del self._bodies[body.address]
        self.lines.pop(line.id, None)
        self._served.pop(line.id, None)

    def hold_group(self, line_id: str, number: int, members: Sequence[str], name: str) -> Group:
        """Give the group of a number that stands for bodies of a line, made where none is configured."""
        line = self.lines[line_id]
        group = self._groups.by_address.get(f"{line_id}.{number:02X}")
        if group is None:
            group = Group(line, number, [self._bodies[f"{line_id}.{member}"] for member in members], name)
            line.groups[number] = [member.number for member in group.members]
            self._groups.configure(group)
        return group

    # finding

    def sweep_of(self, line: Line) -> Sweep:
        """The questions to many bodies of a line at once."""
        return self._served[line.id].sweep

    def bodies(self) -> list[Body]:
        """All bodies, in the order of the configuration."""
        return list(self._bodies.values())

    def bodies_of(self, line: Line) -> list[Body]:
        """The bodies of one line, in the order of the configuration."""
        return [body for body in self.bodies() if body.line is line]

    def groups(self) -> list[Group]:
        """All groups."""
        return list(self._groups.by_address.values())

    def groups_of(self, body: Body) -> list[Group]:
        """The groups a body is in."""
        return self._groups.of(body)

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
        return _find(self._groups.by_address, self.lines, address, "group")

    def target(self, collection: str, names: Sequence[str]) -> Target:
        """Find a body or a group; errors as of `body` and `group`."""
        address = "/".join(names)
        if collection == "groups":
            return GroupTarget(self.group(address), self.moves, self.stops, self.endless)
        return BodyTarget(self.body(address), self.moves, self.stops, self.endless)

    def link_of(self, line_id: str) -> Target:
        """The link master of a line."""
        return LinkMasterTarget(self.lines[line_id], partial(self._define_as_told, line_id))

    def addresses(self) -> Iterator[str]:
        """Bodies and groups, with and without their lines."""
        things: list[Body | Group] = [*self.bodies(), *self.groups()]
        for thing in things:
            yield from (thing.address, thing.short)

    def seen(self) -> Iterator[Seen]:
        """Tell of all bodies."""
        return (Seen(body.line.id, body.address, BodyNow.of(body)) for body in self.bodies())

    def parts(self, address: str) -> Sequence[Part]:
        """A body, or the members of a group; a group that is not there yet is its line."""
        with suppress(NotFound):
            return [_part_of(self.body(address))]
        with suppress(NotFound):
            return parts_of(self.group(address))
        line_id = address.rpartition(".")[0].lower()
        return [Part(line_id, line_id)] if line_id in self.lines else []

    def parts_in_scope(self, name: str) -> Sequence[Part]:
        """The members that the configuration gives a group: defining it anew gives no caller more."""
        fitting = [members for address, members in self._groups.configured.items() if fits(name, address)]
        if len(fitting) == 1:
            return [_part_of(member) for member in fitting[0]]
        with suppress(NotFound, Ambiguous):
            return [_part_of(self.body(name))]
        return []

    def info(self, line: Line) -> LineInfo:
        """Tell the state of a line."""
        return {
            **facts_of(line),
            "protocol": "rorze",
            "controllers": line.controllers,
            "stop_mode": "interject" if line.interject_stops else "after_reply",
            "strict": line.strict,
            "bodies": [body.address for body in self._bodies.values() if body.line is line],
            "offline": [f"{line.id}.{number:02X}" for number in sorted(line.offline)],
            "groups": [group.address for group in self._groups.on(line)],
        }

    @classmethod
    def alarmed(cls) -> Sequence[str]:
        """Groups and bodies."""
        return "/groups/{group_id}", "/bodies/{body_id}"

    @classmethod
    def facts(cls, row: Row) -> list[str]:
        """Tell what stands on the row's page of the manual."""
        modes = ", ".join(f"{mode} ({MODE_NAMES[mode]})" for mode in row.modes)
        facts = [
            f"Command `{row.code}`; operating modes {modes}; "
            f"{'allowed' if row.moving else 'refused'} while the motor moves; "
            f"{'allowed' if row.program else 'not allowed'} in user programs; retry class `{row.retry}`.",
            f"Example: `{row.example[0]}`"
            + (f" is answered `{row.example[1]}`." if len(row.example) > 1 else "."),
        ]
        errors = [f"- 0x{code:02X}: {lookup(code, row.code).en}" for code in sorted(row.errors)]
        return [*facts, "Errors:\n\n" + "\n".join(errors)] if errors else facts

    @classmethod
    def is_dated(cls, _: Row) -> bool:
        """All its rows are answered."""
        return True

    # groups

    async def define_group(self, address: str, members: list[str], name: str = "") -> Group:
        """Define a virtual body at the link master (XVS), in the order of the members.

        :raises GatewayError: the members are not on one line, or one moves, or the link master refused.
        """
        address = numbered_address(address)
        home = address.rpartition(".")[0]
        bodies = [
            self.body(f"{home}.{member}" if home and "." not in member else member) for member in members
        ]
        group = planned_group(address, bodies, name)
        if group.number in self._served[group.line.id].table.sweep_numbers:
            raise InvalidRequest(
                f"{group.address} is among the numbers that the gateway keeps for itself; nothing was sent.",
                "Take another number, or change sweep_groups in the configuration.",
            )
        await self._groups.define(group)
        return group

    async def _define_as_told(self, line_id: str, command: SetGroup) -> None:
        members = [f"{line_id}.{member}" for member in command.members]
        await self.define_group(f"{line_id}.{command.group}", members)

    def causes(self) -> Iterator[Cause]:
        """Alarms of bodies."""
        return causes(self._bodies.get, self.lines.get)

    # over restarts

    def trajectories(self) -> Sequence[Any]:
        """The trajectories of the moves."""
        return self.moves.trajectories.all

    def move_logs(self) -> Iterator[MoveLog[Any]]:
        """That of all bodies."""
        yield self.moves.log

    def works(self) -> Mapping[str, DurableJobs[Any]]:
        """Positions and programs that were uploaded, programs that were run, and restores."""
        return {
            "position_upload": self.position_uploads,
            "program_upload": self.uploads,
            "program_run": self.runs,
            "body_restore": self.restores,
        }

    def resume(
        self, records: Sequence[Mapping[str, Any]], begun: Collection[str], since: str = RESTARTED
    ) -> None:
        """Take over the moves of bodies that are still configured."""
        own = [Move.model_validate(record) for record in records if record["body_id"] in self._bodies]
        self.moves.log.remember(own)
        for move in own:
            if not move.status.final:
                self._take_over(self._bodies[move.body_id], move, begun=move.id in begun, since=since)

    def _take_over(self, body: Body, move: Move, *, begun: bool, since: str) -> None:
        group = self._groups.by_address.get(move.group_id or "")
        own = None if group is None else group.position_tolerance
        tolerance = body.configured.position_tolerance if own is None else own
        self.moves.take_over(body, move, begun=begun, tolerance=tolerance, since=since)
        if move.kind in UNATTENDED and not move.status.final:
            with acting(RESTART):
                self.stops.stop([body], "decelerate")

    # life

    def watches(self, line: Line) -> Iterator[Watch]:
        """Look after the bodies and the groups of a line."""
        _, _, health, sweep = self._served[line.id]
        for body in self.bodies_of(line):
            yield BodyWatch(body, health, sweep, self.stops.on_line).run
            if body.configured.events is not None:
                yield partial(watch_events, body, body.configured.events)
        yield partial(watch_groups, health, sweep)
        yield self._sampler(line).run

    def _sampler(self, line: Line) -> Sampler:
        live, (_, table, _, sweep) = self.site.events.live, self._served[line.id]
        bodies = self.bodies_of(line)
        places = (PositionSource(body, sweep, live, table.move_samples_per_s) for body in bodies)
        signals = (SignalSource(body, sweep, live) for body in bodies)
        return Sampler(line, live, [*places, *signals], table.live_share)

    def _way_changes(self, body: Body) -> None:
        if self._served[body.line.id].table.move_samples_per_s:
            self.site.events.live.demand_changes()

    def at_work(self, line: Line) -> Iterator[str]:
        """The bodies to which a program is uploaded or a backup restored."""
        for body in self.bodies_of(line):
            if self.uploads.is_under_way(body) or self.restores.is_under_way(body.address):
                yield body.address

    def was_left_alone(self) -> tuple[Deed, ...]:
        """Name what stops what jogs, and has every body looked at."""
        return partial(self.jogs.end_all, JogNews.MISSED), *(body.may_move for body in self.bodies())

    def stop_all(self, mode: StopMode) -> Awaitable[Stopped]:
        """Stop all bodies."""
        own = [body for body in self.bodies() if not body.line.is_elsewhere()]
        return stopped("bodies", self.stops.stop(own, mode))

    # news

    def _publish_move(self, what: str, body: Body, move: Move) -> Event:
        publish = self.site.events.publish
        event = publish(f"body.move.{what}", f"/bodies/{body.address}", move, correlation=move.id)
        do_each(
            "the news of a move", *(partial(listener.advanced, body, move) for listener in self.listeners)
        )
        return event

    def _publish_jog(self, what: str, body: Body, jog: BodyJog) -> None:
        self.site.events.publish(f"body.jog.{what}", f"/bodies/{body.address}", jog, correlation=jog.id)

    def _publish_upload(self, what: str, upload: ProgramUpload) -> None:
        subject = f"/bodies/{upload.body_id}"
        self.site.events.publish(f"body.program.upload.{what}", subject, upload, correlation=upload.id)

    def _publish_positions(self, noun: str, what: str, reading: Reading) -> None:
        self.site.events.publish(f"body.{noun}.{what}", reading.target, reading, correlation=reading.id)

    def _publish_restore(self, what: str, restore: Restore) -> None:
        kind = "line" if restore.target.startswith("/lines/") else "body"
        publish = self.site.events.publish
        publish(f"{kind}.restore.{what}", restore.target, restore, correlation=restore.id)

    def _amid_a_restore(self, body: Body, exchange: RorzeExchange) -> bool:
        restored = self.restores.amid(body.address)
        return restored is not None and not restored.lets_pass(exchange)

    def _publish_run(self, what: str, run: ProgramRun) -> None:
        subject = f"/bodies/{run.body_id}"
        self.site.events.publish(f"body.program.{what}", subject, run, correlation=run.id)

    def _on_message(self, line: Line, frame: MoveEnded | StatusChanged | UnknownMessage) -> None:
        publish = self.site.events.publish
        if isinstance(frame, UnknownMessage):
            publish("line.message", f"/lines/{line.id}", {"frame": frame.text})
            if told := program_text(frame):
                publish("body.program.message", f"/bodies/{line.id}.{told.body:02X}", {"text": told.text})
            return
        body = self._bodies.get(f"{line.id}.{frame.body:02X}")
        subject = f"/bodies/{line.id}.{frame.body:02X}"
        if isinstance(frame, StatusChanged):
            publish("body.controller_event", subject, dict(frame.fields))
            if body is not None:
                body.reported(frame.fields)
        elif body is None:
            publish("body.end_frame", subject, {"command": frame.code, "cause": frame.cause})
        else:
            for listener in self.listeners:
                listener.announced(body, frame)
            self.moves.ended(body, frame)

    def _on_change(self, line: Line, what: str, facts: dict[str, object]) -> None:
        number = facts.pop("body", None)
        if number is None:
            self._line_changed(line, what)
            self.site.events.publish(what, f"/lines/{line.id}", facts)
            return
        address = f"{line.id}.{number:02X}"
        body = self._bodies.get(address)
        if body is not None and what == "body.offline":
            if facts["asked"]:
                body.fell_silent()
            else:
                body.out_of_sight()
            for listener in self.listeners:
                listener.fell_silent(body)
        if body is not None and what == "body.online":
            body.look_soon()
            self.stops.in_reach_again(body)
        self.site.events.publish(what, f"/bodies/{address}", facts)

    def _line_changed(self, line: Line, what: str) -> None:
        """Note that nothing is known of the bodies of a line that is down until they are asked."""
        for body in self.bodies_of(line):
            if what == "line.down":
                body.out_of_sight()
            elif what == "line.up":
                self.stops.in_reach_again(body)
                if body.moving is None:
                    body.look_soon()

    def _on_news(self, body: Body, kind: str, facts: dict[str, object]) -> None:
        self.site.events.publish(kind, f"/bodies/{body.address}", facts)

    def _on_strangers(self, group: Group, numbers: set[int]) -> None:
        """The link master knows other members of the group than the gateway: those may move now."""
        strangers = [f"{group.line.id}.{number:02X}" for number in sorted(numbers)]
        for address in strangers:
            if address in self._bodies:
                self._bodies[address].may_move()
        group.line.counters["strangers_in_groups"] += 1
        self.site.events.publish("group.strangers", f"/groups/{group.address}", {"bodies": strangers})
        group.line.set_up_again(f"{', '.join(strangers)} obeyed group {group.short}")

    # the end

    def end_motion(self, *, everything: bool, within: Sequence[Part] | None = None) -> tuple[Deed, ...]:
        """Name what stops what jogs or would never end, or everything that moves."""
        meant = (body for body in self.bodies() if is_within(body.line.id, body.address, within))
        must_end = partial(self._must_end, everything=everything)
        bodies = [body for body in meant if in_doubt(partial(must_end, body))]
        return (partial(self.stops.stop, bodies, "decelerate"),) if bodies else ()

    def _must_end(self, body: Body, *, everything: bool) -> bool:
        """True if the body is to be stopped at the end of the gateway, also where that cannot be told."""
        return bool(everything and body.moving) or self._never_ends(body)

    def _never_ends(self, body: Body) -> bool:
        """True if its last move must not go on unattended, and its end was not seen."""
        move = next(iter(self.moves.log.of(body.address, 1)), None)
        if move is None or move.kind not in UNATTENDED or move.sent_at is None:
            return False
        unseen = move.status in (MoveStatus.LOST, MoveStatus.UNKNOWN) and body.moving is not False
        return unseen or not move.status.final

    async def at_rest(self) -> None:
        """Wait for stops, and for refusals of moves."""
        await self.stops.confirmed()
        await self.moves.begun()

    def left_moving(self) -> Iterator[MayMove]:
        """Name the bodies that may move on."""
        for body in self.bodies():
            stopped = self.stops.unconfirmed(body) is not None
            why = why_it_moves(stopped=stopped, moving=body.moving, under_way=body.move is not None)
            if why is not None:
                move_id = None if body.move is None else body.move.id
                yield MayMove("body", f"/bodies/{body.address}", why, move_id)

    def letting_go(self) -> tuple[Deed, ...]:
        """End long work, and give the waiters for moves what is known now."""
        works = (work.close for work in self.works().values())
        return self.scans.close, self.position_readings.close, *works, self.moves.let_go

    def closing(self) -> tuple[Deed, ...]:
        """End all work and close the lines."""
        lines = (line.close for line in self.lines.values())
        return self.jogs.close, self.stops.close, *lines, self.scans.close, self.moves.close


T = TypeVar("T", Body, Group)


def _part_of(body: Body) -> Part:
    return Part(body.line.id, body.address)


def parts_of(group: Group) -> list[Part]:
    """Its members, as parts of the plant."""
    return [_part_of(member) for member in group.members]


def _find(things: dict[str, T], lines: Iterable[str], address: str, what: str) -> T:
    line_id, _, short = numbered_address(address).rpartition(".")
    wanted = [line_id] if line_id else lines
    found = [things[key] for line in wanted if (key := f"{line}.{short}") in things]
    if not found:
        listed = "GET /bodies" if what == "body" else "GET /groups"
        remedy = f"{listed} lists them; bodies have the numbers 00-77, groups 80-9E."
        raise none_such(what, address, things, remedy)
    if len(found) > 1:
        names = [thing.address for thing in found]
        raise Ambiguous(
            f"Several lines have {what} {short}: {', '.join(names)}; nothing was sent.",
            f"Say which {what} is meant: {' or '.join(names)}.",
        ).reservedly(
            f"Several lines have {what} {short}; nothing was sent.",
            f"Say which {what} is meant, with its line: LINE.{short}.",
        )
    return found[0]


FAMILY: Final = Rorze
