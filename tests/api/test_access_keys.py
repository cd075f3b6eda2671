"""Keys over HTTP: an administrator of the whole plant makes them, sees them once, and revokes them."""

from typing import Any

from gateway.access.keys import KeyPolicy
from gateway.access.roles import Role
from tests.api.access.guarded import Keys, guarded
from tests.api.stand import Stand, on_stand

KEYS = "/access/keys"


async def made(stand: Stand, keys: Keys, **new: object) -> dict[str, Any]:
    answer = await stand.post(KEYS, {"name": "mes", "role": "operator", **new}, **keys.header("admin"))
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


async def listed(stand: Stand, keys: Keys) -> dict[str, dict[str, Any]]:
    answer = await stand.get(KEYS, **keys.header("admin"))
    assert answer.status_code == 200, answer.text
    return {it["name"]: it for it in answer.json()["keys"]}


def told(stand: Stand) -> list[tuple[str, object]]:
    hub = stand.plant.events
    events = [hub.event(number) for number in range(hub.first, hub.last + 1)]
    return [(it.type, it.data["name"]) for it in events if it.type.startswith("gateway.key.")]


@guarded()
async def test_a_key_is_shown_once_and_good_at_once(stand: Stand, keys: Keys) -> None:
    key = await made(stand, keys, scope=["arm"], expires_s=3600)
    assert key["key"].startswith(key["begins"])
    header = {"authorization": f"Bearer {key['key']}"}
    identity = (await stand.get("/system/identity", **header)).json()
    assert (identity["name"], identity["role"], identity["scope"]) == ("mes", "operator", ["arm"])
    everything = (await stand.get(KEYS, **keys.header("admin"))).text
    assert key["key"] not in everything
    assert (await listed(stand, keys))["mes"]["state"] == "good"
    keys.now += 3600
    assert (await stand.get("/system/identity", **header)).status_code == 401
    assert (await listed(stand, keys))["mes"]["state"] == "expired"


@guarded()
async def test_the_answer_with_the_secret_is_kept_by_nobody(stand: Stand, keys: Keys) -> None:
    new = {"name": "mes", "role": "operator"}
    answer = await stand.post(KEYS, new, **keys.header("admin"))
    assert answer.headers["cache-control"] == "no-store"
    again = await stand.post(KEYS, new, **keys.header("admin"), **{"idempotency-key": "once"})
    assert again.status_code == 422
    assert "nothing was sent" in again.json()["detail"]


@guarded()
async def test_a_revoked_key_is_of_no_use(stand: Stand, keys: Keys) -> None:
    key = await made(stand, keys)
    revoked = await stand.client.delete(f"{KEYS}/mes", headers=keys.header("admin"))
    assert revoked.json()["state"] == "revoked"
    header = {"authorization": f"Bearer {key['key']}"}
    assert (await stand.get("/system/identity", **header)).status_code == 401
    again = await stand.client.delete(f"{KEYS}/mes", headers=keys.header("admin"))
    assert again.status_code == 404
    assert told(stand) == [("gateway.key.made", "mes"), ("gateway.key.revoked", "mes")]


@guarded()
async def test_nobody_locks_himself_out(stand: Stand, keys: Keys) -> None:
    answer = await stand.client.delete(f"{KEYS}/admin", headers=keys.header("admin"))
    assert answer.status_code == 403
    assert "it was not revoked" in answer.json()["detail"]
    assert (await listed(stand, keys))["admin"]["state"] == "good"


@guarded()
async def test_an_administrator_of_a_part_makes_no_keys(stand: Stand, keys: Keys) -> None:
    new = {"name": "mes", "role": "admin"}
    for header in (keys.header("admin", "arm", "leg"), keys.header("setup")):
        assert (await stand.post(KEYS, new, **header)).status_code == 403
    assert "mes" not in await listed(stand, keys)


