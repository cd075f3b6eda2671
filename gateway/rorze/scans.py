"""Scans: who answers on a line, configured or not."""

import asyncio
import secrets
from datetime import UTC, datetime
from typing import Literal

from pydantic import Field

from gateway.core.errors import BodyBusy, GatewayError, NotSent, PortNotOpen
from gateway.core.events import EventHub
from gateway.core.records import Record
from gateway.core.works import CutOff, Jobs
from gateway.rorze.line import Line
from gateway.rorze.session import Answered
from protocols.rorze.link import encode
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry
from protocols.rorze.row import LAST_BODY

HISTORY = 100
PROBE_TIMEOUT_S = 0.1
"""A body that is there answers within milliseconds; one that missed the first round is asked again."""
ROUNDS = 2


class FoundBody(Record):
    """A body that answered."""

    body_id: str
    configured: bool = Field(description="True if the body is in the configuration.")


class Scan(Record):
    """One scan of a line."""

    id: str
    line_id: str
    status: Literal["running", "finished", "failed"] = "running"
    found: list[FoundBody] = Field(default_factory=list)
    asked: int = Field(0, description="Body numbers asked so far, of 120.")
    error: str | None = None
    started_at: datetime
    ended_at: datetime | None = None

    @property
    def target(self) -> str:
        """The path of the line."""
        return f"/lines/{self.line_id}"


class Scans(Jobs[Scan]):
    """The scans of all lines; one at a time on each."""

    def __init__(self, events: EventHub) -> None:
        super().__init__(HISTORY, "scan", lambda scan: scan.line_id)
        self._events = events

    def start(self, line: Line) -> Scan:
        """Begin to ask all 120 body numbers, between the line's other work.

        :raises BodyBusy: a scan of this line is running.
        :raises LineDown: the line is down.
        """
        for running in self.under_way():
            if running.line_id == line.id:
                raise BodyBusy(f"Scan {running.id} of line {line.id} is still running.", "Wait for it.")
        if line.state == "down":
            raise PortNotOpen(
                f"Line {line.id} is down: {line.down_reason}. Nothing was sent.", "Check the cable."
            )
        scan = Scan(id=secrets.token_hex(6), line_id=line.id, started_at=datetime.now(UTC))
        self.begin(scan, self._run(scan, line), "scan")
        return scan

    async def _run(self, scan: Scan, line: Line) -> None:
        try:
            await self._ask_everybody(scan, line)
        except GatewayError as error:
            scan.status, scan.error = "failed", error.detail
        except asyncio.CancelledError:
            scan.status, scan.error = "failed", "The gateway is shutting down."
        else:
            scan.status = "finished"
        self._end(scan)

    def cut_off(self, scan: Scan, why: CutOff, /) -> None:
        """Say why not all were asked."""
        if scan.ended_at is None:
            scan.status, scan.error = "failed", f"{why.what}."
            self._end(scan)

    def _end(self, scan: Scan) -> None:
        scan.ended_at = datetime.now(UTC)
        self._events.publish(
            f"line.scan.{scan.status}", f"/lines/{scan.line_id}", scan.model_dump(mode="json")
        )

    async def _ask_everybody(self, scan: Scan, line: Line) -> None:
        frame = encode(0, GetNumberedPositionEntry(entry=PositionReference(position=2047)))
        wire_s = 4 * len(frame) * line.byte_time_s
        missing = [body for body in range(LAST_BODY + 1) if line.can_address(body)]
        for _ in range(ROUNDS):
            for body in list(missing):
                outcome = await line.probe(body, PROBE_TIMEOUT_S + wire_s)
                if isinstance(outcome, NotSent):
                    raise outcome
                scan.asked = max(scan.asked, body + 1)
                if isinstance(outcome, Answered):
                    missing.remove(body)
                    scan.found.append(
                        FoundBody(body_id=f"{line.id}.{body:02X}", configured=body in line.bodies)
                    )
        scan.found.sort(key=lambda body: body.body_id)
