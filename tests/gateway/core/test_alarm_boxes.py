"""One box for one event: what tells the same stands in the alarm that tells its cause."""

from datetime import UTC, datetime, timedelta

from gateway.core.alarm_boxes import boxed
from gateway.core.alarms import Alarm, AlarmText

BEGAN = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
TOLD = AlarmText(happened="It happened.", motor="It stood.", remedy="Look.")


def alarm(
    number: int, cause: str, subject: str, after_s: float = 0.0, over_after_s: float | None = None
) -> Alarm:
    return Alarm(
        id=f"{number:02}",
        cause=cause,
        subject=subject,
        raised_at=BEGAN + timedelta(seconds=after_s),
        ended_at=None if over_after_s is None else BEGAN + timedelta(seconds=over_after_s),
        caller="operator",
        request_id=None,
        manual="",
        en=TOLD,
        ja=TOLD,
        next=[],
    )


def heads(*alarms: Alarm) -> dict[str, str | None]:
    def line_of(subject: str) -> str | None:
        return None if subject.startswith(("/lines", "/gateway")) else "line1"

    return {it.id: it.part_of for it in boxed(alarms, line_of)}


LIFT, RAIL = "/bodies/line1.3F", "/bodies/line1.00"


def test_a_failed_move_stands_in_the_box_of_its_cause_whichever_came_first() -> None:
    failed, ems = alarm(1, "body.move.failed", LIFT), alarm(2, "body.ems_error", LIFT, 0.3)
    assert heads(failed, ems) == {"01": "02", "02": None}


def test_a_move_that_failed_long_before_is_an_event_of_its_own() -> None:
    failed, ems = alarm(1, "body.move.failed", LIFT), alarm(2, "body.ems_error", LIFT, 60)
    assert heads(failed, ems) == {"01": None, "02": None}


def test_bodies_and_their_moves_stand_in_the_box_of_their_line_while_it_lasts() -> None:
    line = alarm(1, "line.down", "/lines/line1", over_after_s=100)
    body, move = alarm(2, "body.offline", LIFT, 40), alarm(3, "body.move.lost", LIFT, 41)
    later = alarm(4, "body.offline", RAIL, 200)
    assert heads(line, body, move, later) == {"01": None, "02": "01", "03": "01", "04": None}


def test_bodies_whose_silence_told_of_the_loss_of_their_line_stand_in_its_box() -> None:
    first, second = alarm(1, "body.offline", LIFT), alarm(2, "body.offline", RAIL, 1.0)
    line = alarm(3, "line.down", "/lines/line1", 9.0, over_after_s=20)
    assert heads(first, second, line) == {"01": "03", "02": "03", "03": None}
    back = alarm(1, "body.offline", LIFT, over_after_s=5.0)
    assert heads(back, line) == {"01": None, "03": None}
    ems = alarm(1, "body.ems_error", LIFT)
    assert heads(ems, line) == {"01": None, "03": None}


def test_a_silence_stands_in_the_box_of_the_loss_of_power_that_was_its_cause() -> None:
    silent = alarm(1, "body.offline", LIFT, over_after_s=30.0)
    assert heads(silent, alarm(2, "body.power_cycled", LIFT, 30.1)) == {"01": "02", "02": None}
    assert heads(silent, alarm(2, "body.power_cycled", LIFT, 90.0)) == {"01": None, "02": None}
    assert heads(silent, alarm(2, "body.power_cycled", RAIL, 30.1)) == {"01": None, "02": None}


def test_bodies_that_lost_their_power_together_stand_in_one_box() -> None:
    one, other = alarm(1, "body.power_cycled", LIFT), alarm(2, "body.power_cycled", RAIL, 1)
    move = alarm(3, "body.move.lost", RAIL, 1)
    assert heads(one, other, move) == {"01": None, "02": "01", "03": "01"}


def test_what_is_about_the_gateway_stands_alone() -> None:
    assert heads(alarm(1, "gateway.crashed", "/gateway"), alarm(2, "body.offline", LIFT)) == {
        "01": None,
        "02": None,
    }
