"""The security log over HTTP: who was let in, who was refused, who changed what; for administrators."""

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2

from gateway.access.keys import KeyPolicy
from gateway.access.roles import Role
from gateway.config_file import ConfigFile
from gateway.security.chain import verify
from tests.api.access.guarded import Keys
from tests.api.common.test_idempotent_requests import client
from tests.plants import in_virtual_time
from tests.tested_plant import TestedPlant
from tests.world import World

OWN = {"origin": "http://127.0.0.1:8420", "sec-fetch-site": "same-origin"}
FORM = {"content-type": "application/x-www-form-urlencoded"}


@dataclass
class Scene:
    """A guarded gateway with a data directory."""

    world: World
    plant: TestedPlant
    http: httpx2.AsyncClient
    keys: Keys

    async def post(self, path: str, role: str, content: object = None, **headers: str) -> httpx2.Response:
        return await self.http.post(path, json=content, headers={**self.keys.header(role), **headers})

    async def sign_in(self, key: str) -> httpx2.Response:
        self.http.cookies.clear()
        return await self.http.post("/sign-in", content=f"key={key}", headers={**OWN, **FORM})

    async def entries(self, query: str = "limit=1000") -> list[dict[str, Any]]:
        answer = await self.http.get(f"/security?{query}", headers=self.keys.header("admin"))
        assert answer.status_code == 200, answer.text
        return list(answer.json()["entries"])

    async def last(self, type_: str) -> dict[str, Any]:
        return next(it for it in await self.entries() if it["type"] == type_)


@asynccontextmanager
async def scene(folder: Path) -> AsyncIterator[Scene]:
    world = World(folder / "data")
    world.text = world.text.replace('mode = "open"', 'mode = "keys"')
    keys = Keys(folder / "keys")
    async with world.gateway() as plant, client(plant, keys.credentials) as http:
        yield Scene(world, plant, http, keys)


def told(entry: Mapping[str, Any]) -> tuple[object, ...]:
    return entry["caller"], entry["address"], entry["target"]


