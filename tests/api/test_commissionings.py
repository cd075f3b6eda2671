"""Commissionings over HTTP: a record with progress, that is cancelled."""

from tempfile import TemporaryDirectory

from commissioning.run import ask_only
from simulator.rorze.quirks import QUIRKS
from tests.api.stand import BODIES, Stand, on_stand
from tests.api.test_configuration import give_file


@on_stand({"arm": BODIES})
async def test_a_line_is_commissioned_and_the_record_stays(stand: Stand) -> None:
    stand.plant.works.commissionings.walk = ask_only
    begun = await stand.post("/commissionings", {"line_id": "arm"})
    assert begun.status_code == 202
    record = begun.json()
    assert begun.headers["location"] == f"/commissionings/{record['id']}"
    path = f"/commissionings/{record['id']}"
    over = (await stand.get(f"{path}?wait=60")).json()
    assert (over["status"], over["line_id"], over["error"]) == ("finished", "arm", None)
    assert over["report"]["line"] == "arm"
    assert {"at", "dir", "data"} == set(over["report"]["frames"][0])
    assert (await stand.get(path)).json() == over
    assert (await stand.client.delete(path)).json() == over
    assert (await stand.get("/commissionings/none")).status_code == 404


@on_stand({"arm": BODIES})
async def test_it_is_cancelled_and_the_line_serves_again(stand: Stand) -> None:
    stand.plant.works.commissionings.walk = ask_only
    record = (await stand.post("/commissionings", {"line_id": "arm"})).json()
    twice = await stand.post("/commissionings", {"line_id": "arm"})
    assert (twice.status_code, "is running" in twice.json()["detail"]) == (409, True)
    reading = await stand.get("/bodies/3F/position")
    assert (reading.status_code, "commissioned" in reading.json()["detail"]) == (409, True)
    over = (await stand.client.delete(f"/commissionings/{record['id']}")).json()
    assert (over["status"], over["report"]) == ("cancelled", None)


@on_stand({"arm": BODIES})
async def test_a_gateway_that_cannot_says_so(stand: Stand) -> None:
    frames = len(stand.port.written)
    answer = await stand.post("/commissionings", {"line_id": "arm"})
    assert answer.status_code == 503
    assert "nothing was sent" in answer.json()["detail"]
    assert len(stand.port.written) == frames


@on_stand({"arm": BODIES})
async def test_what_is_proposed_is_written_and_served_without_a_restart(stand: Stand) -> None:
    stand.plant.works.commissionings.walk = ask_only
    QUIRKS["turnaround"](stand.port.machine)
    with TemporaryDirectory() as folder:
        file = give_file(stand, folder)
        record = (await stand.post("/commissionings", {"line_id": "arm"})).json()
        path = f"/commissionings/{record['id']}"
        early = await stand.post(f"{path}/settings")
        assert (early.status_code, "nothing was changed" in early.json()["detail"]) == (422, True)
        while (await stand.get(f"{path}?wait=60")).json()["status"] == "running":
            pass
        keys = {"lines": [{"line_id": "arm", "change": "changed", "keys": ["reply_timeout_s"]}]}
        told = (await stand.post(f"{path}/settings", {"dry_run": True})).json()
        assert told == keys | {"needs_restart": [], "busy": [], "applied": False}
        assert "reply_timeout_s" not in file.read_text()
        assert (await stand.post(f"{path}/settings")).json()["applied"] is True
        assert "reply_timeout_s = 0.8" in file.read_text()
        assert "# the lift" in file.read_text()
        assert stand.plant.config.lines[0].reply_timeout_s == 0.8
