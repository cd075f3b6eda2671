"""Commissionings over HTTP: a record with progress, that is cancelled."""

from commissioning.run import ask_only
from tests.api.stand import BODIES, Stand, on_stand


@on_stand({"arm": BODIES})
async def test_a_line_is_commissioned_and_the_record_stays(stand: Stand) -> None:
    stand.plant.commissionings.walk = ask_only
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
    stand.plant.commissionings.walk = ask_only
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
