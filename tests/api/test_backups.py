"""Backups over HTTP: a text comes out, goes in again, and what differs is told."""

from tests.api.robots.cell import Cell, in_cell
from tests.api.stand import Stand, on_stand, socket

BODY = "/bodies/3F"
SMALL = "[body 3F]\n[patterns]\nSPSA[1],A:S[1],D:S[2] ; both are empty\n[program]\n*A\nEND\n"


@on_stand()
async def test_a_backup_is_a_text_that_equals_what_the_body_holds(stand: Stand) -> None:
    answer = await stand.get(f"{BODY}/backup")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/plain; charset=utf-8")
    assert "\n[body 3F]\n\n[settings]\nEAS0 " in answer.text
    plan = await stand.post(f"{BODY}/restores", {"backup": answer.text, "dry_run": True})
    assert plan.status_code == 200
    assert plan.json() == {
        "target": "/bodies/arm.3F",
        "dry_run": True,
        "commands": [],
        "differences": [],
        "differing": {},
        "scales": [],
    }


@on_stand()
async def test_a_dry_run_tells_the_exact_commands_and_writes_nothing(stand: Stand) -> None:
    before = len(stand.frames())
    plan = await stand.post(f"{BODY}/restores", {"backup": SMALL, "dry_run": True})
    assert plan.json()["commands"] == ["&3FUCS", "&3FUWS*A", "&3FUWSEND", "&3FSPSA[1],A:S[1],D:S[2]"]
    assert plan.json()["differences"][0] == {
        "target": "arm.3F",
        "section": "patterns",
        "name": "speed sets of a pattern",
        "wanted": "SPSA[1],A:S[1],D:S[2]",
        "held": None,
        "restorable": True,
    }
    assert not set(plan.json()["commands"]) & set(stand.frames()[before:])


@on_stand()
async def test_a_dry_run_is_a_record_too_that_is_followed_to_its_end(stand: Stand) -> None:
    before = len(stand.frames())
    async with socket(stand, "/events?types=body.comparison.*") as client:
        await client.message()
        begun = await stand.post(f"{BODY}/comparisons", {"backup": SMALL})
        assert (begun.status_code, begun.json()["status"], begun.json()["commands"]) == (202, "running", None)
        over = (await stand.get(f"{begun.headers['location']}?wait=60")).json()
        assert [(await client.event())["type"] for _ in range(2)] == [
            "body.comparison.started",
            "body.comparison.succeeded",
        ]
    plan = (await stand.post(f"{BODY}/restores", {"backup": SMALL, "dry_run": True})).json()
    assert (over["commands"], over["differences"]) == (plan["commands"], plan["differences"])
    assert (await stand.get(f"{BODY}/comparisons/current")).json() == over
    assert not set(plan["commands"]) & set(stand.frames()[before:])


@on_stand()
async def test_a_comparison_is_cancelled(stand: Stand) -> None:
    assert (await stand.client.delete(f"{BODY}/comparisons/current")).status_code == 404
    await stand.post(f"{BODY}/comparisons", {"backup": SMALL})
    cancelled = await stand.client.delete(f"{BODY}/comparisons/current")
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    assert cancelled.json()["differences"] is None


@on_stand({"arm": ({"id": "00"}, {"id": "3F"})})
async def test_bodies_of_a_line_are_compared_one_after_the_other(stand: Stand) -> None:
    both = SMALL + SMALL.replace("3F", "00")
    over = (await stand.post("/lines/arm/comparisons?wait=60", {"backup": both})).json()
    assert (over["status"], over["controllers"]) == ("succeeded", ["arm.00", "arm.3F"])
    assert {it["target"] for it in over["differences"]} == {"arm.00", "arm.3F"}
    one = (await stand.post("/lines/arm/comparisons?wait=60", {"backup": both, "bodies": ["3F"]})).json()
    assert {it["target"] for it in one["differences"]} == {"arm.3F"}


@in_cell(units=1)
async def test_a_robot_is_compared_with_a_backup(cell: Cell) -> None:
    backup = "[robot r1]\n[variables]\nV01 12.5\n"
    over = (await cell.post("/robots/r1/comparisons?wait=60", {"backup": backup})).json()
    assert (over["status"], len(over["differences"]), over["expected"]) == ("succeeded", 1, None)


@on_stand()
async def test_a_restore_is_a_record_that_is_followed_to_its_end(stand: Stand) -> None:
    async with socket(stand, "/events?bodies=3F") as client:
        await client.message()
        begun = await stand.post(f"{BODY}/restores", {"backup": SMALL, "flash": True})
        assert (begun.status_code, begun.json()["status"]) == (202, "running")
        over = await stand.get(f"{begun.headers['location']}?wait=60")
        assert (over.json()["status"], over.json()["saved"], over.json()["differences"]) == (
            "verified",
            True,
            [],
        )
        types = [(await client.event())["type"]]
        while types[-1] != "body.restore.verified":
            types.append((await client.event())["type"])
        assert "body.restore.started" in types
    assert (await stand.get(f"{BODY}/restores/current")).json() == over.json()
    again = await stand.post(f"{BODY}/restores?wait=60", {"backup": SMALL})
    assert (again.status_code, again.json()["commands"], again.json()["status"]) == (200, 0, "verified")


@on_stand()
async def test_a_restore_is_cancelled(stand: Stand) -> None:
    nothing = await stand.client.delete(f"{BODY}/restores/current")
    assert (nothing.status_code, nothing.json()["detail"]) == (
        404,
        "No backup is being restored to /bodies/arm.3F.",
    )
    await stand.post(f"{BODY}/restores", {"backup": SMALL})
    cancelled = await stand.client.delete(f"{BODY}/restores/current")
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    assert len(cancelled.json()["differences"]) == 3


