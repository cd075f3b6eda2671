"""Drives: controllers with one motor each, one on a line, whose status tells all that they do.

A family of them brings its rows, its line and what a status means; the moves, jogs and stops stand here.
"""

import asyncio
from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from typing import Any, ClassVar, Final, Generic, NamedTuple, Self, TypeVar

from pydantic import Field

from gateway.core.controllers import Controllers
from gateway.core.errors import BodyBusy, GatewayError, NoReply, NotSent, restarted_in_motion
from gateway.core.event_types import EventType, LeftMoving, lease_types, move_types, news_types
from gateway.core.events import Event
from gateway.core.exchange import Exchange, Lane
from gateway.core.family import Site, Watch
from gateway.core.jogs import Jog, Jogging, JogNews, JogOutOfReach, JogOver, Jogs
from gateway.core.journal.intents import OF_MOVES
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState
from gateway.core.move_record import RESTARTED, START_WITHIN_S, MoveRecord, MoveStatus
from gateway.core.move_runs import Beginning, MoveRuns, Silence
from gateway.core.next_calls import NextCall
from gateway.core.operation import Rows, taking
from gateway.core.origin import new_id, working
from gateway.core.records import Record
from gateway.core.rights import Right
from gateway.core.stops import (
    CONFIRM_WITHIN_S,
    RECORD_WITHIN_S,
    BilingualReport,
    StopMode,
    Stopping,
    StopPlan,
    StopState,
    StopsUnderWay,
)
from gateway.core.supervisor import Deed
from gateway.core.targets import BegunMoves, CommandReplies, Opened, Stopped, Target, stopped
from gateway.core.verdicts import (
    MOTOR,
    AtRest,
    Finding,
    Place,
    Power,
    Sight,
    Told,
    Unbegun,
    Unseen,
    judge,
)
from gateway.core.verdicts import Begun as Known
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

    moves: bool
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
        return self.told.moves or (self.move is not None and self.move.status is not MoveStatus.QUEUED)

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
            return not (await self.look()).moves
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

    def __init__(self, drive: Drive, mode: StopMode) -> None:
        self.report = DriveStopReport(drive_id=drive.id)
        super().__init__(mode, self.report, drive.line.admission.held_s)
        self._drive = drive
        self._stop: asyncio.Future[Any] | None = None

    def submit(self) -> None:
        """Send it, unless the last one still waits for its turn or its reply."""
        if self._stop is None or self._stop.done():
            super().submit()

    def _send_stop(self) -> "asyncio.Future[Any]":
        self._stop = self._drive.send_halt(self.note_written)
        return self._stop

    async def stands_still(self) -> bool:
        """Ask the drive."""
        return await self._drive.stands_still()

    def reply_count(self) -> int:
        """Replies on its line, which has no other drive."""
        return int(self._drive.line.counters["replies"])

    def why_not(self) -> Sequence[Text]:
        """Say why standstill is not proved: the drive moves, or does not tell."""
        return [text("stops.motor-not-at-rest")]

    def publish(self, what: str) -> None:
        """Tell how far it has come."""
        self._drive.tell(f"stop.{what}", self.report)


class DriveStops(StopsUnderWay[StopMode, _DriveStop]):
    """The stops of a drive."""

    def __init__(self, drive: Drive) -> None:
        super().__init__()
        self._drive = drive

    def stop(self, mode: StopMode) -> "asyncio.Task[DriveStopReport]":
        """Stop it; the report comes when it stands still, or after two seconds with what is known then."""
        [stop] = self._begun(partial(self._plan, mode))
        return asyncio.create_task(self._report(stop), name="stop report")

    def _plan(self, mode: StopMode) -> StopPlan[StopMode]:
        drive, running = self._drive, self._running.get(mode)
        begin = partial(self._begin_new, mode) if running is None else running.submit
        forbid, end_jogs = partial(drive.line.forbid, {TARGET}), partial(drive.jogs.take_all, JogNews.STOP)
        return (forbid, end_jogs, begin), (mode,)

    def _begin_new(self, mode: StopMode) -> None:
        self._begin(mode, _DriveStop(self._drive, mode), f"the stop of {self._drive.id}")

    async def _report(self, stop: _DriveStop) -> DriveStopReport:
        await asyncio.wait({self._tasks[stop]}, timeout=CONFIRM_WITHIN_S)
        return stop.report

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


