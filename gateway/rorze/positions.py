"""The position table of a body: 2048 positions, read, stored and read back (RC-420 manual 13.4)."""

from collections.abc import AsyncGenerator, Awaitable, Callable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from typing import Final, NamedTuple

from pydantic import Field

from gateway.core.backup_record import Reading
from gateway.core.errors import BodyBusy, CommandGarbled, GatewayError, InvalidRequest, NoReply
from gateway.core.origin import new_id
from gateway.core.readings import ProgressListener, Readings
from gateway.core.records import Record
from gateway.rorze.asked_body import AskedBody, closely, read_pulses
from protocols.rorze.flash import SavePositions
from protocols.rorze.notation import BILLION, PositionReference
from protocols.rorze.position_table import SetPositionEntry

LAST_POSITION: Final = 2047
PLACES: Final = range(LAST_POSITION + 1)
TRIES: Final = 3


class TablePosition(NamedTuple):
    """A position of the table, in pulses or encoder counts as the operating mode is."""

    number: int
    pulses: int


class WantedPosition(NamedTuple):
    """A position to be stored."""

    number: int
    pulses: int | None
    """Pulses to store; None: where the motor stands."""


class NamedPosition(Record):
    """A stored position."""

    number: int
    name: str | None
    pulses: int = Field(description="Encoder counts in encoder mode.")
    value: float | None = Field(description="Position in `unit`; null without a scale.")
    unit: str | None


class PositionReading(Reading):
    """Positions of a body that are being read, or were."""

    first: int = Field(description="Number of the first position.")
    last: int = Field(description="Number of the last position.")
    positions: list[NamedPosition] | None = Field(
        None, description="Once it has succeeded. Events leave them out: ask for the record."
    )


class PositionsDiffer(GatewayError, titled="positions-differ-in-body"):
    """Positions were stored, and the body holds others."""

    kind = "positions-differ"
    retryable = True


class StoringBrokenOff(GatewayError):
    """Some positions were sent, the rest was not."""

    kind = "storing-broken-off"

    def __init__(self, address: str, sent: int, of: int, cause: GatewayError) -> None:
        super().__init__(
            f"{sent} of {of} positions were sent to {address} and not read back, then it was broken off: "
            f"{cause.detail}",
            "Read the table, and store the rest.",
        )


async def read(body: AskedBody, first: int, last: int) -> list[TablePosition]:
    """Read positions one by one (3ND), each by its number, which the answer repeats.

    :raises InvalidRequest: the last is before the first.
    :raises GatewayError: they were not read.
    """
    return [position async for position in _in_order(body, first, last)]


def _in_order(body: AskedBody, first: int, last: int) -> AsyncGenerator[TablePosition, None]:
    if last < first:
        raise InvalidRequest(f"last: it is less than first, {first}; nothing was sent.")
    return closely(read_one(body, number) for number in range(first, last + 1))


class PositionReadings(Readings[PositionReading]):
    """The readings of position tables, one at a time of each body."""

    noun = "table of positions"

    def start(
        self, body: AskedBody, first: int, last: int, named: Callable[[TablePosition], NamedPosition]
    ) -> PositionReading:
        """Begin to read positions one by one, as `read` does.

        :raises InvalidRequest: the last is before the first.
        :raises BodyBusy: positions of the body are being read.
        """
        now, target = datetime.now(UTC), f"/bodies/{body.address}"
        self.require_none(target)
        found = _in_order(body, first, last)
        record = PositionReading(
            id=new_id(now),
            target=target,
            controllers=[body.address],
            controller=body.address,
            expected=last - first + 1,
            started_at=now,
            first=first,
            last=last,
        )

        async def collect(progress: ProgressListener) -> None:
            positions = []
            async for position in found:
                positions.append(named(position))
                progress.has_read()
            record.positions = positions

        return self.follow(record, collect)


