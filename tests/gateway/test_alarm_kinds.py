"""Each kind of alarms: raised by its event, worded whole in both languages, with calls, and reset."""

from contextlib import nullcontext
from typing import Any, Final

import pytest
from pydantic import BaseModel
from pydantic_core import to_json

from gateway.causes import causes_of
from gateway.config import parse
from gateway.core.alarms import AlarmLasts, Cause
from gateway.core.origin import Origin, acting
from gateway.event_types import EVENT_TYPES
from simulator.rorze.line import build_line
from tests.fics_plants import SCARA
from tests.plants import Wire, configuration, in_virtual_time
from tests.tested_plant import TestedPlant
from tests.through_the_door import reset

PARTS: Final = {
    "body_id": "line1.3F",
    "group_id": "line1.80",
    "line_id": "line1",
    "robot_id": "r1",
    "unit": "1",
}
ROBOT_LINE: Final = (
    f'\n[[lines]]\nid = "cell"\naddress = "tcp://127.0.0.1:2"\nprotocol = "fics"\n'
    f'robot = {{id = "r1", units = [{SCARA}]}}\n'
)


def plant() -> TestedPlant:
    config = parse(configuration(server="latch = true") + ROBOT_LINE, "test.toml")
    return TestedPlant(config, open_transport=lambda _: Wire(build_line([], 0.0)))


def causes() -> list[Cause]:
    return list(causes_of(plant().packages.families.values(), {}, {}, latch=True))


def sample(model: type[BaseModel]) -> Any:
    """Data of a model, in which a text is the name of its field."""
    schema = model.model_json_schema()
    return _sample(schema, schema.get("$defs", {}), "")


def _sample(schema: dict[str, Any], defs: dict[str, Any], name: str) -> Any:
    if "$ref" in schema:
        return _sample(defs[schema["$ref"].rpartition("/")[2]], defs, name)
    if options := schema.get("anyOf") or schema.get("oneOf"):
        return _sample(options[0], defs, name)
    if "const" in schema or "enum" in schema:
        return schema["const"] if "const" in schema else schema["enum"][0]
    match schema.get("type"):
        case "object":
            return {key: _sample(part, defs, key) for key, part in schema.get("properties", {}).items()}
        case "array":
            return [_sample(schema.get("items", {}), defs, name)] * schema.get("minItems", 1)
        case "string":
            return "2026-11-23T00:00:00Z" if schema.get("format") == "date-time" else name
        case "boolean":
            return True
        case "integer" | "number":
            return schema.get("minimum", 1)
    return None


@pytest.mark.parametrize("name", [cause.name for cause in causes()])
def test_an_alarm_says_what_happened_what_the_motor_did_and_what_to_do(name: str) -> None:
    @in_virtual_time
    async def story() -> None:
        it = plant()
        [cause] = [cause for cause in causes() if cause.name == name]
        row = EVENT_TYPES[cause.event]
        data = sample(row.data)
        if cause.event == "body.status.changed":
            data["status"] = [name.removeprefix("body.")]
        subject = row.subject.split(" or ")[0].format_map(PARTS)
        with acting(Origin("operator")):
            it.events.publish(cause.event, subject, row.data.model_validate_json(to_json(data)))
        [alarm] = [alarm for alarm in it.alarms.standing() if alarm.cause == name]
        for text in (alarm.en, alarm.ja):
            assert all(part and "{" not in part for part in text.model_dump().values())
        assert alarm.subject in (subject, subject.removesuffix("/units/1"))
        assert alarm.subject == "/gateway" or alarm.manual
        assert len(alarm.next) == len(cause.next) > 0
        lasts = alarm.ended_at is None
        with pytest.raises(AlarmLasts) if lasts else nullcontext():
            await reset(it, Origin("operator"), alarm.id)
        assert (name in {alarm.cause for alarm in it.alarms.standing()}) is lasts

    story()


@pytest.mark.parametrize("cause", causes(), ids=lambda cause: cause.name)
def test_what_lasts_has_words_for_when_it_is_over(cause: Cause) -> None:
    lasts = cause.lasts is not Cause.lasts
    words, past = cause.words, cause.words.over
    assert (past is not None) == lasts
    if past is not None:
        for now, over in ((words.en, past.en), (words.ja, past.ja)):
            assert all(part.strip() for part in over.model_dump().values())
            assert over.motor != now.motor or over.happened != now.happened
