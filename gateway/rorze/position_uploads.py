"""Uploads of whole position tables: at 9600 baud 2048 positions take minutes (RC-420 manual 13.4)."""

from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime

from pydantic import Field

from gateway.core.backup_record import Reading
from gateway.core.move_log import new_id
from gateway.core.readings import ProgressListener, Readings
from gateway.rorze.bodies import Body
from gateway.rorze.positions import NamedPosition, TablePosition, WantedPosition, check, store


class TableUpload(Reading):
    """Positions that are being stored in a body, or were: all are sent, then all are read back."""

    count: int = Field(description="The number of positions it has.")
    flash: bool = Field(description="Whether the whole table is to be written to flash memory, too (FPS).")
    positions: list[NamedPosition] | None = Field(
        None, description="As read back, once it has succeeded. Events leave them out: ask for the record."
    )


class TableUploads(Readings[TableUpload]):
    """The uploads of position tables, one at a time to each body."""

    record_type = TableUpload
    noun = "table of positions"
    doing = "being stored"

    def start(
        self,
        body: Body,
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
        """What one that was broken off has changed."""
        if record.read >= record.count:
            return f"all {record.count} positions were sent, and not all of them read back"
        return f"{record.read} of {record.count} positions were sent, perhaps one more, and none read back"
