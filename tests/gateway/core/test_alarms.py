"""Alarms: raised by events, reset when their causes are over, and told in both languages."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from gateway.core.alarms import (
    AGAIN,
    DISPROVED,
    HISTORY,
    Alarm,
    AlarmLasts,
    Alarms,
    AlarmText,
    AlarmWords,
    Cause,
)
from gateway.core.errors import NotFound
from gateway.core.events import EventHub
from gateway.core.next_calls import get
from gateway.core.origin import Origin, acting

DOWN = "line.down"
SUBJECT = "/lines/line1"
OTHER = "/lines/line2"
PAT = Origin("pat", "r-1")


def told(happened: str, motor: str, remedy: str) -> AlarmText:
    return AlarmText(happened=happened, motor=motor, remedy=remedy)


class Room:
    """Alarms of a line that is down or not."""

    def __init__(self) -> None:
        self.down = True
        self.told_elsewhere = self.disproved = False
        self.hub = EventHub("0badcafe")
        cause = Cause(
            DOWN,
            DOWN,
            AlarmWords(
                told("{address} is down: {reason}", "It may move.", "Look."),
                told("{address}: {reason}", "動く可能性があります。", "確認してください。"),
            ),
            "RC-420 manual 10.2",
            (get("/lines/{line}", "line-state"), get("/units/{unit}", "robots.robot")),
            lambda _: self.down,
            is_told=lambda _: self.told_elsewhere,
            disproved=lambda _: self.disproved,
        )
        crash = AlarmWords(told("It crashed.", "-", "-"), told("落ちた", "-", "-"))
        moment = Cause("gateway.crashed", "gateway.crashed", crash)
        self.alarms = Alarms(self.hub, [cause, moment])
        self.hub.listeners.append(self.alarms.note)

    def goes_down(self, subject: str = SUBJECT, reason: str = "cut") -> None:
        self.down = True
        self.hub.publish(DOWN, subject, {"reason": reason})

    @property
    def one(self) -> Alarm:
        [alarm] = self.alarms.standing()
        return alarm

    def told(self) -> Iterator[tuple[str, dict[str, Any]]]:
        for number in range(1, self.hub.last + 1):
            event = self.hub.event(number)
            if event.type.startswith("alarm."):
                yield event.type, event.data


@pytest.fixture
def room() -> Room:
    return Room()


def test_an_event_raises_an_alarm_in_words(room: Room) -> None:
    with acting(PAT):
        room.goes_down()
    alarm = room.one
    assert (alarm.cause, alarm.subject, alarm.ended_at) == (DOWN, SUBJECT, None)
    assert (alarm.caller, alarm.request_id) == ("pat", "r-1")
    assert (alarm.en.happened, alarm.ja.happened) == ("line1 is down: cut", "line1: cut")
    assert [call.path for call in alarm.next] == ["/lines/line1"], "what cannot be filled in is left out"
    [(news, data)] = room.told()
    assert news == "alarm.raised"
    assert data["id"] == alarm.id


def test_while_the_cause_lasts_nothing_is_reset(room: Room) -> None:
    room.goes_down()
    with pytest.raises(AlarmLasts, match="line1 is down: cut That still lasts; nothing was reset") as refused:
        room.alarms.reset(room.one.id)
    assert [call.path for call in refused.value.next] == ["/lines/line1"]
    assert room.one.reset_at is None


def test_an_alarm_stands_after_its_cause_until_somebody_resets_it(room: Room) -> None:
    room.goes_down()
    room.down = False
    alarm = room.one
    assert alarm.ended_at is not None
    with acting(PAT):
        assert room.alarms.reset(alarm.id) is alarm
    assert (alarm.reset_by, room.alarms.standing(), room.alarms.history()) == ("pat", [], [alarm])
    assert [news for news, _ in room.told()] == ["alarm.raised", "alarm.reset"]
    assert room.alarms.reset(alarm.id).reset_by == "pat", "once more does no harm"


def test_an_alarm_that_turns_out_to_have_had_no_cause_ends_itself_as_a_note(room: Room) -> None:
    room.goes_down()
    room.disproved = True
    room.alarms.note_ends()
    assert room.one.reset_at is None, "it lasts"
    room.down = False
    assert room.alarms.standing() == []
    [note] = room.alarms.history()
    assert (note.reset_by, note.ended_at is None) == (DISPROVED, False)
    assert [news for news, _ in room.told()] == ["alarm.raised", "alarm.reset"]


def test_the_same_cause_that_lasts_is_one_alarm(room: Room) -> None:
    room.goes_down()
    first = room.one.id
    room.goes_down(reason="still cut")
    assert room.one.id == first


def test_another_error_is_another_alarm_though_the_first_one_lasts(room: Room) -> None:
    room.hub.publish(DOWN, SUBJECT, {"reason": "cut", "code": "001"})
    first = room.one
    room.hub.publish(DOWN, SUBJECT, {"reason": "cut", "code": "001"})
    assert room.one is first
    room.hub.publish(DOWN, SUBJECT, {"reason": "gone", "code": "002"})
    assert (room.one.code, room.one.en.happened) == ("002", "line1 is down: gone")


def test_an_alarm_ends_with_the_event_that_tells_so(room: Room) -> None:
    room.goes_down()
    first = room.one
    room.down = False
    room.hub.publish("line.up", SUBJECT, {})
    room.goes_down(reason="cut again")
    assert first.ended_at is not None
    assert (room.one.en.happened, first.reset_by) == ("line1 is down: cut again", AGAIN)


def test_what_an_alarm_of_something_larger_tells_is_none_of_its_own(room: Room) -> None:
    room.told_elsewhere = True
    room.goes_down()
    assert room.alarms.standing() == []
    room.told_elsewhere = False
    room.goes_down()
    assert room.one.cause == DOWN


def test_a_reset_means_what_was_seen(room: Room) -> None:
    room.goes_down()
    seen = room.one
    room.down = False
    room.alarms.note_ends()
    room.goes_down(reason="cut again")
    assert room.one.id != seen.id
    assert seen.reset_by == AGAIN
    with pytest.raises(AlarmLasts, match="come again"):
        room.alarms.reset(seen.id)
    assert room.one.reset_at is None


def test_what_happens_at_a_moment_is_over_at_once(room: Room) -> None:
    room.hub.publish("gateway.crashed", "/gateway", {})
    assert room.alarms.reset(room.one.id).ended_at is not None


def test_alarms_of_others_are_others(room: Room) -> None:
    room.goes_down()
    room.goes_down(OTHER)
    assert [alarm.subject for alarm in room.alarms.standing()] in ([OTHER, SUBJECT], [SUBJECT, OTHER])


def test_of_a_unit_the_robot_is_told() -> None:
    hub = EventHub()
    alarms = Alarms(
        hub, [Cause("a", "robot.move.lost", AlarmWords(told("-", "-", "-"), told("-", "-", "-")))]
    )
    hub.listeners.append(alarms.note)
    hub.publish("robot.move.lost", "/robots/r1/units/1", {})
    assert alarms.standing()[0].subject == "/robots/r1"


def test_at_the_end_nothing_is_raised(room: Room) -> None:
    room.alarms.closed = True
    room.goes_down()
    assert room.alarms.standing() == []


def test_an_alarm_of_an_earlier_life_is_looked_at_anew(room: Room) -> None:
    room.goes_down()
    later = Room()
    later.alarms.resume([room.one.model_copy()])
    assert later.one.ended_at is None
    later.down = False
    assert later.one.ended_at is not None


def test_a_cause_that_is_known_no_more_is_over(room: Room) -> None:
    room.goes_down()
    later = Alarms(EventHub(), [])
    later.resume([room.one.model_copy()])
    assert later.reset(later.standing()[0].id).reset_at is not None


def test_only_so_many_are_kept(room: Room) -> None:
    room.down = False
    ids = []
    for _ in range(HISTORY + 1):
        room.hub.publish("gateway.crashed", "/gateway", {})
        ids.append(room.one.id)
        room.alarms.reset(ids[-1])
    assert len(room.alarms.history()) == HISTORY
    with pytest.raises(NotFound):
        room.alarms.get(ids[0])


def test_a_change_is_told_to_who_keeps_it(room: Room) -> None:
    kept: list[str | None] = []
    told: Callable[[Alarm], object] = lambda alarm: kept.append(alarm.reset_by)  # noqa: E731
    room.alarms.on_change = told
    room.goes_down()
    room.down = False
    room.alarms.note_ends()
    room.alarms.note_ends()
    room.alarms.reset(room.one.id)
    assert kept == [None, None, "gateway"]


def test_a_latch_names_the_alarms_and_how_they_are_reset(room: Room) -> None:
    assert room.alarms.latched(["line1"]) is None
    room.goes_down()
    assert room.alarms.latched(["line2"]) is None
    refusal = room.alarms.latched(["line2", "line1"])
    assert refusal is not None
    assert "line.down at /lines/line1" in refusal.detail
    assert [call.path for call in refusal.next] == ["/lines/line1", f"/alarms/{room.one.id}/reset"]