@in_virtual_time
async def test_only_an_administrator_of_the_whole_plant_reads_it_newest_first(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        for role, *scope in (("viewer",), ("setup",), ("admin", "line1.3F")):
            answer = await it.http.get("/security", headers=it.keys.header(role, *scope))
            assert answer.status_code == 403
        found = await it.entries()
        assert [entry["type"] for entry in found] == [*3 * ["request.refused"], "gateway.started"]
        assert [entry["caller"] for entry in found] == ["admin-line1.3F", "setup", "viewer", "gateway"]
        answer = await it.http.get("/security?limit=2", headers=it.keys.header("admin"))
        older = await it.entries(f"cursor={answer.json()['cursor']}")
        assert [*answer.json()["entries"], *older] == found
        assert older[-1]["number"] == 1


@in_virtual_time
async def test_a_key_that_is_made_and_ended_names_who_did_it(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        new = {"name": "mes", "role": "operator", "scope": ["line1"], "expires_s": 60}
        made = await it.post("/access/keys", "admin", new, **{"x-request-id": "r-1"})
        await it.http.delete("/access/keys/mes", headers=it.keys.header("admin"))
        revoked, first = (await it.entries())[:2]
        assert (first["type"], *told(first)) == ("key.made", "admin", "127.0.0.1", "mes")
        assert (first["request_id"], first["data"]["scope"]) == ("r-1", ["line1"])
        assert (revoked["type"], *told(revoked)) == ("key.revoked", "admin", "127.0.0.1", "mes")
        assert made.json()["key"] not in str(await it.entries())


@in_virtual_time
async def test_no_use_of_the_gateway_pushes_an_entry_out(tmp_path: Path) -> None:
    """Later events push out the event that a key was made; the entry in the log stays."""
    async with scene(tmp_path) as it:
        await it.post("/access/keys", "admin", {"name": "mes", "role": "viewer"})
        for number in range(300):
            await it.post("/bodies/3F/stop", "viewer", {"mode": "immediate"})
            await it.post("/leases", "operator", {"scope": "line1.3F", "ttl_s": 0.5})
            await it.sign_in(f"wrong{number}")
        assert (await it.last("key.made"))["target"] == "mes"
        assert len(await it.entries()) < 100
        assert verify(it.world.folder).fault is None


@in_virtual_time
async def test_wrong_sign_ins_leave_a_trace_and_an_alarm_that_latches_nothing(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        statuses = [(await it.sign_in(f"wrong{number}")).status_code for number in range(1500)]
        assert statuses[:100] == 100 * [401]
        assert statuses[-1] == 503
        found = [entry for entry in await it.entries() if entry["type"] == "sign_in.refused"]
        assert sum(entry["count"] for entry in found) == 1500
        assert {told(entry) for entry in found} == {(None, "127.0.0.1", "/sign-in")}
        alarms = (await it.http.get("/alarms", headers=it.keys.header("viewer"))).json()["alarms"]
        [alarm] = [alarm for alarm in alarms if alarm["cause"] == "gateway.refusals.burst"]
        assert "the last from 127.0.0.1" in alarm["en"]["happened"]
        assert it.plant.alarms.latched(["gateway", "line1.3F"]) is None
        assert (await it.sign_in(it.keys.of("viewer"))).status_code == 303  # a good key is let in


@in_virtual_time
async def test_a_bad_credential_is_told_and_one_that_is_missing_is_not(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        await it.http.get("/bodies")
        await it.http.get("/bodies", headers={"cookie": "mg-session=over"})
        await it.http.get("/bodies", headers={"authorization": "Bearer mg_0_0"})
        refused, started = await it.entries()
        assert (refused["type"], *told(refused)) == ("credential.refused", None, "127.0.0.1", "GET /bodies")
        assert started["type"] == "gateway.started"


@in_virtual_time
async def test_sessions_are_told_from_their_beginning_to_their_end(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        await it.sign_in(it.keys.of("viewer"))
        began = await it.last("sign_in.accepted")
        assert (began["caller"], began["address"]) == ("viewer", "127.0.0.1")
        await it.http.post("/sign-out", headers=OWN)
        ended = await it.last("session.ended")
        assert (ended["caller"], ended["data"]) == ("viewer", {"why": "signed_out", "of": "viewer"})
        assert ended["target"] == began["target"]


@in_virtual_time
async def test_leases_are_told_with_who_lost_them(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        lease = {"scope": "line1.3F", "ttl_s": 5}
        await it.post("/leases", "operator", lease)
        await it.post("/leases", "admin", {**lease, "take_over": True})
        it.plant.access.leases.clock = lambda: float("inf")
        it.plant.access.leases.expire()
        expired, taken, over, first, *_ = await it.entries()
        assert (first["type"], *told(first)) == ("lease.taken", "operator", "127.0.0.1", "line1.3F")
        assert (over["type"], over["caller"], over["data"]["holder"]) == (
            *("lease.taken_over", "admin"),
            "operator",
        )
        assert (taken["type"], taken["caller"]) == ("lease.taken", "admin")
        assert (expired["type"], expired["caller"], expired["address"]) == ("lease.expired", "gateway", None)


@in_virtual_time
async def test_what_is_named_acknowledged_reset_and_asked_is_told(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        await it.http.put(
            "/bodies/3F/positions/7/name", json={"name": "home"}, headers=it.keys.header("setup")
        )
        named = await it.last("position.named")
        assert (*told(named), named["data"]) == ("setup", "127.0.0.1", "line1.3F", {"names": {"7": "home"}})
        await it.post("/bodies/3F/power-cycle/acknowledge", "operator")
        assert told(await it.last("power_cycle.acknowledged")) == ("operator", "127.0.0.1", "line1.3F")
        it.plant.events.publish("gateway.reload_failed", "/gateway", {"reason": "no file"})
        [alarm] = it.plant.alarms.standing()
        await it.post(f"/alarms/{alarm.id}/reset", "operator")
        reset = await it.last("alarm.reset")
        assert (*told(reset), reset["data"]["cause"]) == (
            *("operator", "127.0.0.1", "/gateway"),
            "gateway.reload_failed",
        )
        await it.post("/system/scans", "admin", {"ports": ["/dev/ttyUSB77"]})
        assert (await it.last("port_scan.started"))["target"] == "/dev/ttyUSB77"


@in_virtual_time
async def test_another_configuration_is_told_and_one_that_was_not_taken(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        file = tmp_path / "gateway.toml"
        file.write_text(it.world.text)
        it.plant.file = ConfigFile(file)
        new = {"id": "line2", "address": "tcp://10.1.0.7:4001", "bodies": [{"id": "01"}]}
        for dry_run in (True, False):
            answer = await it.post("/lines", "admin", {"line": new, "dry_run": dry_run})
            assert answer.status_code == 200, answer.text
        added, reload, *_ = await it.entries()
        assert (added["type"], *told(added)) == ("line.added", "admin", "127.0.0.1", "line2")
        assert (reload["type"], reload["data"]["lines"]) == ("reload", ["line2 added"])
        await it.post("/lines/line2/bodies", "admin", {"bodies": [{"id": "02"}]})
        assert (await it.last("bodies.added"))["data"] == {"bodies": ["02"]}
        file.write_text("[")
        await it.post("/system/reload", "admin")
        assert told(await it.last("reload.refused")) == ("admin", "127.0.0.1", str(file))


@in_virtual_time
async def test_who_rotated_and_who_approved_a_key_is_kept(tmp_path: Path) -> None:
    async with scene(tmp_path) as it:
        await it.post("/access/keys", "admin", {"name": "mes", "role": "operator"})
        rotated = await it.post("/access/keys/mes/rotate", "admin", {"overlap_s": 60})
        assert rotated.status_code == 201
        entry = await it.last("key.changed")
        assert (entry["caller"], entry["target"]) == ("admin", "mes")
        assert entry["address"]
        assert entry["request_id"]
        assert (entry["data"]["role"], entry["data"]["overlap"]) == ("operator", "60 s")
        bob = {"authorization": f"Bearer {it.keys.store.create('bob', Role.ADMIN)}"}
        it.keys.store.adopt(KeyPolicy(four_eyes=True))
        await it.post("/access/keys", "admin", {"name": "eve", "role": "admin"})
        assert (await it.http.post("/access/keys/eve/approve", headers=bob)).status_code == 200
        entry = await it.last("key.approved")
        assert (entry["caller"], entry["target"]) == ("bob", "eve")
