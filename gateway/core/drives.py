"""Drives: controllers with one motor each, one on a line, whose status tells all that they do.

A family of them brings its rows, its line and what a status means; the moves, jogs and stops stand here.
"""

import asyncio
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from typing import Any, ClassVar, Final, Generic, NamedTuple, Self, TypeVar

from pydantic import Field

from gateway.core.controllers import Controllers
from gateway.core.errors import BodyBusy, GatewayError, NotSent
from gateway.core.event_types import EventType, LeftMoving, lease_types, move_types, news_types
from gateway.core.events import Event
from gateway.core.exchange import Exchange, Lane
from gateway.core.family import Site, Watch
from gateway.core.jogs import Jog, Jogging, JogNews, JogOutOfReach, JogOver, Jogs
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState
from gateway.core.move_record import RESTARTED, START_WITHIN_S, MoveRecord, MoveStatus
from gateway.core.move_runs import Found, Motion, MoveRun, MoveRuns, found
from gateway.core.operation import Rows, taking
from gateway.core.origin import new_id
from gateway.core.records import Record
from gateway.core.rights import Right
from gateway.core.stops import (
    RECORD_WITHIN_S,
    BilingualReport,
    StopMode,
    Stopping,
    StopsOfOne,
    StopState,
)
from gateway.core.supervisor import Deed
from gateway.core.targets import BegunMoves, CommandReplies, Opened, Stopped, Target, stopped
from gateway.core.verdicts import MOTOR, AtRest, Begun, Place, Power, Told, VerdictWords
from gateway.texts import Text, text
from protocols.table import Effect

TARGET: Final = 0
"""The target of all that is asked of a drive: it is alone on its line."""
POLL_S: Final = 0.1
"""Seconds between the questions to a drive that moves."""
WATCH_S: Final = 1.0
"""Seconds between the questions to a drive that stands still."""


class Status(NamedTuple):
    """A drive's own report of its state."""

    runs: bool
    """True while it moves."""
    place: int
    newest: int
    """The number of the newest motion that it has taken."""
    life: int
    """Number of times that the drive was switched on."""
    stopped: bool = False
    """True if a stop has ended its last motion."""
    alarm: int = 0
    """The code of what is wrong; 0 where nothing is."""


class DriveNow(Record):
    """A drive, as far as is known."""

    drive_id: str
    online: bool
    moving: bool | None
    alarm: int = Field(description="Alarm code of the drive; 0 if there is no alarm.")

    @classmethod
    def of(cls, drive: "Drive") -> Self:
        """Tell it without asking the drive."""
        return cls(drive_id=drive.id, online=drive.online, moving=drive.moving, alarm=drive.alarm)


class DriveMove(MoveRecord):
    """A move of a drive."""

    number: int = Field(description="Number of the move's command.")
    start: int | None = Field(default=None, description="Position of the drive before the move.")
    life: int | None = Field(
        default=None, description="Number of times that the drive had been switched on before."
    )
    target: int | None = Field(default=None, description="Position that the move was to reach, if known.")
    end_cause: str | None = None


class DriveStopReport(BilingualReport):
    """Progress of a drive's stop."""

    drive_id: str
    state: StopState = "requested"
    detail: str | None = None


class DriveJog(Jog):
    """A drive that jogs, or has jogged."""

    drive_id: str


