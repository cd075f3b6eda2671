"""Commands that are never carried out: answered where that is possible, counted and logged always."""

from typing import Any

import pytest

from tests.bridges.mqtt.stand import MES, ROOT, Bridge, Broker, Client, Plant, at, bridging, relative
from tests.e2e.processes import until

MOVE = "/bodies/3F/moves"
WAITED = f"{MOVE}?wait=30"


@pytest.mark.parametrize(
    ("kind", "status", "told"),
    [
        ("correlation-missing", 400, {"CorrelationData": None}),
        ("expiry-missing", 400, {"MessageExpiryInterval": None}),
        ("caller-not-mapped", 403, {"who": "eve"}),
        ("caller-not-mapped", 403, {"who": "bridge", "path": "/stop"}),
        ("not-over-mqtt", 403, {"who": "admin", "path": "/access/keys"}),
        ("not-over-mqtt", 403, {"path": "/tickets"}),
        ("malformed-request", 400, {"content": b"{"}),
        ("malformed-request", 400, {"content": {"correlation": "x", "expires_at": "soon"}}),
        ("malformed-request", 400, {"path": "/bodies/../stop"}),
        ("malformed-request", 400, {"path": ""}),
        ("retained", 400, {"retain": True}),
        ("expired", 503, {"content": {"correlation": "x", "expires_at": "2001-01-31T12:00:00Z"}}),
    ],
)
def test_a_command_is_refused_answered_counted_and_logged(
    kind: str, status: int, told: dict[str, Any], client: Client, bridge: Bridge, plant: Plant
) -> None:
    refused, moved = bridge.counted("refused"), len(plant.moves())
    asked = {"path": MOVE, "content": relative(), **told}
    answer = client.command(**asked)
    if told.get("retain"):
        client.publish(f"cmd/{MES}{MOVE}", retain=True)
        until(lambda: bridge.counted("refused") >= refused + 2, "what clears it is refused, too")
        refused += 1
    assert (answer["status"], answer["moved"], answer["replayed"]) == (status, "no", False)
    assert answer["body"]["type"] == f"urn:motion-gateway:problem:{kind}"
    assert answer["body"]["remedy"]
    assert bridge.counted("refused") == refused + 1
    assert f"kind={kind}" in bridge.program.words()
    assert len(plant.moves()) == moved


@pytest.mark.parametrize(
    "topic",
    [f"{ROOT}/cmd/{MES}/stop", f"{ROOT}/bodies/line1.3F/state", "motion/another/cmd/mes/stop", "$SYS/x"],
)
def test_no_answer_is_published_where_it_would_pass_for_something_else(
    topic: str, client: Client, bridge: Bridge, plant: Plant
) -> None:
    refused, moved = bridge.counted("refused"), len(plant.moves())
    client.publish(
        f"cmd/{MES}{MOVE}",
        relative(),
        ResponseTopic=topic,
        CorrelationData=topic.encode(),
        MessageExpiryInterval=30,
    )
    until(lambda: bridge.counted("refused") == refused + 1, "it is counted")
    assert "kind=response-topic" in bridge.program.words()
    assert len(plant.moves()) == moved


def test_an_answer_below_the_root_has_a_place_of_its_own(client: Client) -> None:
    client.answers = f"{ROOT}/answers/{MES}"
    assert client.command("/bodies/3F/commands/get-position")["status"] == 200


def test_a_question_needs_no_correlation(client: Client) -> None:
    answer = client.command(
        "/bodies/3F/commands/get-position", CorrelationData=None, MessageExpiryInterval=None
    )
    assert (answer["status"], answer["moved"]) == (200, "no")


def test_a_message_with_a_long_or_binary_correlation_is_carried_out_once(
    client: Client, plant: Plant
) -> None:
    moved = len(plant.moves())
    for correlation in (b"\x00\xff" * 8, b"x" * 1000):
        first, again = (client.command(WAITED, relative(), CorrelationData=correlation) for _ in range(2))
        assert (first["replayed"], again["replayed"]) == (False, True)
    assert len(plant.moves()) == moved + 2


def test_commands_are_off_where_the_file_does_not_say_otherwise(
    plant: Plant, broker: Broker, tmp_path: Any
) -> None:
    config = "root = 'quiet'", "client_id = 'quiet'"
    with (
        bridging(tmp_path, plant, broker, *config, commands=False) as bridge,
        at(broker, "quiet/#") as client,
    ):
        client.root = "quiet"
        client.last("status", lambda it: it["state"] == "online")
        client.publish(f"cmd/{MES}/stop", ResponseTopic=client.answers)
        client.last("status")
        assert not [it for it in client.heard if it.topic == client.answers]
        assert bridge.counted("done") == bridge.counted("refused") == 0


def test_what_the_broker_has_stored_is_refused_even_if_it_is_a_stop(
    plant: Plant, broker: Broker, tmp_path: Any
) -> None:
    with at(broker, "stored/#") as client:
        client.root = "stored"
        client.publish(f"cmd/{MES}/stop", {}, retain=True, ResponseTopic=client.answers)
        with bridging(tmp_path, plant, broker, "root = 'stored'", "client_id = 'stored'") as bridge:
            bridge.wait_until_online()
            until(lambda: bridge.counted("refused") == 1, "the stored stop is refused")
            answer = until(
                lambda: [it.json for it in client.heard if it.topic == client.answers], "it is answered"
            )[0]
            assert answer["body"]["type"].endswith(":retained")
            client.publish(f"cmd/{MES}/stop", {}, retain=True)
            until(lambda: bridge.counted("done") == 1, "one that comes now stops, whatever its flag")
        client.publish(f"cmd/{MES}/stop", b"", retain=True)
