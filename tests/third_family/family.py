"""Toy axes: drives that speak in binary frames."""

from typing import Any, ClassVar, Literal

from pydantic import Field

from gateway.core import tables
from gateway.core.alarms import AlarmText, AlarmWords, Cause, causes_of_moves
from gateway.core.drives import Drive, DriveJog, DriveMove, Drives, Status, drive_types, jog_rows
from gateway.core.exchange import Lane
from gateway.core.family import PortInfo, TargetKind, facts_of
from gateway.core.operation import Rows
from gateway.core.records import Record, RequestModel
from gateway.core.rights import Right
from tests.third_family.rows import ROWS, GetStatus, Halt, Home, Jog, SetSpeed
from tests.third_family.session import ToyExchange, ToyLine
from transports.base import Transport

TOY = "/toys/{toy_id}"
OF_TOYS = Rows("toys")


class ToyTable(tables.LineTable):
    """The configuration of a line with an axis."""

    toy: str


class ToyInfo(PortInfo):
    """A line with an axis."""

    protocol: Literal["toy"]
    toy_id: str


class ToySpeed(Record):
    """The speed that an axis keeps."""

    speed: int


class ToySpeedRequest(RequestModel):
    """The speed that an axis is to keep, in steps per second."""

    speed: int = Field(ge=1, le=999)


class Toy(Drive):
    """An axis, whose status names the newest motion by the number of its frame."""

    stop_modes: ClassVar = {Halt: "decelerate"}
    jog_rows = (Jog,)
    halt = Halt()
    line: ToyLine

    def exchange(self, command: Any, lane: Lane) -> ToyExchange:
        return self.line.numbers.exchange(command, lane)

    def number_of(self, exchange: ToyExchange) -> int:
        return exchange.serial

    def target_of(self, command: Any) -> int | None:
        return 0 if isinstance(command, Home) else command.place

    async def status(self) -> Status:
        reply = await self.line.reply_to(self.exchange(GetStatus(), Lane.VERIFY))
        return Status(reply.moves, reply.place, reply.newest, reply.life, reply.stopped, reply.alarm)

    async def speed(self) -> ToySpeed:
        """Ask for the speed."""
        return ToySpeed(speed=(await self.line.reply_to(self.exchange(GetStatus(), Lane.READ))).speed)


@OF_TOYS.get(f"{TOY}/speed")
async def get_speed(toy: Toy) -> ToySpeed:
    """Read the speed that it keeps."""
    return await toy.speed()


@OF_TOYS.put(f"{TOY}/speed", Right.SETUP)
async def set_speed(toy: Toy, wanted: ToySpeedRequest) -> ToySpeed:
    """Set the speed, and read it back."""
    await toy.ask(SetSpeed(speed=wanted.speed))
    return await toy.speed()


class Toys(Drives[Toy]):
    """All toy axes."""

    kind = "toy"
    event_types = drive_types("toy", TOY)
    line_table = ToyTable
    line_info = ToyInfo
    collections = ("toys",)
    commands: ClassVar = tuple((TargetKind(TOY, DriveMove), row) for row in ROWS)
    stop_modes = Toy.stop_modes
    sessions: ClassVar = {Jog: DriveJog}
    rows = (OF_TOYS, jog_rows(TOY, Toy))
    things: ClassVar = {Toy: lambda toys, toy_id: toys.find(toy_id)}

    def add(self, table: ToyTable, port: Transport) -> ToyLine:
        line = ToyLine(table.id, port, (table.reply_timeout_s, table.late_reply_s))
        self._all[table.toy] = Toy(self, table.toy, line)
        return line

    def info(self, line: ToyLine) -> ToyInfo:
        return {**facts_of(line), "protocol": "toy", "toy_id": self.on_line(line).id}

    def causes(self) -> Any:
        yield from causes_of_moves("toy", "", ())
        words = AlarmWords(
            AlarmText(happened="An axis tells the alarm {alarm}.", motor="It stands.", remedy="Home it."),
            AlarmText(
                happened="軸のアラーム{alarm}です。",
                motor="停止しています。",
                remedy="原点復帰してください。",
            ),
        )
        yield Cause("toy.alarm", "toy.alarm", words, lasts=lambda subject: self.find(subject[6:]).alarm > 0)