async def store(
    body: AskedBody,
    wanted: Sequence[WantedPosition],
    *,
    flash: bool = False,
    answered: Callable[[], None] = lambda: None,
) -> list[TablePosition]:
    """Store positions (3PS), read them back, and write the whole table to flash memory (FPS) if asked.

    An entry that reads otherwise is sent again: no checksum tells a garbled digit. `answered` is called for
    each answer.

    :raises InvalidRequest: a number comes twice, or does not exist; nothing was sent.
    :raises BodyBusy: it moves, and is to store where it stands; nothing was sent.
    :raises StoringBrokenOff: some were sent.
    :raises PositionsDiffer: all were sent, and what was read back is something else.
    :raises GatewayError: nothing was sent, or it was not read back, or not written to flash memory.
    """
    check(wanted)
    if any(position.pulses is None for position in wanted) and (await body.where_it_rests()).runs:
        raise BodyBusy(f"{body.address} moves; nothing was sent.", "Wait for standstill.")
    held: dict[int, TablePosition] = {}
    left = list(wanted)
    for _ in range(TRIES):
        await _send(body, left, len(wanted), answered)
        async for position in closely(read_one(body, position.number) for position in left):
            held[position.number] = position
            answered()
        left = [position for position in left if position.pulses not in (None, held[position.number].pulses)]
        if not left:
            break
    else:
        numbers = ", ".join(str(position.number) for position in left)
        raise PositionsDiffer(
            f"{body.address} was sent {len(wanted)} positions, and holds others under the numbers {numbers}.",
            "Store them again.",
        )
    if flash:
        await body.ask(SavePositions())
    return [held[position.number] for position in wanted]


async def _send(
    body: AskedBody, wanted: Sequence[WantedPosition], of: int, answered: Callable[[], None]
) -> None:
    for sent, position in enumerate(wanted):
        try:
            await _set(body, position)
        except GatewayError as error:
            if sent:
                raise StoringBrokenOff(body.address, sent, of, error) from error
            raise
        answered()


def check(wanted: Sequence[WantedPosition]) -> None:
    """Make sure that positions can be stored.

    :raises InvalidRequest: a number comes twice, or does not exist, or a position is out of range.
    """
    seen: set[int] = set()
    for number, pulses in wanted:
        if number not in PLACES:
            raise InvalidRequest(
                f"There is no position {number}: they go from 0 to {LAST_POSITION}; nothing was sent."
            )
        if pulses is not None and abs(pulses) >= BILLION:
            raise InvalidRequest(
                f"Position {number} comes to {pulses}: must be less than {BILLION} either way; "
                "nothing was sent."
            )
        if number in seen:
            raise InvalidRequest(f"Position {number} is given twice; nothing was sent.")
        seen.add(number)


async def _set(body: AskedBody, wanted: WantedPosition) -> None:
    """Store a position; what may be lost or garbled is sent again, which changes nothing where it was not."""
    command = SetPositionEntry(entry=PositionReference(position=wanted.number), pulses=wanted.pulses)
    for _ in range(TRIES - 1):
        with suppress(NoReply, CommandGarbled):
            await body.ask(command)
            return
    await body.ask(command)


async def read_one(body: AskedBody, number: int) -> TablePosition:
    """Read one position; errors as of `read_pulses`."""
    return TablePosition(number, await read_pulses(body, number))


# a table of positions that is uploaded


class TableUpload(Reading):
    """Positions that are being stored in a body, or were: all are sent, then all are read back."""

    count: int = Field(description="The number of positions it has.")
    flash: bool = Field(description="True if the whole table is to be written to flash memory, too (FPS).")
    positions: list[NamedPosition] | None = Field(
        None,
        description="Positions as read back, once all are stored. Events leave them out: ask for the record.",
    )


class TableUploads(Readings[TableUpload]):
    """The uploads of position tables, one at a time to each body."""

    record_type = TableUpload
    noun = "table of positions"
    doing = "being stored"

    def start(
        self,
        body: AskedBody,
        wanted: Sequence[WantedPosition],
        *,
        flash: bool,
        named: Callable[[Sequence[TablePosition]], Awaitable[list[NamedPosition]]],
    ) -> TableUpload:
        """Begin to store positions as `store` does; what is held in the end is `named`.

        :raises InvalidRequest: a number comes twice, or does not exist, or a position is out of range.
        :raises BodyBusy: positions are being stored in the body.
        """
        now, target = datetime.now(UTC), f"/bodies/{body.address}"
        check(wanted)
        self.require_none(target)
        record = TableUpload(
            id=new_id(now),
            target=target,
            controllers=[body.address],
            controller=body.address,
            expected=2 * len(wanted),
            started_at=now,
            count=len(wanted),
            flash=flash,
        )

        async def work(progress: ProgressListener) -> None:
            def answered() -> None:
                if record.read < 2 * record.count:  # not what is sent again
                    progress.has_read()

            record.positions = await named(await store(body, wanted, flash=flash, answered=answered))

        return self.follow(record, work)

    def left_by(self, record: TableUpload, /) -> str:
        """The changes of an upload that was broken off."""
        if record.read >= record.count:
            return f"all {record.count} positions were sent, and not all of them read back"
        return f"{record.read} of {record.count} positions were sent, perhaps one more, and none read back"