@guarded()
async def test_what_is_no_key_is_refused_with_the_reason(stand: Stand, keys: Keys) -> None:
    wrong: list[tuple[dict[str, object], str]] = [
        ({"name": "gateway"}, "is no name of a key"),
        ({"name": "admin"}, "There is a good key admin already"),
        ({"scope": ["a b"]}, "is no address"),
        ({"role": "boss"}, "admin"),
        ({"expires_s": 0}, "expires_s"),
    ]
    for new, said in wrong:
        answer = await stand.post(KEYS, {"name": "mes", "role": "operator"} | new, **keys.header("admin"))
        assert answer.status_code == 422
        assert said in answer.text
    assert list(await listed(stand, keys)) == ["admin"]


@guarded()
async def test_a_file_that_cannot_be_trusted_changes_nothing(stand: Stand, keys: Keys) -> None:
    await made(stand, keys)
    file = next(iter(keys.store._directory.glob("keys.json")))
    file.chmod(0o666)
    header = keys.header("admin")
    for asking in (
        stand.get(KEYS, **header),
        stand.post(KEYS, {"name": "two", "role": "viewer"}, **header),
        stand.client.delete(f"{KEYS}/mes", headers=header),
    ):
        answer = await asking
        assert answer.status_code == 503, answer.text
        assert "Others may write" in answer.json()["detail"]


@on_stand()
async def test_where_everybody_is_let_in_nobody_makes_keys(stand: Stand) -> None:
    for asking in (stand.get(KEYS), stand.post(KEYS, {"name": "mes", "role": "admin"})):
        answer = await asking
        assert answer.status_code == 403
        assert "lets everybody in" in answer.json()["detail"]


@guarded()
async def test_a_key_ends_after_a_year_if_nothing_else_is_said(stand: Stand, keys: Keys) -> None:
    await made(stand, keys)
    keys.now += 365 * 86_400 - 1
    await made(stand, keys, name="later")
    assert {name: it["state"] for name, it in (await listed(stand, keys)).items() if name != "admin"} == {
        "mes": "good",
        "later": "good",
    }
    keys.now += 1
    assert (await listed(stand, keys))["mes"]["state"] == "expired"


@guarded()
async def test_a_key_is_rotated_with_an_overlap(stand: Stand, keys: Keys) -> None:
    old = await made(stand, keys)
    answer = await stand.post(f"{KEYS}/mes/rotate", {"overlap_s": 60}, **keys.header("admin"))
    assert (answer.status_code, answer.headers["cache-control"]) == (201, "no-store")
    for key in (old, answer.json()):
        header = {"authorization": f"Bearer {key['key']}"}
        assert (await stand.get("/system/identity", **header)).json()["name"] == "mes"
    keys.now += 60
    header = {"authorization": f"Bearer {old['key']}"}
    assert (await stand.get("/system/identity", **header)).status_code == 401
    assert told(stand)[-1] == ("gateway.key.rotated", "mes")
    unknown = await stand.post(f"{KEYS}/none/rotate", {}, **keys.header("admin"))
    assert unknown.status_code == 404
    assert (await stand.post(f"{KEYS}/mes/rotate", {}, **keys.header("setup"))).status_code == 403


@guarded()
async def test_a_second_admin_approves_the_key_of_an_admin(stand: Stand, keys: Keys) -> None:
    keys.store.adopt(KeyPolicy(four_eyes=True))
    keys.of("admin")
    second = {"authorization": f"Bearer {keys.store.create('bob', Role.ADMIN)}"}
    key = await made(stand, keys, name="eve", role="admin")
    header = {"authorization": f"Bearer {key['key']}"}
    assert (key["state"], key["made_by"]) == ("waiting", "admin")
    assert (await stand.get("/system/identity", **header)).status_code == 401
    assert (await stand.post(f"{KEYS}/eve/approve", **keys.header("admin"))).status_code == 403
    approved = await stand.post(f"{KEYS}/eve/approve", **second)
    assert (approved.status_code, approved.json()["approved_by"]) == (200, "bob")
    assert (await stand.get("/system/identity", **header)).status_code == 200
    assert (await stand.post(f"{KEYS}/eve/approve", **second)).status_code == 404
    assert told(stand)[-1] == ("gateway.key.approved", "eve")
