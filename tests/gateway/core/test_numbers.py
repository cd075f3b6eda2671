"""Numbers of event types and alarm causes: each has one, and none that was published is ever another's."""

from pathlib import Path

from gateway.core.alarms import Alarm
from gateway.core.numbers import ALARMS, EVENTS
from gateway.event_types import EVENT_TYPES
from tests.gateway.test_alarm_kinds import causes

PUBLISHED = Path(__file__).with_name("published_numbers.txt").read_text("ascii").splitlines()
"""Lines are added to this list, and none is ever changed."""
TABLES = {"events": EVENTS, "alarms": ALARMS}


def test_what_was_published_has_its_number_for_ever() -> None:
    rows = [line.split() for line in PUBLISHED]
    assert {(of, name): TABLES[of].get(name) for of, _, name in rows} == {
        (of, name): int(number) for of, number, name in rows
    }


def test_what_has_a_number_is_published() -> None:
    told = {f"{of} {number} {name}" for of, table in TABLES.items() for name, number in table.items()}
    assert told == set(PUBLISHED), f"add to {__name__}'s list: {told - set(PUBLISHED)}"


def test_each_type_and_each_cause_has_a_number_of_its_own() -> None:
    assert EVENT_TYPES.keys() <= EVENTS.keys(), "add them at the end of numbers.toml"
    assert {it.name for it in causes()} <= ALARMS.keys(), "add them at the end of numbers.toml"
    for table in TABLES.values():
        assert sorted(table.values()) == list(range(1, len(table) + 1))


def test_an_alarm_of_an_earlier_version_has_its_number_too() -> None:
    text = {"happened": "", "motor": "", "remedy": ""}
    kept = Alarm.model_validate(
        {"id": "a", "cause": "body.offline", "subject": "/bodies/line1.3F", "caller": "",
         "raised_at": "2026-01-31T12:00:00Z", "request_id": None,
         "manual": "", "en": text, "ja": text, "next": []}
    )  # fmt: skip
    assert kept.number == ALARMS["body.offline"]
