"""Commissionings of lines beside the gateway's work: the port is lent to questions alone, and taken back."""

import asyncio
import secrets
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime
from functools import partial
from typing import Any, Final, Literal

from pydantic import Field, JsonValue

from gateway.core.errors import BodyBusy, NotSent
from gateway.core.family import AnyLine
from gateway.core.records import Record
from gateway.core.works import CutOff, Jobs
from transports import Transport, TransportError

HISTORY: Final = 10
LOOK_S: Final = 0.02
"""A stop waits at most this long before the port is taken back for it."""
LENT: Final = "it is being commissioned; a stop ends that at once"
STOPPED: Final = "A stop came: the line serves again."
CANCELLED: Final = "It was cancelled; the line serves again."


Status = Literal["running", "finished", "failed", "cancelled"]


class Commissioning(Record):
    """One commissioning of a line: which assumptions about real hardware hold there."""

    id: str
    line_id: str
    status: Status = "running"
    done: int = Field(0, description="Number of assumptions that were tried so far.")
    of: int | None = Field(None, description="Number of assumptions about such a line.")
    doing: str | None = Field(None, description="The assumption that is being tried.")
    report: dict[str, JsonValue] | None = Field(
        None, description="All results and frames, as `motion-gateway commission --report` writes them."
    )
    error: str | None = None
    started_at: datetime
    ended_at: datetime | None = None

    def proposed(self) -> dict[str, JsonValue]:
        """Other values of the line's settings, by their keys."""
        results: Any = (self.report or {}).get("results", [])
        settings = (result["setting"] for result in results if result["setting"] is not None)
        return {
            setting["key"]: setting["proposed"] for setting in settings if setting["proposed"] is not None
        }


Tell = Callable[[int, int, str], None]
Walk = Callable[[Any, Callable[[str], Transport], Tell], Awaitable[dict[str, JsonValue]]]
"""Tries all assumptions with questions: the line's table, what opens its port, who is told."""


class Commissionings(Jobs[Commissioning]):
    """The commissionings of all lines; one at a time on each."""

    def __init__(self) -> None:
        super().__init__(HISTORY, "commissioning", lambda record: record.line_id)
        self.walk: Walk | None = None
        """The trial of the assumptions; None in a gateway that was not given one."""

    def start(
        self, line: AnyLine, table: Any, open_port: Callable[[str], Transport], busy: list[str]
    ) -> Commissioning:
        """Lend the port of a line on which nothing moves; only questions are sent.

        :raises BodyBusy: something moves or is at work there, or it is being commissioned.
        :raises NotSent: this gateway cannot commission.
        """
        if self.walk is None:
            raise NotSent("This gateway cannot commission lines; nothing was sent.", "Use the command line.")
        if running := self.current(line.id):
            raise BodyBusy(f"Commissioning {running.id} of line {line.id} is running.", "Wait for its end.")
        if busy:
            raise BodyBusy(
                f"On line {line.id} {', '.join(busy)} moves or is at work; nothing was sent.",
                "Stop it, or wait for its end.",
            )
        record = Commissioning(id=secrets.token_hex(6), line_id=line.id, started_at=datetime.now(UTC))
        walk = partial(self.walk, table, open_port, partial(_note, record))
        task = self.begin(record, self._run(record, line, walk), "commissioning")
        task.add_done_callback(lambda _: record.ended_at or self._end(record, "cancelled", CANCELLED))
        return record

    async def _run(
        self, record: Commissioning, line: AnyLine, walk: Callable[[], Awaitable[dict[str, JsonValue]]]
    ) -> None:
        stops = line.gate.all_stops()
        async with line.lent(LENT):
            work = asyncio.ensure_future(walk())
            try:
                while not work.done() and line.gate.all_stops() == stops:
                    await asyncio.wait([work], timeout=LOOK_S)
                record.report = work.result() if work.done() else None
                end: tuple[Status, str | None] = ("finished", None) if work.done() else ("cancelled", STOPPED)
            except TransportError as lost:
                end = "failed", str(lost)
            except asyncio.CancelledError:
                end = "cancelled", CANCELLED
            finally:
                work.cancel()
                await asyncio.gather(work, return_exceptions=True)
        self._end(record, *end)

    def cut_off(self, record: Commissioning, why: CutOff, /) -> None:
        """Say why it has not come to its end."""
        if record.ended_at is None:
            self._end(record, "failed", f"{why.what}.")

    @staticmethod
    def _end(record: Commissioning, status: Status, error: str | None) -> None:
        record.status, record.error, record.doing = status, error, None
        record.ended_at = datetime.now(UTC)


def _note(record: Commissioning, place: int, of: int, slug: str) -> None:
    record.done, record.of, record.doing = place - 1, of, slug