@on_stand()
async def test_what_is_wrong_is_told_by_its_line_and_nothing_is_sent(stand: Stand) -> None:
    before = len(stand.frames())
    answer = await stand.post(f"{BODY}/restores", {"backup": "[body 3F]\n[settings]\n1+M500\n"})
    [fault] = answer.json()["errors"]
    assert (answer.status_code, fault["field"], fault["line"]) == (422, "backup", 3)
    other = await stand.post("/bodies/00/restores", {"backup": SMALL})
    assert (other.status_code, "Name the body" in other.json()["remedy"]) == (422, True)
    unsaved = await stand.post(f"{BODY}/restores", {"backup": SMALL, "power_cycle": True})
    assert (unsaved.status_code, unsaved.json()["remedy"]) == (422, "Ask for flash, too.")
    large = await stand.post(f"{BODY}/restores", {"backup": ";" * 2_097_152})
    assert large.status_code == 413
    assert not [frame for frame in stand.frames()[before:] if frame[3:6] in ("UCS", "SPS")]


@on_stand({"arm": ({"id": "00"}, {"id": "3F"})})
async def test_a_backup_is_a_record_that_is_followed_to_its_end(stand: Stand) -> None:
    async with socket(stand, "/events?types=line.backup.*") as client:
        await client.message()
        begun = await stand.post("/lines/arm/backups")
        assert (begun.status_code, begun.json()["status"], begun.json()["text"]) == (202, "running", None)
        again = await stand.post("/lines/arm/backups")
        assert (again.status_code, "is being read" in again.json()["detail"]) == (409, True)
        over = (await stand.get(f"{begun.headers['location']}?wait=60")).json()
        assert (over["status"], over["controllers"]) == ("succeeded", ["arm.00", "arm.3F"])
        assert over["text"] == (await stand.get("/lines/arm/backup")).text
        event = await client.event()
        while event["type"] != "line.backup.succeeded":
            event = await client.event()
        assert (event["data"]["text"], event["data"]["read"]) == (None, over["read"])
    one = await stand.post("/lines/arm/backups?bodies=3F&wait=60")
    assert (one.status_code, one.json()["controllers"]) == (200, ["arm.3F"])
    assert (await stand.get("/lines/arm/backups/current")).json() == one.json()
    nobody = await stand.post("/lines/arm/backups?bodies=44")
    assert nobody.status_code == 404


@on_stand()
async def test_a_backup_is_cancelled(stand: Stand) -> None:
    nothing = await stand.client.delete(f"{BODY}/backups/current")
    assert (nothing.status_code, nothing.json()["detail"]) == (
        404,
        "No backup of /bodies/arm.3F is being read.",
    )
    await stand.post(f"{BODY}/backups")
    cancelled = await stand.client.delete(f"{BODY}/backups/current")
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    assert (await stand.post(f"{BODY}/backups?wait=60")).json()["status"] == "succeeded"


@on_stand({"arm": ({"id": "00"}, {"id": "3F"})})
async def test_a_line_is_backed_up_and_restored_to_chosen_bodies(stand: Stand) -> None:
    text = (await stand.get("/lines/arm/backup")).text
    assert [line for line in text.splitlines() if line.startswith("[body")] == ["[body 00]", "[body 3F]"]
    one = (await stand.get("/lines/arm/backup?bodies=3F")).text
    assert ("[body 00]" in one, "[body 3F]" in one) == (False, True)
    nobody = await stand.get("/lines/arm/backup?bodies=44")
    assert nobody.status_code == 404
    short = text.replace("\n[positions]\n", "").replace("\n[memories]\n", "")
    wanted = {"backup": short.replace("0SS10 ", "0SS20 "), "bodies": ["3F"]}
    over = await stand.post("/lines/arm/restores?wait=60", wanted)
    assert (over.json()["status"], over.json()["controllers"]) == ("verified", ["arm.3F"])
    assert over.headers["location"] == f"/lines/arm/restores/{over.json()['id']}"
    assert {frame for frame in stand.frames() if frame[3:6] == "0SS"} == {"&3F0SS20"}
    assert (await stand.get("/lines/arm/restores/current")).json() == over.json()
    assert (await stand.client.delete("/lines/arm/restores/current")).status_code == 404


@in_cell(units=1)
async def test_a_robot_is_backed_up_and_restored(cell: Cell) -> None:
    cell.rig.fics.units[1].positions[2] = (1.0, 2.0, 3.0)
    text = (await cell.get("/robots/r1/backup")).text
    assert "\n[unit 1 positions]\n" in text
    record = await cell.post("/robots/r1/backups?wait=60")
    assert (record.status_code, record.json()["text"], record.json()["expected"]) == (200, text, None)
    wanted = {"backup": text.replace("2 X=1 ", "2 X=7.5 ")}
    plan = await cell.post("/robots/r1/restores", {**wanted, "dry_run": True})
    assert plan.json()["commands"] == ["POF 1,2", "POS 7.5,2,3", "POF 2"]
    over = await cell.post("/robots/r1/restores?wait=60", wanted)
    assert (over.status_code, over.json()["status"]) == (200, "verified")
    assert cell.rig.fics.units[1].positions[2] == (7.5, 2.0, 3.0)
    assert (await cell.get(over.headers["location"])).json() == over.json()
    assert (await cell.client.delete("/robots/r1/restores/current")).status_code == 404
    refused = await cell.post("/robots/r1/restores", {**wanted, "flash": True})
    assert (refused.status_code, "no command" in refused.json()["detail"]) == (422, True)
    of_bodies = await cell.get("/lines/cell/backup")
    assert (of_bodies.status_code, of_bodies.json()["remedy"]) == (422, "Back up its robot.")