class DriveMoves(MoveRuns[Drive, DriveMove]):
    """All moves of all drives of a family."""

    def _move_of(self, who: Drive) -> DriveMove | None:
        return who.move

    def _publish(self, news: str, who: Drive, move: DriveMove, /) -> Event:
        return who.tell(f"move.{news}", move)

    def _claim(self, who: Drive, move: DriveMove, /) -> None:
        who.move = move

    def _free(self, who: Drive) -> None:
        who.move = None

    def _calls(self, _: Drive, error: GatewayError, /) -> Sequence[NextCall]:
        return error.next

    async def start(self, drive: Drive, command: Any, start_within_s: float) -> DriveMove:
        """Send a motion, and give its move when the drive has taken it.

        :raises GatewayError: it was refused, or not sent.
        """
        loop, now = asyncio.get_running_loop(), datetime.now(UTC)
        exchange = drive.exchange(command, Lane.COMMAND)
        exchange.expires_at = loop.time() + start_within_s
        move = DriveMove(
            id=new_id(now),
            body_id=drive.id,
            command=command.code,
            frame=exchange.frame.hex(" "),
            created_at=now,
            number=drive.number_of(exchange),
            target=drive.target_of(command),
        )
        begun: Beginning = loop.create_future()
        refusal = await self._start([(drive, move)], partial(self._make, drive, move, exchange, begun), begun)
        if refusal is not None:
            raise refusal
        return move

    async def _make(
        self, drive: Drive, move: DriveMove, exchange: Exchange[Any, Any, Any], begun: Beginning
    ) -> None:
        """See it through: ask where it stands, send the motion, and follow it to its end."""
        OF_MOVES.set([move.id])
        exchange.on_written = lambda _: self.advance(drive, move, MoveStatus.SENT)
        doubt: NoReply | None = None
        try:
            before = await drive.look()
            move.start, move.life = before.place, before.life
            await drive.line.reply_to(exchange)
        except GatewayError as error:
            if move.status is MoveStatus.QUEUED or not isinstance(error, NoReply):
                unsent = isinstance(error, NotSent) or move.status is MoveStatus.QUEUED
                unbegun = Unbegun.WITHHELD if unsent else Unbegun.REFUSED
                self._end(drive, move, unbegun, error)
                begun.set_result(error)
                return
            doubt = error
        begun.set_result(None)
        await self._follow(drive, move, doubt)

    def take_over(self, drive: Drive, move: DriveMove, *, begun: bool, since: str = RESTARTED) -> None:
        """Go on with a move of an earlier life: ask the drive, and follow the move to its end."""
        if self._take_over(drive, move, begun=begun, asked="the drive", since=since):
            known: Beginning = asyncio.get_running_loop().create_future()
            known.set_result(None)
            work = partial(self._follow, drive, move, restarted_in_motion(drive.id))
            self._see_through(move.id, work, known, partial(self._give_up, [(drive, move)]))

    async def _follow(self, drive: Drive, move: DriveMove, doubt: NoReply | None) -> None:
        """Look until it stands still, and judge what it tells then."""
        loop = asyncio.get_running_loop()
        silence = Silence(loop.time(), drive.line.reply_timeout_s + drive.line.late_reply_s + POLL_S)
        with working("followers"):
            while not silence.too_long:
                try:
                    told = await drive.look()
                except GatewayError as error:
                    silence.unanswered(loop.time(), silent=isinstance(error, NoReply))
                else:
                    silence.answered(loop.time())
                    if not told.moves:
                        self._end(drive, move, found(move, told), doubt, position=told.place)
                        return
                    if move.status is MoveStatus.SENT:
                        self.advance(drive, move, MoveStatus.MOVING)
                await asyncio.sleep(POLL_S)
        sight = Sight.SILENT if silence.of_body else Sight.OUT_OF_REACH
        lost = Unseen(sight, begun=Known.SEEN if doubt is None else Known.IN_DOUBT)
        self._end(drive, move, lost, doubt, unheard=silence.told)

    def _end(
        self, drive: Drive, move: DriveMove, finding: Finding, error: GatewayError | None, **more: Any
    ) -> None:
        sending = f"{move.command} was sent to {drive.id}"
        words = MOTOR._replace(who=drive.id, sending=sending, target=move.target, lost="has lost", **more)
        self.end(drive, move, judge(finding, words, error))


def found(move: DriveMove, told: Status) -> AtRest:
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
        begun=Known.SEEN if is_taken else Known.IN_DOUBT,
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
        self.moves = DriveMoves()

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
