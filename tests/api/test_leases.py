"""Leases over HTTP: only the holder moves and sets, everybody reads and stops."""

import asyncio
from collections.abc import Mapping
from typing import Any, Final

import httpx2

from gateway.core.errors import NotFound
from tests.api.access.guarded import Keys, guarded
from tests.api.robots.cell import HOME, Cell, in_cell, mm
from tests.api.stand import RELATIVE, Stand, on_stand

FAR = {"kind": "relative", "direction": "cw", "distance": {"value": 200_000, "unit": "pulse"}}
NO_KEY: Final[Mapping[str, str]] = {}
ENDLESS = {"kind": "continuous", "direction": "cw"}


def is_refused(answer: httpx2.Response, status: int = 409, kind: str = "lease") -> None:
    assert (answer.status_code, answer.json()["type"].rpartition(":")[2]) == (status, kind), answer.text
    assert answer.json()["moved"] == "no"
    assert "nothing was" in answer.json()["detail"]


def in_virtual_time(place: Stand | Cell) -> None:
    plant = place.plant if isinstance(place, Stand) else place.rig.plant
    plant.access.leases.clock = asyncio.get_running_loop().time


async def leased(
    place: Stand | Cell, scope: str, header: Mapping[str, str] = NO_KEY, ttl_s: float = 10.0
) -> dict[str, Any]:
    """Take a lease that no other caller has; give it with the header that shows it."""
    answer = await place.post("/leases", {"scope": scope, "ttl_s": ttl_s}, **header)
    assert answer.status_code == 201, answer.text
    taken = dict(answer.json())
    assert answer.headers["location"] == f"/leases/{taken['lease']}"
    return taken | {"header": {"Lease-Token": str(taken["token"])}}


def leases_told(place: Stand) -> list[tuple[str, str]]:
    hub = place.plant.events
    events = [hub.event(number) for number in range(hub.first, hub.last + 1)]
    return [(it.type, it.subject) for it in events if ".lease." in it.type]


@guarded()
async def test_what_is_leased_is_moved_and_set_by_its_holder_alone(stand: Stand, keys: Keys) -> None:
    anna, bert = keys.header("operator", "arm"), keys.header("setup")
    await stand.post("/bodies/arm.3F/commands/set-maximum-speed", {"speed": 50_000}, **bert)
    lease = await leased(stand, "arm.3F", anna)
    before = stand.frames()
    is_refused(await stand.post("/bodies/arm.3F/moves", RELATIVE, **bert))
    is_refused(await stand.post("/bodies/arm.3F/commands/set-maximum-speed", {"speed": 9_000}, **bert))
    is_refused(await stand.post("/groups/arm.80/moves", RELATIVE, **bert))
    guessed = {"Lease-Token": ",".join(map(str, range(1, 30)))}
    is_refused(await stand.post("/bodies/arm.3F/moves", RELATIVE, **bert, **guessed))
    is_refused(await stand.post(f"/leases/{lease['lease']}/renew", **bert, **lease["header"]))
    assert [frame for frame in stand.frames()[len(before) :] if frame[5:6] in "M1"] == []
    assert (await stand.get("/bodies/arm.3F/position", **bert)).status_code == 200
    assert (await stand.post("/bodies/arm.3F/moves", RELATIVE, **anna, **lease["header"])).status_code == 202
    stop = await stand.post("/bodies/arm.3F/stop", **keys.header("viewer", "leg"))
    assert (stop.status_code, stop.json()["confirmed"]) == (200, True)


@guarded()
async def test_leases_are_taken_where_the_key_may_move(stand: Stand, keys: Keys) -> None:
    wanted = {"scope": "arm.3F", "ttl_s": 5.0}
    is_refused(await stand.post("/leases", wanted, **keys.header("operator", "leg")), 403, "not-permitted")
    is_refused(await stand.post("/leases", wanted, **keys.header("viewer")), 403, "not-permitted")
    lease = await leased(stand, "arm.80", keys.header("operator", "arm"))
    assert (lease["scope"], lease["covers"]) == ("arm.80", ["arm.01", "arm.3F"])
    shown = (await stand.get("/leases", **keys.header("viewer", "arm"))).json()["leases"]
    assert [it["holder"] for it in shown] == ["operator-arm"]
    assert "token" not in shown[0]
    assert (await stand.get("/leases", **keys.header("viewer", "leg"))).json()["leases"] == []
    answer = await stand.get(f"/leases/{lease['lease']}", **keys.header("viewer", "leg"))
    assert answer.status_code == 403


