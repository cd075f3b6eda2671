"""The audit over HTTP: who did what, by key and by target."""

from pathlib import Path

import pytest

from tests.api.access.guarded import Keys
from tests.api.common.test_idempotent_requests import MOVES, client, relative
from tests.api.stand import Stand, on_stand
from tests.plants import in_virtual_time
from tests.world import World


@pytest.fixture
def world(tmp_path: Path) -> World:
    return World(tmp_path / "data")


@in_virtual_time
async def test_each_deed_has_its_caller_request_frame_and_outcome(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        answer = await http.post(f"{MOVES}?wait=30", json=relative(), headers={"x-request-id": "r-1"})
        move = answer.json()
        await http.post("/bodies/00/stop", json={"mode": "immediate"})
        audit = (await http.get("/audit?target=3F")).json()
        [deed] = audit["deeds"]
        assert audit["cursor"] is None
        assert (deed["request_id"], deed["effect"], deed["outcome"]) == ("r-1", "motion", "answered")
        assert deed["moves"] == [move["id"]]
        assert deed["frame"] == "&3F1+M500\r"
        page = (await http.get("/audit?limit=1")).json()
        rest = (await http.get(f"/audit?cursor={page['cursor']}")).json()
        assert [*page["deeds"], *rest["deeds"]] == (await http.get("/audit")).json()["deeds"]
        for oddly in ("since=yesterday", "cursor=newest"):
            assert (await http.get(f"/audit?{oddly}")).status_code == 422


@in_virtual_time
async def test_a_refusal_has_the_controller_s_code(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        refused = await http.post(MOVES, json=relative() | {"pattern": 12})
        assert refused.status_code in (409, 422)
        [deed] = (await http.get("/audit")).json()["deeds"]
        told = f"The controller told {refused.json()['code']}."
        assert (deed["outcome"], deed["detail"]) == ("refusal", told)


@in_virtual_time
async def test_who_has_a_key_is_named_and_a_scope_is_kept(world: World, tmp_path: Path) -> None:
    world.text = world.text.replace('mode = "open"', 'mode = "keys"')
    keys = Keys(tmp_path / "keys")
    async with world.gateway() as plant, client(plant, keys.credentials) as http:
        await http.post(MOVES, json=relative(), headers=keys.header("operator"))
        seen = (await http.get("/audit?caller=operator", headers=keys.header("viewer"))).json()
        assert [deed["caller"].partition(" ")[0] for deed in seen["deeds"]] == ["operator"]
        scoped = keys.header("viewer", "line1.3F")
        assert (await http.get("/audit?target=3F", headers=scoped)).json() == seen
        assert (await http.get("/audit", headers=scoped)).status_code == 403
        assert (await http.get("/audit?target=00", headers=scoped)).status_code == 403


@on_stand()
async def test_without_a_journal_there_is_none(stand: Stand) -> None:
    assert (await stand.get("/audit")).status_code == 404