class Drive(Target):
    """A drive on its line: what is known of it, and how it moves, jogs and stops."""

    jog_rows: ClassVar[Sequence[type]]
    """The rows whose motion lasts only as long as heartbeats come."""

    def __init__(self, family: "Drives[Any]", drive_id: str, line: LineDriver[Any, Any, Any]) -> None:
        self.id = self.address = drive_id
        self.path = f"/{family.collections[0]}/{drive_id}"
        self.line, self.moves, self.log = line, family.moves, family.moves.log
        self.kind, self._publish = family.kind, family.site.events.publish
        self.move: DriveMove | None = None
        self.told: Status | None = None
        """Last status of the drive; None before the first."""
        self.stops, self.jogs = DriveStops(self), DriveJogs(self)
        line.on_change = self._line_changed

    # what a family adds

    @abstractmethod
    def exchange(self, command: Any, lane: Lane) -> Exchange[Any, Any, Any]:
        """Build the exchange of a command, admitted now; its reply is one record."""

    @abstractmethod
    def number_of(self, exchange: Any) -> int:
        """The number by which its status names a motion."""

    @abstractmethod
    def target_of(self, command: Any) -> int | None:
        """Give the end of a motion; None if it cannot be known."""

    @abstractmethod
    async def status(self) -> Status:
        """Ask it, before all that others want.

        :raises GatewayError: it did not tell.
        """

    halt: ClassVar[Any]
    """The command that stops it."""

    # what it is now

    @property
    def online(self) -> bool:
        """True if the drive can be asked, as far as is known."""
        return self.line.state in (LineState.READY, LineState.OUT_OF_STEP)

    @property
    def moving(self) -> bool | None:
        """True while the drive moves, as far as is known; None if unknown."""
        if self.told is None or not self.online:
            return None
        return self.told.runs or (self.move is not None and self.move.status is not MoveStatus.QUEUED)

    @property
    def alarm(self) -> int:
        """The code that it told last; 0 where nothing is wrong."""
        return 0 if self.told is None else self.told.alarm

    @property
    def moves_under_way(self) -> list[str]:
        """The id of its move that is not over."""
        return [] if self.move is None else [self.move.id]

    def _line_changed(self, what: str, facts: dict[str, object]) -> None:
        self._publish(what, f"/lines/{self.line.id}", facts)

    def tell(self, news: str, record: Record) -> Event:
        """Publish news of it."""
        correlation = getattr(record, "id", None)
        return self._publish(f"{self.kind}.{news}", self.path, record.model_dump(mode="json"), correlation)

    async def look(self) -> Status:
        """Ask what it does; an alarm is told when it is new. Errors as of `status`."""
        before, self.told = self.told, await self.status()
        if self.told.alarm and (before is None or before.alarm != self.told.alarm):
            self.tell("alarm", DriveNow.of(self))
        return self.told

    async def stands_still(self) -> bool:
        """Ask the drive whether it stands still."""
        with suppress(GatewayError):
            return not (await self.look()).runs
        return False

    async def comes_to_rest(self, meanwhile: Callable[[], object] = lambda: None) -> None:
        """Return when it stands still; `meanwhile` is done as often as it was not seen to."""
        while True:
            if await self.stands_still():
                return
            await asyncio.sleep(POLL_S)
            meanwhile()

    async def watch(self) -> None:
        """Ask it now and then."""
        while True:
            await asyncio.sleep(WATCH_S)
            if self.online and self.move is None:
                await self.stands_still()

    def closing(self) -> tuple[Deed, ...]:
        """End its jogs and stops, and close the line."""
        return self.jogs.close, self.stops.close, self.line.close

    # asked for

    async def ask(self, command: Any) -> CommandReplies:
        """Send a command that starts no motion; errors as of `LineDriver.reply_to`."""
        reads = command.effect is Effect.READ
        if not reads:
            self.line.require_fit()
        reply = await self.line.reply_to(self.exchange(command, Lane.READ if reads else Lane.COMMAND))
        return CommandReplies((reply,), asyncio.get_running_loop().time())

    async def start(self, command: Any, start_within_s: float = START_WITHIN_S) -> BegunMoves | Opened:
        """Start a move, or a jog.

        :raises GatewayError: it was refused, or not sent.
        """
        self.line.require_fit()
        if self.move is not None or self.stops.is_unconfirmed or self.jogs.is_under_way:
            raise BodyBusy(f"{self.id} has not come to rest; nothing was sent.", "Try again when it has.")
        if isinstance(command, tuple(self.jog_rows)):
            jog = await self.jogs.start(command)
            return Opened(f"{self.path}/jogs/{jog.id}", jog)
        return BegunMoves(self.path, [await self.moves.start(self, command, start_within_s)])

    def claim(self, move: DriveMove) -> None:
        """Let no other move begin."""
        self.move = move

    def release(self) -> None:
        """Let another move begin."""
        self.move = None

    async def stop(self, mode: StopMode) -> Stopped:
        """Stop it; the stop is queued before anything is awaited."""
        return await stopped(self.path.split("/")[1], asyncio.gather(self.stops.stop(mode)))

    def send_halt(self, on_written: Callable[[float], None] | None = None) -> "asyncio.Future[Any]":
        """Queue a stop ahead of everything; errors as of `LineDriver.queue`."""
        exchange = self.exchange(self.halt, Lane.STOP)
        exchange.on_written = on_written
        return self.line.queue(exchange)


