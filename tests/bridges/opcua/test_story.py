"""The plant over OPC UA, as node-opcua sees it: signed in, read, moved once, told of the end."""

from datetime import UTC, datetime
from uuid import uuid4

from tests.bridges.opcua.stand import Bridge, Client, Plant

FIELDS = ["EventType", "SourceName", "Message", "Severity", "+MoveId", "+Status", "+Position", "+Record"]
MOVE_ENDED = "MoveEndedEventType"


def test_a_motor_is_moved_once_and_its_end_is_told(bridge: Bridge, client: Client, plant: Plant) -> None:
    client.connect(bridge)
    client.tell("subscribe")
    assert client.tell("watch", fields=FIELDS, type=MOVE_ENDED) == "Good"
    before = len(plant.moves())
    key = uuid4().hex

    first = client.move("line1.3F", -700, key)
    again = client.move("line1.3F", -700, key)

    assert first["status"] == again["status"] == "Good"
    move_id, status, replayed, detail, _ = first["outputs"]
    assert (status in ("queued", "sent", "moving"), replayed, detail) == (True, False, "")
    assert again["outputs"][0] == move_id
    assert again["outputs"][2] is True
    end = client.event(lambda it: it["MoveId"] == move_id)
    assert (end["Status"], end["SourceName"]) == ("succeeded", "line1.3F")
    assert f'"id": "{move_id}"' in end["Record"]
    assert len(plant.moves()) == before + 1
    position = plant.get("/bodies/line1.3F")["position"]
    assert end["Position"] == position
    value = client.read("line1.3F.ActualPosition")[0]
    assert (value["status"], value["value"]) == ("Good", position)
    age_s = (datetime.now(UTC) - datetime.fromisoformat(value["source"])).total_seconds()
    assert 0 <= age_s < 10
