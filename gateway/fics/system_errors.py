"""The error of the system that stands, as far as is known (C-HOST manual 2-12)."""

from datetime import UTC, datetime

from pydantic import Field

from gateway.core.marks import DETAIL
from gateway.core.records import Record
from gateway.fics.axes import Tell
from gateway.texts import Text, text
from protocols.fics.alarm_texts import row_of
from protocols.fics.alarms import DetailKind, ErrorDetail
from protocols.fics.errors import FicsErrorKind, lookup
from protocols.fics.notation import driver_error_text


class RobotErrorRecord(Record):
    """An error of the system that stands until it is reset (C-HOST manual 2-12, 2-13)."""

    code: str | None = Field(description="Three digits; null where the answer that named it was lost.")
    en: str
    ja: str
    remedy_en: str
    remedy_ja: str
    kind: DetailKind | None = Field(
        description="Kind of error that the details describe; null if not known.", json_schema_extra=DETAIL
    )
    detail: str | None = Field(description="Answer of ERD, as it came.")
    unit: int | None = Field(
        default=None, description="Unit of the error; null in a system of a single unit, too."
    )
    axis: str | None = Field(default=None, description="The motor axis.")
    driver_error: str | None = Field(
        default=None, description="The driver's own code, hexadecimal as in `31h`; `FFh`: not ready."
    )
    program: int | None = Field(default=None, description="The program that was stopped.")
    step: int | None = None
    at: datetime


class StandingError:
    """The error of the system of one robot, as it was told last."""

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self.latched: RobotErrorRecord | None = None
        """The error that stands, as far as is known."""
        self.looked_at: datetime | None = None
        """Time at which the robot last told its error, or that there is none."""
        self.asked_after = 0
        """`FicsLine.unheard` when the error was last asked for."""
        self.older_may_hide = False
        """True if the last answer was an error that stands: an older refusal may still wait behind it."""

    def note_told(self, error: str, asked_after: int) -> None:
        """Note the answer of ERR, and `FicsLine.unheard` when it was asked."""
        self.asked_after = asked_after
        self.older_may_hide = lookup(error).kind is FicsErrorKind.FICS

    def note_looked(self, error: str, reset_by: str) -> None:
        """Note that the robot was asked; an error that was known and stands no more is told to be reset."""
        self.looked_at = datetime.now(UTC)
        if self.latched is not None and lookup(error).kind is not FicsErrorKind.FICS:
            self.forget()
            self._tell("robot.errors.reset", {"by": reset_by})

    def is_known(self, error: str | None) -> bool:
        """True if this error is the one that stands; None stands for one whose name was lost."""
        return self.latched is not None and error in (None, self.latched.code)

    def keep(self, error: str | None, detail: ErrorDetail | None) -> None:
        """Keep and publish an error; nothing is kept where its name was lost and no details tell of one."""
        if error is None and (detail is None or detail.kind is DetailKind.NONE):
            return
        self.latched = _record(error, detail)
        self._tell("robot.error", self.latched.model_dump(mode="json"))

    def forget(self) -> None:
        """No error stands that is known of."""
        self.latched = None

    def details_of(self, error: str) -> RobotErrorRecord | None:
        """The details of an error; None where another stands."""
        return self.latched if self.latched is not None and self.latched.code == error else None

    def is_silent(self, unit: int, motor: str) -> bool:
        """True if the error that stands is that of a driver which does not answer (C-HOST manual 2-13)."""
        error = self.latched
        if error is None or error.kind is not DetailKind.CONNECTION:
            return False
        return error.axis == motor and error.unit in (None, unit)


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
