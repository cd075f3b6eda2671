"""The models of events take what the gateway really publishes, and no type they do not know."""

import pytest
from pydantic import ValidationError

from gateway.core.event_types import LineDown
from gateway.door.event_models import EventList
from tests.checked_events import CheckedHub


def test_a_published_event_is_of_its_types_model() -> None:
    event = CheckedHub().publish("line.down", "/lines/arm", LineDown(reason="The port has gone."))
    page = EventList.model_validate_json(f'{{"events": [{event.json}], "cursor": "{event.cursor}"}}')
    (read,) = dict(page)["events"]
    assert type(read).__name__ == "LineDownEvent"
    assert read.data == LineDown(reason="The port has gone.")


def test_a_type_that_stands_in_no_table_is_none() -> None:
    event = CheckedHub().publish("line.down", "/lines/arm", LineDown(reason="The port has gone."))
    with pytest.raises(ValidationError, match=r"line\.sideways"):
        EventList.model_validate_json(
            f'{{"events": [{event.json.replace("line.down", "line.sideways")}], "cursor": "a"}}'
        )
