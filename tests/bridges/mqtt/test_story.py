"""The bridge to a real mosquitto, as an MES sees it: states, events, alarms, positions and commands."""

import json
from typing import Any

from tests.bridges.mqtt.stand import MES, Bridge, Client, Plant, relative
from tests.e2e.processes import until


def test_everything_is_there_for_a_client_that_comes_late(client: Client, plant: Plant) -> None:
    status = client.last("status")
    assert (status["state"], status["reason"], status["lines"]) == ("online", None, {"line1": "ready"})
    body = client.last("bodies/line1.3F/state")
    as_got = plant.get("/bodies/3F")
    assert body.keys() == {*as_got, "position_age_s", "time"}
    stable = ("body_id", "online", "moving", "position", "homed", "unit", "groups")
    assert {name: body[name] for name in stable} == {name: as_got[name] for name in stable}
    assert 0 <= body["position_age_s"] < 100
    assert client.last("lines/line1/state")["state"] == "ready"
    assert all(it.retain for it in client.of("status") + client.of("bodies/line1.3F/state"))


def test_a_command_moves_a_motor_once_and_its_end_is_told(
    client: Client, plant: Plant, bridge: Bridge
) -> None:
    before = len(plant.moves())
    done, replayed = bridge.counted("done"), bridge.counted("replayed")
    start = plant.get("/bodies/3F/position")["pulses"]
    answer = client.command("/bodies/3F/moves", relative(), CorrelationData=b"order-1")
    move = answer["body"]
    assert (answer["status"], answer["moved"], answer["replayed"]) == (202, "yes", False)
    event = client.last(
        "events/bodies/line1.3F/body.move.succeeded", lambda it: it["correlationid"] == move["id"]
    )
    assert event == plant.get(f"/events?after={move['event_cursor']}&types=body.move.succeeded")["events"][0]
    assert client.last("bodies/line1.3F/state", lambda it: it["position"] == start + 100)["moving"] is False
    again = client.command(
        "/bodies/3F/moves", relative(), CorrelationData=b"order-1", MessageExpiryInterval=5
    )
    assert (again["replayed"], again["body"]) == (True, move)
    assert len(plant.moves()) == before + 1
    assert (bridge.counted("done"), bridge.counted("replayed")) == (done + 1, replayed + 1)
    (deed,) = plant.get("/audit?target=3F&limit=1")["deeds"]
    assert deed["caller"].split()[0] == MES, "not the bridge"


def test_the_wait_for_the_end_stands_in_the_topic(client: Client) -> None:
    answer = client.command("/bodies/3F/moves?wait=30", relative())
    assert (answer["status"], answer["body"]["status"]) == (200, "succeeded")


def test_the_gateways_refusals_come_as_they_are(client: Client) -> None:
    answer = client.command("/bodies/77/moves", relative())
    assert (answer["status"], answer["moved"]) == (404, "no")
    assert answer["body"]["type"] == "urn:motion-gateway:problem:not-found"
    viewer = client.command("/bodies/3F/moves", relative(), who="watcher")
    assert (viewer["status"], viewer["body"]["type"].rpartition(":")[2]) == (403, "not-permitted")


def test_a_stop_needs_nothing_but_the_topic(client: Client) -> None:
    move = client.command("/bodies/3F/moves", relative(1_000_000))["body"]
    client.publish(f"cmd/{MES}/bodies/3F/stop")
    event = client.last(
        "events/bodies/line1.3F/body.move.stopped", lambda it: it["correlationid"] == move["id"]
    )
    assert event["data"]["end_cause"] == "stop_command"
    answer = client.command(
        "/stop", b"no JSON", who="watcher", CorrelationData=None, MessageExpiryInterval=None
    )
    assert (answer["status"], answer["body"]["confirmed"]) == (200, True), "every role may stop"


def power_cycled(plant: Plant) -> Any:
    alarms = plant.get("/alarms")["alarms"]
    return next((it for it in alarms if it["cause"] == "body.power_cycled"), None)


def test_an_alarm_is_retained_until_it_is_reset(client: Client, plant: Plant) -> None:
    plant.line.tell("POST", "/bodies/00/brown-outs", for_s=0.1)
    there = {"kind": "absolute", "position": {"value": 500, "unit": "pulse"}}
    refusal = client.command("/bodies/00/moves", there)
    assert (refusal["status"], refusal["moved"]) == (409, "no")
    raised = until(lambda: power_cycled(plant), "an alarm")
    topic = f"alarms/{raised['id']}"
    told = client.last(topic)
    assert told == plant.get(f"/alarms/{raised['id']}")
    assert told["ja"]["happened"]

    def is_acknowledged() -> bool:  # while its power goes on and off, it is refused
        return bool(client.command("/bodies/00/power-cycle/acknowledge")["status"] == 200)

    until(is_acknowledged, "the acknowledgement")
    ended = client.last(topic, lambda it: it["ended_at"] is not None)
    assert ended["reset_at"] is None
    assert client.command(f"/{topic}/reset")["status"] == 200
    until(lambda: client.of(topic)[-1].payload == b"", "the alarm is taken back")


def test_live_positions_are_told_with_their_time(client: Client) -> None:
    position = client.last("bodies/line1.3F/position")
    assert {"pulses", "counted_in", "value", "unit", "time"} <= position.keys()
    assert not client.of("bodies/line1.3F/position")[-1].retain


def test_an_older_client_says_the_same_in_an_envelope(client: Client, plant: Plant) -> None:
    envelope = {
        "correlation": "old-1",
        "response_topic": client.answers,
        "expires_at": "2099-01-31T12:00:00Z",
        "body": relative(),
    }
    before = len(plant.moves())
    for _ in range(2):
        client.publish(f"cmd/{MES}/bodies/3F/moves", envelope)
    answers = until(
        lambda: [it.json for it in client.heard if it.topic == client.answers and b"old-1" in it.payload][1:],
        "two answers",
    )
    assert answers[0]["correlation"] == "old-1"
    assert len(plant.moves()) == before + 1


def test_no_key_is_told_or_logged(client: Client, plant: Plant, bridge: Bridge) -> None:
    told = b"".join(it.payload for it in client.heard).decode() + bridge.program.words()
    told += json.dumps([str(it.properties) for it in client.heard])
    for file in plant.key_files.values():
        assert file.read_text().strip() not in told
