"""The status of a drive at rest, and the verdict about its move by the table."""

from datetime import UTC, datetime
from typing import Any

import pytest

from gateway.core.drives import DriveMove, Status, drive_types, finding_of
from gateway.core.event_types import table_of
from gateway.core.move_record import MoveStatus
from gateway.core.verdicts import MOTOR, judge

TARGET, START, NUMBER, LIFE = 100, 20, 7, 3


def move(**more: Any) -> DriveMove:
    """A move from one place to another, whose command has a number."""
    facts = {"start": START, "target": TARGET, "number": NUMBER, "life": LIFE, **more}
    now = datetime.now(UTC)
    return DriveMove(id="1", body_id="d", command="10", frame="", created_at=now, **facts)


def told(place: int = TARGET, *, newest: int = NUMBER, life: int = LIFE, **more: Any) -> Status:
    """Status of the drive at rest."""
    return Status(runs=False, place=place, newest=newest, life=life, **more)


@pytest.mark.parametrize(
    ("of", "tells", "status", "cause"),
    [
        (move(), told(), MoveStatus.SUCCEEDED, "normal"),
        (move(target=None), told(55), MoveStatus.SUCCEEDED, "normal"),
        (move(), told(55), MoveStatus.FAILED, "position_mismatch"),
        (move(), told(55, stopped=True), MoveStatus.STOPPED, "stop_command"),
        (move(), told(stopped=True), MoveStatus.STOPPED, "stop_command"),
        (move(), told(55, alarm=4), MoveStatus.FAILED, None),
        (move(), told(life=LIFE + 1), MoveStatus.LOST, None),
        # an earlier motion is the newest: this one was not taken, wherever the drive stands
        (move(), told(newest=NUMBER - 1), MoveStatus.FAILED, "not_executed"),
        (move(), told(START, newest=NUMBER - 1), MoveStatus.FAILED, "not_executed"),
        (move(), told(START, newest=NUMBER - 1, stopped=True, alarm=4), MoveStatus.FAILED, "not_executed"),
        (move(), told(START, newest=NUMBER - 1, life=LIFE + 1), MoveStatus.LOST, None),
        # taken over from an earlier life that did not ask before
        (move(life=None), told(), MoveStatus.SUCCEEDED, "normal"),
    ],
)
def test_a_move_is_judged_by_the_newest_motion_that_the_drive_names(
    of: DriveMove, tells: Status, status: MoveStatus, cause: str | None
) -> None:
    verdict = judge(
        finding_of(of, tells), MOTOR._replace(who="d", sending="10 was sent to d", lost="has lost")
    )
    assert (verdict.status, verdict.end_cause) == (status, cause)


def test_its_events_have_types_of_their_own() -> None:
    names = table_of(drive_types("toy", "/toys/{toy_id}"))
    assert {"toy.move.queued", "toy.jog.lost", "toy.stop.unconfirmed", "toy.alarm"} <= set(names)
