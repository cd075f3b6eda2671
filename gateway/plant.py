"""The plant: the configured lines with all that is on them, found by their addresses, and their life."""

import asyncio
import logging
import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

from gateway import logbook
from gateway.access.territory import PlantAccess, Territory
from gateway.causes import CONFIGURED_ANEW, LINE_DOWN, UNUSABLE, causes_of
from gateway.commissionings import Commissioning, Commissionings
from gateway.config import Config
from gateway.config_file import ConfigFile, changes
from gateway.core import tables
from gateway.core.addresses import none_such
from gateway.core.admission import SUSPENDED_S, Admission, LoopWatch
from gateway.core.alarms import Alarms, Latched
from gateway.core.backup_record import Reading
from gateway.core.backups import Backups, Comparisons
from gateway.core.errors import BodyBusy, HeldUp, NotFound
from gateway.core.events import EventHub
from gateway.core.exchange import Exchange
from gateway.core.family import AnyLine, Family, PortInfo, Registered, Site, Watch
from gateway.core.gate import Guard
from gateway.core.journal.journal import Journal
from gateway.core.journal.opening import OpenedJournal
from gateway.core.leases import End, Lease, Leases, LeaseTokens, Tokens
from gateway.core.line import LineOwnership
from gateway.core.move_log import MoveLog
from gateway.core.move_record import MoveRecord
from gateway.core.names import Names
from gateway.core.origin import POLL, Origin, acting
from gateway.core.parts import GATEWAY, Part
from gateway.core.supervisor import Deed, Observers, do_each, do_in_turn, insist, supervise
from gateway.core.targets import Target
from gateway.core.works import DurableJobs, Jobs
from gateway.families import Packages
from gateway.logbook import Figures
from gateway.membership import Membership
from gateway.memory import Persistence
from gateway.ownership import LOST, Ownership
from gateway.port_scans import PortScans
from gateway.recordings import REQUESTS_BYTES, STATES_BYTES, Noted, RecordedSpan, RecordingInfo, Recordings
from gateway.security import entries
from gateway.security.log import Burst, SecurityLog
from gateway.snapshot import taking
from gateway.wind_down import WindDown
from protocols.wording import as_given
from transports import Transport, create
from transports.recorder import History, Recorded, Recorder
from transports.trace_file import TraceFile

log = logging.getLogger(__name__)

ALARMS_CHECK_S = 5.0
OF_ALARMS = ""
"""The watch of alarms, among those of lines."""

F = TypeVar("F", bound=Registered)


@dataclass(frozen=True)
class Peers:
    """Other gateways of the plant: which of them has which line, and how this one belongs to them."""

    ownership: Ownership
    membership: Membership | None
    """This gateway as a member of a plant; None without one."""


@dataclass(slots=True)
class PlantWorks:
    """Long work on the whole of controllers and lines."""

    backups: Backups
    comparisons: Comparisons
    recordings: Recordings
    port_scans: PortScans
    commissionings: Commissionings
    nightly_backups: Path | None = None
    """The folder of backups that are read by night; None where none are."""

    def all(self) -> Iterable[Jobs[Any]]:
        """All kinds, in the order in which they end."""
        return self.port_scans, self.commissionings, self.backups, self.comparisons, self.recordings


@dataclass(slots=True)
class PlantHistory:
    """Records of what has happened: the traffic of lines, requests of callers, states of parts, counts."""

    figures: Figures
    recorders: dict[str, Recorder] = field(default_factory=dict)
    requests: History[Noted] = field(default_factory=lambda: History[Noted](REQUESTS_BYTES))
    states: History[Noted] = field(default_factory=lambda: History[Noted](STATES_BYTES))


@dataclass(slots=True)
class ServedLines:
    """The lines that are served, and the tasks that watch them."""

    open_transport: Callable[[str], Transport]
    ports: dict[str, AnyLine] = field(default_factory=dict)
    """Lines by their ids, in the order of the configuration."""
    watches: dict[str, list["asyncio.Task[None]"]] = field(default_factory=dict)
    on_change: Observers[[]] = field(default_factory=lambda: Observers[[]]("other lines"))
    """Called when other lines are served."""


