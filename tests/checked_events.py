"""A hub that publishes what stands in the table of events, and fails the test on anything else."""

import re
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel
from pydantic_core import to_json

from gateway.core.event_types import EventType
from gateway.core.events import Data, Event, EventHub
from gateway.core.live import Live
from gateway.event_types import event_types

_BRACED = re.compile(r"\\\{[\w\\ ]+\\\}")


def subject_fits(row: EventType, subject: str) -> bool:
    """Say whether a subject has the form of its type's."""
    forms = (re.escape(form) for form in row.subject.split(" or "))
    return any(re.fullmatch(_BRACED.sub("[^/]+", form), subject) for form in forms)


class CheckedLive(Live):
    """Refuses values of no known type, about something else, or with other data."""

    def __init__(self, live: Live, rows: Mapping[str, EventType]) -> None:
        vars(self).update(vars(live))
        self._rows = rows

    def put(self, type_: str, subject: str, data: BaseModel, at: float | None = None) -> None:
        row = self._rows[type_]
        assert row.live
        assert subject_fits(row, subject), f"{type_} is about {row.subject}, not {subject}"
        assert type(data) is row.data
        super().put(type_, subject, data, at)


class CheckedHub(EventHub):
    """Refuses events of no known type, about something else, or with other data."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._rows = event_types()
        self.live = CheckedLive(self.live, self._rows)

    def publish(self, type_: str, subject: str, data: Data, correlation: str | None = None) -> Event:
        row = self._rows.get(type_)
        assert row is not None, f"{type_} stands in no table of events"
        assert subject_fits(row, subject), f"{type_} is about {row.subject}, not {subject}"
        event = super().publish(type_, subject, data, correlation)
        if not (isinstance(data, BaseModel) and type(data) is row.data):
            row.data.model_validate_json(to_json(event.data))
        return event
