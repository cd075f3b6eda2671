"""Types of events: one name each, a subject, and data that says what there is."""

import re

import pytest

from gateway.core.event_types import CORE, EventData, EventType, Nothing, table_of
from gateway.core.events import _TYPE
from gateway.event_types import EVENT_TYPES
from tests.checked_events import CheckedHub, subject_fits

SUBJECTS = (*("/lines/{", "/bodies/{", "/groups/{", "/scaras/{", "/robots/{", "/gateway", "/events"),)


def test_names_are_words_joined_by_dots_and_begin_with_their_subject() -> None:
    for name, row in EVENT_TYPES.items():
        assert _TYPE.fullmatch(name)
        assert row.name == name
        assert row.subject.startswith(SUBJECTS)
        assert re.fullmatch(r"\d+\.\d+\.\d+", row.since)


def test_a_name_cannot_be_given_twice() -> None:
    with pytest.raises(ValueError, match="one name"):
        table_of(CORE, CORE[:1])


def test_subjects_have_the_form_of_their_type() -> None:
    row = EventType("robot.move.sent", "/robots/{robot_id}/units/{unit}", EventData, "it is sent")
    assert subject_fits(row, "/robots/r1/units/1")
    assert not subject_fits(row, "/robots/r1")
    assert not subject_fits(row, "/robots/r1/units/1/more")


def test_a_test_fails_on_what_stands_in_no_table() -> None:
    hub = CheckedHub()
    hub.publish("body.online", "/bodies/line1.3F", {})
    with pytest.raises(AssertionError, match="no table"):
        hub.publish("body.on_line", "/bodies/line1.3F", {})
    with pytest.raises(AssertionError, match="is about"):
        hub.publish("body.online", "/lines/line1", {})
    with pytest.raises(ValueError, match="extra"):
        hub.publish("body.online", "/bodies/line1.3F", {"since": 1})


def test_the_type_can_say_all() -> None:
    assert EVENT_TYPES["robot.online"].data is Nothing