class _DriveStop(Stopping):
    """The stop of a drive, repeated until it says that it stands still."""

    one_at_a_time = True

    def __init__(self, drive: Drive, mode: StopMode) -> None:
        report = DriveStopReport(drive_id=drive.id)
        super().__init__(mode, report, drive.line, lambda news, _: drive.tell(news, report))
        self._drive = drive
        self._reasons = (text("stops.motor-not-at-rest"),)

    def _send_stop(self) -> "asyncio.Future[Any]":
        return self._drive.send_halt(self.note_written)

    async def _see(self) -> Sequence[Text]:
        """Ask the drive: it moves, or does not tell."""
        return () if await self._drive.stands_still() else (text("stops.motor-not-at-rest"),)


class DriveStops(StopsOfOne[_DriveStop]):
    """The stops of a drive."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive.id, partial(_DriveStop, drive))
        self._drive = drive

    def _before(self) -> Sequence[Callable[[], object]]:
        drive = self._drive
        return partial(drive.line.forbid, {TARGET}), partial(drive.jogs.take_all, JogNews.STOP)

    async def _record(self, _: _DriveStop) -> None:
        if self._drive.move is not None:
            await self._drive.moves.wait(self._drive.move.id, RECORD_WITHIN_S)


class DriveJogs(Jogs[DriveJog, None]):
    """The jogs of a drive."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(lambda news, session: drive.tell(f"jog.{news}", session.jog))
        self._drive = drive

    async def start(self, command: Any) -> DriveJog:
        """Start to jog; errors as of `LineDriver.reply_to`, and JogOver if it was stopped meanwhile."""
        drive, jog = self._drive, DriveJog(drive_id=self._drive.id)
        session = Jogging(jog, drive.id, drive.line, None)
        exchange = drive.exchange(command, Lane.COMMAND)
        exchange.expires_at = asyncio.get_running_loop().time() + START_WITHIN_S
        exchange.on_written = lambda _: self._begin(session)
        try:
            await drive.line.reply_to(exchange)
        except GatewayError as error:
            if jog.id in self._sessions:
                self._take(session, JogNews.REFUSED if error.moved == "no" else JogNews.END)
            raise
        if not session.jogs:
            raise JogOver(session.what, jog)
        return jog

    def _require_in_reach(self, _: object) -> None:
        if not self._drive.online:
            raise JogOutOfReach(self._drive.id, "its motor")

    def _stop(self, _: object) -> None:
        with suppress(GatewayError):  # it is repeated until it is seen to stand still
            self._drive.send_halt()

    async def _rests(self, _: object) -> None:
        await self._drive.comes_to_rest()

    async def _see_still(self, session: Jogging[DriveJog, None]) -> bool:
        await self._drive.comes_to_rest(partial(self._stop, session))
        return True


class DriveRun(MoveRun[DriveMove, Status]):
    """A move of a drive."""

    controller = "the drive"

    def __init__(self, drive: Drive, move: DriveMove) -> None:
        super().__init__(drive.moves, move, drive, drive.line, drive.id, POLL_S)
        self.drive = drive

    def _was_refused(self, error: GatewayError, /) -> bool:
        return self.move.status is MoveStatus.SENT and not isinstance(error, NotSent)

    async def _look(self) -> Status | None:
        return await self._answer_to(self.drive.look)

    async def _finding(self, seen: Status, /) -> Found:
        return found(finding_of(self.move, seen), self._doubt, position=seen.place)

    def _words(self) -> VerdictWords:
        sending = f"{self.move.command} was sent to {self.who}"
        return MOTOR._replace(who=self.who, sending=sending, target=self.move.target, lost="has lost")


@dataclass(eq=False)
class DriveMotion(Motion[DriveRun, None]):
    """A motion command of a drive."""

    exchange: Exchange[Any, Any, Any]

    async def _prepare(self) -> None:
        """Ask where the drive stands."""
        [run] = self.runs
        before = await run.drive.look()
        run.move.start, run.move.life = before.place, before.life

    async def _write(self, _: None, expires_at: float) -> Mapping[DriveRun, object]:
        """Send the motion; errors as of `LineDriver.reply_to`."""
        [run] = self.runs
        self.exchange.expires_at, self.exchange.on_written = expires_at, self.was_written
        return {run: await run.line.reply_to(self.exchange)}


