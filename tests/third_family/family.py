"""Toy axes: all of a plant, with their moves and stops."""

import asyncio
from collections.abc import Awaitable, Iterator, Sequence
from datetime import UTC, datetime
from typing import Any, ClassVar, Literal

from gateway.core import tables
from gateway.core.errors import BodyBusy, GatewayError, NoReply, NotFound
from gateway.core.event_types import EventType, lease_types, move_types
from gateway.core.events import EventHub
from gateway.core.family import Family, LeftMoving, Place, PortInfo, Seen, Site, facts_of
from gateway.core.lanes import Lane
from gateway.core.move_log import MoveLog, new_id
from gateway.core.move_record import START_WITHIN_S, MoveError, MoveRecord, MoveStatus
from gateway.core.parts import Part
from gateway.core.records import Record
from gateway.core.stops import CONFIRM_WITHIN_S, BilingualReport, StopMode, Stopping, StopState
from gateway.core.targets import Answer, Begun, Opened, Stopped, Target, stopped
from gateway.texts import Text
from protocols.table import Effect
from tests.third_family.rows import ROWS, GetPlace, Go, Halt
from tests.third_family.session import ToyLine
from transports.base import Transport

TOY = Place("/toys/{toy_id}")
POLL_S = 0.1


class ToyTable(tables.Line):
    """What the configuration says of a line with an axis."""

    toy: str


class ToyInfo(PortInfo):
    """A line with an axis."""

    protocol: Literal["toy"]
    toy_id: str


class ToyMove(MoveRecord):
    """A move of an axis."""

    place: int


class ToyNow(Record):
    """An axis, as far as is known."""

    toy_id: str
    online: bool
    moving: bool | None


class ToyStop(BilingualReport):
    """How far the stop of an axis has come."""

    toy_id: str
    state: StopState = "requested"
    detail: str | None = None


class Toy(Target):
    """An axis: what is known of it, and how it moves and stops."""

    stop_modes: ClassVar = {Halt: "decelerate"}

    def __init__(self, toy_id: str, line: ToyLine, log: MoveLog[Any], events: EventHub) -> None:
        self.address, self.path, self.line, self.log = toy_id, f"/toys/{toy_id}", line, log
        self.move: ToyMove | None = None
        self.tasks: set[asyncio.Task[None]] = set()
        self._events = events

    async def ask(self, command: Any) -> Answer:
        lane = Lane.READ if command.effect is Effect.READ else Lane.COMMAND
        reply = await self.line.ask(command, lane)
        return Answer((reply,), asyncio.get_running_loop().time())

    async def start(self, command: Any, start_within_s: float = START_WITHIN_S) -> Begun | Opened:
        if self.move is not None:
            raise BodyBusy(f"{self.address} still has the move {self.move.id}; nothing was sent.")
        now = datetime.now(UTC)
        self.move = move = ToyMove(
            id=new_id(now),
            body_id=self.address,
            command=command.code,
            frame=f"{command.code} {command.written()}",
            created_at=now,
            place=command.place,
        )
        self.log.add(move)
        self._advance(move, MoveStatus.QUEUED)
        try:
            await self.line.ask(command, Lane.COMMAND, lambda _: self._advance(move, MoveStatus.SENT))
        except GatewayError as error:
            move.error = MoveError.of(error)
            self._advance(move, MoveStatus.REJECTED if error.moved == "no" else MoveStatus.UNKNOWN)
            raise
        self._follow_up(self._follow(move, command))
        return Begun(self.path, [move])

    def _advance(self, move: ToyMove, status: MoveStatus) -> None:
        move.status = status
        if status.final:
            self.move = None
            self.log.end(move)
        news = "started" if status is MoveStatus.MOVING else status
        self._events.publish(f"toy.move.{news}", self.path, move.model_dump(mode="json"), move.id)

    async def _follow(self, move: ToyMove, command: Go) -> None:
        while True:
            await asyncio.sleep(POLL_S)
            try:
                told = await self.line.ask(GetPlace())
            except NoReply:
                continue
            except GatewayError:
                self._advance(move, MoveStatus.LOST)
                return
            if not told.moves:
                arrived = told.place == command.place
                self._advance(move, MoveStatus.SUCCEEDED if arrived else MoveStatus.STOPPED)
                return

    def _follow_up(self, work: Any) -> "asyncio.Task[None]":
        task = asyncio.create_task(work)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)
        return task

    async def stop(self, mode: StopMode) -> Stopped:
        return await stopped("toys", self.begin_stop(mode))

    def begin_stop(self, mode: StopMode) -> Awaitable[Sequence[ToyStop]]:
        self.line.begin_stop()
        report = ToyStop(toy_id=self.address)
        stopping = ToyStopping(self, mode, report)
        stopping.submit()
        task = self._follow_up(stopping.see_through())

        async def told() -> Sequence[ToyStop]:
            await asyncio.wait({task}, timeout=CONFIRM_WITHIN_S)
            return [report]

        return told()

    def send_halt(self) -> None:
        """Send a stop ahead of everything; whether it works shows later."""
        self._follow_up(self._halt())

    async def _halt(self) -> None:
        try:
            await self.line.ask(Halt(), Lane.STOP)
        except GatewayError:
            return