class Plant:
    """All lines of a configuration. `open_transport` is replaced by tests that have no ports."""

    def __init__(
        self,
        config: Config,
        *,
        open_transport: Callable[[str], Transport] = create,
        rng: random.Random | None = None,
        lease_tokens: Tokens | None = None,
        file: ConfigFile | None = None,
        journal: OpenedJournal | None = None,
        security: SecurityLog | None = None,
        owners_in: Path | None = None,
    ) -> None:
        self.config = config
        self.file = file
        """File of the configuration, if it comes from one."""
        self.events = EventHub()
        self.names = Names()
        self.names.on_named = self._positions_named
        self.peers = Peers(
            Ownership(
                "" if config.plant is None else config.plant.name,
                {line.id: line.owners for line in config.lines},
                owners_in,
            ),
            None if config.plant is None else Membership(config.plant.name),
        )
        self.peers.ownership.on_loss = self._line_taken_over
        self.admission = Admission(LoopWatch())
        self.admission.watch.on_held = self._was_held
        site = Site(self.events, allow_endless_moves=config.server.allow_endless_moves, rng=rng)
        self.packages = Packages(site)
        registered = self.packages.registered
        self.served = ServedLines(open_transport)
        self.access = PlantAccess(
            security or SecurityLog(),
            Leases(config.access.lease_mode, lease_tokens or LeaseTokens()),
            Territory(self.served.ports, registered),
            self.peers.ownership,
        )
        self._hear_of_access()
        self.events.take_snapshot = taking(registered, self.served.ports)
        troubles = {
            "gateway.journal.trouble": self._journal_trouble,
            "gateway.security.trouble": lambda: self.access.security.trouble,
            "gateway.refusals.burst": lambda: self.access.security.burst,
            "plant.unreachable": lambda: None if (of := self.peers.membership) is None else of.trouble,
        }
        causes = causes_of(registered, self.served.ports, troubles, latch=config.server.latch)
        self.alarms = Alarms(self.events, causes)
        self._memory = (
            None
            if journal is None
            else Persistence(journal, self.events, self.alarms, registered, site.known)
        )
        self.history = PlantHistory(Figures(self.line_of))
        self.works = PlantWorks(
            backups=Backups(partial(self._publish_reading, "backup")),
            comparisons=Comparisons(partial(self._publish_reading, "comparison")),
            recordings=self._recordings(),
            port_scans=PortScans(self.events, lambda: self.config, open_transport),
            commissionings=Commissionings(),
        )
        self.events.listeners += [self.history.figures.note, logbook.note, self.alarms.note]
        self.events.listeners += [self.works.recordings.note] if self.works.recordings.takes_alarms else []
        self._reloading = asyncio.Lock()
        self._end = WindDown(
            site, self.admission, registered, self.served.ports.values(), config.server.on_exit
        )
        for line in config.lines:
            self._build(line)

    def _hear_of_access(self) -> None:
        security, leases = self.access.security, self.access.leases
        security.on_trouble = self._security_trouble
        security.on_burst = self._refusals_burst
        leases.on_taken += [self._tell_lease_taken, self._note_lease_taken]
        leases.on_end += [self._tell_lease_ended, self._note_lease_ended]
        leases.on_loss = self._stop_without_holder

    def _build(self, line: tables.LineTable) -> None:
        port = self._open_port(line)
        built = self.packages.families[line.protocol].add(line, port)
        built.admission = self.admission
        built.recorder = self.history.recorders[built.id]
        built.owner = LineOwnership(
            partial(self.peers.ownership.stands_by, line.id),
            partial(self.peers.ownership.elsewhere, line.id),
            partial(self._port_lost, line.id),
        )
        built.gate.add(self.access.leases.guard(built.id))
        if self.config.server.latch:
            built.gate.add(self._latch(built))
        if self._memory is not None:
            self._memory.keep(built)
        for extension in self.packages.extensions:
            for table in self.config.made()[extension.collections[0]]:
                if table.line == line.id:
                    extension.make(table)
        self.served.ports[line.id] = built

    @property
    def journal(self) -> Journal | None:
        """Where what has an effect is written down, if anywhere."""
        return None if self._memory is None else self._memory.journal

    def _open_port(self, line: tables.LineTable) -> Transport:
        file = (
            TraceFile(line.trace_file, line.trace_file_bytes, line.trace_files) if line.trace_file else None
        )
        history_bytes = self.config.recordings.memory_mib << 20
        self.history.recorders[line.id] = recorder = Recorder(line.trace_entries, file, history_bytes)
        port = self.served.open_transport(line.address)
        return Recorded(port, recorder) if line.trace_entries or line.trace_file else port

    # life

    async def start(self) -> None:
        """Open the lines; ports that are missing are tried again and again."""
        self.access.security.note(entries.GATEWAY_STARTED)
        if self._memory is not None:
            self._memory.start(self._works())
        for line_id in self.served.ports:
            self._start(line_id)
        with acting(POLL):
            self.works.recordings.salvage()
            self._watch(OF_ALARMS, "the watch of alarms", [self._watch_alarms])

    def _works(self) -> dict[str, DurableJobs[Any]]:
        works: dict[str, DurableJobs[Any]] = {}
        for package in self.packages.registered:
            works |= package.works()
        return works

    def _start(self, line_id: str) -> None:
        line, what = self.served.ports[line_id], f"a watch of line {line_id}"
        line.start()
        watches = list(self._family_of(line_id).watches(line))  # all, or a fault has begun none
        with acting(POLL):
            self._watch(line_id, what, watches)

    def _watch(self, key: str, what: str, watches: Sequence[Watch]) -> None:
        self.served.watches[key] = [supervise(what, watch) for watch in watches]

    async def _unwatch(self, line_id: str) -> None:
        watches = self.served.watches.pop(line_id, [])
        for watch in watches:
            watch.cancel()
        await asyncio.gather(*watches, return_exceptions=True)

    def commission(self, line_id: str) -> Commissioning:
        """Lend the port of a line to questions about it; errors as of `port` and `Commissionings.start`."""
        line, recorder = self.port(line_id), self.history.recorders[line_id]
        table = next(line for line in self.config.lines if line.id == line_id)
        return self.works.commissionings.start(
            line,
            table,
            lambda address: Recorded(self.served.open_transport(address), recorder),
            self._busy_on(line_id),
        )

    async def reload(self, config: Config) -> None:
        """Serve the lines of another configuration; those that are in it as they were go on undisturbed.

        Errors as of `require_rest`.

        :raises ShuttingDown, HeldUp: nothing begins now.
        """
        async with self._reloading:
            self.admission.require()
            what = "the reload of the configuration"
            gone = self.require_rest(config)
            wanted = {line.id: line for line in config.lines}
            found = changes(self.config, config)
            served = self.config.model_copy(update={"lines": config.lines, **config.made()})
            await do_in_turn(
                what,
                *(partial(self.served.ports[line_id].retire, CONFIGURED_ANEW) for line_id in gone),
                *(partial(self._removing, line_id) for line_id in gone),
            )
            self.config = served
            do_each(
                what,
                *(partial(self._add, wanted[line_id]) for line_id in wanted.keys() - self.served.ports),
                partial(self._in_order, wanted),
                self.access.territory.forget,
                self.served.on_change,
                partial(self.events.publish, "gateway.reloaded", GATEWAY, found),
            ).or_raise()

    def _add(self, line: tables.LineTable) -> None:
        if line.id not in self.served.ports:  # a fault may have met only its start
            self._build(line)
        self._start(line.id)

    def _in_order(self, wanted: Iterable[str]) -> None:
        """Put the lines into the order of the configuration; one that a fault has met can be loaded again."""
        for line_id in (line_id for line_id in wanted if line_id in self.served.ports):
            self.served.ports[line_id] = self.served.ports.pop(line_id)

    def require_rest(self, config: Config) -> Sequence[str]:
        """Make sure that nothing moves on the lines that another configuration would close; gives their ids.

        :raises BodyBusy: something does, or is at work; nothing was changed.
        """
        gone = self._gone(config)
        for line_id in gone:
            if busy := self._busy_on(line_id):
                raise BodyBusy(
                    f"Line {line_id} would be closed, and {', '.join(busy)} moves or is at work; "
                    "nothing was changed.",
                    "Stop it, or wait for its end; then reload again.",
                )
        return gone

    def busy(self, config: Config) -> list[str]:
        """Addresses that move or work on the lines that another configuration would close."""
        return [address for line_id in self._gone(config) for address in self._busy_on(line_id)]

    def _gone(self, config: Config) -> list[str]:
        wanted = config.served()
        return [line_id for line_id, served in self.config.served().items() if wanted.get(line_id) != served]

    def _busy_on(self, line_id: str) -> list[str]:
        family = self._family_of(line_id)
        moving = [seen.subject.rpartition("/")[2] for seen in family.left_moving()]
        there = {part.address for part in map(self._part, moving) if part.line_id == line_id}
        commissioned = (
            [] if self.works.commissionings.current(line_id) is None else [f"the port of {line_id}"]
        )
        line = self.served.ports[line_id]
        at_work = (
            address for package in (family, *self.packages.extensions) for address in package.at_work(line)
        )
        return sorted({*there, *at_work, *commissioned})

    def _part(self, address: str) -> Part:
        """Find the part that a whole address means; if it was removed, only its line is known."""
        return next(iter(self.access.territory.parts(address)), Part(address.partition(".")[0], address))

    def _removing(self, line_id: str) -> tuple[Deed, ...]:
        """Name what closes a line for good: a retired line serves no request, whatever is left of it."""
        family, line = self._family_of(line_id), self.served.ports[line_id]
        return (
            partial(self._unwatch, line_id),
            partial(family.removing, line),
            *(partial(extension.forget, line) for extension in self.packages.extensions),
            partial(asyncio.to_thread, self.history.recorders.pop(line_id).close),
            partial(self.served.ports.pop, line_id),
        )

    async def wind_down(self) -> None:
        """Let nothing begin any more, stop what would never end, and name what still moves, within seconds.

        Reads and stops go on until the lines are closed.
        """
        await do_in_turn("the end of the gateway", self._end.done)

    def hurry(self) -> None:
        """Wait for nothing longer than a stop takes to be written."""
        self._end.hurry()

    async def close(self) -> None:
        """End all work.

        Motors that `on_exit` leaves moving run on in the controllers; nothing more is sent.
        """
        what = "the end of the plant"
        unwatching = (partial(self._unwatch, line_id) for line_id in list(self.served.watches))
        await do_in_turn(
            what,
            self.wind_down,
            *(work.close for work in self.works.all()),
            self._stop_looking,
            *unwatching,
            *(package.closing for package in self.packages.registered),
            *(partial(asyncio.to_thread, recorder.close) for recorder in self.history.recorders.values()),
            self.access.security.close,
        )
        if self._memory is not None:
            await self._memory.close()

    async def _stop_looking(self) -> None:
        """Raise no alarm any more, and look neither for holds nor for leases that are over."""
        self.alarms.closed = True
        self.admission.watch.close()
        self.access.leases.close()
        await self._unwatch(OF_ALARMS)

    async def take_over(self, line_id: str, old: str) -> None:
        """Have a line from now on: what was its owner is thrown out by the terminal server as this connects.

        :raises NotSent: that cannot be written down; nothing has changed.
        """
        epoch = self.peers.ownership.take(line_id)
        told = {
            "reason": f"a person has taken it over from {old}",
            "owner": self.peers.ownership.name,
            "epoch": epoch,
        }
        self.events.publish("line.owned", f"/lines/{line_id}", told)
        do_each(f"the moves that {old} has begun", partial(self._go_on_with_moves, line_id, old))

    def moves_under_way(self, line_id: str) -> list[MoveRecord]:
        """The moves on a line that are not over."""
        moves = (move for log in self._move_logs() for move in log.under_way())
        return [move for move in moves if self._part(move.body_id).line_id == line_id]

    def _move_logs(self) -> list[MoveLog[Any]]:
        return [log for package in self.packages.registered for log in package.move_logs()]

    def _go_on_with_moves(self, line_id: str, old: str) -> None:
        """Follow what the last owner has begun, as after a restart."""
        moves, logs = self.peers.ownership.left_by(line_id, old), self._move_logs()
        there = [move for move in moves if self._part(move["body_id"]).line_id == line_id]
        new = [move for move in there if not any(move["id"] in log for log in logs)]
        since = f"gateway {self.peers.ownership.name} took the line over from {old}"
        for package in self.packages.registered:
            package.resume(new, {move["id"] for move in new}, since)

    def _port_lost(self, line_id: str) -> None:
        """A line with a spare is not opened again by itself: who has taken it over would be thrown out."""
        owner = self.peers.ownership.of(line_id)
        if owner is not None and owner.gateway == self.peers.ownership.name:
            self.peers.ownership.lose(line_id)
            self._tell_taken_over(line_id, LOST)

    def _line_taken_over(self, line_id: str, why: str) -> None:
        if line_id in self.served.ports:
            self._tell_taken_over(line_id, why)
            self.served.ports[line_id].hand_over(why)

    def _tell_taken_over(self, line_id: str, why: str) -> None:
        owner = self.peers.ownership.of(line_id)
        if owner is not None:
            told = {"reason": why, "owner": owner.gateway, "epoch": owner.epoch}
            self.events.publish("line.taken_over", f"/lines/{line_id}", told)

    def _journal_trouble(self) -> str | None:
        return None if self.journal is None else self.journal.trouble

    def _security_trouble(self, why: str | None) -> None:
        if why is None:
            self.events.publish("gateway.security.recovered", GATEWAY, {})
        else:
            self.events.publish("gateway.security.trouble", GATEWAY, {"reason": why})

    def _refusals_burst(self, burst: Burst) -> None:
        self.events.publish("gateway.refusals.burst", GATEWAY, asdict(burst))

    def _positions_named(self, address: str, names: Mapping[int, str]) -> None:
        told = {str(number): name for number, name in names.items()}
        self.access.security.note(entries.POSITION_NAMED, address, names=told)

    async def _watch_alarms(self) -> None:
        """Note which causes are over, and raise what no event tells: a line that never was up."""
        while True:
            await asyncio.sleep(ALARMS_CHECK_S)
            self.alarms.note_ends()
            for port in self.served.ports.values():
                if port.state in UNUSABLE and port.trouble is not None:
                    self.alarms.find(LINE_DOWN, f"/lines/{port.id}", reason=port.trouble)

    def _was_held(self, seconds: float) -> None:
        """Cancel commands that waited while the loop was held for long, and fence all lines."""
        suspended = seconds > SUSPENDED_S
        log.warning(
            "the gateway was suspended or held up for %.1f s%s",
            seconds,
            "; what waited is cancelled, and all lines are fenced" if suspended else "",
        )
        what, told = "the time after a suspension", {"seconds": round(seconds, 3), "cancelled": suspended}
        tell = partial(self.events.publish, "gateway.loop.held", GATEWAY, told)
        if not suspended:
            tell()
            return
        forgetting = (
            deed for port in self.served.ports.values() for deed in (partial(port.revoke, HeldUp), port.fence)
        )
        stopping = (family.was_left_alone for family in self.packages.families.values())
        insist(what, tell, self.access.leases.expire, *forgetting, *stopping)

    def _tell_lease_taken(self, subject: str, lease: Lease) -> None:
        self.events.publish(f"{_what(subject)}.lease.taken", subject, lease)

    def _note_lease_taken(self, _: str, lease: Lease) -> None:
        self.access.security.note(entries.LEASE_TAKEN, lease.scope, lease=lease.lease, ttl_s=lease.ttl_s)

    def _tell_lease_ended(self, subject: str, lease: Lease, why: End) -> None:
        self.events.publish(f"{_what(subject)}.lease.{why}", subject, lease)

    def _note_lease_ended(self, _: str, lease: Lease, why: End) -> None:
        kind, by = entries.LEASE_ENDS[why], "gateway" if why == "expired" else None
        self.access.security.note(kind, lease.scope, caller=by, lease=lease.lease, holder=lease.holder)

    def _stop_without_holder(self, lease: Lease, parts: Sequence[Part]) -> None:
        """Stop what would never end without the holder of a lease; moves go on to their ends."""
        what = f"the end of {lease.lease}"
        with acting(Origin(f"gateway: {what}")):
            ends = (
                partial(family.end_motion, everything=False, within=parts)
                for family in self.packages.families.values()
            )
            insist(what, *ends)

    def _recordings(self) -> Recordings:
        registered, journal, wanted = self.packages.registered, self.journal, self.config.recordings
        taken = RecordedSpan(
            events=self.events,
            recorders=self.history.recorders,
            requests=self.history.requests,
            states=self.history.states,
            configuration=self._recorded_configuration,
            trajectories=lambda: (
                trajectory for source in registered for trajectory in source.trajectories()
            ),
            line_of=self._line_that_has,
            read_journal=(lambda *_: ()) if journal is None else journal.disk.read_apart,
        )
        recordings = Recordings(taken, wanted.disk_mib << 20, wanted.before_alarm_s, wanted.after_alarm_s)
        recordings.on_end = self._publish_recording
        return recordings

    def _publish_recording(self, record: RecordingInfo) -> None:
        self.events.publish(f"gateway.recording.{record.status}", GATEWAY, record, correlation=record.id)

    def _recorded_configuration(self, lines: Sequence[str]) -> dict[str, Any]:
        """Configuration for a replay: the lines and the parts on them, without keys, hosts or files."""
        config = self.config
        return {
            "server": config.server.model_dump(include={"latch", "allow_endless_moves", "on_exit"}),
            "lines": [
                line.model_dump(mode="json", exclude_unset=True, exclude={"trace_file"})
                for line in config.lines
                if line.id in lines
            ],
            **{
                key: [
                    thing.model_dump(mode="json", exclude_unset=True) for thing in made if thing.line in lines
                ]
                for key, made in config.made().items()
            },
        }

    def _line_that_has(self, name: str) -> str | None:
        """The line of a subject or of an address; None of what is about no line."""
        collection, *named = name.strip("/").split("/") if name.startswith("/") else ("", name)
        if collection in ("gateway", "events"):
            return None
        return self._part("/".join(named)).line_id

    def _publish_reading(self, noun: str, what: str, reading: Reading) -> None:
        kind = f"{_what(reading.target)}.{noun}.{what}"
        self.events.publish(kind, reading.target, reading, correlation=reading.id)

    # finding

    def family(self, kind: Callable[..., F]) -> F:
        """All controllers of one kind, or all that an extension has made; `kind` is a class, or a base."""
        return self.packages.of(cast("type[F]", kind))

    def ports(self) -> dict[str, AnyLine]:
        """All lines, by their ids in the order of the configuration."""
        return dict(self.served.ports)

    def port(self, line_id: str) -> AnyLine:
        """Find a line.

        :raises NotFound: there is none of this id.
        """
        if line_id not in self.served.ports:
            raise none_such("line", line_id, self.served.ports, "GET /lines lists them.")
        return self.served.ports[line_id]

    def info(self, line_id: str) -> PortInfo:
        """Tell the state of a line; errors as of `port`."""
        told = self._family_of(line_id).info(self.port(line_id))
        if (owner := self.peers.ownership.of(line_id)) is not None:
            told["owner"] = {"gateway": owner.gateway, "epoch": owner.epoch}
        return told

    def line_of(self, subject: str) -> str:
        """The line of what events are about, by their subject."""
        return self._part(subject.split("/")[2]).line_id

    def _family_of(self, line_id: str) -> Family:
        self.port(line_id)
        return next(self.packages.families[line.protocol] for line in self.config.lines if line.id == line_id)

    def target(self, path: str) -> Target:
        """Find what commands are addressed to, such as `/bodies/3F`, `/robots/r1/units/1` or `/lines/arm`.

        :raises GatewayError: there is no such thing, or several, or it takes no commands.
        """
        collection, *names = path.removeprefix("/").split("/")
        if collection == "lines":
            return self._family_of(names[0]).link_of(names[0])
        for package in self.packages.registered:
            if collection in package.collections:
                return package.target(collection, names)
        raise NotFound(f"There is no {as_given(path)}; nothing was sent.")

    def require_unlatched(self, address: str) -> None:
        """Refuse to move what alarms keep from moving, where the configuration lets them.

        :raises Latched: an alarm of one of its parts stands, or one of the gateway itself.
        """
        refusal = self._latched(address)
        if refusal is not None:
            raise refusal

    def _latched(self, address: str) -> Latched | None:
        if not self.config.server.latch:
            return None
        parts = self.access.territory.parts(address)
        return self.alarms.latched([GATEWAY.removeprefix("/"), *(part.address for part in parts)])

    def _latch(self, line: AnyLine) -> Guard[Any]:
        """Make the guard of a line's gate: an alarm may have come while a motion waited for its turn."""

        def guard(exchange: Exchange[Any, Any, Any], _: float) -> Latched | None:
            starts = exchange.command.starts_motion
            return self._latched(line.address_of(exchange.target)) if starts else None

        return guard

    def addresses(self) -> set[str]:
        """All addresses by which events can be wanted."""
        return {address for package in self.packages.registered for address in package.addresses()}


def _what(subject: str) -> str:
    """Give the kind of a path: `body` for `/bodies/line1.3F`."""
    kind = subject.split("/")[1]
    return {"bodies": "body"}.get(kind, kind.removesuffix("s"))
