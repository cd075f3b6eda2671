"""The error of the system that stands: asked for by the gateway alone, and kept (C-HOST manual 2-12)."""

import asyncio
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

from pydantic import Field

from gateway.core.errors import GatewayError, NoReply
from gateway.core.lanes import Lane
from gateway.core.origin import Origin, acting
from gateway.core.records import Record
from gateway.fics.commander import Commander
from gateway.fics.errors import ErrorStands
from gateway.fics.motion_state import Tell
from gateway.texts import Text, text
from protocols.fics.alarm_texts import row_of
from protocols.fics.alarms import DetailKind, ErrorDetail
from protocols.fics.errors import FicsErrorKind, lookup
from protocols.fics.notation import driver_error_text
from protocols.fics.row import FicsCommand


class RobotErrorRecord(Record):
    """An error of the system that stands until it is reset (C-HOST manual 2-12, 2-13)."""

    code: str | None = Field(description="Three digits; null where the answer that named it was lost.")
    en: str
    ja: str
    remedy_en: str
    remedy_ja: str
    kind: DetailKind | None = Field(description="Which kind of error the details tell of; null if not known.")
    detail: str | None = Field(description="What ERD has answered.")
    unit: int | None = Field(default=None, description="Null in a system of a single unit, too.")
    axis: str | None = Field(default=None, description="The motor axis.")
    driver_error: str | None = Field(
        default=None, description="The driver's own code, hexadecimal as in `31h`; `FFh`: not ready."
    )
    program: int | None = Field(default=None, description="The program that was stopped.")
    step: int | None = None
    at: datetime


class SystemErrors:
    """What is known of a robot's errors of the system."""

    def __init__(self, commander: Commander, tell: Tell) -> None:
        self._commander = commander
        self._line = commander.line
        self._tell = tell
        self.latched: RobotErrorRecord | None = None
        """The error that stands, as far as is known."""
        self.looked_at: datetime | None = None
        """When the robot has told it last, or that there is none."""
        self._looking: set[asyncio.Task[str | None]] = set()
        commander.on_error = self._keep
        commander.on_alarm = self._poll_soon

    async def close(self) -> None:
        """Look for no more errors."""
        for task in self._looking:
            task.cancel()
        await asyncio.gather(*self._looking, return_exceptions=True)

    async def take(
        self, lane: Lane = Lane.COMMAND, expires_at: float | None = None, *, reset_by: str = "elsewhere"
    ) -> str:
        """Ask for the present error; an error of the system is kept and published, and so is its reset.

        :raises GatewayError: it was not told.
        """
        async with self._line.sequence_lock.held(lane, expires_at):
            error = await self._commander.take_error()
            self.looked_at = datetime.now(UTC)
            if self.latched is not None and lookup(error).kind is not FicsErrorKind.FICS:
                self.forget()
                self._tell("robot.errors.reset", {"by": reset_by})
        return error

    async def poll(self) -> str | None:
        """Find out which error stands, and give the answer of ERR.

        None where its answer is lost: then the details still tell of an error (C-HOST manual 2-13).
        """
        try:
            return await self.take()
        except NoReply:
            with suppress(GatewayError):
                async with self._line.sequence_lock.held(Lane.COMMAND):
                    await self._keep(None)
        except GatewayError:
            return None
        return None

    def details_of(self, error: str) -> RobotErrorRecord | None:
        """The details of an error; None where another stands."""
        return self.latched if self.latched is not None and self.latched.code == error else None

    def forget(self) -> None:
        """No error stands that is known of."""
        self.latched = None

    def require_none(self, command: FicsCommand[Any]) -> None:
        """Refuse a motion while an error stands.

        :raises ErrorStands: one does.
        """
        if self.latched is not None:
            raise ErrorStands(command.wire_name(), self.latched.code, self.latched)

    @acting(Origin("gateway: poll"))
    def _poll_soon(self) -> None:
        task = asyncio.create_task(self.poll(), name=f"errors of {self._commander.robot_id}")
        self._looking.add(task)
        task.add_done_callback(self._looking.discard)

    async def _keep(self, error: str | None) -> None:
        """Keep and publish an error, once; None where its answer was lost. The sequence lock is held."""
        known = self.latched
        if known is not None and error in (None, known.code):
            return
        detail = await self._detail()
        if error is None and (detail is None or detail.kind is DetailKind.NONE):
            return
        self.latched = _record(error, detail)
        self._tell("robot.error", self.latched.model_dump(mode="json"))

    async def _detail(self) -> ErrorDetail | None:
        if self._line.uploading:
            return None  # an upload takes positions only
        try:
            return await self._commander.take_detail()
        except GatewayError:
            return None


def _record(error: str | None, detail: ErrorDetail | None) -> RobotErrorRecord:
    code = error
    driver = detail.driver_error if detail else None
    if code is None and detail is not None and detail.error is not None:
        code = f"{detail.error:03d}"
    known = code is not None or (detail is not None and detail.kind is not DetailKind.UNREADABLE)
    row = row_of(code or "999", detail)
    told = Text(row.en, row.ja) if known else text("refusals.unknown-system-error")
    return RobotErrorRecord(
        code=code,
        en=told.en,
        ja=told.ja,
        remedy_en=row.remedy_en,
        remedy_ja=row.remedy_ja,
        kind=detail.kind if detail else None,
        detail=detail.written() if detail else None,
        unit=(detail.unit or None) if detail else None,
        axis=detail.axis if detail else None,
        driver_error=None if driver is None else driver_error_text(driver),
        program=detail.program if detail else None,
        step=detail.step if detail else None,
        at=datetime.now(UTC),
    )