class ToyStopping(Stopping):
    """The stop of an axis, repeated until it stands still."""

    def __init__(self, toy: Toy, mode: StopMode, report: ToyStop) -> None:
        super().__init__(mode, report)
        self._toy, self._told = toy, report

    def submit(self) -> None:
        self._toy.send_halt()

    async def stands_still(self) -> bool:
        try:
            return not (await self._toy.line.ask(GetPlace(), Lane.VERIFY)).moves
        except GatewayError:
            return False

    def reply_count(self) -> int:
        return int(self._toy.line.counters["replies"])

    def why_not(self) -> Sequence[Text]:
        return [Text("The axis has not come to rest.", "軸がまだ静止していません。")]

    def publish(self, what: str) -> None:
        self._toy._events.publish(f"toy.stop.{what}", self._toy.path, self._told.model_dump())


TYPES = (
    *move_types("toy", TOY.path, ToyMove),
    *lease_types("toy", TOY.path),
    *(EventType(f"toy.stop.{it}", TOY.path, ToyStop, it) for it in ("requested", "confirmed", "unconfirmed")),
)


class Toys(Family):
    """All toy axes."""

    event_types = TYPES

    line_table = ToyTable
    line_info = ToyInfo
    now = ToyNow
    move_records = (ToyMove,)
    collections = ("toys",)
    commands: ClassVar = tuple((Place("/toys/{toy_id}", ToyMove), row) for row in ROWS)
    stop_modes = Toy.stop_modes

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self.toys: dict[str, Toy] = {}
        self.log = MoveLog[ToyMove]()

    def add(self, table: ToyTable, port: Transport) -> ToyLine:
        line = ToyLine(table.id, port)
        line.on_change = lambda what, facts: self._on_change(line, what, facts)
        self.toys[table.toy] = Toy(table.toy, line, self.log, self.site.events)
        return line

    def _on_change(self, line: ToyLine, what: str, facts: dict[str, object]) -> None:
        self.site.events.publish(what, f"/lines/{line.id}", facts)

    async def remove(self, line: ToyLine) -> None:
        await line.close()
        self.toys = {name: toy for name, toy in self.toys.items() if toy.line is not line}

    def target(self, collection: str, names: Sequence[str]) -> Target:
        if names[0] not in self.toys or len(names) > 1:
            raise NotFound(f"There is no toy {'/'.join(names)}; nothing was sent.")
        return self.toys[names[0]]

    def addresses(self) -> Iterator[str]:
        return iter(self.toys)

    def seen(self) -> Iterator[Seen]:
        for toy in self.toys.values():
            moving = toy.move is not None
            yield Seen(toy.line.id, toy.address, ToyNow(toy_id=toy.address, online=True, moving=moving))

    def move_logs(self) -> Iterator[MoveLog[Any]]:
        yield self.log

    def info(self, line: ToyLine) -> ToyInfo:
        (toy,) = (it.address for it in self.toys.values() if it.line is line)
        return {**facts_of(line), "protocol": "toy", "toy_id": toy}

    def was_left_alone(self) -> None:
        return

    def stop_all(self, mode: StopMode) -> Awaitable[Stopped]:
        (toy,) = self.toys.values()
        return stopped("toys", toy.begin_stop(mode))

    def end_motion(
        self, *, everything: bool, within: Sequence[Part] | None = None
    ) -> Sequence["asyncio.Task[Any]"]:
        return ()

    async def at_rest(self) -> None:
        return

    def left_moving(self) -> Iterator[LeftMoving]:
        return iter(())

    async def let_go(self) -> None:
        self.log.let_go()

    async def close(self) -> None:
        for toy in self.toys.values():
            tasks = list(toy.tasks)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await toy.line.close()
