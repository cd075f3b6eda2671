"""A document is sent back as GET gives it: what cannot be set passes, and is refused where it was changed."""

from typing import Any

import pytest

from tests.api.bodies.test_speed_sets import QUICK, set_by
from tests.api.stand import Stand, on_stand

DOCUMENTS = [
    ("PUT", "/bodies/01/speed-sets/12"),
    ("PATCH", "/bodies/01/speed-sets/12"),
    ("PUT", "/bodies/01/patterns/3"),
    ("PATCH", "/bodies/01/patterns/3"),
    ("PATCH", "/bodies/01/settings"),
    ("PATCH", "/bodies/01/homing"),
    ("PATCH", "/bodies/01/encoder"),
    ("PUT", "/bodies/01/positions?first=5&last=7"),
    ("PUT", "/bodies/01/memories?first=D0&count=3"),
]


async def prepared(stand: Stand) -> None:
    """Let a body hold something of each kind."""
    await stand.client.put("/bodies/01/speed-sets/12", json=QUICK)
    change = {"point": 2, "begin": 30_000, "speed_pps": 20_000}
    pattern = {"acceleration_set": 12, "deceleration_set": 12, "changes": [change]}
    made = await stand.client.put("/bodies/01/patterns/3", json=pattern)
    assert made.status_code == 200, made.text
    seven = {"number": 7, "position": {"value": 12, "unit": "mm"}, "name": "load"}
    stored = await stand.client.put("/bodies/01/positions", json={"positions": [seven]})
    assert stored.status_code == 200, stored.text


def settings_in(stand: Stand) -> list[str]:
    """The settings that were sent, but for positions and memories, which are stored anew in any case."""
    return [it for it in set_by(stand.frames()) if it[:3] not in ("3PS", "UDS")]


@pytest.mark.parametrize(("method", "path"), DOCUMENTS)
def test_a_document_as_it_was_read_changes_nothing(method: str, path: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        await prepared(stand)
        document, before = (await stand.get(path)).json(), settings_in(stand)
        answer = await stand.client.request(method, path.partition("?")[0], json=document)
        assert answer.status_code == 200, answer.text
        assert settings_in(stand) == before
        again = (await stand.get(path)).json()
        assert {**again, "flash": None} == {**document, "flash": None}

    story()


@pytest.mark.parametrize(("method", "path"), DOCUMENTS)
def test_what_cannot_be_set_is_refused_by_its_name_where_it_was_changed(method: str, path: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        await prepared(stand)
        document, before = (await stand.get(path)).json(), set_by(stand.frames())
        answer = await stand.client.request(
            method, path.partition("?")[0], json={**document, "body_id": "arm.02"}
        )
        assert answer.status_code == 422
        assert answer.json()["detail"].startswith("body_id: it cannot be set, and is otherwise now")
        assert set_by(stand.frames()) == before
        unknown = await stand.client.request(method, path.partition("?")[0], json={**document, "colour": 1})
        assert (unknown.status_code, unknown.json()["errors"][0]["field"]) == (422, "colour")

    story()


@on_stand()
async def test_the_settings_alone_go_back_with_the_nulls_of_what_is_not_there(stand: Stand) -> None:
    told = (await stand.get("/bodies/01/settings")).json()["settings"]
    assert (told["adjustment"], told["soft_limits"]) == (None, None)
    answer = await stand.client.patch("/bodies/01/settings", json={**told, "homing_retries": 2})
    assert answer.status_code == 200, answer.text
    assert set_by(stand.frames()) == ["0RS2"]
    refused = await stand.client.patch("/bodies/01/settings", json={"homing_retries": None})
    assert refused.status_code == 422
    assert refused.json()["detail"] == "homing_retries: null is no value of it; nothing was sent."


@on_stand()
async def test_a_position_is_stored_by_its_pulses_and_never_by_a_value_that_was_changed(stand: Stand) -> None:
    await prepared(stand)
    [entry] = (await stand.get("/bodies/01/positions?first=7&last=7")).json()["positions"]
    assert entry == {"number": 7, "name": "load", "pulses": 12_000, "value": 12.0, "unit": "mm"}

    async def put(**changed: Any) -> Any:
        return await stand.client.put("/bodies/01/positions", json={"positions": [{**entry, **changed}]})

    assert (await put(pulses=13_000)).json()["positions"][0]["value"] == 13.0
    assert (await put(pulses=14_000, value=14.0)).status_code == 200
    before = set_by(stand.frames())
    wrong = await put(value=15.0)
    assert wrong.status_code == 422
    assert wrong.json()["detail"].startswith("positions.7.value: it cannot be set")
    alone = {"positions": [{"number": 7, "value": 15.0, "unit": "mm"}]}
    told = await stand.client.put("/bodies/01/positions", json=alone)
    assert told.status_code == 422
    assert "value and unit follow from pulses" in told.text
    assert set_by(stand.frames()) == before


@on_stand()
async def test_a_change_of_speed_is_placed_by_its_beginning(stand: Stand) -> None:
    await prepared(stand)
    document = (await stand.get("/bodies/01/patterns/3")).json()
    [change] = document["changes"]
    moved = {**document, "changes": [{**change, "begin": change["begin"] + 100}]}
    answer = await stand.client.put("/bodies/01/patterns/3", json=moved)
    assert answer.status_code == 200, answer.text
    assert answer.json()["changes"][0]["begin"] == change["begin"] + 100
    wrong = {**document, "changes": [{**change, "speed": {"value": 1.0, "unit": "mm/s"}}]}
    refused = await stand.client.put("/bodies/01/patterns/3", json=wrong)
    assert refused.status_code == 422
    assert refused.json()["detail"].startswith("changes.2.")