class DriveMoves(MoveRuns[DriveMove]):
    """All moves of all drives of a family."""

    async def start(self, drive: Drive, command: Any, start_within_s: float) -> DriveMove:
        """Send a motion, and give its move when the drive has taken it; errors as of `_begin`."""
        now, exchange = datetime.now(UTC), drive.exchange(command, Lane.COMMAND)
        move = DriveMove(
            id=new_id(now),
            body_id=drive.id,
            command=command.code,
            frame=exchange.frame.hex(" "),
            created_at=now,
            number=drive.number_of(exchange),
            target=drive.target_of(command),
        )
        await self._begin(DriveMotion([DriveRun(drive, move)], exchange), start_within_s)
        return move

    def take_over(self, drive: Drive, move: DriveMove, *, begun: bool, since: str = RESTARTED) -> None:
        """Go on with a move of an earlier life: ask the drive, and follow the move to its end."""
        self._go_on(DriveRun(drive, move), since, begun=begun)


def finding_of(move: DriveMove, told: Status) -> AtRest:
    """Turn the status of a drive at rest into a finding: it names the newest motion that it has taken."""
    is_taken, is_there = told.newest == move.number, told.place == move.target
    if not is_taken:
        place = Place.START
    elif move.target is None:
        place = Place.WITHOUT_TARGET
    else:
        place = Place.TARGET if is_there else Place.ELSEWHERE
    ends = Told.ALARM if told.alarm else Told.STOP if told.stopped else Told.NOTHING
    return AtRest(
        ends if is_taken else Told.NOTHING,
        Power.KEPT if move.life in (None, told.life) else Power.LOST,
        begun=Begun.SEEN if is_taken else Begun.IN_DOUBT,
        place=place,
    )


D = TypeVar("D", bound=Drive)


class Drives(Controllers[D], Generic[D]):
    """A family of drives."""

    moves: DriveMoves
    now = DriveNow
    move_records = (DriveMove,)

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self.moves = DriveMoves(lambda news, drive, move: drive.tell(f"move.{news}", move))

    def target(self, _collection: str, names: Sequence[str]) -> Target:
        """Find a drive; errors as of `find`."""
        return self.find("/".join(names))

    def watches(self, line: Any) -> Iterator[Watch]:
        """Look after the drive on a line."""
        yield self.on_line(line).watch


def drive_types(kind: str, path: str) -> Sequence[EventType]:
    """The types of the events of drives of a kind."""
    return (
        *move_types(kind, path, DriveMove),
        *lease_types(kind, path),
        *news_types(
            f"{kind}.jog",
            path,
            DriveJog,
            started="it jogs",
            stopping="it is told to stop, and may still move",
            ended="the jog was ended by request, or it came to rest, and the motor stands still",
            lost="its heartbeat stayed away, and the motor stands still",
            stopped="a stop or the end of the gateway has ended it, and the motor stands still",
        ),
        *news_types(
            f"{kind}.stop",
            path,
            DriveStopReport,
            requested="a stop is being sent until it stands still",
            confirmed="it stands still",
            unconfirmed="it was not seen to stand still in time",
        ),
        EventType(f"{kind}.alarm", path, DriveNow, "it tells that something is wrong"),
        EventType(
            f"{kind}.left_moving", path, LeftMoving, "the gateway ends, and it moves as far as is known"
        ),
    )


def jog_rows(path: str, drive: type[Drive]) -> Rows:
    """The operations that keep a jog of drives of a kind, and end it."""
    rows, jogs = Rows("jogs"), f"{path}/jogs/{{jog_id}}"

    async def keep(target: Drive, jog_id: str) -> DriveJog:
        return target.jogs.heartbeat(jog_id)

    async def end(target: Drive, jog_id: str) -> DriveJog:
        return await target.jogs.end(jog_id)

    kind, told = path.split("/")[1], {"target": drive, "jog_id": str}
    over, stopping = "The motor was seen to stand still.", "It may still move: the stop is repeated."
    rows.add(
        "POST",
        f"{jogs}/heartbeat",
        Right.OPERATE,
        taking(keep, **told),
        name=f"keep_jogging_of_{kind}",
        result=DriveJog,
    )
    rows.add(
        "POST",
        f"{jogs}/stop",
        Right.STOP,
        taking(end, **told),
        name=f"end_jog_of_{kind}",
        result=DriveJog,
        over=over,
        stopping=stopping,
    )
    return rows