@guarded()
async def test_an_admin_takes_over_and_breaks_and_nobody_else(stand: Stand, keys: Keys) -> None:
    anna, bert, admin = keys.header("operator", "arm"), keys.header("operator"), keys.header("admin")
    lease = await leased(stand, "arm.3F", anna)
    over = {"scope": "arm", "take_over": True}
    is_refused(await stand.post("/leases", {"scope": "arm"}, **admin))
    is_refused(await stand.post("/leases", over, **bert), 403, "not-permitted")
    broken = await stand.client.delete(f"/leases/{lease['lease']}", headers=bert)
    is_refused(broken, 403, "not-permitted")
    assert (await stand.post("/leases", over, **admin)).status_code == 201
    is_refused(await stand.post("/bodies/arm.3F/moves", RELATIVE, **anna, **lease["header"]))
    (second,) = (await stand.get("/leases", **bert)).json()["leases"]
    assert (await stand.client.delete(f"/leases/{second['lease']}", headers=admin)).status_code == 200
    assert leases_told(stand) == [
        ("body.lease.taken", "/bodies/arm.3F"),
        ("body.lease.taken_over", "/bodies/arm.3F"),
        ("line.lease.taken", "/lines/arm"),
        ("line.lease.released", "/lines/arm"),
    ]


@on_stand()
async def test_a_lease_is_renewed_with_its_token_and_ends_without(stand: Stand) -> None:
    in_virtual_time(stand)
    lease = await leased(stand, "3F", ttl_s=2.0)
    place = f"/leases/{lease['lease']}"
    is_refused(await stand.post(f"{place}/renew"))
    for _ in range(3):
        await asyncio.sleep(1.5)
        assert (await stand.post(f"{place}/renew", **lease["header"])).json()["expires_in_s"] == 2.0
    await asyncio.sleep(2.1)
    assert leases_told(stand)[-1] == ("body.lease.expired", "/bodies/arm.3F")
    is_refused(await stand.post("/bodies/3F/moves", RELATIVE, **lease["header"]))
    assert (await stand.post(f"{place}/renew", **lease["header"])).status_code == 404
    assert (await stand.post("/bodies/3F/moves", RELATIVE)).status_code in (202, 422)


@on_stand()
async def test_a_move_whose_lease_ends_while_it_waits_is_never_written(stand: Stand) -> None:
    in_virtual_time(stand)
    await stand.teach_speeds("3F")
    lease = await leased(stand, "3F", ttl_s=1.0)

    async def hold_up() -> None:
        async with stand.plant.line("arm").undivided([0x3F]):
            await asyncio.sleep(1.5)

    holding = asyncio.create_task(hold_up())
    await asyncio.sleep(0)
    is_refused(await stand.post("/bodies/3F/moves", RELATIVE, **lease["header"]))
    await holding
    assert stand.moved() == []
    (record,) = (await stand.get("/bodies/3F/moves")).json()["moves"]
    assert (record["status"], record["sent_at"]) == ("cancelled", None)


@on_stand(allow_endless_moves=True)
async def test_with_its_lease_ends_what_would_never_end_and_nothing_else(stand: Stand) -> None:
    in_virtual_time(stand)
    moves = {}
    for body, content in ("00", ENDLESS), ("01", ENDLESS), ("3F", FAR):
        await stand.teach_speeds(body)
        lease = await leased(stand, body, ttl_s=30.0 if body == "01" else 1.0)
        moves[body] = (await stand.post(f"/bodies/{body}/moves", content, **lease["header"])).json()["id"]
    await asyncio.sleep(3)

    async def status(body: str) -> str:
        return str((await stand.get(f"/bodies/{body}/moves/{moves[body]}")).json()["status"])

    assert [await status(body) for body in moves] == ["stopped", "moving", "moving"]
    await stand.post("/stop")


