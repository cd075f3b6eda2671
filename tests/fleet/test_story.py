"""One gateway of a plant is lost and found; then the engine is lost, its disk too."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.processes import until
from tests.fleet.plants import Plant, needs_engine, numbers_of, plant_of, stored, told

pytestmark = needs_engine

MOVE = {"kind": "relative", "direction": "cw", "distance": {"value": 400, "unit": "pulse"}}


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    with plant_of(Path(tmp_path_factory.mktemp("plant"))) as plant:
        yield plant


def test_a_plant_is_the_sum_of_its_gateways(plant: Plant) -> None:
    process, (one, two) = plant.process, plant.gateways
    found = {it["name"]: it for it in process.get("/gateways")["gateways"]}
    assert found["stocker1"]["url"] == one.url
    assert found["stocker2"]["lines"] == ["line1"]
    assert found["stocker1"]["heard_age_s"] < 10
    assert [it["body_id"] for it in process.get("/bodies")["bodies"]] == [
        f"{gateway}:line1.{body}" for gateway in ("stocker1", "stocker2") for body in ("00", "3F")
    ]
    assert [it["line_id"] for it in process.get("/lines")["lines"]] == ["stocker1:line1", "stocker2:line1"]
    assert process.get("/alarms")["alarms"] == []
    metrics = process.http.get("/metrics").text
    assert 'motion_gateway_line_ready{line="stocker1:line1"} 1.0' in metrics
    assert 'motion_plant_gateway_online{gateway="stocker2"} 1.0' in metrics
    assert two.http.get("/readyz").is_success


def test_a_move_goes_to_the_owner_once_and_its_events_come_from_the_stream(plant: Plant) -> None:
    process, (one, two) = plant.process, plant.gateways
    _, cursor = process.events()
    path, key = "/bodies/stocker2:line1.3F/moves", {"Idempotency-Key": "lot-4711", "Prefer": "wait=20"}
    first = process.http.post(path, json=MOVE, headers=key)
    assert first.status_code == 200, first.text
    assert first.json()["body_id"] == "stocker2:line1.3F"
    assert first.headers["x-gateway"] == "stocker2"
    again = process.http.post(path, json=MOVE, headers=key)
    assert again.json()["id"] == first.json()["id"]
    assert ("idempotency-replayed" in first.headers, "idempotency-replayed" in again.headers) == (False, True)
    assert len(two.line.executed("1+M")) == 1
    assert not one.line.executed("1+M")
    own = process.get(f"{path}/{first.json()['id']}")
    assert own["status"] == "succeeded"
    until(lambda: process.has_up_to(two), "the plant has all events of stocker2")
    events, _ = process.events(cursor)
    moved = [it for it in events if it["type"].startswith("body.move.")]
    assert [it["subject"] for it in moved] == ["/bodies/stocker2:line1.3F"] * len(moved)
    assert moved[-1]["type"] == "body.move.succeeded"
    assert moved[-1]["id"] == moved[-1]["cursor"]
    assert numbers_of(events, "stocker2") == sorted(set(numbers_of(events, "stocker2")))


def test_leases_over_two_gateways_are_taken_together_or_not_at_all(plant: Plant) -> None:
    process = plant.process
    taken = process.http.post("/leases", json={"scopes": ["stocker2:line1", "stocker1:line1.3F"]})
    assert taken.status_code == 201, taken.text
    lease = taken.json()
    assert [it["scope"] for it in lease["leases"]] == ["stocker1:line1.3F", "stocker2:line1"]
    refused = process.http.post("/bodies/stocker2:line1.3F/moves", json=MOVE)
    assert refused.status_code in (409, 423), refused.text
    moved = process.http.post(
        "/bodies/stocker2:line1.3F/moves", json=MOVE, headers={"Lease-Token": lease["token"]}
    )
    assert moved.is_success, moved.text
    half = process.http.post("/leases", json={"scopes": ["stocker1:line1.00", "stocker2:line1.00"]})
    assert half.status_code >= 400
    assert [it["scope"] for it in process.get("/leases")["leases"]] == ["stocker1:line1.3F", "stocker2:line1"]
    ended = process.http.delete(f"/leases/{lease['lease']}", headers={"Lease-Token": lease["token"]})
    assert ended.is_success, ended.text
    assert process.get("/leases")["leases"] == []


def test_a_stop_is_confirmed_by_every_gateway(plant: Plant) -> None:
    stopped = plant.process.http.post("/stop")
    assert stopped.status_code == 200, stopped.text
    report = stopped.json()
    assert [(it["gateway"], it["state"]) for it in report["gateways"]] == [
        ("stocker1", "confirmed"),
        ("stocker2", "confirmed"),
    ]
    assert report["gateways"][0]["report"]["bodies"][0]["body_id"] == "stocker1:line1.00"


def test_a_gateway_that_is_lost_is_shown_as_old_and_found_again_whole(plant: Plant) -> None:
    process, (_, two) = plant.process, plant.gateways
    process.get("/bodies")
    _, cursor = process.events()
    two.kill()
    lost = [it for it in process.get("/bodies")["bodies"] if it["gateway"] == "stocker2"]
    assert [it["unheard"] for it in lost] == [True, True]
    assert all("position" not in it and "moving" not in it for it in lost)
    assert lost[0]["last_known"]["position"] is not None
    stopped = process.http.post("/stop")
    assert stopped.status_code == 409
    problem = told(stopped)
    assert problem["type"] == "urn:motion-gateway:problem:gateways-unreached"
    assert {it["gateway"]: it["state"] for it in problem["gateways"]} == {
        "stocker1": "confirmed",
        "stocker2": "unreached",
    }
    assert "hardware stop" in problem["gateways"][1]["detail"]
    assert process.http.post("/bodies/stocker2:line1.3F/moves", json=MOVE).status_code == 503

    two.start()
    two.wait_until_ready()
    until(lambda: process.states()["stocker2"] == "online", "stocker2 is heard again")
    until(lambda: process.has_up_to(two), "the plant has all events of stocker2")
    events, _ = process.events(cursor)
    types = [it["type"] for it in events if it["gateway"] == "stocker2"]
    assert "gateway.crashed" in types
    assert "stream.gap" not in types
    assert [it for it in process.get("/bodies")["bodies"] if it["unheard"]] == []


def test_stops_need_no_engine_and_its_disk_is_filled_again(plant: Plant) -> None:
    process, (one, two) = plant.process, plant.gateways
    plant.engine.kill()
    stopped = process.http.post("/stop")
    assert stopped.status_code == 200, stopped.text
    assert one.moving("3F", 200)["status"]
    alarm = until(
        lambda: [it for it in one.get("/alarms")["alarms"] if it["cause"] == "plant.unreachable"],
        "stocker1 tells that the plant is unreachable",
    )
    assert "NATS" in alarm[0]["en"]["remedy"]
    assert one.http.get("/readyz").is_success
    _, cursor = process.events()

    plant.engine.wipe()
    plant.engine.start()
    until(lambda: process.has_up_to(one) and process.has_up_to(two), "the plant has all events")
    events, _ = process.events(cursor)
    assert "plant.reached" in [it["type"] for it in events if it["gateway"] == "stocker1"]
    assert "stream.gap" not in [it["type"] for it in events]
    for gateway in (one, two):
        own = [it["id"] for it in gateway.get("/events?limit=1000")["events"]]
        in_stream = [id_ for subject, id_ in stored(plant.engine.url) if subject == f"mg.{gateway.name}.ev"]
        assert in_stream[: len(own)] == own