@on_stand()
async def test_a_plan_takes_no_lease_for_nothing_moves(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await leased(stand, "3F")
    assert (await stand.post("/bodies/3F/moves", RELATIVE | {"validate_only": True})).status_code == 200


@on_stand()
async def test_what_is_no_address_and_no_token_is_refused(stand: Stand) -> None:
    for scope in ("7A", "arm.85", "nobody"):
        answer = await stand.post("/leases", {"scope": scope})
        assert (answer.status_code, answer.json()["type"].rpartition(":")[2]) == (404, NotFound.kind), scope
    for content in ({"scope": "a/b"}, {"scope": "3F", "ttl_s": 31}, {"scope": "3F", "ttl_s": 0}, {}):
        assert (await stand.post("/leases", content)).status_code == 422, content
    for token in ("x", "-1", "1,,2", "1 2", "0"):
        answer = await stand.post("/bodies/3F/moves", RELATIVE, **{"Lease-Token": token})
        is_refused(answer, 422, "invalid-request")
    assert (await stand.get("/leases/lease-9")).status_code == 404
    assert (await stand.client.delete("/leases/lease-9")).status_code == 404


@guarded({"lease_mode": "required"})
async def test_where_leases_are_required_nothing_moves_or_is_set_without(stand: Stand, keys: Keys) -> None:
    header = keys.header("setup")
    is_refused(await stand.post("/bodies/arm.3F/moves", RELATIVE, **header))
    setting, speed = "/bodies/arm.3F/commands/set-maximum-speed", {"speed": 50_000}
    is_refused(await stand.post(setting, speed, **header))
    assert (await stand.post("/bodies/arm.3F/stop", **header)).status_code == 200
    lease = await leased(stand, "arm", header)
    assert (await stand.post(setting, speed, **header, **lease["header"])).status_code == 200


@guarded({"lease_mode": "off"})
async def test_switched_off_there_are_none(stand: Stand, keys: Keys) -> None:
    answer = await stand.post("/leases", {"scope": "arm.3F"}, **keys.header("admin"))
    is_refused(answer, 403, "not-allowed")
    posture = (await stand.get("/system/posture", **keys.header("admin"))).json()
    assert "access.lease_mode" in [it["setting"] for it in posture["weakened"]]


# robots


@in_cell()
async def test_a_robot_is_leased_with_all_its_units_and_read_by_everybody(cell: Cell) -> None:
    lease = await leased(cell, "r1")
    before = cell.commands()
    is_refused(await cell.post("/robots/r1/units/2/moves", HOME))
    assert cell.commands() == before
    assert (await cell.get("/robots/r1/units/2/position")).status_code == 200
    answer = await cell.post("/robots/r1/units/2/moves?wait=60", HOME, **lease["header"])
    assert (answer.status_code, answer.json()["status"]) == (200, "succeeded")


@in_cell()
async def test_a_robots_move_is_followed_to_its_end_after_its_lease(cell: Cell) -> None:
    in_virtual_time(cell)
    await cell.move(HOME)
    lease = await leased(cell, "r1", ttl_s=0.6)
    far = {"kind": "absolute", "axes": mm(X=100)}
    started = await cell.post("/robots/r1/units/1/moves", far, **lease["header"])
    assert started.status_code == 202, started.text
    await asyncio.sleep(1)
    assert (await cell.get("/leases")).json()["leases"] == []
    assert "followers" in cell.rig.robot.line.load_percent()
    ended = await cell.get(f"/robots/r1/units/1/moves/{started.json()['id']}?wait=60")
    assert ended.json()["status"] == "succeeded"


@in_cell()
async def test_a_jog_ends_with_its_lease(cell: Cell) -> None:
    in_virtual_time(cell)
    lease = await leased(cell, "r1", ttl_s=1.0)
    jog = {"unit": 2, "axis": "X", "direction": "+"}
    place = (await cell.post("/robots/r1/jogs", jog, **lease["header"])).headers["location"]
    is_refused(await cell.post(f"{place}/heartbeat"))
    for _ in range(2):
        await asyncio.sleep(0.4)
        assert (await cell.post(f"{place}/heartbeat", **lease["header"])).status_code == 200
    await asyncio.sleep(0.4)
    is_refused(await cell.post(f"{place}/heartbeat", **lease["header"]))
    await asyncio.sleep(0.3)
    assert (await cell.post(f"{place}/stop")).json()["state"] == "stopped"
